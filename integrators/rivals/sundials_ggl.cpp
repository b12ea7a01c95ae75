#include <ida/ida.h>

#include "integrators/rivals/index_one.h"
#include "integrators/rivals/sundials-inl.h"
#include "integrators/rivals/sundials.h"
#include "phs/scalars/derivative.h"

namespace porthos::integrators {
namespace {

/// Constraints with both g and g' kept, by a second multiplier μ that is zero for the exact motion
/// (Gear, Gupta, Leimkuhler 1985), index 2:
///
///   x' = field(t, x) - B λ - J B μ,   0 = g(x, t),   0 = Bᵀe + ∂g/∂t
///
/// B μ acts on the rates like an effort: J B μ = (Gᵀμ, 0) in a canonical state. Only independent
/// rows take part. z = (x, λ, μ).
template <class T>
class GglEquations {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  explicit GglEquations(const phs::Model& model)
      : system_(model.instantiate<T>()),
        rows_(system_->constraints()),
        turns_(model.description()),
        n_(size_t(model.description().nx)),
        g_(size_t(rows_->count())),
        lambda_(g_.size()),
        e_(n_),
        push_(n_) {}

  void synchronise(const phs::State& s) {
    turns_.when_changed(s.turns, [&](In angles) {
      system_->set_turn_angles(angles);
      rows_->set_turn_angles(angles);
    });
  }
  /// Independent rows at a state on the manifold.
  std::vector<size_t> independent(double t, In x) {
    rows_->set_time(T(t));
    rows_->place(x, g_);
    rows_->factor(x);
    std::vector<size_t> rows;
    for (size_t r = 0; r < g_.size(); ++r)
      if (rows_->uses(int(r))) rows.push_back(r);
    return rows;
  }
  void use(const std::vector<size_t>& rows) { used_ = rows; }
  size_t size() const { return n_ + 2 * used_.size(); }

  /// F = (x' - ..., g, g') for the rates dx. z, F: size(); dx: at least nx
  void residual(double t, In z, In dx, Out F) {
    const In x = z.first(n_);
    const size_t r = used_.size();
    system_->field(T(t), x, {}, F.first(n_));
    rows_->set_time(T(t));
    rows_->place(x, g_);
    for (size_t i = 0; i < r; ++i) F[n_ + i] = g_[used_[i]];
    for (size_t k = 0; k < n_; ++k) F[k] = dx[k] - F[k];
    force(z.subspan(n_, r));
    for (size_t k = 0; k < n_; ++k) F[k] += push_[k];
    force(z.subspan(n_ + r, r));
    system_->apply_structure(x, push_, e_);
    for (size_t k = 0; k < n_; ++k) F[k] += e_[k];
    system_->gradient(x, e_);
    rows_->rates(e_, g_);
    rows_->add_drift(g_);
    for (size_t i = 0; i < r; ++i) F[n_ + r + i] = g_[used_[i]];
  }

 private:
  /// push_ = B λ, λ of the rows in use.
  void force(In lambda) {
    std::fill(lambda_.begin(), lambda_.end(), T(0.0));
    for (size_t i = 0; i < used_.size(); ++i) lambda_[used_[i]] = lambda[i];
    rows_->forces(lambda_, push_);
  }

