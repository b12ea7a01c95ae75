#pragma once
#include <array>
#include <string>

#include "energy_shaping/laws/potential_loop.h"
#include "scene/read/schema.h"

namespace porthos::scene {

class Table;

/// A link held in the world, and its attitude as a quaternion.
struct HeldPose {
  energy_shaping::PoseSpring spring;
  std::array<double, 4> wxyz{1, 0, 0, 0};
};
/// Its keys: point, stiffness, position, attitude_stiffness, attitude_wxyz.
std::vector<SchemaKey> pose_keys();
/// @throws InvalidArgument with file and line, for a pose that holds nothing
HeldPose read_pose(const std::string& link, const Table& t);

}  // namespace porthos::scene
