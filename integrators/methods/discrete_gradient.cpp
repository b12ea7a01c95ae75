#include "integrators/methods/discrete_gradient.h"

#include <algorithm>
#include <cmath>

#include "integrators/core/entry.h"
#include "integrators/implicit/step_solver.h"
#include "integrators/methods/discrete_field.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {
namespace {

using Rule = DiscreteGradientRule;
using phs::Dual;

/// f̄ as a function of the middle m, δ = 2 (m - x0). Newton's matrix for δ = h f̄ is then I - (h/2)
/// ∂f̄/∂m. If f̄ is the field at m, this is the matrix of the midpoint rule.
class MiddleField final : public DualField {
 public:
  MiddleField(Rule rule, const phs::Model& model, std::shared_ptr<const InvariantGradients> kept)
      : system_(model.instantiate<Dual>()),
        keeper_(model.description()),
        field_(rule, model, *system_, false, std::move(kept), 3),  // enough panels for a Jacobian
        start_(size_t(model.description().nx), 0.0),
        x0_(start_.size()),
        lo_(start_.size(), Dual(0.0)),
        delta_(start_.size()) {}

  void start_at(std::span<const double> x0) { std::copy(x0.begin(), x0.end(), start_.begin()); }
  void carry(Archive& a) { a(start_); }

  void tell_turns(const std::vector<std::int64_t>& turns) override {
    keeper_.synchronise(turns, *system_);
  }
  int operator()(double t, std::span<const Dual> m, std::span<Dual> f) override {
    for (size_t k = 0; k < start_.size(); ++k) {
      x0_[k] = Dual(start_[k]);
      delta_[k] = Dual(2.0) * (m[k] - x0_[k]);
    }
    field_.start_at(x0_,
                    lo_);  // each product alike: a resumed run then has the same bits
    field_(Dual(t), delta_, f);
    return field_.evaluations();
  }

