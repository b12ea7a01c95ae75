#pragma once
#include <algorithm>
#include <cmath>

#include "contact/geometry/shape.h"

namespace porthos::contact {

/// Coulomb's exact law at one contact, in the axes (normal, first, second direction across it):
///   0 <= w_n ⊥ P_n >= 0,  |P_t| <= μ P_n,  P_t = -μ P_n w_t/|w_t| where w_t is not 0,
/// with w = b + A P. No cone is dilated: what slides has w_n = 0, where a convex relaxation, such
/// as that of Anitescu 2006, has w_n = μ|w_t|.
///
/// A is symmetric, positive semidefinite. The axes across are those in which A_tt - a aᵀ/A_nn, with
/// a = A_tn, is diagonal.
class FrictionCone {
 public:
  FrictionCone() = default;
  /// nn, a: A_nn and A_tn in these axes; across: the two numbers of the diagonal
  FrictionCone(double nn, double a1, double a2, double across1, double across2, double mu)
      : nn_(nn), a_{a1, a2}, across_{across1, across2}, mu_(mu) {
    const double least = 1e-12 * std::max({nn, across1, across2});
    for (double& s : across_)
      if (!(s > least)) s = 0;  // nothing moves there
  }

  /// The impulse P for w = b at P = 0. What can part does so: P = 0 where b_n >= 0.
  Vec3d impulse(const Vec3d& b) const {
    if (!(b.x < 0) || !(nn_ > 0)) return {0, 0, 0};
    if (!(mu_ > 0)) return {-b.x / nn_, 0, 0};
    const double b1 = b.y - a_[0] * b.x / nn_, b2 = b.z - a_[1] * b.x / nn_;
    // w_t = -α P_t, with α >= 0: at α = 0 it sticks.
    const auto at = [&](double alpha) {
      const double s1 = across_[0] + alpha, s2 = across_[1] + alpha;
      const double p1 = s1 > 0 ? -b1 / s1 : 0, p2 = s2 > 0 ? -b2 / s2 : 0;
      return Vec3d{-(b.x + a_[0] * p1 + a_[1] * p2) / nn_, p1, p2};
    };
    const auto length = [](const Vec3d& p) { return std::sqrt(p.y * p.y + p.z * p.z); };
    Vec3d p = at(0);
    if (length(p) <= mu_ * p.x) return p;
    // |P_t| exceeds μ P_n at α = 0 and not as α -> ∞, where P_t = 0 and P_n = -b_n/A_nn. Newton on
    // μ P_n/|P_t| - 1, which is linear in α where the axes are alike and a = 0.
    const double size = across_[0] + across_[1] + 1e-300;
    double low = 0, high = HUGE_VAL, alpha = across_[0] > 0 && across_[1] > 0 ? 0 : size;
    for (int k = 0; k < 200; ++k) {
      p = at(alpha);
      const double across = length(p);
      (across > mu_ * p.x ? low : high) = alpha;
      if (!(across > 0)) break;
      const double q1 = -p.y / (across_[0] + alpha), q2 = -p.z / (across_[1] + alpha);  // dP_t/dα
      const double ratio = mu_ * p.x / across, slope = -(mu_ * (a_[0] * q1 + a_[1] * q2) / nn_ +
                                                         ratio * (p.y * q1 + p.z * q2) / across) /
                                                       across;
      double next = alpha + (1 - ratio) / slope;
      if (!(next > low && next < high))
        next = high < HUGE_VAL ? 0.5 * (low + high) : 4 * low + size;
      if (std::fabs(next - alpha) <= 1e-15 * alpha) break;
      alpha = next;
    }
    return p;
  }
  /// A P in these axes.
  Vec3d times(const Vec3d& p) const {
    const double along = (a_[0] * p.y + a_[1] * p.z) / (nn_ > 0 ? nn_ : 1);
    return {nn_ * p.x + a_[0] * p.y + a_[1] * p.z, a_[0] * p.x + across_[0] * p.y + a_[0] * along,
            a_[1] * p.x + across_[1] * p.z + a_[1] * along};
  }

 private:
  double nn_ = 0, a_[2] = {0, 0}, across_[2] = {0, 0}, mu_ = 0;
};

}  // namespace porthos::contact
