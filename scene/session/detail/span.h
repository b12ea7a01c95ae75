#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "scene/plot/trace_plot.h"
#include "scene/session/replot.h"

/// Cuts panels to a span of a run.
namespace porthos::scene {

/// What a cut found: the first and last time of all records, and the largest number of finite
/// records that one line has in the span.
struct InSpan {
  double first = HUGE_VAL, last = -HUGE_VAL;  ///< [s]
  std::int64_t most = 0;
};
/// @throws InvalidArgument naming the span and what there is
void refuse_fewer_than_two(const InSpan& f, const TimeSpan& span);

/// Panels in a span, of lines of at most `each` records, without those that have nothing there.
/// Adds to `found`.
std::vector<TracePanel> cut(std::vector<TracePanel> panels, const TimeSpan& span, std::int64_t each,
                            InSpan& found);

}  // namespace porthos::scene
