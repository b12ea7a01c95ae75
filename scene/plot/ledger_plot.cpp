#include "scene/plot/ledger_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

using colour::grid, colour::ink, colour::soft;

// Page and panels [px]; legends are to the right of them.
constexpr double width = 1180, left = 96, right = 850, legend_x = 872, legend_row = 19;
constexpr double first_top = 96, gap = 46, below = 64;
constexpr const char* palette[] = {"#1d5c96", "#6fa8dc", "#2f8f5b", "#9bcf8f",
                                   "#8a5fb0", "#c9a3e0", "#b8741a", "#e8c26a",
                                   "#2a8c99", "#8fd0d4", "#7a5a48", "#c4a392"};

const char* colour_of(size_t i) { return palette[i % std::size(palette)]; }

struct Range {
  double low = 0, high = 0;
  void take(double x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  void widen() {
    if (!(high > low)) high = low + 1;
    const double room = 0.04 * (high - low);
    high += room;
    if (low < 0) low -= room;
  }
};

/// 1, 2 or 5 times a power of ten.
class LedgerPlot {
 public:
  LedgerPlot(const LedgerSeries& s, std::string title, std::string subtitle)
      : s_(s),
        title_(std::move(title)),
        subtitle_(std::move(subtitle)),
        svg_(width, page_height()) {}

  std::string draw() {
    svg_.text(left, 40, "start", 20, ink, fit_text(title_, 20, width - left - 20),
              R"( font-weight="600")");
    svg_.text(left, 63, "start", 13, soft, fit_text(subtitle_, 13, width - left - 20));
    stored();
    if (has_works()) works();
    defect();
    time_axis();
    return svg_.finish();
  }

 private:
  bool has_works() const { return !s_.supplied.empty() || !s_.dissipated.empty(); }
  double rows(size_t n) const { return legend_row * double(n + 1); }
  double stored_height() const { return std::max(210.0, rows(s_.stored.size())); }
  double works_height() const {
    return has_works() ? std::max(190.0, rows(s_.supplied.size() + s_.dissipated.size())) : 0;
  }
  double page_height() const {
    return first_top + stored_height() + gap + (has_works() ? works_height() + gap : 0) + 130 +
           below;
  }

  /// Begins a panel of the given height for a range of values.
  void panel(double height, Range r, const std::string& what) {
    top_ = bottom_ == 0 ? first_top : bottom_ + gap;
    bottom_ = top_ + height;
    r.widen();
    range_ = r;
    const double step = round_step(r.high - r.low, 4);
    for (double v = std::ceil(r.low / step) * step; v <= r.high; v += step) {
      svg_.rule(left, y(v), right, y(v), grid, std::fabs(v) < 1e-9 * step ? 1.8 : 1);
      svg_.text(left - 10, y(v) + 4.5, "end", 12.5, soft,
                std::fabs(v) < 1e-9 * step ? "0" : fmt::format("{:.6g}", v));
    }
    svg_.text_upwards(22, 0.5 * (top_ + bottom_), 13, ink, what);
    legend_y_ = top_ + 10;
  }
  double x(double t) const { return left + (right - left) * (last() > 0 ? t / last() : 0); }
  double y(double v) const {
    return bottom_ - (bottom_ - top_) * (v - range_.low) / (range_.high - range_.low);
  }
  double last() const { return s_.t.empty() ? 0 : s_.t.back(); }
  std::string path(const std::vector<double>& v) const {
    std::string p;
    for (size_t i = 0; i < s_.t.size(); ++i)
      fmt::format_to(std::back_inserter(p), "{:.1f},{:.1f} ", x(s_.t[i]), y(v[i]));
    return p;
  }
  void legend(const std::string& name, const char* colour, const char* dash) {
    svg_.rule(legend_x, legend_y_ - 4, legend_x + 24, legend_y_ - 4, colour, 3, dash);
    svg_.text(legend_x + 32, legend_y_, "start", 12, ink,
              fit_text(name, 12, width - legend_x - 36));
    legend_y_ += legend_row;
  }

