#pragma once
#include <string>
#include <vector>

#include "scene/read/event.h"

namespace porthos::scene {

/// A robot besides that of [model]: a [[robot]] of the scene.
struct Robot {
  std::string name, where;
  bool free = true;  ///< false: fixed to the world
  BaseStart start;   ///< of a free one
};

/// Reads the tables [[robot]] and adds their files to the model's text, unless it has them already.
/// beside: the folder of the scene file. merged: whether `urdf` is a text that has them
/// @throws InvalidArgument as read_scene(); for a file that is no model, with file and line
std::vector<Robot> read_robots(const Table& scene, const std::string& beside, bool merged,
                               std::string& urdf);

/// Refuses a key of a fixed robot for another number: its place is in the text of the model.
/// @throws InvalidArgument
void require_free(const std::vector<Robot>& robots, const std::string& key);

}  // namespace porthos::scene
