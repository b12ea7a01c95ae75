#include "scene/plot/trace_plot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <tuple>

#include "scene/plot/drawn_lines.h"
#include "scene/plot/svg.h"
#include "scene/plot/time_axis.h"

namespace porthos::scene {
namespace {

using colour::grid, colour::ink, colour::soft;

constexpr size_t most_in_column = 6;
constexpr double gap_in_legend = 4;  ///< right of an entry

class TracePlot {
 public:
  TracePlot(const std::vector<TracePanel>& panels, const Look& look)
      : panels_(panels), look_(look), log_time_(!panels.empty() && panels[0].log_time) {
    first_ = HUGE_VAL;
    for (const auto& p : panels) {
      drawn_.push_back(drawn_of(p, look));
      for (const auto& l : p.lines)
        for (const double t : l.t)
          if (std::isfinite(t)) {
            last_ = std::max(last_, t);
            if (t > 0 || !log_time_) first_ = std::min(first_, t);
          }
    }
    log_time_ = log_time_ && first_ < last_;
    if (!log_time_ && !(first_ > 0.1 * last_ && first_ < last_)) first_ = 0;
    place_panels();
  }
  std::string draw(const std::string& title, const std::string& subtitle) {
    const bool two = rows_ < panels_.size();
    Svg& svg = svg_.emplace((two ? 2 : 1) * look_.width, height_, look_.unit);
    if (look_.head > 0) {
      const double room = look_.width - look_.left - 20;
      svg.text(look_.left, 38, "start", 19, ink, fit_text(title, 19, room),
               R"( font-weight="600")");
      svg.text(look_.left, 61, "start", 13, soft, fit_text(subtitle, 13, room));
    }
    for (size_t k = 0; k < panels_.size(); ++k) {
      if (k == rows_) svg.raw(fmt::format(R"x(<g transform="translate({},0)">)x", look_.width));
      panel(k);
    }
    if (two) svg.raw("</g>");
    return svg.finish();
  }

 private:
  /// Tops and bottoms of the panels: a legend beside one makes it taller, one above it lower. Many
  /// panels with axes of time of their own stand in two columns, the first ones left.
  void place_panels() {
    if (!look_.beside && panels_.size() > most_in_column) rows_ = (panels_.size() + 1) / 2;
    double at = look_.head, lowest = at;
    for (size_t k = 0; k < drawn_.size(); ++k) {
      auto& d = drawn_[k];
      if (k == rows_) at = look_.head;
      if (look_.beside) {
        const double tall =
            std::max(panels_.size() == 1 ? 360.0 : 170.0, look_.row * double(d.size()) + 8);
        places_.push_back({at, at + tall});
        at += tall + look_.gap;
      } else {
        if (d.size() == 1 && panels_[k].what.starts_with(d[0].name + " ["))
          d[0].name = "";  // stands there
        const double rows = double(rows_above(d).size());
        const double tall = std::max(height_in_print, rows * look_.row + 32 + least_in_print);
        places_.push_back({at + 5 + rows * look_.row, at + tall - 27});
        at += tall;
      }
      lowest = std::max(lowest, at);
    }
    height_ = lowest - look_.gap + look_.foot;
  }
  /// The rows of a legend above its panel: indices of lines.
  std::vector<std::vector<size_t>> rows_above(const std::vector<Drawn>& d) const {
    std::vector<std::vector<size_t>> rows;
    double free = 0;
    if (d.size() == 1 && d[0].name.empty()) return rows;
    for (size_t i = 0; i < d.size(); ++i) {
      const double need = entry_width(d[i]);
      if (rows.empty() || need - gap_in_legend > free) {
        rows.emplace_back();
        free = 2 * look_.right - look_.width;
      }
      rows.back().push_back(i);
      free -= need;
    }
    return rows;
  }
  double entry_width(const Drawn& d) const {
    return look_.swatch + 3 + text_width(d.name, look_.legend) + gap_in_legend;
  }

  double scaled(double v) const { return log_ ? std::log10(v) : v; }
  double x(double t) const {
    if (!(last_ > 0)) return look_.left;
    const double f = log_time_ ? std::log(t / first_) / std::log(last_ / first_)
                               : (t - first_) / (last_ - first_);
    return look_.left + (look_.right - look_.left) * f;
  }
  double y(double v) const { return bottom_ - (bottom_ - top_) * (v - low_) / (high_ - low_); }

