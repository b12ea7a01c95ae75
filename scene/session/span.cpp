#include "scene/session/detail/span.h"

#include <fmt/format.h>

#include <algorithm>

#include "phs/error.h"
#include "scene/plot/motion.h"

namespace porthos::scene {
namespace {

/// What of a line lies in a span, at no more than `most` records.
TraceLine cut_line(const TraceLine& l, const TimeSpan& span, std::int64_t most) {
  TraceLine part{l.name, {}, {}, l.stroke};
  std::vector<size_t> inside;
  for (size_t i = 0; i < l.t.size(); ++i)
    if (l.t[i] >= span.from && l.t[i] <= span.to) inside.push_back(i);
  for (const auto k : thinned(std::int64_t(inside.size()), most)) {
    const size_t i = inside[size_t(k)];
    part.t.push_back(l.t[i]);
    part.value.push_back(l.value[i]);
    if (!l.low.empty()) part.low.push_back(l.low[i]);
  }
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
      l = cut_line(l, span, each);
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
