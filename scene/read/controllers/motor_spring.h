#pragma once
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The actuator of a joint: a torque drive behind a spring that keeps its stiffness setting.
/// @throws InvalidArgument if the joint has another one, or none
const JointActuator& motor_spring(const Scene& scene, const std::string& joint);
/// The motor's angle θ in the state of the actuator.
phs::Block motor_angle(const JointActuator& a);

}  // namespace porthos::scene
