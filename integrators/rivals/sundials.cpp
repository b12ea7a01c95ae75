#include "integrators/rivals/sundials.h"

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <cstdlib>

#include "integrators/rivals/index_one.h"
#include "integrators/rivals/sundials-inl.h"

namespace porthos::integrators {
namespace {

class Cvode : public Sundials {
 public:
  Cvode(const Declaration& d, const phs::Model& model, double h, const Options& o, int lmm)
      : Sundials(d, model, h, o), solver_(CVodeCreate(lmm, context())) {
    void* const c = solver_.get();
    require(c ? 0 : -1, "allocation");
    require(CVodeInit(c, right_hand_side, 0.0, vector()), "initialisation");
    require(CVodeSStolerances(c, o.rtol, o.atol), "setting of tolerances");
    require(CVodeSetUserData(c, self()), "setting of user data");
    require(CVodeSetErrHandlerFn(c, listen, self()), "setting of the error handler");
    require(CVodeSetMaxNumSteps(c, most_inner_steps), "setting of the step limit");
    if (lmm == CV_BDF) {
      const bool exact = use_newton(model);
      require(CVodeSetLinearSolver(c, linear_.get(), matrix_.get()), "attaching of a solver");
      if (exact) require(CVodeSetJacFn(c, dense_jacobian), "setting of the Jacobian");
    } else {
      fixed_point_.reset(SUNNonlinSol_FixedPoint(vector(), 0, context()));
      require(CVodeSetNonlinearSolver(c, fixed_point_.get()), "attaching of a solver");
    }
  }

 private:
  bool restart(double t) override { return CVodeReInit(solver_.get(), t, vector()) == CV_SUCCESS; }
  bool integrate(double end) override {
    double reached = 0;
    CVodeSetMinStep(solver_.get(), least_inner_step(end));
    return CVodeSetStopTime(solver_.get(), end) == CV_SUCCESS &&
           CVode(solver_.get(), end, vector(), &reached, CV_NORMAL) >= 0;
  }
  Counts counts() const override {
    Counts c;
    CVodeGetNumNonlinSolvIters(solver_.get(), &c.iterations);
    CVodeGetNumLinSolvSetups(solver_.get(), &c.factorisations);
    return c;
  }

  Owned<SUNNonlinearSolver> fixed_point_;
  OwnedSolver<CVodeFree> solver_;
};

enum class Kind { explicit_pair, implicit_pair };

class Arkode final : public Sundials {
 public:
  Arkode(const Declaration& d, const phs::Model& model, double h, const Options& o, Kind kind,
         int order)
      : Sundials(d, model, h, o), kind_(kind), order_(order) {
    if (kind == Kind::implicit_pair) exact_ = use_newton(model);
    make_solver(0);
  }

 private:
  void make_solver(double t) {
    const bool implicit = kind_ == Kind::implicit_pair;
    solver_.reset(ARKStepCreate(implicit ? nullptr : right_hand_side,
                                implicit ? right_hand_side : nullptr, t, vector(), context()));
    void* const a = solver_.get();
    require(a ? 0 : -1, "allocation");
    // It is used only to step back to the end by a rounding error. The default interpolant costs an
    // evaluation at every inner step.
    require(ARKStepSetInterpolantType(a, ARK_INTERP_LAGRANGE), "choice of an interpolant");
    require(ARKStepSetOrder(a, order_), "choice of an order");
    require(ARKStepSStolerances(a, options_.rtol, options_.atol), "setting of tolerances");
    require(ARKStepSetUserData(a, self()), "setting of user data");
    require(ARKStepSetErrHandlerFn(a, listen, self()), "setting of the error handler");
    require(ARKStepSetMaxNumSteps(a, most_inner_steps), "setting of the step limit");
    if (implicit)
      require(ARKStepSetLinearSolver(a, linear_.get(), matrix_.get()), "attaching of a solver");
    if (exact_) require(ARKStepSetJacFn(a, dense_jacobian), "setting of the Jacobian");
  }

  /// Makes a new solver, because ARKStepReInit keeps the sign of the last inner step and then
  /// refuses to reverse (6.4.1).
  bool restart(double t) override {
    make_solver(t);
    reached_ = t;
    good_ = y_;
    return true;
  }
  bool integrate(double end) override {
    head_for(end);
    for (long i = 0; i < most_inner_steps; ++i) {
      double now = 0;
      const int flag = ARKStepEvolve(solver_.get(), end, vector(), &now, ARK_ONE_STEP);
      if (flag < 0) {
        if (shorten(end)) continue;
        if (remark_.empty()) remark_ = "ARKODE: " + name_of(flag);  // some failures are silent
        return false;
      }
      reached_ = now;
      good_ = y_;
      if (flag == ARK_TSTOP_RETURN) return true;
    }
    remark_ = "ARKODE: the limit of inner steps was reached";
    return false;
  }
  /// ARKODE's explicit steps give up at the first stage that is not finite. Restarts from the last
  /// good state with half the distance to that stage.
  bool shorten(double end) {
    const double step = 0.5 * (refused_at_ - reached_);
    if (kind_ != Kind::explicit_pair || !stopped_by_field() || reached_ + step == reached_)
      return false;
    y_ = good_;
    make_solver(reached_);
    remark_.clear();
    head_for(end);
    return ARKStepSetInitStep(solver_.get(), step) == ARK_SUCCESS;
  }
  static std::string name_of(int flag) {
    const std::unique_ptr<char, decltype(&std::free)> name(ARKStepGetReturnFlagName(flag),
                                                           std::free);
    return name.get();
  }
  void head_for(double end) {
    ARKStepSetMinStep(solver_.get(), least_inner_step(end));
    ARKStepSetStopTime(solver_.get(), end);
  }
  Counts counts() const override {
    Counts c;
    if (kind_ == Kind::implicit_pair) {
      ARKStepGetNumNonlinSolvIters(solver_.get(), &c.iterations);
      ARKStepGetNumLinSolvSetups(solver_.get(), &c.factorisations);
    }
    return c;
  }

