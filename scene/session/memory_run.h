#pragma once
#include "scene/run/phase_sequence.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {

/// Who watches a run in memory.
struct MemoryOptions {
  const std::atomic<bool>* stop = nullptr;
  /// Fraction done, wall seconds spent, estimated wall seconds left: of a run without events.
  std::function<void(double, double, double)> progress = {};
  /// Takes the records. With events the rows of each phase have a layout of their own.
  RecordSink record = {};
  bool check_symmetry = false;  ///< as in RunOptions
};

/// A scene run without a folder: the steps, the ledger and the verdict of run(), with the same
/// bits, and neither files nor checkpoints.
/// @throws InvalidArgument as run()
RunReport run_in_memory(const Scene& scene, const Assembly& assembly, const MemoryOptions& options);

/// The phases of a sequence, one after another, that has been rehearsed.
/// @throws InvalidArgument as PhaseSequence::done(); its last() and whole() are of the phase before
RunReport run_in_memory(PhaseSequence& phases, const MemoryOptions& options);

}  // namespace porthos::scene
