#pragma once
#include <filesystem>

#include "scene/run/run_report.h"

namespace porthos::scene {

/// Writes run.h5, energy_error.svg and summary.json of a finished run under temporary names and
/// then renames them, the summary last: a folder with a summary is complete. Results of an earlier
/// run stay untouched until then; then those that this run does not have, its phases too, are
/// removed.
/// @throws IoError "cannot write <path>: ..."
void write_results(const std::filesystem::path& folder, const Scene& scene,
                   const Assembly& assembly, const RunReport& report,
                   const std::filesystem::path& log);

/// Writes its pictures and summary again when the verdict is known.
void write_verdict(const std::filesystem::path& folder, const Scene& scene,
                   const Assembly& assembly, const RunReport& report,
                   const std::filesystem::path& log);

/// Removes the results of an earlier run, its phases and its last state.
void remove_results(const std::filesystem::path& folder);

/// @throws InvalidArgument for a folder without the summary of a finished run
void require_finished(const std::filesystem::path& folder);

}  // namespace porthos::scene
