#include "integrators/methods/collocation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "integrators/core/stage_field.h"
#include "integrators/methods/collocation_stages.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {
namespace {

/// The step of one state, by fixed-point iteration or Newton.
template <class T, int W>
class Collocation final : public BasicIntegrator<T>, public StagedSteps<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::options_, Base::system_, Base::port_work_;
  using typename Base::State;
  using Step = CollocationStages<T, W>;
  using Real = typename Step::Real;
  using Lanes = typename Step::Lanes;
  static constexpr int V = Step::V, chunks = W / V;

 public:
  Collocation(Declaration d, CollocationTable<Real> t, const phs::Model& model, T h,
              const Options& o)
      : Base(std::move(d), model, h, o),
        step_(std::move(t), n_),
        field_(model, *system_, o.lanes),
        solver_(Stagnation::of<T>(o.iteration_tolerance), o, n_),
        E_(port_work_.any() ? n_ : 0),
        noise_(n_, 0.0) {
    for (int c = 0; c < chunks; ++c) {
      F_[c].resize(n_);
      F_at_Y_[c].resize(n_);
    }
    if (offer_newton(solver_, step_.table, model, o)) {
      residual_.resize(n_ * size_t(step_.s));
      point_.resize(n_);
    }
    step_.adapt_to(table_real(h), table_real(h));
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    field_.tell_turns(state.turns);
  }

  Outcome advance(T t, T h, State& state) override {
    t_ = t;
    step_.adapt_to(table_real(h), table_real(have_before_ ? h_before_ : h));
    Equations equations{*this, state};
    const Outcome o = solver_.solve(equations, have_before_, cost_);
    if (o != Outcome::ok) {
      have_before_ = false;
      return o;
    }
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(state.x[k], state.lo[k], step_.sum(k));
    if (port_work_.any()) book();
    std::swap(step_.L, step_.L_before);
    have_before_ = true;
    h_before_ = h;
    return Outcome::ok;
  }

  bool interpolate(const State& after, T theta, std::span<T> x) const override {
    if (!have_before_) return false;
    interpolate_step<W>(
        step_.table, after, theta, [&](size_t k, int j) { return Step::at(step_.L_before, k, j); },
        x.first(n_));
    return true;
  }

  CollocationTable<Real> table() const override { return step_.table; }
  void stages(const State&, std::span<T> Y) const override {
    for (int i = 0; i < step_.s; ++i)
      for (size_t k = 0; k < n_; ++k) Y[size_t(i) * n_ + k] = Step::at(step_.Y, k, i);
  }

  void carry(Archive& a) override {
    a(have_before_);
    a(h_before_);
    step_.carry(a, 0);
    solver_.carry(a);
  }

  std::string remark() const override { return solver_.remark(); }
  bool integrates_power() const override { return true; }

 private:
  /// The equations that the solver works on.
  struct Equations {
    Collocation& method;
    const State& state;
    void guess(bool predicted) {
      if (method.solver_.newton()) method.step_.guess_slopes(predicted);
      method.step_.guess(state.x, state.lo, 1, predicted ? 1 : 0);
    }
    Sweep sweep(double& distance) { return method.sweep_once(state, distance); }
    void finish() { method.improve(); }
    void freeze(SimplifiedNewton& newton, Solver solver) { method.freeze(state, newton, solver); }
    double newton_step() const { return phs::to_double(method.step_.h_of_weights); }
    double noise() { return method.noise_of_newton(state); }
  };

  /// works = Σ h b_i power(Y_i), where f(Y_i) = L_i / (h b_i) once the step is solved.
  void book() {
    port_work_.restart();
    for (int c = 0; c < chunks; ++c) {
      const int used = std::min(V, step_.s - c * V);
      if (used <= 0) break;
      for (size_t k = 0; k < n_; ++k) F_[c][k] = step_.L[c][k] / step_.hb[c];
      field_.powers(t_, step_.ch[c], step_.Y[c], F_[c], E_, used,
                    [&](size_t a, int i, T power) { port_work_.add(a, step_.hb[c][i] * power); });
    }
  }

  // --- the iteration ----------------------------------------------------------------------------
  /// J at the mean of the stages.
  void freeze(const State& state, SimplifiedNewton& newton, Solver solver) {
    for (size_t k = 0; k < n_; ++k) {
      double sum = 0;
      for (int i = 0; i < step_.s; ++i) sum += phs::to_double(Step::at(step_.Y, k, i));
      point_[k] = sum / step_.s;
    }
    const double h = phs::to_double(step_.h_of_weights);
    newton.freeze(solver, phs::to_double(t_) + h / 2, h, point_, state.turns);
  }

  void evaluate(int c, typename Step::Stages& f) {
    field_.field(t_, step_.ch[c], step_.Y[c], f[c], std::min(V, step_.s - c * V));
  }

