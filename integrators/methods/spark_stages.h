#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "integrators/core/stage_lanes.h"
#include "integrators/methods/collocation.h"
#include "integrators/methods/step_rows.h"
#include "integrators/tables/spark_table.h"
#include "phs/system/archive.h"
#include "phs/system/description.h"

namespace porthos::integrators {

/// The arithmetic of a SPARK step with s <= W stages (tables/spark_table.h), without the system:
/// data by component in chunks of V lanes, as CollocationStages. Lane i of stages belongs to stage
/// i + 1; lane j of nodes to the constraint node j + 1. Lanes beyond s repeat the last one.
template <class T, int W>
struct SparkStages {
  static constexpr int V = std::is_same_v<T, double> ? (W < stage_lanes ? W : stage_lanes) : W;
  static constexpr int chunks = W / V;
  using Real = TableReal<T>;
  using Lanes = StageLanes<T, V>;
  using Stages = std::array<std::vector<Lanes>, size_t(chunks)>;
  using Weights = std::array<Lanes, size_t(chunks)>;

  /// m: rows
  SparkStages(SparkTable<Real> t, const phs::Description& d, size_t m)
      : table(std::move(t)), s(table.s()), n_(size_t(d.nx)), sizes_(d) {
    const size_t n = n_;
    for (const auto& b : d.blocks)
      for (size_t k = 0; m > 0 && b.momentum >= 0 && k < size_t(b.size); ++k)
        pushed_.push_back(size_t(b.momentum) + k);
    std::sort(pushed_.begin(), pushed_.end());
    for (auto* a : {&Y, &L, &L_before, &Q, &F})
      for (auto& chunk : *a) chunk.assign(n, Lanes(T(0.0)));
    for (auto* a : {&g, &drift})
      for (auto& chunk : *a) chunk.assign(m, Lanes(T(0.0)));
    impulse.assign(size_t(s + 1) * m, T(0.0));
    before_ = impulse;
    F_start.assign(n, T(0.0));
    for (int lane = 0; lane < W; ++lane) {
      const int i = row(lane);
      for (int j = 0; j < s; ++j) {
        set(mu_[size_t(j)], lane, table.gauss.mu[size_t(i * s + j)]);
        set(nu_[size_t(j)], lane, table.nu[size_t((i + 1) * s + j)]);
        set(rest_[size_t(j)], lane, table.rest[size_t(j * s + i)]);
        set(response_[size_t(j)], lane, table.response[size_t(i * s + j)]);
      }
    }
  }

  int row(int lane) const { return std::min(lane, s - 1); }
  static T at(const Stages& a, size_t k, int i) { return a[size_t(i / V)][k][i % V]; }
  static int used(int s, int chunk) { return std::clamp(s - chunk * V, 0, V); }

  /// Weights for a step of size h, and for extrapolation from the last step, of size `before`.
  void adapt_to(Real h, Real before) {
    if (have_weights_ && h == h_ && before == before_h_) return;
    Real weights[W], B[W + 1];
    const auto stages = [&](Real* a) { return std::span<Real>(a, size_t(s)); };
    table.gauss.weights(h, stages(weights));
    const Real ratio = h / before;
    for (int lane = 0; lane < W; ++lane) {
      const Real c = table.gauss.c[size_t(row(lane))];
      set(hb, lane, weights[row(lane)]);
      set(ch, lane, h * c);
      set(node_time, lane, h * table.node[size_t(row(lane) + 1)]);
      table.gauss.slope(1 + ratio * c, stages(B));
      for (int j = 0; j < s; ++j)
        set(slope_[size_t(j)], lane, ratio * table.gauss.b[size_t(row(lane))] * B[j]);
    }
    const size_t nodes = size_t(s + 1);
    ahead_.resize(nodes * nodes);
    for (size_t j = 0; j < nodes; ++j) {  // I = h b̃ λ, with λ's polynomial
      table.basis(1 + ratio * table.node[j], std::span<Real>(B, nodes));
      for (size_t l = 0; l < nodes; ++l)
        ahead_[j * nodes + l] = T(ratio * table.weight[j] * B[l] / table.weight[l]);
    }
    h_ = h;
    before_h_ = before;
    have_weights_ = true;
  }

  /// First values: extrapolated, or those of a step without motion. impulses: likewise
  void guess(bool predicted, bool impulses) {
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k) {
        Lanes sum(T(0.0));
        if (predicted)
          for (int j = 0; j < s; ++j)
            sum += slope_[size_t(j)][size_t(c)] * Lanes(at(L_before, k, j));
        L[size_t(c)][k] = sum;
      }
    const size_t nodes = size_t(s + 1), m = impulse.size() / nodes;
    for (size_t j = 0; j < nodes; ++j)
      for (size_t r = 0; r < m; ++r) {
        T sum(0.0);
        if (impulses && j + 1 < nodes)
          for (size_t l = 0; l < nodes; ++l) sum = sum + ahead_[j * nodes + l] * before_[l * m + r];
        impulse[j * m + r] = sum;
      }
  }

