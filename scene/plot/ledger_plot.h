#pragma once
#include <optional>
#include <string>
#include <vector>

#include "scene/plot/trace_plot.h"

namespace porthos::scene {

/// A series of the ledger over the times of LedgerSeries.
struct LedgerLine {
  std::string name;
  std::vector<double> value;  ///< [J]
};

/// The ledger of a run, reduced for a picture.
struct LedgerSeries {
  std::vector<double> t;  ///< [s]
  std::vector<LedgerLine> stored, supplied, dissipated;
  std::vector<double> defect;      ///< H - H(start) - supplied + dissipated [J]
  std::vector<double> holes = {};  ///< as those of a panel
};

/// "energies [J]", stacked, and, if there are any, "works [J]" through sources (in) and losses.
std::vector<TracePanel> ledger_panels(const LedgerSeries& series);

/// One row, a stored energy or a work; none of another name.
std::optional<TracePanel> row_panel(const LedgerSeries& series, const std::string& name);

/// Works as of a part of a run: from zero at its begin. The panel has a line of a record or more.
void count_anew(TracePanel& works);

/// Energies, works and, on an axis of its own, the residual of the balance, as an SVG document.
std::string ledger_plot(const LedgerSeries& series, const std::string& title,
                        const std::string& subtitle);

}  // namespace porthos::scene
