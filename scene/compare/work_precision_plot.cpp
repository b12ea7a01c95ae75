#include "scene/compare/work_precision_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

using colour::alarm, colour::grid, colour::ink, colour::soft;

// Page and plot area [px]; the legend stands right of it.
constexpr double width = 1080, left = 84, right = 862, top = 92, least_height = 620;
constexpr double legend_x = 892, legend_row = 18, below = 70;
constexpr double least_error = 1e-17;  // zeros and better are drawn here
constexpr double label_size = 11.5;

struct Rgb {
  double r, g, b;
};

/// From the deep to the light end of a family.
struct Hue {
  Rgb deep, middle, light;
};
constexpr Hue hues[] = {{{10, 28, 92}, {38, 102, 207}, {88, 190, 238}},    // blue
                        {{0, 78, 56}, {20, 145, 95}, {125, 205, 130}},     // green
                        {{72, 20, 120}, {140, 80, 200}, {205, 150, 230}},  // violet
                        {{130, 62, 0}, {210, 130, 10}, {236, 190, 80}},    // ochre
                        {{0, 75, 90}, {0, 140, 150}, {110, 205, 200}},     // teal
                        {{85, 45, 30}, {150, 95, 70}, {205, 160, 140}},    // brown
                        {{70, 80, 10}, {130, 145, 40}, {185, 195, 100}},   // olive
                        {{45, 50, 70}, {95, 100, 130}, {160, 165, 190}}};  // slate
constexpr Hue rival_hue = {{150, 10, 50}, {220, 50, 70}, {245, 140, 120}};

