#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace porthos::scene {

/// Draws energy_error.svg and ledger.svg of a finished run, and of all its phases, again from
/// summary.json and run.h5.
/// @return the files written
/// @throws InvalidArgument for a folder without a finished run, or one whose files are damaged
std::vector<std::string> replot(const std::filesystem::path& folder);

}  // namespace porthos::scene
