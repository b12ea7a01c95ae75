#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "integrators/control/event.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Options of a run: where it writes its results, and where it ends.
struct RunOptions {
  std::string out = "results";  ///< results folder, made if missing
  bool resume = false;          ///< continue from out/checkpoint
  /// Ends the run at the instant at which one of these rises through 0, by a shortened step; the
  /// next run continues from its final state to the end of that step. x has its angles with all
  /// turns and is relative to Assembly::centre if there is one.
  std::vector<integrators::Event> until = {};
  bool check_symmetry = false;  ///< `verify`: symmetry in time, and the axioms of the system
  const std::atomic<bool>* stop = nullptr;  ///< set by Ctrl-C: checkpoint and return
  std::int64_t stop_at = -1;                ///< a step at which this happens without `stop`
  /// Progress: fraction done, wall seconds spent, estimated wall seconds left. Called a few times a
  /// second at most.
  std::function<void(double, double, double)> progress = {};
  /// Called with a sentence on what the results do not hold: the choice of method = "auto" before
  /// the first step, a damaged checkpoint, a folder that could not be removed.
  std::function<void(const std::string&)> say = {};
};

/// Runs a scene: steps, records, checkpoints, judges; writes run.h5, summary.json and
/// energy_error.svg into the folder. Records go first to an append-only file in out/checkpoint. At
/// the end they become run.h5, written under a temporary name and renamed. So a run killed at any
/// moment continues bit for bit with `resume`. Results of an earlier finished run in the folder are
/// replaced after the new run has finished. They are written before the additional checks
/// (judge_beside()); the verdict is written again after them.
/// @throws InvalidArgument for a folder that holds an unfinished run (without `resume`), a method
///   that cannot be continued, a missing, truncated or damaged checkpoint, or one of another run
///   (names what differs); nothing is overwritten then.
/// @throws IoError for a folder that cannot be written or is full; the records stay, and the run
/// can be resumed.
RunReport run(const Scene& scene, const Assembly& assembly, const RunOptions& options);

}  // namespace porthos::scene
