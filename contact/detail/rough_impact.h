#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "contact/detail/coulomb.h"
#include "contact/friction_impact.h"
#include "contact/impact.h"

namespace porthos::contact {

/// Impacts at one instant of which some have friction: one after another, always at the contact
/// that approaches fastest, until none does. Each is Stronge's impact at its point alone, or
/// Newton's where there is no friction. No impact makes energy, so their sequence makes none.
///
/// A row of balls that touch passes the motion on, as with reflections. After 500 impacts the rest
/// are plastic; 1000 are the most.
class RoughImpact {
 public:
  using Quad = phs::Quad;

  explicit RoughImpact(size_t most) : impulse_(most), normal_loss_(most), friction_loss_(most) {}

  /// @param W  m × m row-major, symmetric; v: rates before, then after; e: restitution of each
  ///   normal, which are the first rows; rubs: at most one of each normal
  /// @return whether every point with friction can move across its normal as well as along it
  bool solve(std::span<const Quad> W, std::span<Quad> v, std::span<const double> e,
             std::span<const Rubbing> rubs) {
    m_ = v.size();
    std::fill_n(impulse_.begin(), m_, Quad(0.0));
    std::fill_n(normal_loss_.begin(), m_, 0.0);
    std::fill_n(friction_loss_.begin(), m_, 0.0);
    Quad fastest(0.0);
    for (size_t i = 0; i < e.size(); ++i) fastest = std::max(fastest, Quad(-v[i]));
    for (int k = 0; k < 1000; ++k) {
      const size_t i = size_t(std::min_element(v.begin(), v.begin() + long(e.size())) - v.begin());
      if (!(-v[i] > Quad(1e-13) * fastest)) return true;
      const auto rub =
          std::find_if(rubs.begin(), rubs.end(), [i](const Rubbing& r) { return r.normal == i; });
      const double restitution = k < 500 ? e[i] : 0;
      if (rub == rubs.end())
        strike(W, v, i, restitution);
      else if (!strike(W, v, *rub, restitution))
        return false;
    }
    return true;
  }
  std::span<const Quad> impulses() const { return std::span(impulse_).first(m_); }
  /// Of each normal: the loss of its force, and of friction at it [J].
  double normal_loss(size_t i) const { return normal_loss_[i]; }
  double friction_loss(size_t i) const { return friction_loss_[i]; }

 private:
  void push(std::span<const Quad> W, std::span<Quad> v, size_t row, const Quad& impulse) {
    impulse_[row] += impulse;
    for (size_t k = 0; k < m_; ++k) v[k] += W[k * m_ + row] * impulse;
  }
  void strike(std::span<const Quad> W, std::span<Quad> v, size_t i, double e) {
    const Quad before = v[i], impulse = -Quad(1 + e) * before / W[i * m_ + i];
    push(W, v, i, impulse);
    normal_loss_[i] += double(-Quad(0.5) * impulse * (before + v[i]));
  }
  bool strike(std::span<const Quad> W, std::span<Quad> v, const Rubbing& r, double e) {
    const std::array<size_t, 3> rows{r.normal, r.across, r.across + 1};
    PointImpact start;
    std::array<Quad, 3> before;
    for (size_t i = 0; i < 3; ++i) {
      before[i] = v[rows[i]];
      start.u[i] = double(before[i]);
      for (size_t j = 0; j < 3; ++j) start.W[i][j] = double(W[rows[i] * m_ + rows[j]]);
    }
    const auto& w = start.W;
    for (size_t i = 1; i < 3; ++i) {
      if (!(w[i][i] > 1e-12 * w[0][0]))  // in a plane nothing moves across it
        for (size_t j = 0; j < 3; ++j) start.W[i][j] = start.W[j][i] = 0;
      else if (!(w[0][0] * w[i][i] - w[0][i] * w[0][i] > 1e-12 * w[0][0] * w[i][i]))
        return false;
    }
    const ImpactOutcome after = impact_with_friction(start, e, r.mu);
    for (size_t i = 0; i < 3; ++i) push(W, v, rows[i], Quad(after.impulse[i]));
    Quad all(0.0);
    for (size_t i = 0; i < 3; ++i) all -= Quad(0.5 * after.impulse[i]) * (before[i] + v[rows[i]]);
    const double friction = std::clamp(after.friction_loss, 0.0, std::max(0.0, double(all)));
    friction_loss_[r.normal] += friction;
    normal_loss_[r.normal] += std::max(0.0, double(all) - friction);
    return true;
  }

  size_t m_ = 0;
  std::vector<Quad> impulse_;
  std::vector<double> normal_loss_, friction_loss_;
};

}  // namespace porthos::contact
