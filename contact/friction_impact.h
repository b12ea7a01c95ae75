#pragma once
#include <array>

/// A rigid impact with friction at one point, in a plane.
namespace porthos::contact {

/// The state of an impact in the plane of its normal and one tangent: W = G M⁻¹ Gᵀ [1/kg] of both
/// directions, and the rates u of the point on B relative to A [m/s].
struct PlanarImpact {
  double nn = 0, nt = 0, tt = 0;   ///< W, positive definite
  double normal = 0, tangent = 0;  ///< u; normal < 0: they approach
};

/// What it leads to.
struct PlanarOutcome {
  double normal = 0, tangent = 0;   ///< u after
  std::array<double, 2> impulse{};  ///< along the normal and the tangent [N s]
  double compression = 0;           ///< work of the normal force until the approach ends, <= 0 [J]
  double normal_loss = 0, friction_loss = 0;  ///< [J], never negative
};

/// Stronge's law: the impact is followed in the normal impulse, in phases of slip and stick.
/// Friction is Coulomb's at each of its values, and the impact ends where the normal force has
/// given back e² of the work of its compression. So it loses (1 - e²) of that, and friction the
/// rest: no energy is made, whatever e, μ and W are. Each phase is linear in the impulse, so the
/// result is exact to rounding. A start that moves apart is returned as it is.
///
/// Newton's law for the normal with Coulomb's for the impulses may make energy (Kane, Levinson
/// 1985). Source: Stronge 1990, "Rigid body collisions with friction".
/// @param e  restitution of energy, 0 to 1; mu  coefficient of friction, >= 0
/// @throws InvalidArgument for numbers out of range, or a W that is not positive definite
PlanarOutcome impact_with_friction(const PlanarImpact& start, double e, double mu);

}  // namespace porthos::contact
