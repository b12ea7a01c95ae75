#pragma once
#include <array>

/// A rigid impact with friction at one point.
namespace porthos::contact {

/// The state of an impact along its normal and two directions across it: W = G M⁻¹ Gᵀ [1/kg] and
/// the rates u of the point on B relative to A [m/s]. u[0] < 0: they approach.
struct PointImpact {
  std::array<std::array<double, 3>, 3> W{};  ///< symmetric, W[0][0] > 0; 0 where nothing can move
  std::array<double, 3> u{};
};

/// What it leads to.
struct ImpactOutcome {
  std::array<double, 3> u{};        ///< after
  std::array<double, 3> impulse{};  ///< [N s]
  double compression = 0;           ///< work of the normal force until the approach ends, <= 0 [J]
  double normal_loss = 0, friction_loss = 0;  ///< [J], never negative
};

/// Stronge's law: the impact is followed in the normal impulse, in phases of slip and stick.
/// Friction is Coulomb's at each of its values, and the impact ends where the normal force has
/// given back e² of the work of its compression. So it loses (1 - e²) of that, and friction the
/// rest: no energy is made, whatever e, μ and W are. A phase in which the slip keeps its direction
/// is linear in the impulse, and exact to rounding: every impact in a plane, and that of every
/// ball. Else the direction is followed by Runge-Kutta steps, to 1e-10. A start that moves apart is
/// returned as it is.
///
/// Newton's law for the normal with Coulomb's for the impulses may make energy (Kane, Levinson
/// 1985). Source: Stronge 1990, "Rigid body collisions with friction"; in space Batlle 1993,
/// J. Appl. Mech. 60, "On Newton's and Poisson's rules of percussive dynamics".
/// @param e  restitution of energy, 0 to 1; mu  coefficient of friction, >= 0
/// @throws InvalidArgument for numbers out of range, or a W that is not positive
ImpactOutcome impact_with_friction(const PointImpact& start, double e, double mu);

/// The friction on a point at rest for a unit of normal force, and whether the point slips.
struct SlipStart {
  std::array<double, 2> friction{};
  bool slips = false;
};
/// The least friction f with a + W f = 0 if |f| <= mu: the point sticks. Else f = -mu s and the
/// point begins to slip along s, the unit vector with a - mu W s = c s and c > 0.
/// @param W  2 × 2, symmetric, not negative (xx, xy, yy); a: rates for a unit of normal force
SlipStart slip_start(const std::array<double, 3>& W, const std::array<double, 2>& a, double mu);

}  // namespace porthos::contact
