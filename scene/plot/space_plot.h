#pragma once
#include <string>

#include "scene/run/run_report.h"

namespace porthos::scene {

/// The ledgers of a run in orbit on one logarithmic axis of joules, as a complete SVG document:
/// what stands in each, what went through it, what does not add up, and where one rounding of a
/// total in double precision would lie. r.space must be there.
std::string space_plot(const RunReport& r);

}  // namespace porthos::scene
