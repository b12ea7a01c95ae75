#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace porthos::scene {

/// Writes the time series of a finished run as one CSV table, a row for each record, for
/// spreadsheets: "time [s],state/elbow [rad],output/hand.x [m],...". Numbers have the digits that
/// give the same double again. Angles are true angles, turns included. Of a run with events the
/// phases follow each other, with their number in a column "phase"; what a phase has not is empty.
/// @param names  of series as in run.h5, in the order wanted, or groups of them ("output"); empty:
///   all
/// @throws InvalidArgument for a folder without a finished run, a damaged file or a name that no
///   phase has; IoError if the file cannot be written. Cost: a read of run.h5, 1 MB of memory
void export_csv(const std::filesystem::path& folder, const std::filesystem::path& to,
                const std::vector<std::string>& names = {});

}  // namespace porthos::scene
