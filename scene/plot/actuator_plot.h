#pragma once
#include <string>

namespace porthos::vsa {
struct Device;
}

namespace porthos::scene {

/// Torque and stiffness of a device against its deflection for the values of σ in the catalogue, as
/// a complete SVG document.
/// @throws InvalidArgument for a device without a model
std::string datasheet_plot(const vsa::Device& device);

}  // namespace porthos::scene