 private:
  std::unique_ptr<phs::System<Dual>> system_;
  TurnKeeper<Dual> keeper_;
  DiscreteField<Dual> field_;
  std::vector<double> start_;
  std::vector<Dual> x0_, lo_, delta_;
};

/// The unknown is δ itself, so its precision does not depend on the size of x.
template <class T>
class DiscreteGradient final : public BasicIntegrator<T>,
                               public StagedSteps<T>,
                               public DiscreteGradientSteps {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::system_, Base::port_work_;
  using typename Base::State;

 public:
  DiscreteGradient(const Declaration& d, Rule rule, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        rule_(rule),
        invariants_(rule == Rule::gonzalez ? std::make_shared<InvariantGradients>(model) : nullptr),
        field_(rule, model, *system_, o.lanes, invariants_),
        // gonzalez: the amplified rounding of its correction counts as noise too
        solver_(Stagnation(unit_roundoff<T> * (rule == Rule::gonzalez ? 1e7 : 1e5),
                           o.iteration_tolerance),
                o, n_),
        delta_(n_),
        next_(n_),
        smallest_(n_),
        noise_(n_, 0.0),
        residual_(n_),
        point_(n_) {
    if (o.solver == Solver::fixed_point) return;
    middle_ = std::make_unique<MiddleField>(rule, model, invariants_);
    const double half = 0.5;
    solver_.set_newton(
        std::make_unique<SimplifiedNewton>(model, std::span(&half, 1), o.solver, middle_.get()));
  }

  void tell_turns(const State& s) override {
    Base::tell_turns(s);
    field_.tell_turns(s.turns);
  }

  Outcome advance(T t, T h, State& s) override {
    field_.start_at(s.x, s.lo);
    Equations equations{*this, s, t, h};
    const Outcome o = solver_.solve(equations, true, cost_);
    cost_.evaluations += field_.evaluations();
    if (o != Outcome::ok) return o;
    if (port_work_.any()) field_.book(t + T(0.5) * h, h, port_work_);
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(s.x[k], s.lo[k], delta_[k]);
    return Outcome::ok;
  }

  void carry(Archive& a) override {
    if (middle_) middle_->carry(a);
    solver_.carry(a);
  }
  std::string remark() const override { return solver_.remark(); }
  bool integrates_power() const override { return true; }

  Rule rule() const override { return rule_; }
  CollocationTable<TableReal<T>> table() const override { return gauss_table<TableReal<T>>(1); }
  void stages(const State& after, std::span<T> Y) const override {
    for (size_t k = 0; k < n_; ++k) {
      Y[k] = after.x[k] + (after.lo[k] - T(0.5) * delta_[k]);
      Y[n_ + k] = delta_[k];
    }
  }
  size_t multipliers() const override { return n_; }

 private:
  /// The equations that the solver works on.
  struct Equations {
    DiscreteGradient& method;
    const State& state;
    T t, h;
    void guess(bool predicted) { method.guess(t, h, state, predicted); }
    Sweep sweep(double& distance) { return method.sweep_once(t, h, state, distance); }
    void finish() {}  // δ is up to date after the last sweep
    void freeze(SimplifiedNewton& newton, Solver solver) { method.freeze(*this, newton, solver); }
    double newton_step() const { return phs::to_double(h); }
  };

  /// δ = h f(x0). For Newton 0: it converges equally well from there, and better in stiff
  /// directions.
  void guess(T t, T h, const State& s, bool predicted) {
    std::fill(smallest_.begin(), smallest_.end(), HUGE_VAL);
    std::fill(delta_.begin(), delta_.end(), T(0.0));
    if (!predicted || solver_.newton()) return;
    for (size_t k = 0; k < n_; ++k) next_[k] = s.x[k] + s.lo[k];
    system_->field(t, next_, {}, delta_);
    ++cost_.evaluations;
    for (T& d : delta_) d *= h;
  }

  void freeze(const Equations& e, SimplifiedNewton& newton, Solver solver) {
    for (size_t k = 0; k < n_; ++k) point_[k] = phs::to_double(e.state.x[k] + e.state.lo[k]);
    middle_->start_at(point_);
    for (size_t k = 0; k < n_; ++k) point_[k] += 0.5 * phs::to_double(delta_[k]);
    const double h = phs::to_double(e.h);
    newton.freeze(solver, phs::to_double(e.t) + h / 2, h, point_, e.state.turns);
  }

  Sweep sweep_once(T t, T h, const State& s, double& distance) {
    ++cost_.sweeps;
    SimplifiedNewton* const newton = solver_.newton();
    field_(t + T(0.5) * h, delta_, next_);
    for (size_t k = 0; k < n_; ++k) next_[k] *= h;
    if (newton) correct(*newton);

    Sweep p;
    double largest = 0;
    distance = 0;
    for (size_t k = 0; k < n_; ++k) largest = std::max(largest, magnitude(s.x[k]));
    for (size_t k = 0; k < n_; ++k) {
      const double move = magnitude(next_[k] - delta_[k]), away = magnitude(next_[k]);
      delta_[k] = next_[k];
      if (!(move < HUGE_VAL)) p.finite = false;
      if (move > 0) {
        p.changed = true;
        if (move < smallest_[k]) {
          smallest_[k] = move;
          p.improved = true;
        }
      }
      const double size = std::max({magnitude(s.x[k]), away, 1e-4 * largest, 1e-300});
      p.change = std::max(p.change, move / size);
      if (newton) p.blur(noise_[k] / size);
      distance = std::max(distance, away / size);
    }
    return p;
  }
  /// next = δ + (I - (h/2) ∂f̄/∂m)⁻¹ (h f̄ - δ)
  void correct(SimplifiedNewton& newton) {
    for (size_t k = 0; k < n_; ++k) {
      next_[k] -= delta_[k];
      noise_[k] = solver_noise(magnitude(next_[k]));
    }
    for (int part = 0; part < newton_parts<T>; ++part) {
      for (size_t k = 0; k < n_; ++k) residual_[k] = part_of(next_[k], part);
      newton.solve(residual_);
      for (size_t k = 0; k < n_; ++k) set_part(next_[k], part, residual_[k]);
    }
    for (size_t k = 0; k < n_; ++k) next_[k] += delta_[k];
  }

  Rule rule_;
  std::shared_ptr<const InvariantGradients> invariants_;  ///< of gonzalez
  DiscreteField<T> field_;
  std::unique_ptr<MiddleField> middle_;  ///< for Newton; the solver refers to it
  StepSolver solver_;
  std::vector<T> delta_, next_;
  std::vector<double> smallest_, noise_, residual_, point_;
};

Entry method(Declaration d, Rule rule) {
  d.family = "Energy-preserving";
  d.energy_exact = d.passivity_exact = Claim::holds;
  return entry(std::move(d),
               [rule](const Declaration& own, const phs::Model& m, auto h,
                      const Options& o) -> std::unique_ptr<BasicIntegrator<decltype(h)>> {
                 return std::make_unique<DiscreteGradient<decltype(h)>>(own, rule, m, h, o);
               });
}

}  // namespace

Entries discrete_gradient_entries() {
  return {method({.name = "gonzalez",
                  .title = "midpoint discrete gradient: H and declared invariants exactly",
                  .order = 2,
                  .symmetric = Claim::holds,
                  .quadratic_invariants = Claim::holds,
                  .source = "Gonzalez 1996, J. Nonlinear Sci. 6:449, eq. (13)"},
                 Rule::gonzalez),
          method({.name = "mean_value",
                  .title = "mean value discrete gradient (average vector field): H exactly",
                  .order = 2,
                  .symmetric = Claim::holds,
                  .source = "Harten, Lax, van Leer 1983; Quispel, McLaren 2008, J. Phys. A "
                            "41:045206"},
                 Rule::mean_value),
          method({.name = "itoh_abe",
                  .title = "coordinate increment discrete gradient: H exactly",
                  .order = 1,
                  .quadratic_invariants = Claim::unknown,
                  .needs = {.linear_state = true},
                  .source = "Itoh, Abe 1988, J. Comput. Phys. 76:85"},
                 Rule::itoh_abe),
          method({.name = "itoh_abe2",
                  .title = "coordinate increments both ways: H exactly",
                  .order = 2,
                  .symmetric = Claim::holds,
                  .quadratic_invariants = Claim::unknown,
                  .needs = {.linear_state = true},
                  .source = "Itoh, Abe 1988, J. Comput. Phys. 76:85, symmetrised"},
                 Rule::itoh_abe2)};
}

}  // namespace porthos::integrators
