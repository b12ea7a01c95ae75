#include "scene/ensemble/ensemble_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

constexpr double width = 860, left = 70, right = 830, panel = 150, first = 96, gap = 74;
constexpr int bins_per_decade = 8;

std::string error_text(double x) { return x > 0 ? scientific(x) : "0"; }

struct Histogram {
  std::string name;
  size_t at;  ///< in a row
  std::optional<double> limit;
  const Spread* spread;
  std::vector<std::int64_t> count = {};
};

/// The decades that contain all errors. An error of exactly 0 counts at the left end.
struct Axis {
  int low = -17, high = -12;
  int bins() const { return (high - low) * bins_per_decade; }
  double x(double error) const {
    const double d = error > 0 ? std::clamp(std::log10(error), double(low), double(high)) : low;
    return left + (right - left) * (d - low) / (high - low);
  }
  int bin(double error) const {
    const double d = error > 0 ? std::log10(error) : low;
    return std::clamp(int(std::floor((d - low) * bins_per_decade)), 0, bins() - 1);
  }
};

void draw(Svg& svg, const Histogram& h, const Axis& axis, double top) {
  const double bottom = top + panel;
  svg.text(left, top - 8, "start", 12.5, colour::ink, h.name);
  if (h.spread->quantiles[6] == 0) {
    svg.text(left, top + 14, "start", 12, colour::soft, "exactly 0 in every case");
    return;
  }
  const auto most = std::max<std::int64_t>(1, *std::max_element(h.count.begin(), h.count.end()));
  for (int d = axis.low; d <= axis.high; ++d) {
    const double x = axis.x(std::pow(10.0, d));
    svg.rule(x, top, x, bottom, colour::grid, 1);
    svg.text(x, bottom + 18, "middle", 11, colour::soft, power_of_ten(d));
  }
  const double bar = (right - left) / axis.bins();
  for (int i = 0; i < axis.bins(); ++i) {
    const double tall = (panel - 4) * double(h.count[size_t(i)]) / double(most);
    if (tall > 0)
      svg.raw(fmt::format(
          R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#1b4f9c"/>)",
          left + i * bar + 0.5, bottom - tall, bar - 1, tall));
  }
  svg.rule(left, bottom, right, bottom, colour::guide, 1);
  svg.text(left - 8, top + 12, "end", 11, colour::soft, std::to_string(most));
  svg.text(left - 8, bottom, "end", 11, colour::soft, "0");
  const double largest = axis.x(h.spread->quantiles[6]);
  svg.marker(2, largest, bottom - 7, 5, "#1b4f9c", "#1b4f9c");
  const double median = h.spread->quantiles[3], most_of_all = h.spread->quantiles[5];
  for (const double q : {median, most_of_all})
    if (std::isfinite(q))
      svg.rule(axis.x(q), top, axis.x(q), bottom, colour::ink, 1.2, " stroke-dasharray=\"4 3\"");
  if (h.limit && *h.limit > 0)
    svg.rule(axis.x(*h.limit), top, axis.x(*h.limit), bottom, colour::alarm, 1.6);
  svg.text(right, top - 8, "end", 11.5, colour::soft,
           fmt::format("median {}  ·  95 % below {}  ·  largest (▲) {}{}", error_text(median),
                       error_text(most_of_all), error_text(h.spread->quantiles[6]),
                       h.limit ? "  ·  limit " + error_text(*h.limit) : ""));
}

}  // namespace

std::string ensemble_plot(const Ensemble& e, const CaseStore& store, const EnsembleReport& r) {
  const CaseLayout& l = e.layout();
  const Limits& limits = e.scene().verify;
  std::vector<Histogram> all{{"energy", l.energy, limits.energy, &r.energy}};
  for (const auto& i : e.assembly().model->description().invariants) {
    if (i.name == "linear_momentum")
      all.push_back({"linear momentum", l.linear, limits.linear_momentum, &r.linear});
    if (i.name == "angular_momentum")
      all.push_back({"angular momentum", l.angular, limits.angular_momentum, &r.angular});
  }
  Axis axis;
  const auto reach = [&](double error) {
    if (!(error > 0) || !std::isfinite(error)) return;
    axis.low = std::min(axis.low, std::max(-20, int(std::floor(std::log10(error)))));
    axis.high = std::max(axis.high, int(std::floor(std::log10(error))) + 1);
  };
  for (const Histogram& h : all)
    for (const double x : {h.spread->quantiles[0], h.spread->quantiles[6], h.limit.value_or(0)})
      reach(x);
  for (Histogram& h : all) h.count.assign(size_t(axis.bins()), 0);
  std::vector<double> row(l.size());
  for (std::int64_t i = 0; i < r.cases; ++i) {
    if (!store.has(i)) continue;
    store.read(i, row);
    if (integer(row[l.status]) != 0) continue;
    for (Histogram& h : all) ++h.count[size_t(axis.bin(row[h.at]))];
  }
  const auto tall = [](const Histogram& h) {
    return h.spread->quantiles[6] == 0 ? 24 + 0.6 * gap : panel + gap;
  };
  double height = first + 10;
  for (const Histogram& h : all) height += tall(h);
  Svg svg(width, height);
  svg.text(left, 30, "start", 16, colour::ink, fit_text(e.scene().title, 16, right - left),
           " font-weight=\"600\"");
  svg.text(left, 52, "start", 12, colour::soft,
           fmt::format("{} cases  ·  {}  ·  step {:g} s  ·  {:g} s each  ·  {} passed", r.cases,
                       e.scene().method, e.scene().step, e.scene().duration, r.passed));
  double top = first;
  for (const Histogram& h : all) {
    draw(svg, h, axis, top);
    top += tall(h);
  }
  svg.text((left + right) / 2, height - gap + 46 - 10, "middle", 11.5, colour::soft,
           "largest relative error over a run");
  return svg.finish();
}

}  // namespace porthos::scene
