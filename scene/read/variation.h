#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/read/scene.h"

/// A scene with some of its numbers replaced: one case of an ensemble.
namespace porthos::scene {

/// Other numbers for a key of the scene: its tables and keys with dots between them, the place in
/// an array in brackets, from 0: "initial.joints.joint_1.velocity",
/// "initial.base.angular_velocity[2]", "element[0].stiffness". More than one number replace a whole
/// array.
struct Replacement {
  std::string key;
  std::vector<double> values;
};

/// Whether a replacement changes the start of a run and nothing else.
bool is_of_start(const std::string& key);

/// A scene with the numbers of `replacements` in the place of its own, from the texts that were
/// read for it. Tables and keys that are not there are added.
/// @throws InvalidArgument as read_scene; for a key that has no place in it
Scene read_variation(const Scene& scene, std::span<const Replacement> replacements);

}  // namespace porthos::scene
