#include "scene/plot/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "scene/plot/svg.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

constexpr int columns = 1500;

// Page and plot area [px].
constexpr double width = 960, height = 560, left = 84, right = 924, top = 124, bottom = 490;
using colour::alarm, colour::grid, colour::guide, colour::ink, colour::soft;
constexpr const char* band = "#7daed9";
constexpr const char* line = "#1d5c96";

struct Tick {
  double value;
  std::string text;
};

/// Maps values to px and writes SVG elements.
class Canvas {
 public:
  Canvas(const Envelope& e, const PlotLabels& labels) : e_(e), labels_(labels) { find_range(); }

  std::string draw() {
    head();
    vertical_axis();
    horizontal_axis();
    series();
    legend();
    return svg_.finish();
  }

 private:
  template <class... A>
  void put(fmt::format_string<A...> f, A&&... a) {
    svg_.raw(fmt::format(f, std::forward<A>(a)...));
  }

  /// Whole decades around the data, at most six below its maximum: a zero crossing should not
  /// extend the axis to 10⁻²⁵.
  void find_range() {
    double highest = 0, lowest = HUGE_VAL;
    for (const auto& p : e_.points()) {
      highest = std::max({highest, p.high, p.rms});
      for (const double v : {p.low, p.rms})
        if (v > 0) lowest = std::min(lowest, v);
    }
    if (!(highest > 0) || !std::isfinite(highest)) {  // nothing but zeros
      highest = 1e-16;
      lowest = 1e-18;
    }
    lowest = std::max(lowest, highest * 1e-5);
    if (labels_.limit && limit_fits(highest)) highest = std::max(highest, *labels_.limit);
    high_ = static_cast<int>(std::ceil(std::log10(highest) + 0.05));
    low_ = std::min(static_cast<int>(std::floor(std::log10(lowest))), high_ - 2);
  }
  /// A limit far above the errors would flatten them; the legend names it in any case.
  bool limit_fits(double highest) const {
    return *labels_.limit > 0 && *labels_.limit<1e6 * highest&& * labels_.limit> 1e-4 * highest;
  }

  double y(double v) const {
    const double decade = v > 0 ? std::log10(v) : double(low_);  // zero: the bottom edge
    return bottom - (bottom - top) * (std::clamp(decade, double(low_), double(high_)) - low_) /
                        (high_ - low_);
  }
  double x(double t) const {
    const double a = e_.first(), b = e_.last();
    const double f = e_.logarithmic() ? std::log(t / a) / std::log(b / a) : t / b;
    return left + (right - left) * std::clamp(f, 0.0, 1.0);
  }

  void head() {
    svg_.text(left, 40, "start", 20, ink, fit_text(labels_.title, 20, right - left),
              R"( font-weight="600")");
    svg_.text(left, 63, "start", 13, soft, fit_text(labels_.subtitle, 13, right - left));
  }

  void vertical_axis() {
    const int every = std::max(1, (high_ - low_ + 7) / 8);
    for (int d = low_; d <= high_; ++d) {
      const double at = y(std::pow(10.0, d));
      svg_.rule(left, at, right, at, grid, 1);
      if ((d - low_) % every == 0)
        svg_.text(left - 10, at + 4.5, "end", 12.5, soft, power_of_ten(d));
    }
    svg_.text_upwards(24, 0.5 * (top + bottom), 13, ink, "|relative energy error|");
  }

  void horizontal_axis() {
    std::string unit;
    const auto ticks = e_.logarithmic() ? landmarks() : even_ticks(unit);
    double free_from = -1e9;
    for (const Tick& t : ticks) {
      const double at = x(t.value), half = 0.5 * text_width(t.text, 12.5);
      svg_.rule(at, top, at, bottom, grid, 1);
      svg_.rule(at, bottom, at, bottom + 5, soft, 1);
      if (at - half < free_from) continue;
      svg_.text(at, bottom + 21, "middle", 12.5, soft, t.text);
      free_from = at + half + 8;
    }
    svg_.rule(left, bottom, right, bottom, soft, 1);
    svg_.text(0.5 * (left + right), bottom + 47, "middle", 13, ink,
              unit.empty() ? "simulated time" : "simulated time [" + unit + "]");
  }

  /// Round everyday times for a logarithmic axis.
  std::vector<Tick> landmarks() const {
    static const Tick all[] = {{1, "1 s"},      {10, "10 s"},     {60, "1 min"},
                               {600, "10 min"}, {3600, "1 h"},    {36000, "10 h"},
                               {86400, "1 d"},  {864000, "10 d"}, {8.64e6, "100 d"}};
    std::vector<Tick> ticks;
    for (int d = -12; d < 0; ++d) {
      const int prefix = (12 + d) / 3;  // ps, ns, µs, ms
      static const char* units[] = {"ps", "ns", "µs", "ms"};
      ticks.push_back(
          {std::pow(10.0, d), fmt::format("{:g} {}", std::pow(10.0, (12 + d) % 3), units[prefix])});
    }
    ticks.insert(ticks.end(), std::begin(all), std::end(all));
    constexpr double year = 365.25 * 86400;
    for (double years = 1; years < 1e12; years *= 10)
      ticks.push_back({years * year, fmt::format("{:g} y", years)});
    std::erase_if(ticks, [&](const Tick& t) {
      return t.value < e_.first() * 0.999 || t.value > e_.last() * 1.001;
    });
    return ticks;
  }

  /// In s, h or d.
  std::vector<Tick> even_ticks(std::string& unit) const {
    const double last = e_.last();
    const double second = last <= 7200 ? 1 : last <= 2 * 86400 ? 3600 : 86400;
    unit = second == 1 ? "s" : second == 3600 ? "h" : "d";
    const double step = round_step(last / second, 6);
    std::vector<Tick> ticks;
    for (int i = 0; i * step <= last / second * 1.0001; ++i)
      ticks.push_back({i * step * second, fmt::format("{:.6g}", i * step)});
    return ticks;
  }

