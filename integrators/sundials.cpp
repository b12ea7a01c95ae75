#include "integrators/sundials.h"

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cmath>

#include "integrators/catalogue.h"

namespace porthos::integrators {
namespace {

void require(bool ok, const char* what) {
  if (!ok) throw InvalidArgument(std::string("SUNDIALS: ") + what + " failed");
}
constexpr long most_inner_steps = 1'000'000;

/// What the solvers share: context, state vector, dense matrix, right-hand side, and when to start anew.
class Sundials : public Integrator {
 public:
  Sundials(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : Integrator(d, model, h, keep_angles(o)), before_(n_) {
    require(SUNContext_Create(nullptr, &context_) == 0, "making a context");
    y_ = N_VNew_Serial(sunindextype(n_), context_);
    require(y_, "allocation");
    N_VConst(0.0, y_);
  }
  ~Sundials() override {
    if (fixed_point_) SUNNonlinSolFree(fixed_point_);
    if (linear_) SUNLinSolFree(linear_);
    if (matrix_) SUNMatDestroy(matrix_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Sundials(const Sundials&) = delete;
  Sundials& operator=(const Sundials&) = delete;

  Outcome advance(double t, double h, phs::State& s) override {
    double* y = N_VGetArrayPointer(y_);
    if (s.step != next_step_ || s.x != before_) {  // not a state of ours to continue: start anew
      for (size_t i = 0; i < n_; ++i) y[i] = s.x[i] + s.lo[i];
      finite_ = true;
      if (!start(t)) return finite_ ? Outcome::failed : Outcome::not_finite;
    }
    next_step_ = -1;
    finite_ = true;
    const int flag = proceed(t + h);
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

 protected:
  virtual bool start(double t) = 0;
  /// Integrates y_ to `end` exactly; the solver's flag, negative for failure.
  virtual int proceed(double end) = 0;

  static int right_hand_side(double t, N_Vector y, N_Vector dy, void* self) {
    return static_cast<Sundials*>(self)->evaluate(t, y, dy);
  }
  int evaluate(double t, N_Vector y, N_Vector dy) {
    const std::span<const double> x(N_VGetArrayPointer(y), n_);
    const std::span<double> dx(N_VGetArrayPointer(dy), n_);
    system_->field(t, x, {}, dx);
    ++cost_.evaluations;
    for (double d : dx)
      if (!std::isfinite(d)) return finite_ = false, -1;
    return 0;
  }
  void make_dense_solver() {
    matrix_ = SUNDenseMatrix(sunindextype(n_), sunindextype(n_), context_);
    linear_ = SUNLinSol_Dense(y_, matrix_, context_);
    require(matrix_ && linear_, "making the linear solver");
  }

  std::vector<double> before_;
  std::int64_t next_step_ = -1;
  bool finite_ = true;
  SUNContext context_ = nullptr;
  N_Vector y_ = nullptr;
  SUNMatrix matrix_ = nullptr;
  SUNLinearSolver linear_ = nullptr;
  SUNNonlinearSolver fixed_point_ = nullptr;

 private:
  /// The solvers' histories know nothing of a wrap.
  static Options keep_angles(Options o) { return o.wrap = false, o; }
};

class Cvode final : public Sundials {
 public:
  Cvode(const Declaration& d, const phs::Model& model, double h, const Options& o, int lmm)
      : Sundials(d, model, h, o), memory_(CVodeCreate(lmm, context_)) {
    require(memory_ && CVodeInit(memory_, &Cvode::right_hand_side, 0.0, y_) == CV_SUCCESS,
            "initialisation");
    require(CVodeSStolerances(memory_, o.rtol, o.atol) == CV_SUCCESS, "setting tolerances");
    CVodeSetUserData(memory_, static_cast<Sundials*>(this));
    CVodeSetMaxNumSteps(memory_, most_inner_steps);
    CVodeSetErrFile(memory_, nullptr);  // outcomes are returned, not printed
    if (lmm == CV_BDF) {
      make_dense_solver();
      require(CVodeSetLinearSolver(memory_, linear_, matrix_) == CV_SUCCESS, "attaching a solver");
    } else {
      fixed_point_ = SUNNonlinSol_FixedPoint(y_, 0, context_);
      require(CVodeSetNonlinearSolver(memory_, fixed_point_) == CV_SUCCESS, "attaching a solver");
    }
  }
  ~Cvode() override { CVodeFree(&memory_); }

 private:
  bool start(double t) override { return CVodeReInit(memory_, t, y_) == CV_SUCCESS; }
  int proceed(double end) override {
    double reached;
    CVodeSetStopTime(memory_, end);
    return CVode(memory_, end, y_, &reached, CV_NORMAL);
  }
  void* memory_;
};

class ArkodeExplicit final : public Sundials {
 public:
  ArkodeExplicit(const Declaration& d, const phs::Model& model, double h, const Options& o,
                 int order)
      : Sundials(d, model, h, o),
        memory_(ERKStepCreate(&ArkodeExplicit::right_hand_side, 0.0, y_, context_)) {
    require(memory_ && ERKStepSetOrder(memory_, order) == ARK_SUCCESS, "choosing the order");
    require(ERKStepSStolerances(memory_, o.rtol, o.atol) == ARK_SUCCESS, "setting tolerances");
    ERKStepSetUserData(memory_, static_cast<Sundials*>(this));
    ERKStepSetMaxNumSteps(memory_, most_inner_steps);
    ERKStepSetErrFile(memory_, nullptr);
  }
  ~ArkodeExplicit() override { ERKStepFree(&memory_); }

 private:
  bool start(double t) override {
    return ERKStepReInit(memory_, &ArkodeExplicit::right_hand_side, t, y_) == ARK_SUCCESS;
  }
  int proceed(double end) override {
    double reached;
    ERKStepSetStopTime(memory_, end);
    return ERKStepEvolve(memory_, end, y_, &reached, ARK_NORMAL);
  }
  void* memory_;
};

class ArkodeImplicit final : public Sundials {
 public:
  ArkodeImplicit(const Declaration& d, const phs::Model& model, double h, const Options& o,
                 int order)
      : Sundials(d, model, h, o),
        memory_(ARKStepCreate(nullptr, &ArkodeImplicit::right_hand_side, 0.0, y_, context_)) {
    require(memory_ && ARKStepSetOrder(memory_, order) == ARK_SUCCESS, "choosing the order");
    require(ARKStepSStolerances(memory_, o.rtol, o.atol) == ARK_SUCCESS, "setting tolerances");
    make_dense_solver();
    require(ARKStepSetLinearSolver(memory_, linear_, matrix_) == ARK_SUCCESS, "attaching a solver");
    ARKStepSetUserData(memory_, static_cast<Sundials*>(this));
    ARKStepSetMaxNumSteps(memory_, most_inner_steps);
    ARKStepSetErrFile(memory_, nullptr);
  }
  ~ArkodeImplicit() override { ARKStepFree(&memory_); }

 private:
  bool start(double t) override {
    return ARKStepReInit(memory_, nullptr, &ArkodeImplicit::right_hand_side, t, y_) == ARK_SUCCESS;
  }
  int proceed(double end) override {
    double reached;
    ARKStepSetStopTime(memory_, end);
    return ARKStepEvolve(memory_, end, y_, &reached, ARK_NORMAL);
  }
  void* memory_;
};

/// F(t, y, y') = y' - f(t, y): the form that constrained systems will need, tried here on unconstrained ones.
class Ida final : public Sundials {
 public:
  Ida(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : Sundials(d, model, h, o),
        dy_(N_VClone(y_)),
        f_(N_VClone(y_)),
        memory_(IDACreate(context_)) {
    N_VConst(0.0, dy_);
    require(memory_ && IDAInit(memory_, &Ida::residual, 0.0, y_, dy_) == IDA_SUCCESS,
            "initialisation");
    require(IDASStolerances(memory_, o.rtol, o.atol) == IDA_SUCCESS, "setting tolerances");
    make_dense_solver();
    require(IDASetLinearSolver(memory_, linear_, matrix_) == IDA_SUCCESS, "attaching a solver");
    IDASetUserData(memory_, this);
    IDASetMaxNumSteps(memory_, most_inner_steps);
    IDASetErrFile(memory_, nullptr);
  }
  ~Ida() override {
    IDAFree(&memory_);
    N_VDestroy(dy_), N_VDestroy(f_);
  }

 private:
  static int residual(double t, N_Vector y, N_Vector dy, N_Vector r, void* self) {
    auto& me = *static_cast<Ida*>(self);
    if (const int bad = me.evaluate(t, y, me.f_)) return bad;
    N_VLinearSum(1.0, dy, -1.0, me.f_, r);
    return 0;
  }
  bool start(double t) override {
    return evaluate(t, y_, dy_) == 0 && IDAReInit(memory_, t, y_, dy_) == IDA_SUCCESS;
  }
  int proceed(double end) override {
    double reached;
    IDASetStopTime(memory_, end);
    return IDASolve(memory_, end, &reached, y_, dy_, IDA_NORMAL);
  }
  N_Vector dy_, f_;
  void* memory_;
};

/// An entry whose maker passes `extra` on to the constructor.
template <class Solver, class... Extra>
Entry rival(std::string name, std::string title, std::string source, Extra... extra) {
  return double_entry({.name = std::move(name),
                       .title = std::move(title),
                       .family = "Rivals",
                       .resumable = false,
                       .rival = true,
                       .source = std::move(source)},
                      [=](const Declaration& d, const phs::Model& m, double h, const Options& o) {
                        return std::make_unique<Solver>(d, m, h, o, extra...);
                      });
}

}  // namespace

Entries sundials_entries() {
  const char* sundials = "Hindmarsh et al. 2005, ACM Trans. Math. Softw. 31:363";
  const char* arkode = "Reynolds, Gardner, Woodward, Chinomona 2023, ACM Trans. Math. Softw. 49:19";
  return {
      rival<Cvode>("cvode_adams", "SUNDIALS CVODE, Adams-Moulton, variable step and order",
                   sundials, CV_ADAMS),
      rival<Cvode>("cvode_bdf", "SUNDIALS CVODE, BDF, variable step and order", sundials, CV_BDF),
      rival<ArkodeExplicit>("arkode_erk4", "SUNDIALS ARKODE, explicit Runge-Kutta of order 4",
                            arkode, 4),
      rival<ArkodeExplicit>("arkode_erk5", "SUNDIALS ARKODE, explicit Runge-Kutta of order 5",
                            arkode, 5),
      rival<ArkodeExplicit>("arkode_erk8", "SUNDIALS ARKODE, explicit Runge-Kutta of order 8",
                            arkode, 8),
      rival<ArkodeImplicit>(
          "arkode_dirk5", "SUNDIALS ARKODE, diagonally implicit Runge-Kutta of order 5", arkode, 5),
      rival<Ida>("ida", "SUNDIALS IDA, BDF on the residual y' - f(t, y)", sundials)};
}

}  // namespace porthos::integrators
