#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "phs/system/state.h"
#include "scene/run/provenance.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

/// Everything needed to continue a run, bit for bit.
struct Checkpoint {
  NamedTexts fingerprint;
  integrators::Outcome outcome =
      integrators::Outcome::ok;  ///< not ok: the last good state of a run that failed
  phs::State state;
  std::vector<double> memory;  ///< of the integrator
  integrators::Cost cost;
  std::vector<double> statistics;  ///< memory of the Ledger
  LogMark log;
  double cpu_s = 0, wall_s = 0;
};

/// Writes folder/state.bin under a temporary name, flushes it and renames it. A crash at any moment
/// leaves either the old file or the new one.
void write_checkpoint(const std::filesystem::path& folder, const Checkpoint& checkpoint);

/// Whether there is a checkpoint to resume from.
bool has_checkpoint(const std::filesystem::path& folder);

/// @throws InvalidArgument if there is no checkpoint, or it is truncated, damaged or of another
/// format version
Checkpoint read_checkpoint(const std::filesystem::path& folder);

/// The checkpoint before the last one is kept beside it, as state.old, in case the last one or the
/// records between the two are damaged.
bool has_checkpoint_before(const std::filesystem::path& folder);
/// Replaces the last checkpoint by the one before it. @throws IoError
void return_to_checkpoint_before(const std::filesystem::path& folder);
/// @throws InvalidArgument as read_checkpoint()
Checkpoint read_checkpoint_before(const std::filesystem::path& folder);

}  // namespace porthos::scene
