#pragma once
#include <optional>
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// A commented scene file for a URDF file, which runs and passes as it is. Pilot runs over the
/// whole duration find method, step and duration; start values are inside the joints' limits; and
/// [model] has the keys needed so that the file is accepted (joints that move no mass are locked).
/// Slides that leave their limits by more than their range in the pilot run are locked too.
/// Takes some seconds and gives the same text on every machine.
/// @param urdf   path of the URDF file
/// @param shown  its path in the scene file, relative to that file
/// @param base   fixed: fixed to the world, with gravity; free: floating, without. Absent: fixed,
///   or free if no joint of the file moves
/// @throws InvalidArgument as mechanics::read_urdf, with the message of the last attempt; also
///   for a model whose pilot runs all fail
std::string starter_scene(const std::string& urdf, const std::string& shown,
                          std::optional<mechanics::UrdfOptions::Base> base);

}  // namespace porthos::scene
