#pragma once
#include <string>
#include <vector>

#include "scene/plot/look.h"
#include "scene/plot/trace_plot.h"

namespace porthos::scene {

/// A line as it is drawn.
struct Drawn {
  const TraceLine* line;
  std::string name, colour, dash;
  double width;
  bool wraps = false;                      ///< an angle that jumps from π to -π
  bool held = false;                       ///< is_held()
  std::vector<double> from = {}, to = {};  ///< of a stacked area
};

/// How often a series turns back.
std::size_t turns_back(const std::vector<double>& values);

/// What of a panel is drawn, and how; what is 0 all the time comes last, in one row. The lines
/// refer to the panel.
std::vector<Drawn> drawn_of(const TracePanel& panel, const Look& look);

}  // namespace porthos::scene
