#include "integrators/cvode.h"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cmath>

#include "integrators/catalogue.h"

namespace porthos::integrators {
namespace {

void require(bool ok, const char* what) {
  if (!ok) throw InvalidArgument(std::string("CVODE: ") + what + " failed");
}

class Cvode final : public Integrator {
 public:
  Cvode(const Declaration& d, const phs::Model& model, double h, const Options& o, int lmm)
      : Integrator(d, model, h, keep_angles(o)), before_(n_) {
    require(SUNContext_Create(nullptr, &context_) == 0, "making a context");
    y_ = N_VNew_Serial(sunindextype(n_), context_);
    memory_ = CVodeCreate(lmm, context_);
    require(y_ && memory_, "allocation");
    N_VConst(0.0, y_);
    require(CVodeInit(memory_, &Cvode::right_hand_side, 0.0, y_) == CV_SUCCESS, "initialisation");
    require(CVodeSStolerances(memory_, o.rtol, o.atol) == CV_SUCCESS, "setting tolerances");
    require(CVodeSetUserData(memory_, this) == CV_SUCCESS, "setting user data");
    require(CVodeSetMaxNumSteps(memory_, 1'000'000) == CV_SUCCESS, "setting the step limit");
    CVodeSetErrFile(memory_, nullptr);  // outcomes are returned, not printed
    if (lmm == CV_BDF) {
      matrix_ = SUNDenseMatrix(sunindextype(n_), sunindextype(n_), context_);
      linear_ = SUNLinSol_Dense(y_, matrix_, context_);
      require(CVodeSetLinearSolver(memory_, linear_, matrix_) == CV_SUCCESS,
              "attaching the linear solver");
    } else {
      fixed_point_ = SUNNonlinSol_FixedPoint(y_, 0, context_);
      require(CVodeSetNonlinearSolver(memory_, fixed_point_) == CV_SUCCESS,
              "attaching the fixed-point solver");
    }
  }
  ~Cvode() override {
    CVodeFree(&memory_);
    if (fixed_point_) SUNNonlinSolFree(fixed_point_);
    if (linear_) SUNLinSolFree(linear_);
    if (matrix_) SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Cvode(const Cvode&) = delete;
  Cvode& operator=(const Cvode&) = delete;

  Outcome advance(double t, double h, phs::State& s) override {
    double* y = N_VGetArrayPointer(y_);
    const double end = t + h;
    if (s.step != next_step_ ||
        s.x != before_) {  // a state that is not ours to continue: start anew from it
      for (size_t i = 0; i < n_; ++i) y[i] = s.x[i] + s.lo[i];
      if (CVodeReInit(memory_, t, y_) != CV_SUCCESS) return Outcome::failed;
    }
    CVodeSetStopTime(memory_, end);
    double reached = t;
    finite_ = true;
    const int flag = CVode(memory_, end, y_, &reached, CV_NORMAL);
    next_step_ = -1;
    if (!finite_) return Outcome::not_finite;
    if (flag < 0) return Outcome::failed;
    for (size_t i = 0; i < n_; ++i)
      if (!std::isfinite(y[i])) return Outcome::not_finite;
    std::copy(y, y + n_, s.x.begin());
    std::fill(s.lo.begin(), s.lo.end(), 0.0);
    before_ = s.x;
    next_step_ = s.step + 1;
    return Outcome::ok;
  }

 private:
  /// CVODE's history knows nothing of a wrap.
  static Options keep_angles(Options o) { return o.wrap = false, o; }
  static int right_hand_side(double t, N_Vector y, N_Vector dy, void* self) {
    auto& me = *static_cast<Cvode*>(self);
    const std::span<const double> x(N_VGetArrayPointer(y), me.n_);
    const std::span<double> dx(N_VGetArrayPointer(dy), me.n_);
    me.system_->field(t, x, {}, dx);
    ++me.cost_.evaluations;
    for (double d : dx)
      if (!std::isfinite(d)) return me.finite_ = false, -1;
    return 0;
  }

  std::vector<double> before_;
  std::int64_t next_step_ = -1;
  bool finite_ = true;
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr;
  void* memory_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  SUNNonlinearSolver fixed_point_ = nullptr;
};

}  // namespace

Entries cvode_entries() {
  const auto rival = [](std::string name, std::string title, int lmm) {
    return double_entry(
        {.name = std::move(name),
         .title = std::move(title),
         .family = "Rivals",
         .resumable = false,
         .rival = true,
         .source = "Hindmarsh et al. 2005"},
        [lmm](const Declaration& d, const phs::Model& m, double h, const Options& o) {
          return std::make_unique<Cvode>(d, m, h, o, lmm);
        });
  };
  return {rival("cvode_adams", "SUNDIALS CVODE, Adams-Moulton, variable step and order", CV_ADAMS),
          rival("cvode_bdf", "SUNDIALS CVODE, BDF, variable step and order", CV_BDF)};
}

}  // namespace porthos::integrators
