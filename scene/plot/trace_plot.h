#pragma once
#include <string>
#include <vector>

namespace porthos::scene {

/// A line of a panel, over times of its own.
struct TraceLine {
  std::string name;
  std::vector<double> t = {}, value = {};  ///< not finite: left out
};

/// A panel with an axis of its own.
struct TracePanel {
  std::string what;  ///< "angle [rad]"
  std::vector<TraceLine> lines;
  bool logarithmic = false;  ///< by powers of ten; values <= 0 are left out
};

/// Panels below each other over one time axis in seconds, as a complete SVG document.
std::string trace_plot(const std::vector<TracePanel>& panels, const std::string& title,
                       const std::string& subtitle);

/// A line from one entry of every vector of `rows`.
TraceLine column(const std::string& name, const std::vector<double>& t,
                 const std::vector<std::vector<double>>& rows, std::size_t entry);

}  // namespace porthos::scene