  Kind kind_;
  int order_;
  bool exact_ = false;  ///< the Jacobian is exact
  double reached_ = 0;  ///< the end of the last good inner step
  std::vector<double> good_;
  OwnedSolver<ARKStepFree> solver_;
};

/// F(t, y, y') = y' - f(t, y). With constraints: sundials_ggl.cpp.
class Ida final : public Sundials {
 public:
  Ida(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : Sundials(d, model, h, o),
        rate_(N_VNew_Serial(sunindextype(n_), context())),
        solver_(IDACreate(context())) {
    void* const s = solver_.get();
    require(s && rate_ ? 0 : -1, "allocation");
    N_VConst(0.0, rate_.get());
    require(IDAInit(s, residual, 0.0, vector(), rate_.get()), "initialisation");
    require(IDASStolerances(s, o.rtol, o.atol), "setting of tolerances");
    require(IDASetUserData(s, self()), "setting of user data");
    require(IDASetErrHandlerFn(s, listen, self()), "setting of the error handler");
    require(IDASetMaxNumSteps(s, most_inner_steps), "setting of the step limit");
    const bool exact = use_newton(model);
    require(IDASetLinearSolver(s, linear_.get(), matrix_.get()), "attaching of a solver");
    if (exact) require(IDASetJacFn(s, residual_jacobian), "setting of the Jacobian");
  }

 private:
  bool restart(double t) override {  // y' = f(t, y) makes the start consistent
    return right_hand_side(t, vector(), rate_.get(), self()) == 0 &&
           IDAReInit(solver_.get(), t, vector(), rate_.get()) == IDA_SUCCESS;
  }
  bool integrate(double end) override {
    double reached = 0;
    IDASetMinStep(solver_.get(), least_inner_step(end));
    return IDASetStopTime(solver_.get(), end) == IDA_SUCCESS &&
           IDASolve(solver_.get(), end, &reached, vector(), rate_.get(), IDA_NORMAL) >= 0;
  }
  Counts counts() const override {
    Counts c;
    IDAGetNumNonlinSolvIters(solver_.get(), &c.iterations);
    IDAGetNumLinSolvSetups(solver_.get(), &c.factorisations);
    return c;
  }

  static int residual(double t, N_Vector y, N_Vector dy, N_Vector F, void* self) {
    const int flag = right_hand_side(t, y, F, self);
    N_VLinearSum(1.0, dy, -1.0, F, F);
    return flag;
  }
  /// c I - ∂f/∂y
  static int residual_jacobian(double t, double c, N_Vector y, N_Vector, N_Vector, SUNMatrix J,
                               void* self, N_Vector a, N_Vector b, N_Vector d) {
    const int flag = dense_jacobian(t, y, nullptr, J, self, a, b, d);
    const auto n = SUNDenseMatrix_Columns(J);
    for (sunindextype j = 0; j < n; ++j) {
      double* const column = SUNDenseMatrix_Column(J, j);
      for (sunindextype i = 0; i < n; ++i) column[i] = (i == j ? c : 0.0) - column[i];
    }
    return flag;
  }

  Owned<N_Vector> rate_;  ///< y'
  OwnedSolver<IDAFree> solver_;
};

}  // namespace

Entries sundials_entries() {
  const char* sundials = "Hindmarsh et al. 2005, ACM Trans. Math. Softw. 31:363";
  const char* arkode = "Reynolds, Gardner, Woodward, Chinomona 2023, ACM Trans. Math. Softw. 49:19";
  using enum Kind;
  return {
      rival_entry<Cvode>("cvode_adams", "SUNDIALS CVODE, Adams-Moulton, variable step and order",
                         sundials, CV_ADAMS),
      rival_entry<Cvode>("cvode_bdf", "SUNDIALS CVODE, BDF, variable step and order", sundials,
                         CV_BDF),
      rival_entry<Arkode>("arkode_erk4", "SUNDIALS ARKODE, explicit Runge-Kutta, Zonneveld 4(3)",
                          arkode, explicit_pair, 4),
      rival_entry<Arkode>("arkode_erk5", "SUNDIALS ARKODE, explicit Runge-Kutta, Cash-Karp 5(4)",
                          arkode, explicit_pair, 5),
      rival_entry<Arkode>("arkode_erk8", "SUNDIALS ARKODE, explicit Runge-Kutta, Fehlberg 8(7)",
                          arkode, explicit_pair, 8),
      rival_entry<Arkode>(
          "arkode_dirk5",
          "SUNDIALS ARKODE, diagonally implicit Runge-Kutta, Kennedy-Carpenter 5(4)", arkode,
          implicit_pair, 5),
      rival_entry<Ida>("ida", "SUNDIALS IDA, BDF on the residual y' - f(t, y)", sundials),
      ida_ggl_entry(),
      constrained_rival_entry<OnIndexOne<Cvode>>(
          true, "index1_cvode_adams", "SUNDIALS CVODE, Adams-Moulton, multipliers eliminated",
          sundials, CV_ADAMS),
      constrained_rival_entry<OnIndexOne<Cvode, true>>(
          true, "baumgarte_cvode_adams",
          "SUNDIALS CVODE, Adams-Moulton, multipliers eliminated, Baumgarte's stabilisation",
          "Baumgarte 1972, Comput. Methods Appl. Mech. Eng. 1:1", CV_ADAMS)};
}

}  // namespace porthos::integrators
