#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/stage_lanes.h"
#include "integrators/tables/legendre.h"
#include "integrators/tables/spark_table.h"
#include "phs/system/archive.h"
#include "phs/system/description.h"

namespace porthos::integrators {

/// What a SPARK step with s <= W stages (tables/spark_table.h) adds to a collocation step
/// (collocation_stages.h): the constraint nodes and their impulses, without the system. Data by
/// component in chunks of V lanes: lane j of Q, g, F belongs to the constraint node j + 1, lane j
/// of impulses to the node j. Lanes beyond s repeat the last one.
template <class T, int W>
class SparkNodes {
 public:
  static constexpr int V = std::is_same_v<T, double> ? (W < stage_lanes ? W : stage_lanes) : W;
  static constexpr int chunks = W / V;
  using Real = TableReal<T>;
  using Lanes = StageLanes<T, V>;
  using Stages = std::array<std::vector<Lanes>, size_t(chunks)>;
  using Weights = std::array<Lanes, size_t(chunks)>;

  /// m: rows
  SparkNodes(SparkTable<Real> t, const phs::Description& d, size_t m)
      : table_(std::move(t)), s_(table_.s()), m_(m) {
    for (const auto& b : d.blocks)
      for (size_t k = 0; m > 0 && b.momentum >= 0 && k < size_t(b.size); ++k) {
        positions_.push_back(size_t(b.at) + k);
        momenta_.push_back(size_t(b.momentum) + k);
      }
    const size_t n = m > 0 ? size_t(d.nx) : 0;
    for (auto* a : {&Q, &F, &first_})
      for (auto& chunk : *a) chunk.assign(n, Lanes(T(0.0)));
    for (auto* a : {&g, &drift, &impulse_, &before_, &modes_})
      for (auto& chunk : *a) chunk.assign(m, Lanes(T(0.0)));
    F_start.assign(n, T(0.0));
    last_.assign(m, T(0.0));
    last_before_ = last_;
    degree_.assign(m, s_ - 1);
    change_.assign(m * size_t(V), T(0.0));
    for (int lane = 0; lane < W; ++lane) {
      const int i = row(lane);
      for (int j = 0; j < s_; ++j) {
        set(nu_[size_t(j)], lane, table_.nu[size_t((i + 1) * s_ + j)]);
        set(rest_[size_t(j)], lane, table_.rest[size_t(j * s_ + i)]);
        set(response_[size_t(j)], lane, table_.response[size_t(i * s_ + j)]);
      }
      for (int l = 0; l <= s_; ++l)
        set(mode_of_[size_t(l)], lane, table_.mode[size_t(i * (s_ + 1) + l)]);
    }
  }

  static int used(int s, int chunk) { return std::clamp(s - chunk * V, 0, V); }

  /// Weights for a step of size h, and for extrapolation from the last step, of size `before`.
  void adapt_to(Real h, Real before) {
    if (have_weights_ && h == h_ && before == before_h_) return;
    const Real ratio = h / before;
    for (int lane = 0; lane < W; ++lane) {
      const size_t j = size_t(row(lane));
      set(node_time, lane, h * table_.node[j + 1]);
      const Legendre<Real> P(s_, 2 * (1 + ratio * table_.node[j]) - 1);
      for (int k = 0; k < s_; ++k) set(ahead_[size_t(k)], lane, ratio * table_.weight[j] * P[k]);
    }
    over_h_ = T(Real(1) / h);
    h_ = h;
    before_h_ = before;
    have_weights_ = true;
  }

