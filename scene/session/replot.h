#pragma once
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/plot/ledger_plot.h"
#include "scene/run/run_report.h"
#include "scene/session/moved.h"

namespace porthos::scene {

/// Draws energy_error.svg, ledger.svg and motion.svg of a finished run, and of all its phases,
/// again from summary.json and run.h5. motion.svg stays as it is where the scene cannot be read.
/// @return the files written
/// @throws InvalidArgument for a folder without a finished run, or one whose files are damaged
std::vector<std::string> replot(const std::filesystem::path& folder);

/// A part of a run [s], both ends included.
struct TimeSpan {
  double from = -HUGE_VAL, to = HUGE_VAL;
  bool whole() const { return !(from > -HUGE_VAL) && !(to < HUGE_VAL); }
};

inline constexpr std::int64_t most_of_ledger = 750;  ///< records in a plot of the ledger
/// The ledger of a run in a span, or in the whole if the span has next to no records.
/// @throws InvalidArgument as Records::column()
LedgerSeries ledger_of(const Records& records, const RunReport& report, const TimeSpan& span = {});

/// A panel of a finished run as figure() draws it: "energies", "works", "residual", a panel of the
/// motion by its name with or without the unit ("rates of joints") or by a beginning that no other
/// has, "motion" (all of them), a line of it or a row of the ledger by its name; "states", of a
/// system made in code a panel or a line of states_in() too.
/// One document for each phase, empty where a phase has no records in the span. The motion and the
/// states are one document for all phases. A picture of a span shows no more records than one of
/// the whole run.
/// @throws InvalidArgument as motion_in(), and for a name that is none, with the list of those
/// there are and the nearest; for a span without records
std::vector<std::string> figures(const std::filesystem::path& folder, const std::string& what,
                                 const TimeSpan& span = {});

}  // namespace porthos::scene
