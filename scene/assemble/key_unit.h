#pragma once
#include <string>

namespace porthos::scene {

struct Scene;
struct Assembly;

/// The unit of a number of the scene by its key, written as in Replacement: of "N m/rad (N/m)" the
/// second if its joint slides, of a joint's start that of the joint, of an actuator's parameter
/// that of its family. "": not known. Cost: reads the text of the scene.
std::string unit_of_key(const Scene& scene, const std::string& key, const Assembly& assembly);

}  // namespace porthos::scene
