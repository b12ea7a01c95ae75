#include "integrators/collocation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "integrators/stage_field.h"
#include "integrators/step_solver.h"

namespace porthos::integrators {
namespace {

/// The step with s <= W stages; lanes beyond s repeat the last stage and carry no weight.
/// Stage data stand component by component in chunks of V lanes: Y[c][k] holds the k-th state number of stages
/// cV … cV + V - 1. A chunk fills a machine register, and one field evaluation serves all its stages.
template <class T, int W>
class Collocation final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::h_, Base::n_, Base::options_, Base::system_, Base::works_;
  using typename Base::State;
  using Real = TableReal<T>;

  static constexpr int V = std::is_same_v<T, double> ? (W < stage_lanes ? W : stage_lanes) : W;
  static constexpr int chunks = W / V;
  using Lanes = StageLanes<T, V>;
  using Stages = std::array<std::vector<Lanes>, chunks>;

 public:
  Collocation(Declaration d, CollocationTable<Real> t, const phs::Model& model, T h,
              const Options& o)
      : Base(std::move(d), model, h, o),
        table_(std::move(t)),
        s_(table_.s),
        momenta_(table_.mu_p.empty() ? n_ : n_ / 2),
        field_(model, *system_, o.lanes),
        solver_(Stagnation::of<T>(o.iteration_tolerance), o, n_),
        E_(works_.any() ? n_ : 0),
        smallest_(n_),
        noise_(n_, 0.0),
        size_(n_, 1.0) {
    for (int c = 0; c < chunks; ++c) {
      Y_[c].resize(n_), L_[c].resize(n_), F_[c].resize(n_), F_at_Y_[c].resize(n_);
      L_before_[c].assign(n_, Lanes(T(0.0)));
    }
    for (int i = 0; i < W; ++i)
      for (int j = 0; j < s_; ++j) {
        const size_t at = size_t(row(i) * s_ + j);
        set(mu_[j], i, T(table_.mu[at]));
        set(mu_p_[j], i, T(table_.mu_p.empty() ? table_.mu[at] : table_.mu_p[at]));
      }
    if (o.solver != Solver::fixed_point && table_.degree() <= 8 && table_.mu_p.empty())
      make_newton(model);
    adapt_to(h, h);
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state), field_.tell_turns(state.turns);
  }

  Outcome advance(T t, T h, State& state) override {
    t_ = t;
    adapt_to(h, have_before_ ? h_before_ : h);
    Equations equations{*this, state};
    const Outcome o = solver_.solve(equations, have_before_, cost_);
    if (o != Outcome::ok) {
      have_before_ = false;
      return o;
    }
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(state.x[k], state.lo[k], sum_of_stages(k));
    if (works_.any()) book();
    std::swap(L_, L_before_);
    have_before_ = true, h_before_ = h;
    return Outcome::ok;
  }

  bool interpolate(const State& after, T theta, std::span<T> x) const override {
    if (!have_before_) return false;
    Real B[W], here = Real(0);
    if constexpr (std::is_same_v<T, phs::Dual>)
      here = theta.v;
    else
      here = theta;
    table_.polynomial(here, std::span<Real>(B, size_t(s_)));
    for (size_t k = 0; k < n_; ++k) {
      T back(0.0);  // from the end of the step, where L carries weight 1
      for (int j = 0; j < s_; ++j) back += T(Real(1) - B[j]) * at(L_before_, k, j);
      x[k] = after.x[k] + (after.lo[k] - back);
    }
    return true;
  }

