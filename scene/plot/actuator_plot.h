#pragma once
#include <string>

namespace porthos::vsa {
struct Device;
}

namespace porthos::scene {

struct JointActuator;

/// Torque and stiffness of a device against its deflection for the values of σ in the catalogue, as
/// a complete SVG document.
/// @throws InvalidArgument for a device without a model
std::string datasheet_plot(const vsa::Device& device);

/// Torque, stiffness and energy of an actuator of a scene, up to the limit of its deflection, else
/// as far as it was measured, else 1 rad, for four values of σ in its range, to its end where the
/// spring has room and no pole, else for the one at the start. Of a table for the measured
/// settings, at most as many as there are colours, with the measured torques.
std::string spring_plot(const JointActuator& actuator);

}  // namespace porthos::scene