  /// First impulses: extrapolated or zero.
  void guess(bool predicted) {
    predicted_ = predicted;
    for (size_t r = 0; r < m_; ++r)
      for (int c = 0; c < chunks; ++c) {
        Lanes sum(T(0.0));
        for (int k = 0; predicted && k <= degree_[r]; ++k) sum = sum + part(k, r, c);
        impulse_[size_t(c)][r] = sum;
      }
  }
  /// The positions at the nodes: Q_j = q + Σ_i ν_ji L_i. (Of other numbers, Q is not meant.)
  void place(std::span<const T> x, std::span<const T> lo, const Stages& L) {
    for (int c = 0; c < chunks; ++c)
      for (const size_t k : positions_)
        Q[size_t(c)][k] =
            Lanes(x[k]) + combination(Lanes(lo[k]), c, nu_, [&](int j) { return at(L, k, j); });
  }
  /// I += (B⁻¹ ⊗ D⁻¹) g / h in the rows in use. solve(r): r ← D⁻¹ r of V columns, r[row V + column]
  template <class Solve>
  void correct(const std::vector<size_t>& rows, const Solve& solve) {
    for (int c = 0; c < chunks && used(s_, c) > 0; ++c) {
      for (const size_t r : rows) {
        const Lanes sum =
            combination(Lanes(T(0.0)), c, response_, [&](int j) { return at(g, r, j); });
        for (int i = 0; i < V; ++i) change_[r * size_t(V) + size_t(i)] = over_h_ * sum[i];
      }
      solve(std::span<T>(change_));
      for (const size_t r : rows)
        for (int i = 0; i < V; ++i) {
          Lanes& I = impulse_[size_t(c)][r];
          I.set(i, I[i] + change_[r * size_t(V) + size_t(i)]);
        }
    }
  }
  /// Impulse of the node j < s (the last one is last()).
  T impulse(size_t j, size_t r) const { return at(impulse_, r, int(j)); }
  /// Writes those of the nodes of F's chunk c: of node s, whose impulse enters no stage, zero.
  void impulses_of(int c, size_t r, Lanes& to) const {
    for (int i = 0; i < V; ++i) {
      const int node = c * V + i + 1;
      to.set(i, node < s_ ? impulse(size_t(node), r) : T(0.0));
    }
  }
  /// From F_start and F: what the stages add up beside L, the low words and the impulses before
  /// them: lo - Σ_j (1 - ν_ji) B(Q_j) I_j.
  void push(std::span<const T> lo) {
    for (int c = 0; c < chunks; ++c) {
      for (size_t k = 0; k < lo.size(); ++k) first_[size_t(c)][k] = Lanes(lo[k]);
      for (const size_t k : momenta_) {
        Lanes sum(F_start[k]);
        for (int j = 1; j < s_; ++j)
          sum = fma(rest_[size_t(j)][size_t(c)], Lanes(at(F, k, j - 1)), sum);
        Lanes& first = first_[size_t(c)][k];
        first = first - sum;
      }
    }
  }
  /// For CollocationStages: the result of push().
  const Lanes& first(int c, size_t k) const { return first_[size_t(c)][k]; }
  /// Σ B(Q_j) I_j, j = 0 … s - 1.
  T pushed_by(size_t k) const {
    T all = F_start[k];
    for (int j = 0; j + 1 < s_; ++j) all += at(F, k, j);
    return all;
  }
  /// The numbers that impulses change.
  const std::vector<size_t>& momenta() const { return momenta_; }
  /// I_s
  std::span<T> last() { return last_; }

  /// The step is done: its impulses are those of the last step from now on.
  void keep() {
    for (size_t r = 0; predicted_ && r < m_; ++r) degree_[r] = best_degree(r);
    std::swap(impulse_, before_);
    std::swap(last_, last_before_);
    for (size_t r = 0; r < m_; ++r) find_modes(r);
  }
  /// The impulse of node j of the last step.
  T kept(size_t j, size_t r) const {
    return int(j) == s_ ? last_before_[r] : at(before_, r, int(j));
  }
  void carry(Archive& a) {
    for (size_t r = 0; r < m_; ++r)
      for (int j = 0; j < s_; ++j) {
        T value = at(before_, r, j);
        a(value);
        for (int lane = j; a.loads() && lane < (j == s_ - 1 ? W : j + 1); ++lane)
          before_[size_t(lane / V)][r].set(lane % V, value);
      }
    a(last_before_);
    for (int& degree : degree_) a(degree);
    for (size_t r = 0; a.loads() && r < m_; ++r) find_modes(r);
  }

