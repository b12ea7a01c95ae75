#pragma once
#include <functional>
#include <string>

#include "scene/run/run_report.h"

namespace porthos::scene {

/// The trajectory to judge, its model and its map.
struct JudgeOptions {
  std::string file;   ///< the trajectory, CSV or HDF5
  std::string model;  ///< URDF
  std::string map;  ///< TOML, see trajectory_map.h; empty: columns by the names Porthos gives them
  std::string out;  ///< results folder
  /// Gets what is told before: notes on the model.
  std::function<void(const std::string& line)> say = {};
};

/// The verdict for a trajectory of another program: energy, momenta, attitude norm, growth law and
/// the balance with the work of the torques, as for a run of Porthos. run.h5 and summary.json are
/// written into the folder.
/// @throws InvalidArgument with file and line: a missing column, a value that is not a number, time
/// that does not increase, a map that does not fit the model, a loop that does not close near the
/// first row
RunReport judge_file(const JudgeOptions& options);

}  // namespace porthos::scene
