#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/read/scene.h"

/// A scene with some of its numbers replaced: one case of an ensemble.
namespace porthos::scene {

/// New numbers for a key of the scene. The key consists of its tables and keys with dots between
/// them and array indices in brackets, from 0: "initial.joints.joint_1.velocity",
/// "initial.base.angular_velocity[2]", "element[0].stiffness". Where a table has names
/// of links or joints as its keys, dots belong to them: "model.mass_factor.target.bus"; a part may
/// be in quotes. Several numbers replace a whole array.
struct Replacement {
  std::string key;
  std::vector<double> values;
};

/// Whether a replacement changes the start of a run and nothing else.
bool is_of_start(const std::string& key);

/// The scene with the numbers of `replacements` instead of its own, read again from its stored
/// texts. Missing tables and keys are added.
/// @throws InvalidArgument as read_scene; for a key that has no place in the scene, and of a robot
/// that is fixed, whose place is in the text of the model
Scene read_variation(const Scene& scene, std::span<const Replacement> replacements);

}  // namespace porthos::scene