  void take(const std::vector<double>& values) {
    for (const double v : values)
      if (const double s = scaled(v); std::isfinite(s))
        std::tie(low_, high_) = std::pair{std::min(low_, s), std::max(high_, s)};
  }
  void find_range(const TracePanel& p, const std::vector<Drawn>& drawn) {
    log_ = p.logarithmic;
    low_ = p.stacked ? 0 : HUGE_VAL;
    high_ = p.stacked ? 0 : -HUGE_VAL;
    for (const Drawn& d : drawn) {
      take(p.stacked ? d.to : d.line->value);
      if (!p.stacked) take(d.line->low);
    }
    if (!(high_ >= low_))
      std::tie(low_, high_) = log_ ? std::pair{-18.0, -16.0} : std::pair{0.0, 1.0};
    if (log_) {
      low_ = std::max(std::floor(low_), std::ceil(high_) - 16);
      high_ = std::max(std::ceil(high_ + 0.02), low_ + 1);
      return;
    }
    // What differs by rounding alone is drawn as constant: no tick is that fine.
    const double size = std::max(std::fabs(low_), std::fabs(high_));
    const double room = high_ - low_ > 1e-9 * size ? 0.05 * (high_ - low_) : std::max(1e-12, size);
    if (!p.stacked) low_ -= room;
    high_ += room;
  }

  void panel(size_t k) {
    const TracePanel& p = panels_[k];
    const auto& drawn = drawn_[k];
    top_ = places_[k].first;
    bottom_ = places_[k].second;
    find_range(p, drawn);
    const double step =
        log_ ? std::max(1.0, std::ceil((high_ - low_) / 5)) : round_step(high_ - low_, 4);
    const bool powers = in_powers(std::max(std::fabs(low_), std::fabs(high_)));
    const double right = look_.left - 0.8 * look_.ticks,
                 room = right - look_.name_at - 0.65 * look_.names;
    double size = look_.ticks;  // of labels, which are narrowed where they would reach the name
    std::vector<std::pair<double, std::string>> labels;
    for (double v = std::ceil(low_ / step - 1e-9) * step; v <= high_ + 1e-9 * step; v += step) {
      const bool zero = !log_ && std::fabs(v) < 1e-9 * step;
      svg_->rule(look_.left, y(v), look_.right, y(v), grid, zero ? 1.8 * look_.rule : look_.rule);
      labels.emplace_back(v, log_   ? power_of_ten(int(std::lround(v)))
                             : zero ? "0"
                                    : number_text(v, powers));
      // digits and the minus are wider than the letters that text_width() counts by
      size = std::min(size,
                      look_.ticks * room / (1.1 * text_width(labels.back().second, look_.ticks)));
    }
    for (const auto& [v, text] : labels)
      svg_->text(right, y(v) + 0.36 * size, "end", size, soft, text);
    svg_->text_upwards(look_.name_at, 0.5 * (top_ + bottom_), look_.names, ink,
                       p.what.substr(0, p.what.find(" [1]")));
    if (k + 1 == panels_.size() || !look_.beside) time_axis();
    draw_marks(p.marks);
    // Bands and areas below, lines upon them.
    for (const bool area : {true, false})
      for (const Drawn& d : drawn)
        if (area == (p.stacked || d.line->stroke == Stroke::band)) draw_line(d, p, area);
    look_.beside ? legend_beside(drawn, p.stacked) : legend_above(drawn, p.stacked);
  }

  void draw_line(const Drawn& d, const TracePanel& p, bool area) {
    const auto& t = d.line->t;
    const auto& value = d.to.empty() ? d.line->value : d.to;
    const auto& from = d.to.empty() ? d.line->low : d.from;
    const size_t n = std::min(t.size(), value.size());
    const bool dense = area && turns_back(value) > n / 8;  // white edges would cover the area
    std::vector<std::string> points, back;
    std::string level;  // of the point before
    const auto flush = [&] {
      std::ranges::reverse(back);
      if (area && !points.empty())  // the outline shows a band without width
        svg_->raw(fmt::format(
            R"(<polygon points="{}{}" fill="{}" fill-opacity="{}" stroke="{}" stroke-width="{}"/>)",
            fmt::join(points, ""), fmt::join(back, ""), d.colour, d.to.empty() ? 0.45 : 0.8,
            d.to.empty() ? d.colour
            : dense      ? "none"
                         : "#ffffff",
            look_.rule));
      else if (!points.empty())
        svg_->polyline(fmt::format("{}", fmt::join(points, "")), d.colour, d.width, d.dash.c_str());
      points.clear();
      back.clear();
    };
    size_t hole = 0;
    for (size_t k = 0; k < n; ++k) {
      bool broken = d.wraps && k > 0 && std::fabs(value[k] - value[k - 1]) > std::numbers::pi;
      for (; hole < p.holes.size() && p.holes[hole] < t[k]; ++hole) broken = true;
      const double s = scaled(value[k]);
      const bool drawn =
          std::isfinite(s) && std::isfinite(t[k]) && s >= low_ - 1e-9 && !(log_time_ && t[k] <= 0);
      if (broken || !drawn) flush();
      if (!drawn) continue;
      const std::string at = fmt::format("{:.1f},", x(t[k])), now = fmt::format("{:.1f} ", y(s));
      if (d.held && !points.empty() && now != level) points.push_back(at + level);
      points.push_back(at + now);
      level = now;
      if (area) back.push_back(at + fmt::format("{:.1f} ", y(std::max(low_, scaled(from[k])))));
    }
    flush();
  }

