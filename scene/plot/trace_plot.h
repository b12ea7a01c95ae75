#pragma once
#include <string>
#include <vector>

namespace porthos::scene {

/// Lines of a panel that are told apart: as many as there are colours.
inline constexpr std::size_t most_lines = 8;

/// How a line is drawn: a line by a colour of its own, the others as what they are.
enum class Stroke { line, band, guide, limit };

/// A line of a panel, over times of its own.
struct TraceLine {
  std::string name;
  std::vector<double> t = {}, value = {};  ///< not finite: left out
  Stroke stroke = Stroke::line;
  std::vector<double> low = {};  ///< of a band: its lower edge
};

/// An instant that is marked by a thin upright line.
struct TimeMark {
  double t;  ///< [s]
  std::string name;
};

/// A panel with an axis of its own.
struct TracePanel {
  std::string what;  ///< "angle [rad]"
  std::vector<TraceLine> lines;
  bool logarithmic = false;  ///< by powers of ten; values <= 0 are left out
  bool log_time = false;     ///< the panels of a picture share the first one's axis of time
  bool stacked = false;      ///< areas upon each other, each from 0, or its least value below that
  std::string others = {};   ///< last in the legend: which lines are elsewhere
  /// Of the records behind which others are missing [s], in order: lines break there.
  std::vector<double> holes = {};
  std::vector<TimeMark> marks = {};  ///< in order
};

/// Whether a series is held between instants, as what a sampled controller tells: it changes twice
/// or more, and nine of ten changes stand between equal values. Drawn as stairs.
bool is_held(const std::vector<double>& values);

/// Panels below each other over one time axis, as a complete SVG document for a screen. Of many
/// lines those that are 0 all the time are counted ("7 others: 0"). An angle in rad that never
/// leaves [-π, π] has a gap where it jumps by more than π, any line where a value is not finite and
/// where records are missing.
std::string trace_plot(const std::vector<TracePanel>& panels, const std::string& title,
                       const std::string& subtitle);

/// The same for print, without a title: one column of 85 mm, of more than six panels two of them,
/// 60 mm a panel, more below a legend of many names, texts of 8 pt, lines that differ by their
/// dashes.
std::string figure(const std::vector<TracePanel>& panels);

/// A line over times: value(i) is that of record i.
template <class F>
TraceLine line_of(const std::string& name, const std::vector<double>& t, const F& value) {
  TraceLine l{name, t, {}};
  for (std::size_t i = 0; i < t.size(); ++i) l.value.push_back(value(i));
  return l;
}
/// A line from one entry of every vector of `rows`.
TraceLine column(const std::string& name, const std::vector<double>& t,
                 const std::vector<std::vector<double>>& rows, std::size_t entry);

}  // namespace porthos::scene
