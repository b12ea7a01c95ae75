#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "integrators/core/lane_set.h"
#include "integrators/core/stage_lanes.h"
#include "integrators/implicit/step_solver.h"
#include "integrators/methods/collocation.h"

namespace porthos::integrators {

/// The arithmetic of a collocation step with s <= W stages, without the field and Newton: for one
/// state, or for one state per lane if T is a Pack.
///
/// For one state, stage data are stored by component in chunks of V lanes: Y[c][k] holds the k-th
/// state number of stages cV … cV + V - 1. Lanes beyond s repeat the last stage with weight zero. A
/// chunk fills a machine register, and one field evaluation serves all its stages. With one state
/// per lane, the lanes are used up: a chunk is one stage of all states.
template <class T, int W>
class CollocationStages {
 public:
  static constexpr bool per_lane = phs::is_pack<T>;
  static constexpr int V = per_lane                    ? 1
                           : std::is_same_v<T, double> ? (W < stage_lanes ? W : stage_lanes)
                                                       : W;
  using Real = TableReal<T>;
  using Lanes = typename std::conditional_t<per_lane, std::type_identity<T>,
                                            std::type_identity<StageLanes<T, V>>>::type;
  using Stages = std::array<std::vector<Lanes>, W / V>;
  /// A coefficient of the table for each stage of a chunk.
  using Weight = std::conditional_t<per_lane, double, Lanes>;
  using Weights = std::array<Weight, W / V>;

  CollocationStages(CollocationTable<Real> t, size_t n)
      : table(std::move(t)),
        s(table.s),
        n_(n),
        momenta_(table.mu_p.empty() ? n : n / 2),
        smallest_(n, Size<T>(HUGE_VAL)) {
    for (int c = 0; c < chunks(); ++c) {
      Y[c].assign(n, Lanes(T(0.0)));
      L[c] = L_before[c] = Y[c];
    }
    for (int i = 0; i < rows(); ++i)
      for (int j = 0; j < s; ++j) {
        const size_t at = size_t(row(i) * s + j);
        set(mu[j], i, table.mu[at]);
        set(mu_p_[j], i, table.mu_p.empty() ? table.mu[at] : table.mu_p[at]);
      }
  }

  int chunks() const { return per_lane ? s : W / V; }
  /// For one state: the lanes of all chunks, including spare ones.
  int rows() const { return per_lane ? s : W; }
  /// The stage that belongs to a row.
  int row(int i) const { return std::min(i, s - 1); }
  static T at(const Stages& a, size_t k, int i) {
    if constexpr (per_lane)
      return a[size_t(i)][k];
    else
      return a[size_t(i / V)][k][i % V];
  }

  /// Sets the weights for a step of size h, with extrapolation from a step of size `before`.
  void adapt_to(Real h, Real before) {
    if (have_weights_ && h == h_of_weights && before == h_of_extrapolation_) return;
    Real B[W], weights[W];
    const auto stages = [&](Real* a) { return std::span<Real>(a, size_t(s)); };
    table.weights(h, stages(weights));
    const Real ratio = h / before;
    for (int i = 0; i < rows(); ++i) {
      const Real c = table.c[size_t(row(i))];
      set(hb, i, weights[row(i)]);
      set(ch, i, h * c);
      table.polynomial(1 + ratio * c, stages(B));
      for (int j = 0; j < s; ++j) set(nu_[j], i, B[j] - 1);
      // L = h b f: of the polynomial's slope
      table.slope(1 + ratio * c, stages(B));
      for (int j = 0; j < s; ++j) set(slope_[j], i, ratio * table.b[size_t(row(i))] * B[j]);
    }
    h_of_weights = h;
    h_of_extrapolation_ = before;
    have_weights_ = true;
  }

  /// Sets first values of Y in some lanes: extrapolated in `predicted` ones, else the state x + lo.
  void guess(std::span<const T> x, std::span<const T> lo, LaneSet lanes, LaneSet predicted) {
    const auto all = mask_of<T>(lanes), with = mask_of<T>(predicted);
    for (int c = 0; c < chunks(); ++c)
      for (size_t k = 0; k < n_; ++k) {
        Lanes first = Lanes(x[k]) + Lanes(lo[k]);
        if (predicted) first = choose(with, value(x[k], lo[k], c, k, nu_, L_before), first);
        Y[c][k] = choose(all, first, Y[c][k]);
      }
    for (Size<T>& move : smallest_) move = select(all, Size<T>(HUGE_VAL), move);
  }
  /// Predicts L from the last step, for Newton.
  void guess_slopes(bool predicted) {
    for (int c = 0; c < chunks(); ++c)
      for (size_t k = 0; k < n_; ++k)
        L[c][k] = predicted ? combination(c, k, slope_, L_before) : Lanes(T(0.0));
  }

  /// Computes all of Y from L.
  void renew(std::span<const T> x, std::span<const T> lo) {
    for (int c = 0; c < chunks(); ++c)
      for (size_t k = 0; k < n_; ++k) Y[c][k] = value(x[k], lo[k], c, k, mu_of(k), L);
  }

  /// The moves of one sweep.
  struct Moves {
    Size<T> total = 0.0;     ///< not finite if any move is
    Size<T> change = 0.0;    ///< the largest, relative to its component's size
    Size<T> distance = 0.0;  ///< largest distance of a stage from the start of the step, likewise
    Size<T> moved = 0.0;     ///< 1: something moved
    Size<T> records = 0.0;   ///< 1: some component made its smallest move in this step

