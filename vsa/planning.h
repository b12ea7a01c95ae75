#pragma once
#include <vector>

#include "vsa/elastic.h"

/// Choosing σ by what it costs.
namespace porthos::vsa {

/// A place of a path on which the spring is retuned.
struct RetuningPoint {
  double phi, sigma, stiffness;  ///< deflection q - θ [rad], unit of σ, [N m/rad]
};
/// A path on which the spring's energy stays what it is at (φ0, σ0): deflection and σ together, φ
/// in equal parts from φ0 to φ1. What the stiffness port takes the link and motor get, and the
/// other way round: the sum of the works is 0.
/// @throws InvalidArgument where no σ in [σ_lower, σ_upper] has this energy, or for an energy that
///   is not translation invariant or does not depend on σ
std::vector<RetuningPoint> constant_energy_path(const Elastic& e, double phi0, double sigma0,
                                                double phi1, int parts);

/// The best stiffness for a swing, and what it saves.
struct Resonance {
  double sigma;       ///< the best
  double torque_rms;  ///< of the torque still needed besides the spring's, over a period [N m]
  double rigid_rms;   ///< of what a rigid drive would need [N m]
  double stiffness;   ///< at zero deflection [N m/rad]
};
/// The σ with which a link of this inertia swings as q = amplitude · sin(ω t), θ at rest, with the
/// least mean square of the torque the spring does not give. Searched for in [lower, upper], 1000
/// places, then refined by golden section.
/// @throws InvalidArgument for an amplitude beyond the deflection limit at every σ, or as
///   constant_energy_path()
Resonance resonant_sigma(const Elastic& e, double inertia, double amplitude, double omega,
                         double lower, double upper);

}  // namespace porthos::vsa