  void stored() {
    std::vector<std::vector<double>> top(1, std::vector<double>(s_.t.size(), 0.0));
    std::vector<std::string> names;
    Range r;
    for (const auto& line : s_.stored) {
      const double least =
          line.value.empty() ? 0 : *std::min_element(line.value.begin(), line.value.end());
      const double from = std::min(0.0, least);
      auto sum = top.back();
      for (size_t i = 0; i < sum.size(); ++i) {
        sum[i] += line.value[i] - from;
        r.take(sum[i]);
      }
      top.push_back(std::move(sum));
      names.push_back(line.name + (from < 0 ? " (above its least)" : ""));
    }
    panel(stored_height(), r, "stored energy [J]");
    for (size_t k = 0; k + 1 < top.size(); ++k) {
      std::string area = path(top[k + 1]);
      for (size_t i = s_.t.size(); i-- > 0;)
        fmt::format_to(std::back_inserter(area), "{:.1f},{:.1f} ", x(s_.t[i]), y(top[k][i]));
      svg_.raw(fmt::format(R"(<polygon points="{}" fill="{}" fill-opacity="0.85"/>)", area,
                           colour_of(k)));
    }
    for (size_t k = names.size(); k-- > 0;)
      legend(names[k], colour_of(k), "");  // as they are stacked
  }

  void works() {
    Range r;
    for (const auto* lines : {&s_.supplied, &s_.dissipated})
      for (const auto& l : *lines)
        for (const double v : l.value) r.take(v);
    panel(works_height(), r, "work since the start [J]");
    size_t next = 0;
    for (const auto* lines : {&s_.supplied, &s_.dissipated})
      for (const auto& l : *lines) {
        // What was never used is not in the legend of many.
        const bool idle =
            s_.supplied.size() + s_.dissipated.size() > 4 &&
            std::all_of(l.value.begin(), l.value.end(), [](double v) { return v == 0; });
        const char* dash = lines == &s_.dissipated ? R"( stroke-dasharray="6 3.5")" : "";
        const char* c = colour_of(2 * next + (2 * next / std::size(palette)));
        svg_.polyline(path(l.value), c, 2, dash);
        if (!idle) legend(l.name + (lines == &s_.dissipated ? " (lost)" : " (in)"), c, dash);
        ++next;
      }
  }

  void defect() {
    Range r;
    for (const double v : s_.defect) r.take(v);
    panel(130, r, "residual [J]");
    svg_.polyline(path(s_.defect), colour::alarm, 1.4);
    legend("residual of the balance", colour::alarm, "");
  }

  void time_axis() {
    const double second = last() <= 7200 ? 1 : last() <= 2 * 86400 ? 3600 : 86400;
    const double step = round_step(std::max(last(), 1e-300) / second, 7);
    for (int i = 0; last() > 0 && i * step <= last() / second * 1.0001; ++i) {
      const double at = x(i * step * second);
      svg_.rule(at, bottom_, at, bottom_ + 5, soft, 1);
      svg_.text(at, bottom_ + 21, "middle", 12.5, soft, fmt::format("{:.6g}", i * step));
    }
    svg_.rule(left, bottom_, right, bottom_, soft, 1);
    svg_.text(0.5 * (left + right), bottom_ + 46, "middle", 13, ink,
              fmt::format("simulated time [{}]", second == 1      ? "s"
                                                 : second == 3600 ? "h"
                                                                  : "d"));
  }

  const LedgerSeries& s_;
  const std::string title_, subtitle_;
  Svg svg_;
  double top_ = 0, bottom_ = 0, legend_y_ = 0;
  Range range_;
};

}  // namespace

std::string ledger_plot(const LedgerSeries& series, const std::string& title,
                        const std::string& subtitle) {
  return LedgerPlot(series, title, subtitle).draw();
}

}  // namespace porthos::scene