    Sweep in_lane(int lane) const {
      using integrators::in_lane;
      return {.finite = in_lane(total, lane) < HUGE_VAL,
              .changed = in_lane(moved, lane) != 0,
              .improved = in_lane(records, lane) != 0,
              .change = in_lane(change, lane)};
    }
  };
  /// Updates Y from L in some lanes. take_size(k, size) receives the size of component k, the scale
  /// of its moves.
  template <class TakeSize>
  Moves sweep(std::span<const T> x, std::span<const T> lo, LaneSet lanes,
              const TakeSize& take_size) {
    const auto now = mask_of_some<T>(lanes);
    const Size<T> zero(0.0), one(1.0);
    Moves m;
    Size<T> largest(0.0);
    for (size_t k = 0; k < n_; ++k) largest = phs::max(largest, magnitude(x[k]));
    const Size<T> least = phs::max(Size<T>(1e-4) * largest, Size<T>(1e-300));
    Sizes total(0.0);
    for (size_t k = 0; k < n_; ++k) {
      Sizes moves(0.0), aways(0.0);
      for (int c = 0; c < chunks(); ++c) {
        const Lanes to = value(x[k], lo[k], c, k, mu_of(k), L);
        const Sizes by = magnitudes(to - Y[c][k]);
        moves = max(moves, by);
        total += by;
        aways = max(aways, magnitudes(to - Lanes(x[k])));
        Y[c][k] = choose(now, to, Y[c][k]);
      }
      const Size<T> move = over_stages(moves), away = over_stages(aways);
      const auto moved = move > zero;
      const auto record = moved & (move < smallest_[k]);
      m.moved = select(moved, one, m.moved);
      m.records = select(record, one, m.records);
      smallest_[k] = select(record, move, smallest_[k]);
      const Size<T> size = phs::max(phs::max(magnitude(x[k]), away), least);
      m.change = phs::max(m.change, move / size);
      m.distance = phs::max(m.distance, away / size);
      take_size(k, size);
    }
    m.total = sum_over_stages(total);
    return m;
  }

  /// Σ L_i, outer pairs first because the weights are symmetric.
  T sum(size_t k) const {
    T all(0.0);
    for (int i = 0; i < s / 2; ++i) all += at(L, k, i) + at(L, k, s - 1 - i);
    return s % 2 ? all + at(L, k, s / 2) : all;
  }

  /// L of a lane's last step, for memory().
  void carry(Archive& a, int lane) {
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < s; ++i) {
        if constexpr (per_lane) {
          carry_lane(a, L_before[size_t(i)][k], lane);
        } else {
          T x = at(L_before, k, i);
          a(x);
          if (!a.loads()) continue;
          set_stage(L_before, k, i, x);
          for (int spare = s; i == s - 1 && spare < W; ++spare) set_stage(L_before, k, spare, x);
        }
      }
  }
  static void set_stage(Stages& a, size_t k, int i, const T& x) {
    a[size_t(i / V)][k].set(i % V, x);
  }

  const CollocationTable<Real> table;
  const int s;
  Real h_of_weights = 0;
  Weights hb, ch;  ///< h b_i and h c_i
  Stages Y, L, L_before;
  std::array<Weights, W> mu;

 private:
  using Sizes = typename std::conditional_t<per_lane, std::type_identity<T>,
                                            std::type_identity<Magnitudes<V>>>::type;

  template <class R>
  static void set(Weights& a, int i, const R& x) {
    if constexpr (per_lane)
      a[size_t(i)] = x;
    else
      a[size_t(i / V)].set(i % V, T(x));
  }
  template <class M>
  static Lanes choose(const M& lanes, const Lanes& a, const Lanes& b) {
    if constexpr (per_lane)
      return select(lanes, a, b);
    else
      return lanes ? a : b;
  }
  static Size<T> over_stages(const Sizes& x) {
    if constexpr (per_lane)
      return x;
    else
      return largest_of(x);
  }
  static Size<T> sum_over_stages(const Sizes& x) {
    if constexpr (per_lane)
      return x;
    else {
      double sum = 0;
      for (int i = 0; i < V; ++i) sum += x[i];
      return sum;
    }
  }
  const std::array<Weights, W>& mu_of(size_t k) const { return k < momenta_ ? mu : mu_p_; }
  Lanes value(const T& x, const T& lo, int c, size_t k, const std::array<Weights, W>& weights,
              const Stages& a) const {
    return Lanes(x) + (Lanes(lo) + combination(c, k, weights, a));
  }
  Lanes combination(int c, size_t k, const std::array<Weights, W>& weights, const Stages& a) const {
    Lanes sum(T(0.0));
    for (int j = 0; j < s; ++j) sum += Lanes(weights[j][c]) * Lanes(at(a, k, j));
    return sum;
  }

  size_t n_, momenta_;  ///< numbers in a state; offset of those that use mu_p
  std::array<Weights, W> mu_p_, nu_, slope_;
  bool have_weights_ = false;
  Real h_of_extrapolation_ = 0;
  std::vector<Size<T>> smallest_;
};

/// Sets up Newton's iteration for the table, if it has one. @return whether it has
template <class Real>
bool offer_newton(StepSolver& solver, const CollocationTable<Real>& t, const phs::Model& model,
                  const Options& o) {
  if (o.solver == Solver::fixed_point || t.degree() > 8 || !t.mu_p.empty()) return false;
  const size_t s = size_t(t.s);
  std::vector<double> A(s * s);  // of L = h b f(x + μ L)
  for (size_t i = 0; i < s; ++i)
    for (size_t j = 0; j < s; ++j)
      A[i * s + j] = phs::to_double(t.b[i]) * phs::to_double(t.mu[i * s + j]);
  solver.set_newton(std::make_unique<SimplifiedNewton>(model, A, o.solver));
  return true;
}

}  // namespace porthos::integrators