  void series() {
    const auto& points = e_.points();
    put(R"(<clipPath id="area"><rect x="{}" y="{}" width="{}" height="{}"/></clipPath>)", left,
        top - 2, right - left, bottom - top + 4);
    put(R"svg(<g clip-path="url(#area)">)svg");
    std::string upper, lower, rms;
    const auto point = [&](std::string& path, double t, double v) {
      fmt::format_to(std::back_inserter(path), "{:.1f},{:.1f} ", x(t), y(v));
    };
    for (const auto& p : points) {
      point(upper, p.t, p.high);
      point(rms, p.t, p.rms);
    }
    for (auto p = points.rbegin(); p != points.rend(); ++p) point(lower, p->t, p->low);
    put(R"(<polygon points="{}{}" fill="{}" fill-opacity="0.45" stroke="{}" )"
        R"(stroke-width="0.8" stroke-linejoin="round"/>)",
        upper, lower, band, band);
    const double last = points.empty() ? 0 : points.back().rms;
    if (last > 0) square_root_guide(last);
    svg_.polyline(rms, line, 2);
    put("</g>");
    if (shows_limit()) {
      const double at = y(*labels_.limit);
      svg_.rule(left, at, right, at, alarm, 1.6,
                R"( stroke-dasharray="1.6 4" stroke-linecap="round")");
    }
  }

  /// c √t through the last rms, cut off where it leaves the plot.
  void square_root_guide(double last_rms) {
    std::string path;
    for (int i = 0; i <= 100; ++i) {
      const double f = i / 100.0;
      const double t =
          e_.logarithmic() ? e_.first() * std::pow(e_.last() / e_.first(), f) : e_.last() * f;
      const double v = last_rms * std::sqrt(t / e_.last());
      if (v >= std::pow(10.0, low_))
        fmt::format_to(std::back_inserter(path), "{:.1f},{:.1f} ", x(t), y(v));
    }
    svg_.polyline(path, guide, 1.5, R"( stroke-dasharray="7 5")");
  }

  bool shows_limit() const {
    if (!labels_.limit || !(*labels_.limit > 0)) return false;
    const double decade = std::log10(*labels_.limit);
    return decade >= low_ && decade <= high_;
  }

  /// A row between title and plot.
  void legend() {
    double at = left;
    constexpr double y0 = 98, size = 12.5;
    const auto label = [&](const std::string& t) {
      svg_.text(at + 34, y0, "start", size, ink, t);
      at += 34 + text_width(t, size) + 22;
    };
    put(R"(<rect x="{:.1f}" y="{:.1f}" width="26" height="10" fill="{}" fill-opacity="0.45" )"
        R"(stroke="{}" stroke-width="0.8"/>)",
        at, y0 - 9, band, band);
    label("|error|, smallest to largest");
    svg_.rule(at, y0 - 4, at + 26, y0 - 4, line, 2);
    label("rms so far");
    svg_.rule(at, y0 - 4, at + 26, y0 - 4, guide, 1.5, R"( stroke-dasharray="7 5")");
    label("∝ √t (random walk)");
    if (!labels_.limit || !(*labels_.limit > 0)) return;
    svg_.rule(at, y0 - 4, at + 26, y0 - 4, alarm, 1.6,
              R"( stroke-dasharray="1.6 4" stroke-linecap="round")");
    label("limit " + scientific(*labels_.limit) + (shows_limit() ? "" : ", off the plot"));
  }

  const Envelope& e_;
  const PlotLabels& labels_;
  int low_ = -18, high_ = -14;
  Svg svg_{width, height};
};

std::string seconds_text(double s) {
  return s < 60 ? fmt::format("{:.3g} s", s) : fmt::format("{:.0f} s", s);
}

/// 50000 -> "50 000", with narrow spaces.
std::string grouped(std::int64_t n) {
  const std::string digits = std::to_string(n);
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += " ";
    text += digits[i];
  }
  return text;
}

}  // namespace

Envelope::Envelope(double first, double last)
    : first_(first > 0 ? first : 1),
      last_(last > 0 ? last : first_),
      logarithmic_(last_ > 100 * first_) {}

void Envelope::add(double t, double error) {
  const double v = std::fabs(error);
  if (!std::isfinite(t) || !std::isfinite(v)) return;
  sum_of_squares_ += v * v;
  ++count_;
  if (logarithmic_ && t < first_) return;
  const double f = logarithmic_ ? std::log(t / first_) / std::log(last_ / first_) : t / last_;
  const int column = std::clamp(static_cast<int>(f * columns), 0, columns - 1);
  if (column != column_) points_.push_back({t, v, v, 0});
  column_ = column;
  EnvelopePoint& p = points_.back();
  p.low = std::min(p.low, v);
  p.high = std::max(p.high, v);
  p.rms = std::sqrt(sum_of_squares_ / count_);
}

std::string energy_plot(const Envelope& envelope, const PlotLabels& labels) {
  return Canvas(envelope, labels).draw();
}

std::string plot_subtitle(const RunReport& r) {
  const bool fixed = r.step_control == integrators::StepControl::fixed;
  return fmt::format("{}  ·  {}step {:g} s  ·  {} steps  ·  {} CPU  ·  verdict: {}", r.method,
                     fixed ? "" : fmt::format("{} ", to_string(r.step_control)), r.step_s,
                     grouped(r.steps), seconds_text(r.cpu_s), to_string(r.verdict()));
}

}  // namespace porthos::scene
