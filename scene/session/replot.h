#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scene/plot/motion.h"

namespace porthos::scene {

/// What moved in a run.
struct Moved {
  std::vector<std::shared_ptr<const mechanics::Mechanism>> mechanisms = {};  ///< one per phase
  std::vector<Spring> springs = {};                                          ///< of its actuators
};
/// That of a finished run, from the scene and the model in its results; empty for a system without
/// a mechanism.
/// @throws InvalidArgument as replot(), and where the scene cannot be read again
Moved moved_in(const std::filesystem::path& folder);

/// Draws energy_error.svg, ledger.svg and motion.svg of a finished run, and of all its phases,
/// again from summary.json and run.h5. motion.svg stays as it is where the scene cannot be read.
/// @return the files written
/// @throws InvalidArgument for a folder without a finished run, or one whose files are damaged
std::vector<std::string> replot(const std::filesystem::path& folder);

}  // namespace porthos::scene
