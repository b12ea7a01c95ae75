#include "scene/plot/trace_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

using colour::grid, colour::ink, colour::soft;

constexpr double width = 1000, left = 96, right = 770, legend_x = 790, legend_row = 19;
constexpr double first_top = 92, height = 170, gap = 40, below = 62;
constexpr const char* palette[] = {"#1d5c96", "#c8472f", "#2f8f5b", "#b8741a",
                                   "#8a5fb0", "#2a8c99", "#7a5a48", "#6fa8dc"};

class TracePlot {
 public:
  explicit TracePlot(const std::vector<TracePanel>& panels)
      : panels_(panels),
        svg_(width, first_top + double(panels.size()) * (height + gap) - gap + below) {
    for (const auto& p : panels)
      for (const auto& l : p.lines)
        if (!l.t.empty()) last_ = std::max(last_, l.t.back());
  }
  std::string draw(const std::string& title, const std::string& subtitle) {
    svg_.text(left, 38, "start", 19, ink, fit_text(title, 19, width - left - 20),
              R"( font-weight="600")");
    svg_.text(left, 61, "start", 13, soft, fit_text(subtitle, 13, width - left - 20));
    top_ = first_top;
    for (const auto& p : panels_) {
      panel(p);
      top_ += height + gap;
    }
    time_axis(top_ - gap);
    return svg_.finish();
  }

 private:
  double scaled(const TracePanel& p, double v) const { return p.logarithmic ? std::log10(v) : v; }
  double x(double t) const { return left + (right - left) * (last_ > 0 ? t / last_ : 0); }
  double y(double v) const { return top_ + height * (high_ - v) / (high_ - low_); }

  void panel(const TracePanel& p) {
    low_ = HUGE_VAL;
    high_ = -HUGE_VAL;
    for (const auto& l : p.lines)
      for (const double v : l.value)
        if (const double s = scaled(p, v); std::isfinite(s)) {
          low_ = std::min(low_, s);
          high_ = std::max(high_, s);
        }
    if (!(high_ >= low_)) {
      low_ = 0;
      high_ = 1;
    }
    if (p.logarithmic) {
      low_ = std::max(std::floor(low_), std::ceil(high_) - 16);
      high_ = std::ceil(high_);
      if (high_ <= low_) high_ = low_ + 1;
    } else {
      // What differs by rounding alone is drawn as constant: no tick is that fine.
      const double size = std::max(std::fabs(low_), std::fabs(high_));
      const double room =
          high_ - low_ > 1e-9 * size ? 0.05 * (high_ - low_) : std::max(1e-12, size);
      low_ -= room;
      high_ += room;
    }
    const double step =
        p.logarithmic ? std::max(1.0, std::ceil((high_ - low_) / 5)) : round_step(high_ - low_, 4);
    for (double v = std::ceil(low_ / step) * step; v <= high_ + 1e-9 * step; v += step) {
      const bool zero = !p.logarithmic && std::fabs(v) < 1e-9 * step;
      svg_.rule(left, y(v), right, y(v), grid, zero ? 1.8 : 1);
      svg_.text(left - 10, y(v) + 4.5, "end", 12.5, soft,
                p.logarithmic ? power_of_ten(int(std::lround(v)))
                : zero        ? "0"
                              : fmt::format("{:.6g}", v));
    }
    svg_.text_upwards(22, top_ + 0.5 * height, 13, ink, p.what);
    for (size_t i = 0; i < p.lines.size(); ++i) line(p, p.lines[i], i);
  }
  void line(const TracePanel& p, const TraceLine& l, size_t i) {
    const char* c = palette[i % std::size(palette)];
    const char* dash = i % 2 ? R"( stroke-dasharray="7 4")" : "";  // shows both of two equal lines
    std::string points;
    const size_t every = std::max<size_t>(1, l.t.size() / 1500);
    const auto flush = [&] {
      if (!points.empty()) svg_.polyline(points, c, 1.8, dash);
      points.clear();
    };
    for (size_t k = 0; k < std::min(l.t.size(), l.value.size()); k += every) {
      const double s = scaled(p, l.value[k]);
      if (!std::isfinite(s) || s < low_)
        flush();
      else
        fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", x(l.t[k]), y(s));
    }
    flush();
    const double at = top_ + 14 + legend_row * double(i);
    svg_.rule(legend_x, at - 4, legend_x + 24, at - 4, c, 3, dash);
    svg_.text(legend_x + 32, at, "start", 12, ink, fit_text(l.name, 12, width - legend_x - 36));
  }
  void time_axis(double bottom) {
    const double step = round_step(std::max(last_, 1e-300), 7);
    for (int i = 0; last_ > 0 && i * step <= last_ * 1.0001; ++i) {
      svg_.rule(x(i * step), bottom, x(i * step), bottom + 5, soft, 1);
      svg_.text(x(i * step), bottom + 21, "middle", 12.5, soft, fmt::format("{:.6g}", i * step));
    }
    svg_.rule(left, bottom, right, bottom, soft, 1);
    svg_.text(0.5 * (left + right), bottom + 45, "middle", 13, ink, "time [s]");
  }

  const std::vector<TracePanel>& panels_;
  Svg svg_;
  double last_ = 0, top_ = 0, low_ = 0, high_ = 1;
};

}  // namespace

std::string trace_plot(const std::vector<TracePanel>& panels, const std::string& title,
                       const std::string& subtitle) {
  return TracePlot(panels).draw(title, subtitle);
}

TraceLine column(const std::string& name, const std::vector<double>& t,
                 const std::vector<std::vector<double>>& rows, std::size_t entry) {
  TraceLine l{name, t, {}};
  for (const auto& row : rows) l.value.push_back(row.at(entry));
  return l;
}

}  // namespace porthos::scene
