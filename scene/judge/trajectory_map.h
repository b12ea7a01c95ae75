#pragma once
#include <map>
#include <string>
#include <vector>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The meaning of the columns of another program's trajectory: a TOML file with [columns], and, as
/// in a scene, [model], [environment], [[element]] and [verify]. docs/judge.md.
struct TrajectoryMap {
  /// Column names by coordinate of the model: one, or as many as the coordinate has numbers.
  using Columns = std::map<std::string, std::vector<std::string>>;
  std::string path, text;  ///< of the file; empty: none
  std::string time;        ///< empty: "time" or "t"
  Columns q, v, p, torque;
  std::map<std::string, std::string> where;  ///< "file:line:column" by "q.elbow"
  bool linear_in_body =
      false;  ///< velocities of free bases along the base's own axes, not the world's
  bool angular_in_world =
      false;  ///< rates of free bases along the world's axes, not the base's own
  /// How a torque goes from row to row; smooth: its slopes are those of neighbouring rows.
  enum class TorqueBetween { held, linear, smooth } torque_between = TorqueBetween::held;
};

/// @throws InvalidArgument as read_scene(), for [columns]
TrajectoryMap read_trajectory_map(const std::string& path);

/// The scene of the trajectory: the map's text without [columns], with a clock.
/// @throws InvalidArgument as read_scene()
Scene scene_of(const TrajectoryMap& map, const std::string& urdf, bool free_base, double step,
               double duration);

}  // namespace porthos::scene
