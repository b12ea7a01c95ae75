#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "scene/plot/motion.h"
#include "scene/plot/shown.h"
#include "scene/session/records.h"

namespace porthos::scene {

/// What moved in a run.
struct Moved {
  std::vector<std::shared_ptr<const mechanics::Mechanism>> mechanisms = {};  ///< one per phase
  std::vector<Spring> springs = {};                                          ///< of its actuators
};
/// That of a finished run or of one of its phases, from the scene and the model in its results;
/// empty for a system without a mechanism.
/// @throws InvalidArgument as replot(), and where the scene cannot be read again
Moved moved_in(const std::filesystem::path& folder);

/// How a mechanism moved, over all phases.
struct Motion {
  std::vector<double> t;  ///< [s], of every line; the instant of an event stands in it twice
  /// As motion_panels(), one for each `what`; nan where a phase has no such line.
  std::vector<TracePanel> panels;
  std::vector<TimeMark> marks = {};  ///< where a phase begins, by what began it
  std::vector<double> holes = {};    ///< holes_in() of all phases
};
/// What is shown of the records of a phase: Shown::records or Shown::bands.
using ShownOf = Shown (*)(std::int64_t count, std::int64_t most);
/// That of a finished run or of one of its phases, at no more than `most` times. mechanism: in
/// place of that of moved_in(), of a model made in code.
/// @throws InvalidArgument as moved_in(), and for a system without a mechanism
Motion motion_in(const std::filesystem::path& folder, std::int64_t most,
                 std::shared_ptr<const mechanics::Mechanism> mechanism = nullptr,
                 ShownOf shown = Shown::bands);

/// Whether the results are of a scene, not of a system made in code.
/// @throws InvalidArgument if there is no run.h5
bool has_scene(const std::filesystem::path& folder);

/// The states of a run of any system, over all phases: panels "states [rad]", "momenta [kg m^2/s]",
/// one for each unit, with a line for each number of the series "state/..." and "momentum/...".
/// Angles have their turns.
/// @throws InvalidArgument as replot()
Motion states_in(const std::filesystem::path& folder, std::int64_t most,
                 ShownOf shown = Shown::bands);
/// Those panels of one run or phase.
std::vector<TracePanel> states_of(const Records& records, const Shown& shown);

/// What the phases of a run share, whose records these are. They must outlive it.
WholeRun whole_run(const std::vector<std::unique_ptr<Records>>& phases);

/// The panels of the motion in records.
std::vector<TracePanel> panels_of(const Records& records, const mechanics::Mechanism& mechanism,
                                  const std::vector<Spring>& springs, const Shown& shown,
                                  const WholeRun& whole = {});

/// Of the records of a judged file behind which others are missing [s]; none of a run.
std::vector<double> holes_in(const Records& records, const std::string& method);

/// The folders of a finished run that have a run.h5: its own, or those of its phases.
/// @throws InvalidArgument if there is none
std::vector<std::filesystem::path> parts_of(const std::filesystem::path& folder);

}  // namespace porthos::scene
