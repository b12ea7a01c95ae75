#pragma once
#include <string>

#include "scene/scene.h"

namespace porthos::scene {

/// A commented scene file for a URDF file, which runs as it is: method, a step that keeps the energy to rounding over a tenth of a
/// second or more of it (found by trials), start values inside the joints' limits, and whatever [model] has to say so
/// that the file is accepted.
/// @param urdf   path of the URDF file
/// @param shown  how the scene file names it, relative to itself
/// @param base   fixed: bolted to the world, with gravity; free: floating, without
/// @throws InvalidArgument as mechanics::read_urdf, in the words of the last way that was tried; for a model without
///   joints that stands in the world
std::string starter_scene(const std::string& urdf, const std::string& shown,
                          mechanics::UrdfOptions::Base base);

}  // namespace porthos::scene
