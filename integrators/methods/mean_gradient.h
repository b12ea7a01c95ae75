#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "integrators/core/stage_field.h"
#include "integrators/methods/collocation.h"

namespace porthos::integrators {

/// The gradient of H along the segment x + lo + a + τ d, τ in [0, 1]: its value in the middle, and
/// the excess of its mean over that value, ∫ (∇H - ∇H(middle)) dτ, in which nothing cancels as d →
/// 0.
///
/// Gauss with 7 points on 1, 3, 9 … most_panels equal panels (an odd number, so that the middle is
/// a node). The panels suffice where the parts P_5 and P_6 of g(τ) = ∇H · d on a panel are below
/// u^(5/14) and u^(6/14) of the terms of g. With geometric decay, P_14, the first part that the
/// rule integrates wrongly, is then below their rounding u.
template <class T>
class MeanGradient {
  static constexpr int nodes = 7, W = 8;
  using Real = TableReal<T>;
  using Lanes = StageLanes<T, W>;

 public:
  MeanGradient(const phs::Model& model, phs::System<T>& one, bool lanes, int most_panels = 81)
      : n_(size_t(model.description().nx)),
        most_panels_(most_panels),
        field_(model, one, lanes),
        x_(n_),
        lo_(n_),
        Y_(n_),
        E_(n_),
        middle_(n_),
        excess_(n_) {
    const auto table = gauss_table<Real>(nodes);
    for (size_t i = 0; i < nodes; ++i) {
      c_[i] = table.c[i];
      b_[i] = T(table.b[i]);
      p5_[i] = T(table.b[i] * table.legendre[i * nodes + 5]);
      p6_[i] = T(table.b[i] * table.legendre[i * nodes + 6]);
    }
  }
  void tell_turns(const std::vector<std::int64_t>& turns) { field_.tell_turns(turns); }
  void start_at(std::span<const T> x, std::span<const T> lo) {
    std::copy(x.begin(), x.end(), x_.begin()), std::copy(lo.begin(), lo.end(), lo_.begin());
  }

  /// scale: the size of the terms of changes of H in this step; parts below its rounding count as
  /// zero. panels: the initial number; on return the number needed, for the next sweep of the same
  /// step. Returns whether the panels resolve H.
  bool along(std::span<const T> a, std::span<const T> d, double scale, int& panels) {
    for (;; panels *= 3) {
      if (sum(a, d, scale, panels)) return true;
      if (panels >= most_panels_) return false;
    }
  }
  const T& middle(size_t k) const { return middle_[k]; }
  const T& excess(size_t k) const { return excess_[k]; }
  /// The points z of the mean over a segment and their weights: calls take(z, weight).
  template <class Take>
  void each_point(std::span<const T> a, std::span<const T> d, int panels, const Take& take) const {
    std::vector<T> z(n_);
    for (int i = 0; i < panels * nodes; ++i) {
      const size_t node = size_t(i % nodes);
      const T tau((Real(i / nodes) + c_[node]) / Real(panels));
      for (size_t k = 0; k < n_; ++k) z[k] = x_[k] + (lo_[k] + a[k] + tau * d[k]);
      take(std::span<const T>(z), b_[node] / T(double(panels)));
    }
  }
  /// Evaluations since the last call.
  int evaluations() { return std::exchange(evaluations_, 0); }

 private:
  bool sum(std::span<const T> a, std::span<const T> d, double scale, int panels) {
    bool resolved = true;
    std::fill(excess_.begin(), excess_.end(), T(0.0));
    for (int count = 0; count < panels; ++count) {
      const int panel = (count + panels / 2) % panels;  // the middle one first
      Lanes tau;
      for (int i = 0; i < W; ++i)
        tau.set(i, T((Real(panel) + c_[size_t(std::min(i, nodes - 1))]) / Real(panels)));
      for (size_t k = 0; k < n_; ++k)
        Y_[k] = Lanes(x_[k]) + (Lanes(lo_[k] + a[k]) + tau * Lanes(d[k]));
      field_.gradient(Y_, E_, nodes);
      evaluations_ += nodes;
      if (count == 0)
        for (size_t k = 0; k < n_; ++k) middle_[k] = E_[k][nodes / 2];
      resolved = add(d, scale, panels) && resolved;
    }
    return resolved;
  }

  /// Adds a panel's part of the excess. Returns whether the rule is exact on it.
  bool add(std::span<const T> d, double scale, int panels) {
    std::array<T, nodes> g;
    g.fill(T(0.0));
    double terms = 0;
    for (size_t k = 0; k < n_; ++k) {
      T mean(0.0);
      for (int i = 0; i < nodes; ++i) {
        const T e = E_[k][i], power = e * d[k];
        mean += b_[size_t(i)] * (e - middle_[k]);
        g[size_t(i)] += power;
        terms = std::max(terms, magnitude(power));
      }
      excess_[k] += mean / T(double(panels));
    }
    T fifth(0.0), sixth(0.0);
    for (size_t i = 0; i < nodes; ++i) {
      fifth += p5_[i] * g[i];
      sixth += p6_[i] * g[i];
    }
    const double unit = std::max(terms, scale), odd = magnitude(fifth), even = magnitude(sixth);
    // Not finite: more panels would not help, and the iteration detects it.
    if (!(odd + even < HUGE_VAL)) return true;
    return odd <= most_odd_ * unit && even <= most_even_ * unit;
  }

  size_t n_;
  int most_panels_;
  StageField<T, W> field_;
  std::array<Real, nodes> c_;
  std::array<T, nodes> b_, p5_, p6_;
  std::vector<T> x_, lo_;
  std::vector<Lanes> Y_, E_;
  std::vector<T> middle_, excess_;
  int evaluations_ = 0;
  const double most_odd_ = std::pow(unit_roundoff<T>, 5.0 / 14),
               most_even_ = std::pow(unit_roundoff<T>, 6.0 / 14);
};

}  // namespace porthos::integrators
