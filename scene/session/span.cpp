#include "scene/session/detail/span.h"

#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "scene/plot/shown.h"

namespace porthos::scene {
namespace {

/// What of a line lies in a span, at no more than `most` times.
TraceLine cut_line(const TraceLine& l, bool stacked, const TimeSpan& span, std::int64_t most) {
  TraceLine part{l.name, {}, {}, l.stroke};
  std::vector<size_t> inside;
  for (size_t i = 0; i < l.t.size(); ++i)
    if (l.t[i] >= span.from && l.t[i] <= span.to) inside.push_back(i);
  const auto shown = stacked || !l.low.empty() ? Shown::records(inside.size(), most)
                                               : Shown::bands(inside.size(), most);
  const auto of = [&](const std::vector<double>& all) {
    std::vector<double> read;
    if (!all.empty())
      for (const auto k : shown.rows()) read.push_back(all[inside[size_t(k)]]);
    return read;
  };
  part.t = shown.times(of(l.t));
  part.value = shown.values(of(l.value));
  part.low = of(l.low);
  if (l.stroke != Stroke::limit || l.t.empty()) return part;
  part.t = {std::max(l.t.front(), span.from), std::min(l.t.back(), span.to)};
  part.value = l.value;
  return part;
}

}  // namespace

void refuse_fewer_than_two(const InSpan& f, const TimeSpan& span) {
  if (f.most < 2)
    throw InvalidArgument(fmt::format(
        "from {:g} to {:g} s there are {} records, expected two or more of {:g} to {:g} s",
        span.from, span.to, f.most, f.first, f.last));
}

std::vector<TracePanel> cut(std::vector<TracePanel> panels, const TimeSpan& span, std::int64_t each,
                            InSpan& found) {
  if (span.whole()) {
    found.most = 2;
    return panels;
  }
  std::erase_if(panels, [&](TracePanel& p) {
    std::int64_t most = 0;
    for (TraceLine& l : p.lines) {
      const bool limit = l.stroke == Stroke::limit;
      if (!limit && !l.t.empty())
        found = {std::min(found.first, l.t.front()), std::max(found.last, l.t.back()), found.most};
      l = cut_line(l, p.stacked, span, each);
      if (!limit)
        most =
            std::max(most, std::ranges::count_if(l.value, [](auto x) { return std::isfinite(x); }));
    }
    found.most = std::max(found.most, most);
    return most == 0;
  });
  return panels;
}

}  // namespace porthos::scene
