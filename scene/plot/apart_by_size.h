#pragma once
#include <vector>

#include "scene/plot/trace_plot.h"

namespace porthos::scene {

/// Panels of outputs and actuators in which every line can be seen: lines that are more than a
/// hundred times smaller than the others of a panel stand in one of their own, "outputs, smaller
/// [N]". What is 0, or 1e-9 of the largest, stays. Panels of anything else are as they are.
std::vector<TracePanel> apart_by_size(std::vector<TracePanel> panels);

}  // namespace porthos::scene
