#include "scene/plot/drawn_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

using colour::soft;

/// In widths of a line, for readers without colours.
constexpr std::array<const char*, most_lines> dashes_of_lines{
    "", "4 2", "1.2 1.8", "7 2 1.2 2", "2.5 1.5", "9 3", "7 2 1.2 2 1.2 2", "1.2 3.5"};

bool is_idle(const TraceLine& l) {
  return l.stroke == Stroke::line && std::ranges::all_of(l.value, [](double v) { return v == 0; });
}

bool in_half_turns(const TraceLine& l) {
  return std::ranges::none_of(l.value,
                              [](double v) { return std::fabs(v) > std::numbers::pi + 1e-9; });
}

/// Of dashes that turn back within three widths of the line, those beside each other make patterns
/// that look like a beat.
bool covers_area(const TraceLine& l, const Look& look) {
  const size_t count = turns_back(l.value);
  return count > l.value.size() / 8 && double(count) * 3 * look.stroke > look.right - look.left;
}

void give_style(Drawn& d, size_t next) {
  switch (d.line->stroke) {
    case Stroke::band:
      d.colour = colour::lines[7];
      break;
    case Stroke::guide:
      d.colour = colour::guide;
      d.dash = dashed("4 3", d.width *= 0.8);
      break;
    case Stroke::limit:
      d.colour = colour::alarm;
      d.dash = dashed("1 2.4", d.width);
      break;
    default:
      d.colour = colour::lines.at(next % most_lines);
      // the ninth line has the colour of the first and another dash
      d.dash = dashed(dashes_of_lines.at((next + next / most_lines) % most_lines), d.width);
  }
}

void put_on_top(Drawn& d, std::vector<double>& top) {
  const auto& v = d.line->value;
  top.resize(v.size(), 0.0);
  const double least = v.empty() ? 0 : std::min(0.0, *std::ranges::min_element(v));
  d.from = top;
  for (size_t i = 0; i < v.size(); ++i) top[i] += v[i] - least;
  d.to = top;
  d.dash = "";
  if (least < 0) d.name += " (above its least)";
}

}  // namespace

bool is_held(const std::vector<double>& v) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const double x : v)
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  // A torque is a difference of two forces: it has their rounding.
  const auto same = [&](size_t i) { return std::fabs(v[i] - v[i - 1]) <= 1e-9 * (high - low); };
  size_t changes = 0, alone = 0;
  for (size_t i = 1; i < v.size(); ++i) {
    if (!std::isfinite(v[i]) || !std::isfinite(v[i - 1]) || same(i)) continue;
    ++changes;
    alone += (i == 1 || same(i - 1)) && (i + 1 == v.size() || same(i + 1));
  }
  return changes > 1 && 10 * alone >= 9 * changes;
}

size_t turns_back(const std::vector<double>& v) {
  size_t count = 0;
  for (size_t i = 2; i < v.size(); ++i) count += (v[i] - v[i - 1]) * (v[i - 1] - v[i - 2]) < 0;
  return count;
}

std::vector<Drawn> drawn_of(const TracePanel& p, const Look& look) {
  std::vector<Drawn> all;
  const auto idles = size_t(std::ranges::count_if(p.lines, is_idle));
  const bool folded = idles > 1 && p.lines.size() > 4;
  std::vector<double> top;
  size_t next = 0;
  for (const TraceLine& l : p.lines) {
    if (folded && is_idle(l)) continue;
    Drawn d{&l, l.name, "", "", look.stroke};
    give_style(d, next);
    if (l.stroke == Stroke::line && covers_area(l, look)) d.dash = "";
    d.wraps = p.what.ends_with("[rad]") && in_half_turns(l);
    d.held = l.stroke == Stroke::line && is_held(l.value);
    next += l.stroke == Stroke::line;
    if (p.stacked) put_on_top(d, top);
    all.push_back(std::move(d));
  }
  static const TraceLine nothing{};
  if (folded) {
    const bool others = idles < p.lines.size();
    all.push_back({&nothing, fmt::format("{} {}: 0", idles, others ? "others" : "lines"), soft, "",
                   look.rule});
  }
  if (!p.others.empty()) all.push_back({&nothing, p.others, soft, "", look.rule});
  return all;
}

}  // namespace porthos::scene
