#include "integrators/methods/radau15.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "integrators/core/entry.h"
#include "integrators/core/stage_field.h"
#include "integrators/implicit/step_solver.h"
#include "integrators/methods/composition.h"
#include "integrators/methods/staged_steps.h"
#include "integrators/tables/radau_table.h"

namespace porthos::integrators {
namespace {

using phs::Quad;

/// Stage data are stored by component in chunks of V lanes, as in the Gauss methods. Stage 0 is the
/// start of the step. Its row of a is 0, so it can be a lane like the others.
template <class T>
class Radau15 final : public BasicIntegrator<T>, public StagedSteps<T>, public ComposedSteps<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::h_, Base::n_, Base::options_, Base::system_;
  using typename Base::State;
  using Real = TableReal<T>;

  static constexpr int s = RadauTable<Real>::s;
  static constexpr int V = std::is_same_v<T, double> ? stage_lanes : s;
  static constexpr int chunks = s / V;
  using Lanes = StageLanes<T, V>;
  using Stages = std::array<std::vector<Lanes>, chunks>;
  using Coefficients =
      std::array<std::array<Lanes, chunks>, s>;  ///< by stage summed over, then row

  /// Bound of the last coefficient of a step. It is an eighth-order quantity; the error is its
  /// square or less. Rein and Spiegel's 1e-9; for 113 bits the power 7/16 of round-off with the
  /// same margin.
  static constexpr double bound = std::is_same_v<T, Quad> ? 1e-17 : 1e-9;
  static constexpr double smallest_factor = 0.25, largest_factor = 4;
  static constexpr std::int64_t most_steps = 1'000'000;  ///< inside one advance()

 public:
  Radau15(const Declaration& d, const phs::Model& model, T h, const Options& o, bool adaptive)
      : Base(d, model, h, o),
        table_(radau_table<Real>()),
        adaptive_(adaptive),
        field_(model, *system_, o.lanes),
        iteration_(Stagnation::of<T>(o.iteration_tolerance)),
        half_(model.description().traits.canonical ? n_ / 2 : n_),
        x_(n_),
        lo_(n_),
        smallest_(n_) {
    for (int c = 0; c < chunks; ++c) {
      Y_[c].resize(n_);
      F_[c].resize(n_);
      before_[c].assign(n_, Lanes(T(0.0)));
    }
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    field_.tell_turns(state.turns);
  }

  Outcome advance(T t, T h, State& state) override {
    const Real whole = table_real(h);
    const double size = std::fabs(double(whole));
    Real done = 0;
    // The first stage is at the start; the last is before the end.
    if (jumps_at(options_.instants, phs::to_double(t))) t += hair(t, h);
    x_ = state.x;
    lo_ = state.lo;
    size_t count = 0;
    for (std::int64_t taken = 0; taken < most_steps; ++taken) {
      const double left = std::fabs(double(whole - done));
      const double asked = adaptive_ && next_ > 0 ? next_ : size;
      // The last two steps before the end of h have equal size, so that no tiny step remains.
      const double step = asked > 0.999 * left ? left : asked > 0.5 * left ? 0.5 * left : asked;
      const bool last = step == left;
      const Real dt = last ? whole - done : Real(std::copysign(step, double(whole)));

      const Outcome o = solve(t + T(done), dt);
      const double factor = o == Outcome::ok ? factor_after(double(dt)) : 0;
      if (o != Outcome::ok || (adaptive_ && factor < smallest_factor)) {
        if (o != Outcome::ok) have_before_ = false;
        if (!adaptive_ || step < 1e-12 * size) {
          next_ = 0;
          have_before_ = false;
          return o == Outcome::ok ? Outcome::failed : o;
        }
        next_ = step * std::max(factor, 0.1);
        continue;
      }
      if (this->watch_) this->watch_(count++, t + T(done), T(dt), state);
      for (size_t k = 0; k < n_; ++k) add_increment(k);
      std::swap(F_, before_);
      have_before_ = true;
      h_before_ = dt;
      const double grown = step * std::min(factor, largest_factor);
      next_ = step < asked ? std::max(asked, std::min(grown, largest_factor * asked)) : grown;
      if (last) {
        state.x = x_;
        state.lo = lo_;
        return Outcome::ok;
      }
      done = done + dt;
    }
    return Outcome::failed;
  }

