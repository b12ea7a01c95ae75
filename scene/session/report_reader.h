#pragma once
#include <filesystem>

#include "scene/run/run_report.h"

namespace porthos::scene {

/// The report of a finished run, from the summary.json in its folder.
/// @param end  its last state, which the summary has only in decimal digits
/// @throws InvalidArgument for a file that is not a summary
RunReport read_report(const std::filesystem::path& folder, const phs::State& end);

}  // namespace porthos::scene
