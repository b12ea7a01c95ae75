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
        smallest_((n + block - 1) / block, Sizes(HUGE_VAL)),
        per_size_(smallest_.size(), Sizes(1.0)),
        per_own_(per_size_) {
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
        if (predicted) first = choose(with, value(x[k], Lanes(lo[k]), c, k, nu_, L_before), first);
        Y[c][k] = choose(all, first, Y[c][k]);
      }
    measure_anew(x, lanes);
  }
  /// Sizes are measured in the next sweep of these lanes, for a new step.
  void measure_anew(std::span<const T> x, LaneSet lanes) {
    const auto all = mask_of<T>(lanes);
    for (Sizes& move : smallest_) move = choose(all, Sizes(HUGE_VAL), move);
    unsized_ |= lanes;
    Size<T> largest(0.0);
    for (size_t k = 0; k < n_; ++k) largest = phs::max(largest, size_of(x[k], k));
    least_ = phs::max(Size<T>(1e-4) * largest, Size<T>(1e-300));
  }
  /// Predicts L from the last step, for Newton.
  void guess_slopes(bool predicted) {
    for (int c = 0; c < chunks(); ++c)
      for (size_t k = 0; k < n_; ++k)
        L[c][k] = predicted ? combination(Lanes(T(0.0)), c, k, slope_, L_before) : Lanes(T(0.0));
  }

  /// Computes all of Y from L. first(c, k): what a chunk adds to component k beside x and L.
  template <class First>
  void renew(std::span<const T> x, const First& first) {
    for (int c = 0; c < chunks(); ++c)
      for (size_t k = 0; k < n_; ++k) Y[c][k] = value(x[k], first(c, k), c, k, mu_of(k), L);
  }
  /// That of a step without other forces: the low words.
  static auto low_words(std::span<const T> lo) {
    return [lo](int, size_t k) { return Lanes(lo[k]); };
  }
  /// Of a step with constraints: momenta do not count in its moves, and angles count as 1 rad at
  /// least. Of a mechanism at rest momenta are noise, which never gets small against itself; rows
  /// see angles through their sines.
  void count_positions(const phs::Description& d) {
    counts_.assign(n_, 1);
    at_least_.assign(n_, 0);
    for (const auto& b : d.blocks)
      for (size_t k = 0; k < size_t(b.size); ++k) {
        if (b.kind != phs::BlockKind::linear) at_least_[size_t(b.at) + k] = 1;
        if (b.momentum >= 0) counts_[size_t(b.momentum) + k] = 0;
      }
  }

  /// The moves of one sweep.
  struct Moves {
    Size<T> total = 0.0;     ///< not finite if any move is
    Size<T> change = 0.0;    ///< the largest, relative to its component's size
    Size<T> own = 0.0;       ///< the largest, relative to its component itself
    Size<T> distance = 0.0;  ///< largest of a stage from the start of the step, likewise
    Size<T> moved = 0.0;     ///< 1: something moved
    Size<T> records = 0.0;   ///< 1: some component made its smallest move in this step

    Sweep in_lane(int lane) const {
      using integrators::in_lane;
      return {.finite = in_lane(total, lane) < HUGE_VAL,
              .changed = in_lane(moved, lane) != 0,
              .improved = in_lane(records, lane) != 0,
              .change = in_lane(change, lane),
              .own = in_lane(own, lane)};
    }
  };
  /// Updates Y from L in some lanes, after guess(). The sizes of components, the scale of moves,
  /// are measured in the first sweep, and again as long as nothing moves, or not by little.
  /// Without a measurement the distance is 0. first: as of renew().
  template <class First>
  Moves sweep(std::span<const T> x, const First& first, LaneSet lanes) {
    const auto now = mask_of_some<T>(lanes);
    const LaneSet unsized = lanes & unsized_;
    unsized_ &= ~lanes;
    Tally tally;
    Sizes total(0.0), distance(0.0);
    for (size_t b = 0; b < smallest_.size(); ++b) {
      std::array<Sizes, block> moves;
      const auto update = [&](size_t i, const std::array<Weights, W>& weights) {
        const size_t k = b * block + i;
        moves[i] = Sizes(0.0);
        if (k >= n_) return;
        for (int c = 0; c < chunks(); ++c) {
          const Lanes to = value(x[k], first(c, k), c, k, weights, L);
          const Sizes by = magnitudes(to - Y[c][k]);
          moves[i] = c == 0 ? by : max(moves[i], by);
          total += by;
          Y[c][k] = choose(now, to, Y[c][k]);
        }
        if (!counts(k)) moves[i] = Sizes(0.0);
      };
      if (b * block < momenta_ && momenta_ < b * block + block) {
        for (size_t i = 0; i < block; ++i) update(i, mu_of(b * block + i));
      } else {
        const std::array<Weights, W> weights = mu_of(b * block);  // a copy stays in registers
        for (size_t i = 0; i < block; ++i) update(i, weights);
      }
      if (unsized) distance = phs::max(distance, measure(b, x, unsized));
      tally.add(over_stages(moves), per_size_[b], per_own_[b], smallest_[b]);
    }
    const Size<T> change = over_components(tally.change);
    const LaneSet moved = lanes_of(change > Size<T>(0.0)), far = lanes_of(change > Size<T>(1e-3));
    unsized_ |= lanes & (far | ~moved);
    return {sum_over_stages(total),       change,
            over_components(tally.own),   over_components(distance),
            over_components(tally.moved), over_components(tally.records)};
  }
  /// One over the size of component k of one state, the scale of its moves.
  double per_size(size_t k) const { return per_size_[k / block][int(k % block)]; }

  /// Σ L_i
  T sum(size_t k) const {
    return sum_of_stages<T>(s, [&](int i) { return at(L, k, i); });
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
  /// Components that are judged together: for one state, as many as a register has lanes.
  static constexpr size_t block = per_lane ? 1 : V;

  /// Collects moves: of one component of all states, or of a block of components of one.
  struct Tally {
    Sizes change{0.0}, own{0.0}, moved{0.0}, records{0.0};
    void add(const Sizes& move, const Sizes& per_size, const Sizes& per_own, Sizes& smallest) {
      const Sizes zero(0.0), one(1.0);
      const auto has_moved = move > zero;
      const auto record = has_moved & (move < smallest);
      moved = select(has_moved, one, moved);
      records = select(record, one, records);
      smallest = select(record, move, smallest);
      change = phs::max(change, move * per_size);
      own = phs::max(own, move * per_own);
    }
  };
  /// Sets the sizes of a block of components in some lanes: of the state and of the largest
  /// distance of a stage from it. @return that distance relative to the size
  Sizes measure(size_t b, std::span<const T> x, LaneSet lanes) {
    std::array<Sizes, block> aways{};
    Sizes here(0.0);
    for (size_t i = 0; i < block && b * block + i < n_; ++i) {
      const size_t k = b * block + i;
      for (int c = 0; counts(k) && c < chunks(); ++c)
        aways[i] = max(aways[i], magnitudes(Y[c][k] - Lanes(x[k])));
      put_size(here, int(i), size_of(x[k], k));
    }
    const Sizes away = over_stages(aways);
    const Sizes own = phs::max(phs::max(here, away), Sizes(1e-300)), one(1.0);
    const auto now = mask_of<T>(lanes);
    per_own_[b] = choose(now, one / own, per_own_[b]);
    per_size_[b] = choose(now, one / phs::max(own, Sizes(least_)), per_size_[b]);
    return away * per_size_[b];
  }

  template <class R>
  static void set(Weights& a, int i, const R& x) {
    if constexpr (per_lane)
      a[size_t(i)] = x;
    else
      a[size_t(i / V)].set(i % V, T(x));
  }
  template <class M, class X>
  static X choose(const M& lanes, const X& a, const X& b) {
    if constexpr (per_lane)
      return select(lanes, a, b);
    else
      return lanes ? a : b;
  }
  static Sizes over_stages(const std::array<Sizes, block>& x) {
    if constexpr (per_lane)
      return x[0];
    else
      return largest_of_each<V>(x);
  }
  static Size<T> over_components(const Sizes& x) {
    if constexpr (per_lane)
      return x;
    else
      return largest_of(x);
  }
  static void put_size(Sizes& sizes, int i, const Size<T>& x) {
    if constexpr (per_lane)
      sizes = x;
    else
      sizes.set(i, x);
  }
  bool counts(size_t k) const { return counts_.empty() || counts_[k]; }
  /// The size of a value of component k.
  Size<T> size_of(const T& x, size_t k) const {
    const Size<T> own = magnitude(x);
    return at_least_.empty() ? own : phs::max(own, Size<T>(at_least_[k]));
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
  Lanes value(const T& x, const Lanes& first, int c, size_t k,
              const std::array<Weights, W>& weights, const Stages& a) const {
    return Lanes(x) + combination(first, c, k, weights, a);
  }
  /// first + Σ weights_j a_j
  Lanes combination(Lanes first, int c, size_t k, const std::array<Weights, W>& weights,
                    const Stages& a) const {
    const auto add = [&](int j) {
      first = fma(Lanes(weights[size_t(j)][size_t(c)]), Lanes(at(a, k, j)), first);
    };
    if (s == W)  // the usual number of stages, unrolled
      for (int j = 0; j < W; ++j) add(j);
    else
      for (int j = 0; j < s; ++j) add(j);
    return first;
  }

  size_t n_, momenta_;  ///< numbers in a state; offset of those that use mu_p
  std::array<Weights, W> mu_p_, nu_, slope_;
  bool have_weights_ = false;
  Real h_of_extrapolation_ = 0;
  /// By blocks of components: moves in this step, 1 / size, 1 / size without a least one.
  std::vector<Sizes> smallest_, per_size_, per_own_;
  std::vector<char> counts_;      ///< by component, whether its moves count; empty: all do
  std::vector<double> at_least_;  ///< and the least that it counts for; empty: nothing
  LaneSet unsized_ = 0;           ///< lanes whose next sweep measures sizes
  Size<T> least_ = 0.0;           ///< size that a component counts for at least
};

}  // namespace porthos::integrators
