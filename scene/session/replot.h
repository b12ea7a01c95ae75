#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace porthos::scene {

/// Draws energy_error.svg and ledger.svg of a finished run anew from its summary.json and run.h5,
/// in every phase of it.
/// @return the files written
/// @throws InvalidArgument for a folder without a finished run, or one whose files are damaged
std::vector<std::string> replot(const std::filesystem::path& folder);

}  // namespace porthos::scene
