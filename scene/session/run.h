#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "integrators/control/event.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Where a run leaves its results, and where it ends.
struct RunOptions {
  std::string out = "results";  ///< results folder, made if missing
  bool resume = false;          ///< continue from out/checkpoint
  /// Ends the run at the instant where one of these rises through 0, by a step cut short there; the
  /// next run goes on from its final state to the end of that step. x has its angles with all their
  /// turns and is relative to Assembly::centre where there is one.
  std::vector<integrators::Event> until = {};
  bool check_symmetry = false;  ///< `verify`: the way forth and back, and the axioms of the system
  const std::atomic<bool>* stop = nullptr;  ///< set by Ctrl-C: checkpoint and return
  std::int64_t stop_at = -1;                ///< a step at which it does so by itself
  /// Progress: fraction done, wall seconds spent, estimated wall seconds left. Called a few times a
  /// second at most.
  std::function<void(double, double, double)> progress = {};
  /// Told what method = "auto" chose, before the first step.
  std::function<void(const std::string&)> say = {};
};

/// Runs a scene: steps, records, checkpoints, judges; writes run.h5, summary.json and
/// energy_error.svg into the folder. Records go to an append-only file in out/checkpoint first and
/// become run.h5 at the end (written aside, then renamed), so that a run killed at any moment
/// continues bit for bit with `resume`. Results of an earlier finished run in the folder are
/// replaced, after the new run has finished; they are written before anything is checked beside the
/// run (judge_beside()), and the verdict once more after it.
/// @throws InvalidArgument for a folder that holds an unfinished run (without `resume`), a method
///   that cannot be continued, a missing, truncated or damaged checkpoint, or one of another run
///   (names what differs); nothing is overwritten then.
/// @throws IoError for a folder that cannot be written or is full; what is recorded stays, and can
///   be resumed.
RunReport run(const Scene& scene, const Assembly& assembly, const RunOptions& options);

}  // namespace porthos::scene