/// f from 0, deep, to 1, light.
std::string mixed(const Hue& h, double f) {
  const auto mix = [f](double deep, double middle, double light) {
    return int(std::lround(f < 0.5 ? deep + 2 * f * (middle - deep)
                                   : middle + (2 * f - 1) * (light - middle)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(h.deep.r, h.middle.r, h.light.r),
                     mix(h.deep.g, h.middle.g, h.light.g), mix(h.deep.b, h.middle.b, h.light.b));
}

struct Dot {
  double x, y;
};

struct Line {
  const MethodTrials* of;
  std::string colour;
  size_t shape;  ///< of its dots: neighbours in a family differ
  std::vector<Dot> dots;
};

struct Box {
  double x1, y1, x2, y2;
  bool meets(const Box& o) const { return x1 < o.x2 && o.x1 < x2 && y1 < o.y2 && o.y1 < y2; }
  Box wider(double by) const { return {x1 - by, y1 - by, x2 + by, y2 + by}; }
  bool holds(const Dot& d) const { return d.x > x1 && d.x < x2 && d.y > y1 && d.y < y2; }
  /// Whether the line from p to q passes it (Liang, Barsky 1984).
  bool meets(const Dot& p, const Dot& q) const {
    double from = 0, to = 1;
    const auto cut = [&](double at, double along, double low, double high) {
      if (along == 0) return at > low && at < high;
      const double f = (low - at) / along, g = (high - at) / along;
      from = std::max(from, std::min(f, g));
      to = std::min(to, std::max(f, g));
      return from < to;
    };
    return cut(p.x, q.x - p.x, x1, x2) && cut(p.y, q.y - p.y, y1, y2);
  }
};

/// Whether the lines p q and r s cross.
bool cross(const Dot& p, const Dot& q, const Dot& r, const Dot& s) {
  const auto side = [](const Dot& a, const Dot& b, const Dot& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0;
  };
  return side(p, q, r) != side(p, q, s) && side(r, s, p) != side(r, s, q);
}

/// "2.3e4 s" of simulated time as people write it.
std::string seconds(double s) { return fmt::format("{:g} s", s); }

class Plot {
 public:
  Plot(const Comparison& c, double target) : c_(c), target_(target) {
    sort_families();
    size_t rows = 0;
    for (const auto& [family, methods] : families_) rows += methods.size() + 1;
    bottom_ = std::max(least_height - below, top + legend_row * double(rows));
    find_range();
    make_lines();
  }

  std::string draw() {
    Svg svg(width, bottom_ + below);
    svg_ = &svg;
    head();
    axes();
    for (const Line& l : lines_) draw_line(l);
    for (const Line& l : lines_) label(l);
    legend();
    return svg.finish();
  }

 private:
  /// Families in the order of the catalogue, rivals last.
  void sort_families() {
    for (const bool rivals : {false, true})
      for (const auto& m : c_.methods) {
        if (m.method.rival != rivals) continue;
        const std::string name = rivals ? "Reference solvers" : m.method.family;
        auto f = std::find_if(families_.begin(), families_.end(),
                              [&](const auto& known) { return known.first == name; });
        if (f == families_.end()) f = families_.insert(f, {name, {}});
        f->second.push_back(&m);
      }
  }

  bool shown(const Trial& t) const {
    const double e = c_.error_of(t);
    return std::isfinite(e) && e < 10 && t.report.cpu_s > 0;
  }

  void find_range() {
    double fast = HUGE_VAL, slow = 0, low = HUGE_VAL, high = 0;
    for (const auto& m : c_.methods)
      for (const Trial& t : m.trials) {
        if (!shown(t)) continue;
        const double e = std::max(c_.error_of(t), least_error);
        fast = std::min(fast, t.report.cpu_s);
        slow = std::max(slow, t.report.cpu_s);
        low = std::min(low, e);
        high = std::max(high, e);
      }
    if (!(slow > 0)) {  // nothing came to an end
      fast = 0.01;
      slow = 1;
      low = 1e-16;
      high = 1;
    }
    if (target_ > 1e-3 * low && target_ < 1e3 * high) {
      low = std::min(low, target_);
      high = std::max(high, target_);
    }
    const auto decade = [](double x) { return std::log10(x); };
    x1_ = decade(fast) - 0.12;
    x2_ = std::max(decade(slow) + 0.12, x1_ + 0.5);
    y1_ = std::floor(decade(low) - 0.15);
    y2_ = std::max(std::ceil(decade(high) + 0.15), y1_ + 2);
  }

  double x(double seconds) const {
    return left + (right - left) * (std::log10(seconds) - x1_) / (x2_ - x1_);
  }
  double y(double error) const {
    const double d = std::log10(std::max(error, least_error));
    return bottom_ - (bottom_ - top) * (d - y1_) / (y2_ - y1_);
  }

  void make_lines() {
    size_t next_hue = 0;
    for (const auto& [family, methods] : families_) {
      const bool rivals = methods.front()->method.rival;
      const Hue hue = rivals ? rival_hue : hues[next_hue++ % std::size(hues)];
      for (size_t i = 0; i < methods.size(); ++i) {
        const double f = methods.size() > 1 ? double(i) / double(methods.size() - 1) : 0.4;
        Line l{methods[i], mixed(hue, f), i, {}};
        for (const Trial& t : methods[i]->trials)
          if (shown(t)) l.dots.push_back({x(t.report.cpu_s), y(c_.error_of(t))});
        lines_.push_back(std::move(l));
      }
    }
  }

  void head() {
    svg_->text(left, 40, "start", 20, ink, fit_text(c_.title, 20, right - left),
               R"( font-weight="600")");
    std::string what = fmt::format("a dot is a run of {}, a line a method from coarse to fine",
                                   seconds(c_.duration_s));
    if (c_.interrupted) what += "; interrupted";
    svg_->text(left, 63, "start", 13, soft, fit_text(what, 13, right - left));
  }

  void axes() {
    const int every = std::max(1, int(y2_ - y1_ + 9) / 10);
    for (int d = int(y1_); d <= int(y2_); ++d) {
      const double at = y(std::pow(10.0, d));
      svg_->rule(left, at, right, at, grid, 1);
      if ((int(y2_) - d) % every == 0)
        svg_->text(left - 10, at + 4.5, "end", 12.5, soft, power_of_ten(d));
    }
    const std::string error =
        c_.by_energy ? "largest relative energy error over the run"
                     : fmt::format("error of the trajectory at {}", seconds(c_.trajectory_time_s));
    svg_->text_upwards(24, 0.5 * (top + bottom_), 13, ink, error);
    time_axis();
    svg_->rule(left, bottom_, right, bottom_, soft, 1);
    svg_->text(0.5 * (left + right), bottom_ + 47, "middle", 13, ink, "CPU time of one core");
    if (std::log10(target_) < y1_ || std::log10(target_) > y2_) return;
    const double at = y(target_);
    svg_->rule(left, at, right, at, alarm, 1.6,
               R"( stroke-dasharray="1.6 4" stroke-linecap="round")");
    const std::string text = "target " + scientific(target_);
    svg_->text(right - 6, at - 6, "end", 12, alarm, text);
    taken_.push_back({right - 8 - text_width(text, 12), at - 18, right, at + 2});
  }

  void time_axis() {
    for (int d = int(std::floor(x1_)); d <= int(std::ceil(x2_)); ++d)
      for (const int m : {1, 2, 5}) {
        const double t = m * std::pow(10.0, d);
        if (std::log10(t) < x1_ || std::log10(t) > x2_) continue;
        const double at = x(t);
        svg_->rule(at, top, at, bottom_, grid, m == 1 ? 1.4 : 0.7);
        svg_->rule(at, bottom_, at, bottom_ + 5, soft, 1);
        if (m == 1 || x2_ - x1_ < 3.2)
          svg_->text(at, bottom_ + 21, "middle", 12.5, soft, time_text(t));
      }
  }
  static std::string time_text(double s) {
    if (s < 0.9e-3) return fmt::format("{:g} µs", std::round(s * 1e7) / 10);
    if (s < 0.9) return fmt::format("{:g} ms", std::round(s * 1e4) / 10);
    return fmt::format("{:g} s", std::round(s * 10) / 10);
  }

  void draw_line(const Line& l) {
    std::string path;
    for (const Dot& d : l.dots) path += fmt::format("{:.1f},{:.1f} ", d.x, d.y);
    const bool rival = l.of->method.rival;
    if (l.dots.size() > 1)
      svg_->polyline(path, l.colour, rival ? 2.2 : 1.9, rival ? R"( stroke-dasharray="7 4")" : "");
    for (const Dot& d : l.dots) mark(l, d);
  }

  void mark(const Line& l, const Dot& d) {
    const bool rival = l.of->method.rival;
    svg_->marker(l.shape, d.x, d.y, rival ? 3.6 : 3.2, rival ? "#ffffff" : l.colour, l.colour);
  }

  /// Writes the name beside a dot of the line where it is on no line, dot or other name; where that
  /// is only farther away, with a thin line from the dot. Else the legend alone names it.
  void label(const Line& l) {
    const std::string name = l.of->label();
    const double w = 1.08 * text_width(name, label_size);
    for (const double far : {0.0, 14.0, 30.0, 48.0})
      for (size_t i = 0; i < l.dots.size(); ++i)
        for (const double towards : {0.0, 0.5, 1.0, 0.75, 0.25, 0.875, 0.625, 0.375, 0.125}) {
          // From both ends inwards; right of the dot first, then around it.
          const Dot& d = l.dots[i % 2 ? l.dots.size() - 1 - i / 2 : i / 2];
          const double c = std::cos(2 * M_PI * towards), s = std::sin(2 * M_PI * towards);
          const Dot at{d.x + (9 + far) * c + 0.5 * w * (c - 1), d.y + (13 + far) * s + 4};
          const Box box{at.x - 2, at.y - 10, at.x + w + 2, at.y + 3};
          const Dot end{std::clamp(d.x, box.x1, box.x2), std::clamp(d.y, box.y1, box.y2)};
          if (!free(box) || (far > 0 && !is_clear(l, d, end))) continue;
          taken_.push_back(box);
          if (far > 0) svg_->rule(d.x, d.y, end.x, end.y, l.colour, 0.7);
          svg_->text(
              at.x, at.y, "start", label_size, l.colour, name,
              R"( font-weight="600" stroke="#ffffff" stroke-width="3" paint-order="stroke")");
          return;
        }
  }
  bool free(const Box& b) const {
    constexpr double of_dot = 4;
    if (b.x1 < left || b.x2 > right || b.y1 < top - 8 || b.y2 > bottom_) return false;
    if (const double at = y(target_); at > b.y1 && at < b.y2) return false;
    for (const Box& t : taken_)
      if (b.meets(t)) return false;
    for (const Line& l : lines_)
      for (size_t i = 0; i < l.dots.size(); ++i) {
        if (b.wider(of_dot).holds(l.dots[i])) return false;
        if (i > 0 && b.wider(1).meets(l.dots[i - 1], l.dots[i])) return false;
      }
    return true;
  }
  /// Whether the line from a dot to its name passes no other line or name.
  bool is_clear(const Line& own, const Dot& from, const Dot& to) const {
    for (const Box& t : taken_)
      if (t.meets(from, to)) return false;
    for (const Line& l : lines_)
      for (size_t i = 1; &l != &own && i < l.dots.size(); ++i)
        if (cross(from, to, l.dots[i - 1], l.dots[i])) return false;
    return true;
  }

  void legend() {
    double at = top + 6;
    size_t line = 0;
    for (const auto& [family, methods] : families_) {
      svg_->text(legend_x, at, "start", 12, soft, fit_text(family, 12, width - legend_x - 8),
                 R"( font-weight="600")");
      at += legend_row;
      for (size_t i = 0; i < methods.size(); ++i, ++line) {
        const Line& l = lines_[line];
        const bool rival = l.of->method.rival;
        svg_->rule(legend_x, at - 4, legend_x + 26, at - 4, l.colour, rival ? 2.2 : 1.9,
                   rival ? R"( stroke-dasharray="7 4")" : "");
        mark(l, {legend_x + 13, at - 4});
        const bool none = l.dots.empty();
        svg_->text(legend_x + 34, at, "start", 12, none ? soft : ink,
                   fit_text(l.of->label() + (none ? " (none)" : ""), 12, width - legend_x - 38));
        at += legend_row;
      }
      at += 4;
    }
  }

  const Comparison& c_;
  const double target_;
  std::vector<std::pair<std::string, std::vector<const MethodTrials*>>> families_;
  std::vector<Line> lines_;  ///< in the order of the legend
  std::vector<Box> taken_;   ///< by texts
  double bottom_ = 0, x1_ = 0, x2_ = 0, y1_ = 0, y2_ = 0;
  Svg* svg_ = nullptr;
};

}  // namespace

std::string work_precision_plot(const Comparison& c, double target) {
  return Plot(c, target).draw();
}

}  // namespace porthos::scene