  /// Instants as thin upright lines, each with its name right of it as far as there is room.
  void draw_marks(const std::vector<TimeMark>& marks) {
    const double size = 0.85 * look_.ticks;
    for (size_t k = 0; k < marks.size(); ++k) {
      const double at = x(marks[k].t),
                   next = k + 1 < marks.size() ? x(marks[k + 1].t) : look_.right;
      if (!(at > look_.left && at < look_.right)) continue;
      svg_->rule(at, top_, at, bottom_, colour::guide, look_.rule,
                 dashed("3 3", look_.rule).c_str());
      const double room = std::min(next, look_.right) - at - 0.7 * size;
      if (room > 2 * size)
        svg_->text(at + 0.35 * size, top_ + size, "start", size, soft,
                   fit_text(marks[k].name, size, room));
    }
  }

  void swatch(const Drawn& d, double at, double base, bool stacked) {
    const double middle = base - 0.33 * look_.legend;
    if (stacked || d.line->stroke == Stroke::band)
      svg_->rule(at, middle, at + look_.swatch, middle, d.colour, 0.6 * look_.legend,
                 stacked ? R"( stroke-opacity="0.8")" : R"( stroke-opacity="0.45")");
    else
      svg_->rule(at, middle, at + look_.swatch, middle, d.colour, 1.3 * d.width, d.dash.c_str());
  }
  void legend_beside(const std::vector<Drawn>& drawn, bool stacked) {
    const double at = look_.right + 20;
    for (size_t i = 0; i < drawn.size(); ++i) {
      // of a stack the upper one comes first
      const Drawn& d = drawn[stacked ? drawn.size() - 1 - i : i];
      const double base = top_ + 14 + look_.row * double(i);
      swatch(d, at, base, stacked);
      svg_->text(at + 32, base, "start", look_.legend, ink,
                 fit_text(d.name, look_.legend, look_.width - at - 36));
    }
  }
  void legend_above(const std::vector<Drawn>& drawn, bool stacked) {
    const auto rows = rows_above(drawn);
    double base = top_ - look_.row * double(rows.size()) + 4;
    for (const auto& row : rows) {
      double at = look_.width - look_.right;  // as far from the edge as the panel is
      for (const size_t i : row) {
        swatch(drawn[i], at, base, stacked);
        svg_->text(at + look_.swatch + 3, base, "start", look_.legend, ink,
                   fit_text(drawn[i].name, look_.legend, look_.right - at - look_.swatch - 3));
        at += entry_width(drawn[i]);
      }
      base += look_.row;
    }
  }

  void time_axis() {
    const TimeAxis axis =
        log_time_ ? everyday_times(first_, last_) : even_times(first_, last_, look_.beside ? 7 : 5);
    double free = -1e9;
    for (const TimeTick& k : axis.ticks) {
      const double tick = x(k.t), half = 0.55 * text_width(k.text, look_.ticks);
      const double at = std::min(tick, look_.width - half - 1);  // whole on the page
      svg_->rule(tick, bottom_, tick, bottom_ + 0.4 * look_.ticks, soft, look_.rule);
      if (at - half < free) continue;
      svg_->text(at, bottom_ + 1.55 * look_.ticks, "middle", look_.ticks, soft, k.text);
      free = at + half + 0.5 * look_.ticks;
    }
    svg_->rule(look_.left, bottom_, look_.right, bottom_, soft, look_.rule);
    svg_->text(0.5 * (look_.left + look_.right), bottom_ + (look_.beside ? 45 : 23), "middle",
               look_.names, ink, axis.unit.empty() ? "time" : "time [" + axis.unit + "]");
  }

  const std::vector<TracePanel>& panels_;
  const Look& look_;
  bool log_time_, log_ = false;
  std::vector<std::vector<Drawn>> drawn_;
  std::vector<std::pair<double, double>> places_;
  size_t rows_ = std::numeric_limits<size_t>::max();  ///< of the first column
  std::optional<Svg> svg_;
  double first_ = 0, last_ = 0, height_ = 0, top_ = 0, bottom_ = 0, low_ = 0, high_ = 1;
};

}  // namespace

std::string trace_plot(const std::vector<TracePanel>& panels, const std::string& title,
                       const std::string& subtitle) {
  return TracePlot(panels, look_on_screen).draw(title, subtitle);
}

std::string figure(const std::vector<TracePanel>& panels) {
  return TracePlot(panels, look_in_print).draw("", "");
}

TraceLine column(const std::string& name, const std::vector<double>& t,
                 const std::vector<std::vector<double>>& rows, std::size_t entry) {
  TraceLine l{name, t, {}};
  for (const auto& row : rows) l.value.push_back(row.at(entry));
  return l;
}

}  // namespace porthos::scene
