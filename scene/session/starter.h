#pragma once
#include <optional>
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// A commented scene file for a URDF file, which runs and passes as it is: method, step and
/// duration found by pilot runs over all of the duration, start values inside the joints' limits,
/// and whatever [model] has to say so that the file is accepted (joints that move nothing heavy are
/// locked). Some seconds; the same text on every machine.
/// @param urdf   path of the URDF file
/// @param shown  how the scene file names it, relative to itself
/// @param base   fixed: bolted to the world, with gravity; free: floating, without. Absent: fixed,
///   or free if no joint of the file moves
/// @throws InvalidArgument as mechanics::read_urdf, in the words of the last way that was tried;
///   for a model whose pilot runs all fail
std::string starter_scene(const std::string& urdf, const std::string& shown,
                          std::optional<mechanics::UrdfOptions::Base> base);

}  // namespace porthos::scene