  /// The positions at the nodes (of momenta, Q is not meant).
  void place_nodes(std::span<const T> x, std::span<const T> lo) {
    for (int c = 0; c < chunks; ++c)
      for (size_t k = 0; k < n_; ++k)
        Q[size_t(c)][k] = Lanes(x[k]) + (Lanes(lo[k]) + combination(c, k, nu_));
  }
  /// change[k m + r] = factor Σ_j (B⁻¹)_kj g_j of row r: what the impulse of node k answers, but
  /// for D⁻¹. Writes that row of change, s × m.
  void respond(size_t r, const T& factor, std::vector<T>& change) const {
    const size_t m = g[0].size();
    for (int c = 0; c < chunks; ++c) {
      Lanes sum(T(0.0));
      for (int j = 0; j < s; ++j) sum += response_[size_t(j)][size_t(c)] * Lanes(at(g, r, j));
      for (int i = 0; i < used(s, c); ++i) change[size_t(c * V + i) * m + r] = sum[i] * factor;
    }
  }
  /// Y from L and the forces F.
  void place_stages(std::span<const T> x, std::span<const T> lo) {
    size_t next = 0;  // in pushed_
    for (size_t k = 0; k < n_; ++k) {
      const bool is_pushed = next < pushed_.size() && pushed_[next] == k;
      Magnitudes<V> away(0.0);
      for (int c = 0; c < chunks; ++c) {
        Lanes sum = combination(c, k, mu_);
        if (is_pushed) sum = sum - push(c, k);
        Lanes& to = Y[size_t(c)][k];
        to = Lanes(x[k]) + (Lanes(lo[k]) + sum);
        away = max(away, magnitudes(to - Lanes(x[k])));
      }
      if (is_pushed) ++next;
      sizes_.measure(k, x[k], largest_of(away));
    }
    sizes_.settle();
  }
  /// Takes over L = h b f of a chunk. @return whether it is finite
  bool take_slopes(int c, std::span<const Lanes> f, SweepMoves& moves) {
    double total = 0;
    for (size_t k = 0; k < n_; ++k) {
      Lanes& own = L[size_t(c)][k];
      const Lanes to = hb[size_t(c)] * f[k];
      sizes_.count(k, largest_of(magnitudes(to - own)), moves);
      for (int i = 0; i < V; ++i) total += magnitude(to[i]);
      own = to;
    }
    return std::isfinite(total);
  }
  /// Σ L_i
  T sum(size_t k) const {
    return sum_of_stages<T>(s, [&](int i) { return at(L, k, i); });
  }
  /// Σ B(Q_j) I_j, j = 0 … s - 1.
  T pushed_by(size_t k) const {
    T all = F_start[k];
    for (int j = 0; j + 1 < s; ++j) all += at(F, k, j);
    return all;
  }
  const std::vector<size_t>& pushed() const { return pushed_; }

  void keep() {
    std::swap(L, L_before);
    std::swap(impulse, before_);
  }
  /// The impulses of the last step, (s + 1) × m.
  std::span<const T> kept() const { return before_; }

  void carry(Archive& a) {
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < s; ++i) {
        T value = at(L_before, k, i);
        a(value);
        if (a.loads())
          for (int lane = i; lane < (i == s - 1 ? W : i + 1); ++lane)
            L_before[size_t(lane / V)][k].set(lane % V, value);
      }
    a(before_);
  }

  const SparkTable<Real> table;
  const int s;
  Weights hb, ch;          ///< h b_i and h c_i
  Weights node_time;       ///< h c̃_j
  Stages Y, L, L_before;   ///< stages
  Stages Q, F;             ///< nodes 1 … s: positions, and B I
  Stages g, drift;         ///< nodes: rows, and ∂g/∂t of them
  std::vector<T> impulse;  ///< I_j, (s + 1) × m
  std::vector<T> F_start;  ///< B(q) I_0

 private:
  template <class R>
  static void set(Weights& a, int lane, const R& x) {
    a[size_t(lane / V)].set(lane % V, T(x));
  }
  Lanes combination(int c, size_t k, const std::array<Weights, size_t(W)>& weights) const {
    Lanes sum(T(0.0));
    for (int j = 0; j < s; ++j) sum += weights[size_t(j)][size_t(c)] * Lanes(at(L, k, j));
    return sum;
  }
  /// Σ (1 - ν_ji) B(Q_j) I_j of the stages i of a chunk.
  Lanes push(int c, size_t k) const {
    Lanes sum(F_start[k]);
    for (int j = 1; j < s; ++j) sum += rest_[size_t(j)][size_t(c)] * Lanes(at(F, k, j - 1));
    return sum;
  }

  size_t n_;
  std::vector<size_t> pushed_;  ///< numbers that constraint forces change, ascending
  StateSizes<T> sizes_;
  std::array<Weights, size_t(W)> mu_, nu_, rest_, slope_, response_;
  std::vector<T> ahead_, before_;
  Real h_ = 0, before_h_ = 0;
  bool have_weights_ = false;
};

}  // namespace porthos::integrators
