#pragma once
#include "scene/run/phase_sequence.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {

/// Callbacks and options of a run in memory.
struct MemoryOptions {
  const std::atomic<bool>* stop = nullptr;
  /// Fraction done, wall seconds spent, estimated wall seconds left; for a run without events.
  std::function<void(double, double, double)> progress = {};
  /// Receives the records. With events the rows of each phase have a layout of their own.
  RecordSink record = {};
  bool check_symmetry = false;  ///< as in RunOptions
  bool judge = true;            ///< false: no verdict, and no runs beside for it
};

/// Runs a scene without a folder: the steps, the ledger and the verdict of run(), with the same
/// bits, but no files and no checkpoints.
/// @throws InvalidArgument as run()
RunReport run_in_memory(const Scene& scene, const Assembly& assembly, const MemoryOptions& options);

/// Runs the phases of a rehearsed sequence one after another.
/// @throws InvalidArgument as PhaseSequence::done(); `phases` then stands before the event:
///   PhaseSequence::last() and whole() are those of the phase before it
RunReport run_in_memory(PhaseSequence& phases, const MemoryOptions& options);

}  // namespace porthos::scene