  bool sees_inside() const override { return true; }

  /// Its steps inside a step are steps of their own.
  const Base& base() const override { return *this; }
  size_t count() const override { return 0; }
  CollocationTable<Real> table() const override { return radau_steps<Real>(); }
  void stages(const State&, std::span<T> Y) const override {
    for (int i = 0; i < s; ++i)
      for (size_t k = 0; k < n_; ++k) Y[size_t(i) * n_ + k] = at(Y_, k, i);
  }

  void carry(Archive& a) override {
    a(have_before_);
    a(next_);
    a(h_before_);
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < s; ++i) {
        T x = at(before_, k, i);
        a(x);
        before_[i / V][k].set(i % V, x);
      }
  }

 private:
  static T at(const Stages& a, size_t k, int i) { return a[i / V][k][i % V]; }

  void adapt_to(Real dt) {
    if (dt != h_of_weights_) {
      hb_ = table_.weights(dt);
      if constexpr (std::is_same_v<Real, double>)  // without it the energy drifts slowly
        for (size_t j = 0; j < s; ++j)
          hb_lo_[j] = std::fma(dt, table_.b[j], -hb_[j]) + dt * table_.b_lo[j];
      for (int i = 0; i < s; ++i) {
        ch_[i / V].set(i % V, T(dt * table_.c[size_t(i)]));
        for (int j = 0; j < s; ++j)
          ha_[j][i / V].set(i % V, T(dt * table_.a[size_t(i)][size_t(j)]));
      }
      h_of_weights_ = dt;
    }
    if (!have_before_) return;
    const Real ratio = dt / h_before_;
    for (int i = 0; i < s; ++i) {
      const auto beyond = table_.beyond(1 + ratio * table_.c[size_t(i)]);
      for (int j = 0; j < s; ++j) nu_[j][i / V].set(i % V, T(h_before_ * beyond[size_t(j)]));
    }
  }

  Outcome solve(T t, Real dt) {
    t_ = t;
    adapt_to(dt);
    const auto first = [&](bool predicted) { guess(predicted); };
    const auto sweep = [&](double& distance) { return sweep_once(distance); };
    const auto between = [] {};
    const auto noise = [] { return 0.0; };
    const auto finish = [&] { evaluate(); };
    return iterate(Iteration{first, sweep, between, noise, finish}, iteration_, have_before_,
                   options_.max_sweeps)
        .outcome;
  }

