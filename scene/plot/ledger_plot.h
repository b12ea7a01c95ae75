#pragma once
#include <string>
#include <vector>

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
  std::vector<double> defect;  ///< H - H(start) - supplied + dissipated [J]
};

/// Three panels over one time axis, as a complete SVG document: stored energies stacked (each from
/// zero, or from its least value where that is below zero), works through sources and losses, and
/// the defect of the balance on an axis of its own.
std::string ledger_plot(const LedgerSeries& series, const std::string& title,
                        const std::string& subtitle);

}  // namespace porthos::scene
