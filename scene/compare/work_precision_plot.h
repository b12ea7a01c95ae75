#pragma once
#include <string>

#include "scene/compare/compare.h"

namespace porthos::scene {

/// Error against CPU seconds on logarithmic axes as a complete SVG document: a line per method, a
/// dot per trial, rivals dashed. Trials that failed have no dot.
std::string work_precision_plot(const Comparison& comparison, double target);

}  // namespace porthos::scene