  void save(std::vector<double>& m) const override {
    m.insert(m.end(), {have_before_ ? 1.0 : 0.0, phs::to_double(h_before_)});
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < s_; ++i) m.push_back(phs::to_double(at(L_before_, k, i)));
    solver_.save(m);
  }
  void restore(std::span<const double> m) override {
    const size_t own = 2 + n_ * size_t(s_);
    require_size("memory of a collocation method", m.size(), own + solver_.memory_size());
    have_before_ = m[0] != 0, h_before_ = T(m[1]);
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < W; ++i)
        L_before_[i / V][k].set(i % V, T(m[2 + k * size_t(s_) + size_t(row(i))]));
    solver_.restore(m.subspan(own));
  }

  std::string remark() const override { return solver_.remark(cost_.steps); }
  bool keeps_books() const override { return true; }

 private:
  /// What the solver works on.
  struct Equations {
    Collocation& method;
    const State& state;
    void guess(bool predicted) { method.guess(state, predicted); }
    Sweep sweep(double& distance) { return method.sweep_once(state, distance); }
    void finish() { method.improve(); }
    void freeze(SimplifiedNewton& newton, Solver solver) { method.freeze(state, newton, solver); }
    double newton_step() const { return phs::to_double(method.h_of_weights_); }
    double noise() { return method.noise_of_newton(state); }
  };

  /// works = Σ h b_i power(Y_i), where f(Y_i) = L_i / (h b_i) once the step is solved.
  void book() {
    works_.restart();
    for (int c = 0; c < chunks; ++c) {
      const int used = std::min(V, s_ - c * V);
      if (used <= 0) break;
      for (size_t k = 0; k < n_; ++k) F_[c][k] = L_[c][k] / hb_[c];
      field_.powers(t_, ch_[c], Y_[c], F_[c], E_, used,
                    [&](size_t a, int i, T power) { works_.add(a, hb_[c][i] * power); });
    }
  }

  /// The stage a lane stands for.
  int row(int lane) const { return std::min(lane, s_ - 1); }
  static void set(std::array<Lanes, chunks>& a, int i, T x) { a[i / V].set(i % V, x); }
  static T at(const Stages& a, size_t k, int i) { return a[i / V][k][i % V]; }

  /// Weights for a step of size h, extrapolation from a step of size `before`.
  void adapt_to(T h, T before) {
    if (have_coefficients_ && h == h_of_weights_ && before == h_of_extrapolation_) return;
    Real hb[W], B[W];
    table_.weights(real(h), std::span<Real>(hb, size_t(s_)));
    const Real ratio = real(h) / real(before);
    for (int i = 0; i < W; ++i) {
      const Real c = table_.c[size_t(row(i))];
      set(hb_, i, T(hb[row(i)])), set(ch_, i, T(real(h) * c));
      table_.polynomial(1 + ratio * c, std::span<Real>(B, size_t(s_)));
      for (int j = 0; j < s_; ++j) set(nu_[j], i, T(B[j] - 1));
      // L = h b f: of the slope's polynomial
      table_.slope(1 + ratio * c, std::span<Real>(B, size_t(s_)));
      for (int j = 0; j < s_; ++j) set(slope_[j], i, T(ratio * table_.b[size_t(row(i))] * B[j]));
    }
    h_of_weights_ = h, h_of_extrapolation_ = before, have_coefficients_ = true;
  }
  static Real real(const T& x) {
    if constexpr (std::is_same_v<T, phs::Dual>)
      return x.v;
    else
      return x;
  }

  void make_newton(const phs::Model& model) {
    std::vector<double> A(size_t(s_ * s_));  // of L = h b f(x + μ L)
    for (int i = 0; i < s_; ++i)
      for (int j = 0; j < s_; ++j)
        A[size_t(i * s_ + j)] =
            phs::to_double(table_.b[size_t(i)]) * phs::to_double(table_.mu[size_t(i * s_ + j)]);
    solver_.set_newton(std::make_unique<SimplifiedNewton>(model, A, options_.solver));
    residual_.resize(n_ * size_t(s_)), point_.resize(n_);
  }

  // --- the iteration ----------------------------------------------------------------------------------------------
  void guess(const State& state, bool predicted) {
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k) {
        if (solver_.newton())
          L_[c][k] = predicted ? combination(c, k, slope_, L_before_) : Lanes(T(0.0));
        Y_[c][k] = predicted ? stage_values(state, c, k, nu_, L_before_)
                             : Lanes(state.x[k]) + Lanes(state.lo[k]);
      }
    std::fill(smallest_.begin(), smallest_.end(), HUGE_VAL);
  }
  /// J at the mean of the stages.
  void freeze(const State& state, SimplifiedNewton& newton, Solver solver) {
    for (size_t k = 0; k < n_; ++k) {
      double sum = 0;
      for (int i = 0; i < s_; ++i) sum += phs::to_double(at(Y_, k, i));
      point_[k] = sum / s_;
    }
    const double h = phs::to_double(h_of_weights_);
    newton.freeze(solver, phs::to_double(t_) + h / 2, h, point_, state.turns);
  }
  Lanes stage_values(const State& state, int c, size_t k,
                     const std::array<Lanes, chunks>* coefficients, const Stages& L) const {
    return Lanes(state.x[k]) + (Lanes(state.lo[k]) + combination(c, k, coefficients, L));
  }
  Lanes combination(int c, size_t k, const std::array<Lanes, chunks>* coefficients,
                    const Stages& L) const {
    Lanes sum(T(0.0));
    for (int j = 0; j < s_; ++j) sum += coefficients[j][c] * Lanes(at(L, k, j));
    return sum;
  }

  /// The next L from Y. Fixed point: L_i = (h b_i) f(Y_i). Newton adds to L the solution for that one's distance from it:
  /// in stiff directions f turns the rounding of Y into much, and the solve turns it back, so that L is good to the
  /// rounding of Y in every direction. (The update from the stages instead of f, Hairer, Wanner 1996, IV.8, does no more
  /// in stiff directions and loses in the others.)
  void improve() {
    cost_.evaluations += s_, ++cost_.sweeps;
    SimplifiedNewton* const newton = solver_.newton();
    for (int c = 0; c < chunks; ++c) {
      field_.field(t_, ch_[c], Y_[c], F_[c], std::min(V, s_ - c * V));
      if (!newton)
        for (size_t k = 0; k < n_; ++k) L_[c][k] = hb_[c] * F_[c][k];
    }
    if (newton) correct(*newton);
  }
  void correct(SimplifiedNewton& newton) {
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k) F_[c][k] = hb_[c] * F_[c][k] - L_[c][k];
    for (size_t k = 0; k < n_; ++k) {
      double r = 0;
      for (int i = 0; i < s_; ++i) r = std::max(r, magnitude(at(F_, k, i)));
      noise_[k] = solver_noise(r);
    }
    for (int part = 0; part < newton_parts<T>; ++part) {
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < s_; ++i)
          residual_[k * size_t(s_) + size_t(i)] = part_of(at(F_, k, i), part);
      newton.solve(residual_);
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < W; ++i) {
          T move(0.0);
          set_part(move, part, residual_[k * size_t(s_) + size_t(row(i))]);
          L_[i / V][k].set(i % V, at(L_, k, i) + move);
        }
    }
  }

  /// One sweep; distance: the largest distance of a stage value from the start of the step, relative to its size.
  Sweep sweep_once(const State& state, double& distance) {
    improve();
    Sweep p;
    const bool fixed_point = !solver_.newton();
    double largest = 0;
    distance = 0;
    for (size_t k = 0; k < n_; ++k) largest = std::max(largest, magnitude(state.x[k]));
    Magnitudes<V> total(0.0);  // of all moves: not finite if any is
    for (size_t k = 0; k < n_; ++k) {
      Magnitudes<V> moves(0.0), aways(0.0);
      for (int c = 0; c < chunks; ++c) {
        const Lanes Y = stage_values(state, c, k, k < momenta_ ? mu_ : mu_p_, L_);
        const auto move = magnitudes(Y - Y_[c][k]);
        moves = max(moves, move), total += move;
        aways = max(aways, magnitudes(Y - Lanes(state.x[k])));
        Y_[c][k] = Y;
      }
      const double move = largest_of(moves), away = largest_of(aways);
      if (move > 0) {
        p.changed = true;
        // Newton's solve spreads its noise over all components, where single records mean nothing.
        if (move < smallest_[k]) smallest_[k] = move, p.improved = fixed_point;
      }
      const double size = size_[k] =
          std::max({magnitude(state.x[k]), away, 1e-4 * largest, 1e-300});
      p.change = std::max(p.change, move / size);
      if (!fixed_point) p.blur(noise_[k] / size);
      distance = std::max(distance, away / size);
    }
    for (int i = 0; i < V; ++i) p.finite &= total[i] < HUGE_VAL;
    return p;
  }

  /// What Newton's move comes to by rounding alone: that of stage values off by a few units in their last places, this way
  /// and that. A spring as stiff as a shaft makes much of the rounding of two angles; no sweep gets below it.
  double noise_of_newton(const State& state) {
    const auto field = [&] {
      cost_.evaluations += s_;
      for (int c = 0; c < chunks; ++c)
        field_.field(t_, ch_[c], Y_[c], F_[c], std::min(V, s_ - c * V));
    };
    field(), std::swap(F_, F_at_Y_);
    unsigned turn = 1;
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < W; ++i) {
        turn = 1664525u * turn + 1013904223u;  // Numerical Recipes' congruential generator
        const double off = (turn >> 31 ? 4 : -4) * unit_roundoff<T>;
        Y_[i / V][k].set(i % V, at(Y_, k, i) * (T(1.0) + T(off)));
      }
    field();
    double noise = 0;
    for (int part = 0; part < newton_parts<T>; ++part) {
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < s_; ++i)
          residual_[k * size_t(s_) + size_t(i)] =
              part_of(T(hb_[i / V][i % V] * (at(F_, k, i) - at(F_at_Y_, k, i))), part);
      SimplifiedNewton& newton = *solver_.newton();
      newton.solve(residual_);
      for (size_t k = 0; k < n_; ++k)
        for (int i = 0; i < s_; ++i) {
          double move = 0;
          for (int j = 0; j < s_; ++j)
            move += phs::to_double(mu_[j][i / V][i % V]) * residual_[k * size_t(s_) + size_t(j)];
          noise = std::max(noise, std::fabs(move) / size_[k]);
        }
    }
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k) Y_[c][k] = stage_values(state, c, k, mu_, L_);
    return noise;
  }

  /// Σ L_i, outer pairs first as the weights are symmetric.
  T sum_of_stages(size_t k) const {
    T sum(0.0);
    for (int i = 0; i < s_ / 2; ++i) sum += at(L_, k, i) + at(L_, k, s_ - 1 - i);
    return s_ % 2 ? sum + at(L_, k, s_ / 2) : sum;
  }

  CollocationTable<Real> table_;
  int s_;
  size_t momenta_;  ///< where the components that use mu_p begin
  T t_ = T(0.0);
  StageField<T, V> field_;
  StepSolver solver_;
  std::array<Lanes, chunks> hb_, ch_, mu_[W], mu_p_[W], nu_[W], slope_[W];
  bool have_coefficients_ = false;
  T h_of_weights_, h_of_extrapolation_;
  Stages Y_, L_, F_, F_at_Y_;
  std::vector<Lanes> E_;  ///< for the books
  std::vector<double> smallest_, noise_,
      size_;  ///< noise_: of Newton's solve; size_: of a component
  Stages L_before_;
  bool have_before_ = false;
  T h_before_ = T(0.0);
  std::vector<double> residual_, point_;
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