  std::unique_ptr<phs::System<T>> system_;
  std::unique_ptr<phs::Constraints<T>> rows_;
  TurnKeeper<T> turns_;
  size_t n_;
  std::vector<T> g_, lambda_, e_, push_;
  std::vector<size_t> used_;
};

/// The index-1 form gives the rates of the start and of the ledger.
class IdaGgl final : private IndexOneModel, public Sundials {
 public:
  IdaGgl(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : IndexOneModel(model),
        Sundials(d, static_cast<const IndexOneModel&>(*this), h, o),
        equations_(model),
        dual_equations_(model) {}

  void tell_turns(const phs::State& s) override {
    Sundials::tell_turns(s);
    equations_.synchronise(s);
    dual_equations_.synchronise(s);
  }

 private:
  bool goes_on() override {
    auto rows = equations_.independent(reached_, y_);
    // Off the manifold dependent rows look independent.
    return rows == rows_ || rows.size() > rows_.size();
  }
  bool restart(double t) override {
    auto rows = equations_.independent(t, y_);
    if (rows_.empty() || rows.size() <= rows_.size()) rows_ = std::move(rows);
    equations_.use(rows_);
    dual_equations_.use(rows_);
    const size_t n = equations_.size();
    z_.assign(n, 0.0);
    rate_.assign(n, 0.0);
    std::copy(y_.begin(), y_.end(), z_.begin());
    if (!field(t, y_.data(), rate_.data())) return false;
    reached_ = t;
    make_solver(t);
    return true;
  }
  void make_solver(double t) {
    const auto n = sunindextype(z_.size());
    solver_.reset();
    dual_z_.assign(z_.size(), phs::Dual(0.0));
    dual_rate_.assign(z_.size(), phs::Dual(0.0));
    dual_F_.assign(z_.size(), phs::Dual(0.0));
    z_vector_.reset(N_VMake_Serial(n, z_.data(), context()));
    rate_vector_.reset(N_VMake_Serial(n, rate_.data(), context()));
    const Owned<N_Vector> tolerances(N_VNew_Serial(n, context()));
    matrix_.reset(SUNDenseMatrix(n, n, context()));
    linear_.reset(SUNLinSol_Dense(z_vector_.get(), matrix_.get(), context()));
    solver_.reset(IDACreate(context()));
    void* const s = solver_.get();
    require(s && z_vector_ && rate_vector_ && tolerances && matrix_ && linear_ ? 0 : -1,
            "allocation");
    // Multipliers follow from the state: they take no part in the choice of steps.
    for (size_t k = 0; k < z_.size(); ++k)
      N_VGetArrayPointer(tolerances.get())[k] = k < n_ ? options_.atol : 1e30;
    require(IDAInit(s, residual, t, z_vector_.get(), rate_vector_.get()), "initialisation");
    require(IDASVtolerances(s, options_.rtol, tolerances.get()), "setting of tolerances");
    require(IDASetUserData(s, self()), "setting of user data");
    require(IDASetErrHandlerFn(s, listen, self()), "setting of the error handler");
    require(IDASetMaxNumSteps(s, most_inner_steps), "setting of the step limit");
    require(IDASetLinearSolver(s, linear_.get(), matrix_.get()), "attaching of a solver");
    require(IDASetJacFn(s, residual_jacobian), "setting of the Jacobian");
  }
  bool integrate(double end) override {
    double now = 0;
    IDASetMinStep(solver_.get(), least_inner_step(end));
    const bool ok =
        IDASetStopTime(solver_.get(), end) == IDA_SUCCESS &&
        IDASolve(solver_.get(), end, &now, z_vector_.get(), rate_vector_.get(), IDA_NORMAL) >= 0;
    std::copy_n(z_.begin(), n_, y_.begin());
    reached_ = end;
    return ok;
  }
  Counts counts() const override {
    Counts c;
    IDAGetNumNonlinSolvIters(solver_.get(), &c.iterations);
    IDAGetNumLinSolvSetups(solver_.get(), &c.factorisations);
    return c;
  }

  static IdaGgl& of(void* self) { return static_cast<IdaGgl&>(*static_cast<Sundials*>(self)); }
  static int residual(double t, N_Vector z, N_Vector rate, N_Vector F, void* self) {
    auto& me = of(self);
    const size_t n = me.z_.size();
    double* const f = N_VGetArrayPointer(F);
    const auto evaluate = [&] {
      ++me.cost_.evaluations;
      me.equations_.residual(me.inside(t), {N_VGetArrayPointer(z), n},
                             {N_VGetArrayPointer(rate), n}, {f, n});
    };
    return me.answer(me.guarded(evaluate, f, n));
  }
  /// ∂F/∂z + c ∂F/∂z', a Dual evaluation per column.
  static int residual_jacobian(double t, double c, N_Vector z, N_Vector, N_Vector, SUNMatrix J,
                               void* self, N_Vector, N_Vector, N_Vector) {
    auto& me = of(self);
    const size_t n = me.z_.size();
    double* const columns = SUNDenseMatrix_Data(J);
    const auto evaluate = [&] {
      for (size_t k = 0; k < n; ++k) me.dual_z_[k] = phs::Dual(N_VGetArrayPointer(z)[k]);
      phs::along_each(me.dual_z_, [&](size_t j) {
        ++me.cost_.evaluations;
        me.dual_equations_.residual(me.inside(t), me.dual_z_, me.dual_rate_, me.dual_F_);
        for (size_t i = 0; i < n; ++i) columns[i + n * j] = me.dual_F_[i].d;
        if (j < me.n_) columns[j + n * j] += c;
      });
    };
    return me.answer(me.guarded(evaluate, columns, n * n));
  }

  GglEquations<double> equations_;
  GglEquations<phs::Dual> dual_equations_;
  std::vector<size_t> rows_;  ///< in use
  double reached_ = 0;
  std::vector<double> z_, rate_;
  std::vector<phs::Dual> dual_z_, dual_rate_, dual_F_;
  Owned<N_Vector> z_vector_, rate_vector_;
  OwnedSolver<IDAFree> solver_;
};

}  // namespace

Entry ida_ggl_entry() {
  return constrained_rival_entry<IdaGgl>(
      false, "ida_ggl", "SUNDIALS IDA, BDF, index 2 with g and g' (Gear, Gupta, Leimkuhler)",
      "Gear, Gupta, Leimkuhler 1985, J. Comput. Appl. Math. 12-13:77");
}

}  // namespace porthos::integrators