  Weights node_time;       ///< h c̃_j
  Stages Q, F;             ///< nodes 1 … s: positions, and B I
  Stages g, drift;         ///< nodes 1 … s: rows, and ∂g/∂t of them
  std::vector<T> F_start;  ///< B(q) I_0

 private:
  int row(int lane) const { return std::min(lane, s_ - 1); }
  static T at(const Stages& a, size_t k, int i) { return a[size_t(i / V)][k][i % V]; }

  // The prediction of impulses: h b̃ λ(t). λ is the least-squares expansion of the last step's
  // multipliers in Legendre polynomials P_0 … P_{s - 1}, cut off at a degree of the row's own:
  // impulses are known to u κ/h only, and an extrapolation of full degree makes 10⁵ times as much
  // of that.

  /// What mode k of row r adds to the prediction.
  Lanes part(int k, size_t r, int c) const {
    return ahead_[size_t(k)][size_t(c)] * Lanes(at(modes_, r, k));
  }
  /// The degree that would have predicted this step's impulses of row r best.
  int best_degree(size_t r) const {
    std::array<Magnitudes<V>, size_t(W)> errors;
    for (int c = 0; c < chunks; ++c) {
      Lanes left = impulse_[size_t(c)][r];
      for (int k = 0; k < W; ++k) {
        if (k < s_) left = left - part(k, r, c);
        Magnitudes<V>& error = errors[size_t(k)];
        error = c == 0 ? magnitudes(left) : max(error, magnitudes(left));
      }
    }
    int best = 0;
    double least = HUGE_VAL;
    for (int first = 0; first < s_; first += V) {
      std::array<Magnitudes<V>, size_t(V)> some;
      std::copy_n(errors.begin() + first, V, some.begin());
      const auto largest = largest_of_each<V>(some);
      for (int i = 0; i < V && first + i < s_; ++i)
        if (largest[i] < least) {
          least = largest[i];
          best = first + i;
        }
    }
    return best;
  }
  void find_modes(size_t r) {
    for (int c = 0; c < chunks; ++c) {
      Lanes sum(T(0.0));
      for (int l = 0; l <= s_; ++l)
        sum = fma(mode_of_[size_t(l)][size_t(c)], Lanes(kept(size_t(l), r)), sum);
      modes_[size_t(c)][r] = sum;
    }
  }
  template <class R>
  static void set(Weights& a, int lane, const R& x) {
    a[size_t(lane / V)].set(lane % V, T(x));
  }
  /// first + Σ weights_j a(j)
  template <class A>
  Lanes combination(Lanes first, int c, const std::array<Weights, size_t(W)>& weights,
                    const A& a) const {
    for (int j = 0; j < s_; ++j) first = fma(weights[size_t(j)][size_t(c)], Lanes(a(j)), first);
    return first;
  }

  const SparkTable<Real> table_;
  const int s_;
  size_t m_;
  std::vector<size_t> positions_, momenta_;
  std::array<Weights, size_t(W)> nu_, rest_, response_;
  std::array<Weights, size_t(W)> ahead_;        ///< by mode: of the prediction
  std::array<Weights, size_t(W + 1)> mode_of_;  ///< by node: of an impulse, the modes in lanes
  std::vector<int> degree_;                     ///< by row: of the prediction
  bool predicted_ = false;                      ///< the step's first impulses were
  Stages impulse_, before_, modes_, first_;
  std::vector<T> last_, last_before_;  ///< I_s
  std::vector<T> change_;              ///< of impulses, m × V
  T over_h_ = T(0.0);
  Real h_ = 0, before_h_ = 0;
  bool have_weights_ = false;
};

}  // namespace porthos::integrators
