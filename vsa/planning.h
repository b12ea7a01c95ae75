#pragma once
#include <vector>

#include "vsa/elastic.h"

/// Choice of σ by its cost.
namespace porthos::vsa {

/// A point of a path on which the spring is retuned.
struct RetuningPoint {
  double phi, sigma, stiffness;  ///< deflection q - θ [rad], unit of σ, [N m/rad]
};
/// A path with constant spring energy, equal to that at (φ0, σ0): deflection and σ change together,
/// φ in equal parts from φ0 to φ1. The energy that the stiffness port receives comes from link and
/// motor, and vice versa: the works sum to 0.
/// @throws InvalidArgument if no σ in [σ_lower, σ_upper] has this energy, or for an energy that is
/// not translation invariant or does not depend on σ
std::vector<RetuningPoint> constant_energy_path(const Elastic& e, double phi0, double sigma0,
                                                double phi1, int parts);

/// The best stiffness for a swing, and its benefit.
struct Resonance {
  double sigma;       ///< the best σ
  double torque_rms;  ///< rms over a period of the torque needed besides the spring's [N m]
  double rigid_rms;   ///< the same for a rigid drive [N m]
  double stiffness;   ///< at zero deflection [N m/rad]
};
/// The σ with which a link of this inertia swings as q = amplitude · sin(ω t), θ at rest, with the
/// least mean square of the torque that the spring does not supply. The search evaluates 1000
/// points in [lower, upper] and refines by golden section.
/// @throws InvalidArgument for an amplitude beyond the deflection limit at every σ, or as
///   constant_energy_path()
Resonance resonant_sigma(const Elastic& e, double inertia, double amplitude, double omega,
                         double lower, double upper);

}  // namespace porthos::vsa
