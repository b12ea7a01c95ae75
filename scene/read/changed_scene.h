#pragma once
#include <span>
#include <string>

#include "scene/read/variation.h"

namespace porthos::scene {

/// Reads a scene file with other numbers, as read_variation(). Its text has them too, so the
/// results of its run hold what was run.
/// @param changes  any number of them
/// @throws InvalidArgument as read_variation(); what a changed key is refused for, with its name
Scene read_changed(const std::string& path, std::span<const Replacement> changes);

}  // namespace porthos::scene
