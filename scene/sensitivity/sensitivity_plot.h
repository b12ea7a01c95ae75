#pragma once
#include <string>

#include "scene/sensitivity/sensitivity.h"

namespace porthos::scene {

/// Bars as SVG: for each quantity, up to six of them, its largest changes by the whole of a
/// parameter (slope × value); without parameters, its largest slopes by start values.
std::string sensitivity_plot(const EndSensitivity& s);

}  // namespace porthos::scene
