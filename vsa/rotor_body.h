#pragma once
#include <optional>
#include <string>

#include "mechanics/builder.h"

/// Rotors with their gyroscopic moment: bodies of the mechanism that spin in place, for attach()
/// with a rotor's port (actuator.h). attach() without such a port neglects the moment Ω × J ω of a
/// rotor with rate ω in a link with angular velocity Ω, and the terms in n J.
namespace porthos::vsa {

/// A rotor as a body of the mechanism.
struct RotorBody {
  double inertia = 0;     ///< J about its axis [kg m²], > 0: the motor's, before the gear
  double transverse = 0;  ///< about the other two [kg m²]; 0: J
  double mass = 0;        ///< [kg]
  /// Spin axis, in the frame of the joint's placement; empty: the joint's axis.
  std::optional<mechanics::Vec3d> axis = {};
};

/// Adds a body "<joint>_rotor" to the body that carries the joint, at the joint's position, on a
/// joint of the same name.
/// @return its port in the mechanism, "<joint>_rotor.torque"
/// @throws InvalidArgument if the joint does not exist yet or an inertia is not positive
std::string add_rotor(mechanics::MechanismBuilder& b, const std::string& joint,
                      const RotorBody& rotor);

}  // namespace porthos::vsa
