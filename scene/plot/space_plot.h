#pragma once
#include <string>

#include "scene/run/run_report.h"

namespace porthos::scene {

/// The ledgers of a run in orbit on one logarithmic axis of joules, as a complete SVG document: the
/// energy in each, its works, its defect, and the size of one rounding of a total in double
/// precision. r.space must be set.
std::string space_plot(const RunReport& r);

}  // namespace porthos::scene
