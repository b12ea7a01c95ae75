#pragma once
#include <string>
#include <vector>

namespace porthos::scene {

/// A mark of an axis of time and its text.
struct TimeTick {
  double t;  ///< [s]
  std::string text;
};

/// A time axis up to `last` [s] in s, h or d.
struct TimeAxis {
  std::vector<TimeTick> ticks;
  std::string unit;  ///< "" where every tick has its own
};
/// From `first` to `last`, in about `parts` parts.
TimeAxis even_times(double first, double last, int parts);
/// Logarithmic: everyday times from `first` to `last`.
TimeAxis everyday_times(double first, double last);

}  // namespace porthos::scene