  /// The next L from Y. Fixed point: L_i = (h b_i) f(Y_i). Newton adds to L the solve of the
  /// distance from that value. In stiff directions f amplifies the rounding of Y, and the solve
  /// reduces it again, so L is accurate to the rounding of Y in every direction. (The update from
  /// the stages instead of f, Hairer, Wanner 1996, IV.8, is no better in stiff directions and worse
  /// in the others.)
  void improve() {
    cost_.evaluations += step_.s;
    ++cost_.sweeps;
    SimplifiedNewton* const newton = solver_.newton();
    for (int c = 0; c < chunks; ++c) {
      evaluate(c, newton ? F_ : step_.L);
      if (newton) continue;
      for (Lanes& slope : step_.L[c]) slope = step_.hb[c] * slope;
    }
    if (newton) correct(*newton);
  }
  void correct(SimplifiedNewton& newton) {
    const size_t s = size_t(step_.s);
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k) F_[c][k] = step_.hb[c] * F_[c][k] - step_.L[c][k];
    for (size_t k = 0; k < n_; ++k) {
      double r = 0;
      for (int i = 0; i < step_.s; ++i) r = std::max(r, magnitude(Step::at(F_, k, i)));
      noise_[k] = solver_noise(r);
    }
    for (int part = 0; part < newton_parts<T>; ++part) {
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < step_.s; ++i)
          residual_[k * s + size_t(i)] = part_of(Step::at(F_, k, i), part);
      newton.solve(residual_);
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < W; ++i) {
          T move(0.0);
          set_part(move, part, residual_[k * s + size_t(step_.row(i))]);
          Step::set_stage(step_.L, k, i, Step::at(step_.L, k, i) + move);
        }
    }
  }

  /// One sweep; distance: the largest distance of a stage value from the start of the step,
  /// relative to its size.
  Sweep sweep_once(const State& state, double& distance) {
    improve();
    const bool newton = solver_.newton() != nullptr;
    const auto moves = step_.sweep(state.x, Step::low_words(state.lo), 1);
    distance = moves.distance;
    Sweep p = moves.in_lane(0);
    if (newton) {
      // Newton's solve spreads its noise over all components, so single records mean nothing.
      p.improved = false;
      p.own = HUGE_VAL;
      for (size_t k = 0; k < n_; ++k) p.blur(noise_[k] * step_.per_size(k));
    }
    return p;
  }

  /// The size of Newton's move that is due to rounding alone: computed from stage values perturbed
  /// by a few units in their last places. A spring as stiff as a shaft amplifies the rounding of
  /// two angles; no sweep gets below this size.
  double noise_of_newton(const State& state) {
    const int s = step_.s;
    const auto field = [&] {
      cost_.evaluations += s;
      for (int c = 0; c < chunks; ++c) evaluate(c, F_);
    };
    field();
    std::swap(F_, F_at_Y_);
    unsigned turn = 1;
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < W; ++i) {
        turn = 1664525u * turn + 1013904223u;  // Numerical Recipes' congruential generator
        const double off = (turn >> 31 ? 4 : -4) * unit_roundoff<T>;
        Step::set_stage(step_.Y, k, i, Step::at(step_.Y, k, i) * (T(1.0) + T(off)));
      }
    field();
    double noise = 0;
    for (int part = 0; part < newton_parts<T>; ++part) {
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < s; ++i)
          residual_[k * size_t(s) + size_t(i)] = part_of(
              T(step_.hb[i / V][i % V] * (Step::at(F_, k, i) - Step::at(F_at_Y_, k, i))), part);
      SimplifiedNewton& newton = *solver_.newton();
      newton.solve(residual_);
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < s; ++i) {
          double move = 0;
          for (int j = 0; j < s; ++j)
            move +=
                phs::to_double(step_.mu[j][i / V][i % V]) * residual_[k * size_t(s) + size_t(j)];
          noise = std::max(noise, std::fabs(move) * step_.per_size(k));
        }
    }
    step_.renew(state.x, Step::low_words(state.lo));
    return noise;
  }

  Step step_;
  T t_ = T(0.0);
  StageField<T, V> field_;
  StepSolver solver_;
  typename Step::Stages F_, F_at_Y_;
  std::vector<Lanes> E_;       ///< for the ledger
  std::vector<double> noise_;  ///< of Newton's solve
  std::vector<double> residual_, point_;
  bool have_before_ = false;
  T h_before_ = T(0.0);
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_collocation(const Declaration& d,
                                                     CollocationTable<TableReal<T>> table,
                                                     const phs::Model& model, T h,
                                                     const Options& o) {
  if (table.s <= 4) return std::make_unique<Collocation<T, 4>>(d, std::move(table), model, h, o);
  if (table.s <= 8) return std::make_unique<Collocation<T, 8>>(d, std::move(table), model, h, o);
  return std::make_unique<Collocation<T, 16>>(d, std::move(table), model, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                      \
  template std::unique_ptr<BasicIntegrator<T>> make_collocation<T>( \
      const Declaration&, CollocationTable<TableReal<T>>, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::integrators
