#pragma once
#include <optional>
#include <string>

#include "mechanics/builder.h"

/// Rotors with their gyroscopic moment: bodies of the mechanism that spin where they sit, for
/// attach() with a rotor's port (actuator.h). What attach() without one neglects is (Ω × J ω) of a
/// rotor at the rate ω in a link that turns at Ω, and the terms in n J.
namespace porthos::vsa {

/// A rotor as a body.
struct RotorBody {
  double inertia = 0;     ///< J about its axis [kg m²], > 0: that of the motor, before the gear
  double transverse = 0;  ///< about the other two [kg m²]; 0: J
  double mass = 0;        ///< [kg]
  /// Spin axis, in the frame of the joint's placement; none: the joint's axis.
  std::optional<mechanics::Vec3d> axis = {};
};

/// Adds a body "<joint>_rotor" to what carries the joint, at the joint's place, on a joint of the
/// same name.
/// @return its port in the mechanism, "<joint>_rotor.torque"
/// @throws InvalidArgument: no such joint yet, an inertia that is not positive
std::string add_rotor(mechanics::MechanismBuilder& b, const std::string& joint,
                      const RotorBody& rotor);

}  // namespace porthos::vsa