  void guess(bool predicted) {
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k)
        Y_[c][k] = predicted ? stage_values(c, k, nu_, before_) : Lanes(x_[k]) + Lanes(lo_[k]);
    std::fill(smallest_.begin(), smallest_.end(), HUGE_VAL);
  }
  Lanes stage_values(int c, size_t k, const Coefficients& a, const Stages& F) const {
    Lanes sum(T(0.0));
    for (int j = 0; j < s; ++j) sum += a[j][c] * Lanes(at(F, k, j));
    return Lanes(x_[k]) + (Lanes(lo_[k]) + sum);
  }

  void evaluate() {
    cost_.evaluations += s;
    ++cost_.sweeps;
    for (int c = 0; c < chunks; ++c) field_.field(t_, ch_[c], Y_[c], F_[c]);
  }

  /// One sweep; distance: the largest distance of a stage from the start of the step, relative to
  /// its size.
  Sweep sweep_once(double& distance) {
    evaluate();
    Sweep p;
    double largest = 0;
    distance = 0;
    for (size_t k = 0; k < n_; ++k) largest = std::max(largest, magnitude(x_[k]));
    for (size_t k = 0; k < n_; ++k) {
      double move = 0, away = 0;
      for (int c = 0; c < chunks; ++c) {
        const Lanes Y = stage_values(c, k, ha_, F_);
        for (int i = 0; i < V; ++i) {
          const double m = magnitude(Y[i] - Y_[c][k][i]), d = magnitude(Y[i] - x_[k]);
          if (m > move || m != m) move = m;  // NaN stays
          if (d > away || d != d) away = d;
        }
        Y_[c][k] = Y;
      }
      if (!(move < HUGE_VAL)) p.finite = false;
      if (move > 0) {
        p.changed = true;
        if (move < smallest_[k]) {
          smallest_[k] = move;
          p.improved = true;
        }
      }
      const double size = std::max({magnitude(x_[k]), away, 1e-4 * largest, 1e-300});
      p.change = std::max(p.change, move / size);
      distance = std::max(distance, away / size);
    }
    return p;
  }

  void add_increment(size_t k) {
    T sum(0.0), low(0.0);
    for (int j = s - 1; j >= 0; --j) {
      sum += T(hb_[size_t(j)]) * at(F_, k, j);
      low += T(hb_lo_[size_t(j)]) * at(F_, k, j);
    }
    lo_[k] += low;  // where it is not lost
    phs::compensated_add(x_[k], lo_[k], sum);
  }

  /// The factor by which the step size may change. The last coefficient of component k, times dt,
  /// is compared with the largest change that the component may have in the step. Changes far below
  /// the largest one in its half (q or p) and below a thousandth of the component itself count as
  /// noise.
  double factor_after(double dt) {
    double worst = 0;
    for (size_t from = 0; from < n_; from += half_) {
      double longest = 0;
      for (int pass = 0; pass < 2; ++pass)
        for (size_t k = from; k < std::min(n_, from + half_); ++k) {
          double way = 0;
          T last(0.0);
          for (int j = 0; j < s; ++j) {
            const T f = at(F_, k, j);
            way = std::max(way, std::fabs(phs::to_double(f)));
            last += T(table_.power[s - 1][size_t(j)]) * f;
          }
          if (pass == 0) {
            longest = std::max(longest, way);
            continue;
          }
          const double size =
              std::max({way, 1e-2 * longest, 1e-3 * std::fabs(phs::to_double(x_[k]) / dt), 1e-300});
          worst = std::max(worst, std::fabs(phs::to_double(last)) / size);
        }
    }
    return worst > 0 ? std::pow(bound / worst, 1.0 / 7) : largest_factor;
  }

  const RadauTable<Real>& table_;
  bool adaptive_;
  T t_ = T(0.0);
  StageField<T, V> field_;
  Iterating iteration_;
  size_t half_;
  std::vector<T> x_, lo_;
  std::vector<double> smallest_;
  std::array<Real, s> hb_, hb_lo_{};  ///< weights, and their rounding errors
  std::array<Lanes, chunks> ch_;
  Coefficients ha_, nu_;
  Real h_of_weights_ = 0;
  Stages Y_, F_, before_;  ///< before_: rates of the last step
  bool have_before_ = false;
  Real h_before_ = 0;
  double next_ = 0;  ///< size of its next internal step, 0: try the whole h
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_radau15(const Declaration& d, const phs::Model& m, T h,
                                                 const Options& o, bool adaptive) {
  return std::make_unique<Radau15<T>>(d, m, h, o, adaptive);
}
#define PORTHOS_INSTANTIATE(T)                                  \
  template std::unique_ptr<BasicIntegrator<T>> make_radau15<T>( \
      const Declaration&, const phs::Model&, T, const Options&, bool);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries radau15_entries() {
  return {entry({.name = "radau15",
                 .title = "Gauss-Radau of order 15, steps of its own inside h, to round-off",
                 .family = "Adaptive",
                 .order = 0,
                 .source = "Everhart 1985; Rein, Spiegel 2015, MNRAS 446, 1424"},
                PORTHOS_MAKER(make_radau15))};
}

}  // namespace porthos::integrators
