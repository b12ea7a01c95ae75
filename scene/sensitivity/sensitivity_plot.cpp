#include "scene/sensitivity/sensitivity_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

// Page and bars [px]. Bars go both ways from zero, numbers stand at their ends.
constexpr double width = 860, left = 250, right = 820, zero = (left + right) / 2, number_room = 76;
constexpr double top = 104, row = 22, bar = 14, head = 34, between = 26;
constexpr size_t most_panels = 6, most_bars = 8;
constexpr const char *up = colour::lines[0], *down = colour::lines[1];

struct Bar {
  std::string name;
  double size;
};

std::vector<Bar> bars_of(const EndSensitivity& s, const EndSlopes& q, bool start) {
  std::vector<Bar> bars;
  for (const size_t i : s.sorted(q, start))
    if (bars.size() < most_bars)
      bars.push_back({s.inputs[i].name, start ? q.slopes[i] : s.by_whole(q, i)});
  return bars;
}

void draw_bars(Svg& svg, double y, const std::vector<Bar>& bars) {
  double largest = 0;
  for (const Bar& b : bars) largest = std::max(largest, std::fabs(b.size));
  const double scale = largest > 0 ? ((right - left) / 2 - number_room) / largest : 0;
  svg.rule(zero, y - 6, zero, y + row * double(bars.size()) - 4, colour::guide, 1);
  for (const Bar& b : bars) {
    const double length = scale * std::fabs(b.size);
    const bool positive = b.size >= 0;
    svg.text(left - 12, y + 10, "end", 12, colour::ink, fit_text(b.name, 12, left - 30));
    svg.raw(fmt::format(
        R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" rx="1.5" fill="{}"/>)",
        positive ? zero : zero - length, y - 1, length, bar, positive ? up : down));
    svg.text(positive ? zero + length + 6 : zero - length - 6, y + 10, positive ? "start" : "end",
             11.5, colour::soft, number_text(b.size, false, 3));
    y += row;
  }
}

}  // namespace

std::string sensitivity_plot(const EndSensitivity& s) {
  const bool start = std::ranges::all_of(s.inputs, &Input::start);
  const size_t panels = std::min(most_panels, s.of.size());
  std::vector<std::vector<Bar>> bars;
  double height = top;
  for (size_t i = 0; i < panels; ++i) {
    bars.push_back(bars_of(s, s.of[i], start));
    height += head + row * double(bars[i].size()) + between;
  }
  Svg svg(width, height + 10);
  svg.text(40, 40, "start", 20, colour::ink, fit_text(s.title, 20, width - 80),
           R"( font-weight="600")");
  const std::string more =
      s.of.size() > panels ? fmt::format("; {} of {} quantities", panels, s.of.size()) : "";
  svg.text(40, 63, "start", 13, colour::soft,
           (start ? "slopes by start values"
                  : "change by the whole of a parameter: slope × value, 1 % of it changes 1 % of "
                    "the bar") +
               more);
  double y = top;
  for (size_t i = 0; i < panels; ++i) {
    const EndSlopes& q = s.of[i];
    svg.text(40, y, "start", 13, colour::ink,
             fmt::format("{} [{}] after {} s: {}{}", q.name, q.unit, number_text(s.duration),
                         number_text(q.value, false, 5),
                         s.runs > 0 ? "" : fmt::format(", growth {:.1f}", q.growth)),
             R"( font-weight="600")");
    draw_bars(svg, y + head - 10, bars[i]);
    y += head + row * double(bars[i].size()) + between;
  }
  return svg.finish();
}

}  // namespace porthos::scene
