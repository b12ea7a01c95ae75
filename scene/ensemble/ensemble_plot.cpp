#include "scene/ensemble/ensemble_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

constexpr double width = 860, left = 70, right = 830, panel = 150, first = 96, gap = 74;
constexpr int bins_per_decade = 8;

std::string error_text(double x) { return x > 0 ? scientific(x) : "0"; }

using Json = nlohmann::ordered_json;

double number_or_nan(const Json& j) { return j.is_number() ? j.get<double>() : std::nan(""); }

/// Of a relative error over the cases that reached their end.
struct Histogram {
  std::string name, dataset;  ///< of ensemble.h5 and ensemble.json
  std::optional<double> limit;
  double least = 0, median = 0, most_of_all = 0, largest = 0;
  std::vector<std::int64_t> count = {};
};

std::vector<Histogram> histograms(const Json& summary) {
  std::vector<Histogram> all;
  for (const char* name : {"energy", "linear momentum", "angular momentum"}) {
    Histogram h{name, std::string(name) + "_error", {}};
    std::ranges::replace(h.dataset, ' ', '_');
    if (!summary.contains(h.dataset)) continue;
    const Json& spread = summary.at(h.dataset);
    h.least = number_or_nan(spread.at("min"));
    h.median = number_or_nan(spread.at("median"));
    h.most_of_all = number_or_nan(spread.at("q95"));
    h.largest = number_or_nan(spread.at("max"));
    if (summary.contains("limits") && summary["limits"].contains(h.dataset))
      h.limit = number_or_nan(summary["limits"][h.dataset]);
    all.push_back(std::move(h));
  }
  return all;
}

/// One number a case.
template <class T>
std::vector<T> numbers_of(const Hdf5Reader& file, const std::string& name, std::int64_t cases) {
  if (file.dataset(name).size() != cases)
    throw InvalidArgument(fmt::format("ensemble.h5 is damaged: {} has {} numbers, expected {}",
                                      name, file.dataset(name).size(), cases));
  std::vector<T> v(static_cast<size_t>(cases));
  file.read(name, v.data());
  return v;
}

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
  if (h.largest == 0) {
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
      svg.raw(
          fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}"/>)",
                      left + i * bar + 0.5, bottom - tall, bar - 1, tall, colour::lines[0]));
  }
  svg.rule(left, bottom, right, bottom, colour::guide, 1);
  svg.text(left - 8, top + 12, "end", 11, colour::soft, std::to_string(most));
  svg.text(left - 8, bottom, "end", 11, colour::soft, "0");
  const double largest = axis.x(h.largest);
  svg.marker(2, largest, bottom - 7, 5, colour::lines[0], colour::lines[0]);
  for (const double q : {h.median, h.most_of_all})
    if (std::isfinite(q))
      svg.rule(axis.x(q), top, axis.x(q), bottom, colour::ink, 1.2, " stroke-dasharray=\"4 3\"");
  if (h.limit && *h.limit > 0)
    svg.rule(axis.x(*h.limit), top, axis.x(*h.limit), bottom, colour::alarm, 1.6);
  svg.text(right, top - 8, "end", 11.5, colour::soft,
           fmt::format("median {}  ·  95 % below {}  ·  largest (▲) {}{}", error_text(h.median),
                       error_text(h.most_of_all), error_text(h.largest),
                       h.limit ? "  ·  limit " + error_text(*h.limit) : ""));
}

}  // namespace

std::string ensemble_plot(const std::filesystem::path& h5, const std::string& json) {
  const Json summary = Json::parse(json);
  const std::int64_t cases = summary.at("cases").get<std::int64_t>();
  auto all = histograms(summary);
  Axis axis;
  const auto reach = [&](double error) {
    if (!(error > 0) || !std::isfinite(error)) return;
    axis.low = std::min(axis.low, std::max(-20, int(std::floor(std::log10(error)))));
    axis.high = std::max(axis.high, int(std::floor(std::log10(error))) + 1);
  };
  for (const Histogram& h : all)
    for (const double x : {h.least, h.largest, h.limit.value_or(0)}) reach(x);
  const Hdf5Reader file(h5);
  const auto status = numbers_of<std::int64_t>(file, "status", cases);
  for (Histogram& h : all) {
    h.count.assign(size_t(axis.bins()), 0);
    const auto errors = numbers_of<double>(file, h.dataset, cases);
    for (size_t i = 0; i < errors.size(); ++i)
      if (status[i] == 0) ++h.count[size_t(axis.bin(errors[i]))];
  }
  const auto tall = [](const Histogram& h) {
    return h.largest == 0 ? 24 + 0.6 * gap : panel + gap;
  };
  double height = first + 10;
  for (const Histogram& h : all) height += tall(h);
  Svg svg(width, height);
  svg.text(left, 30, "start", 16, colour::ink,
           fit_text(summary.at("title").get<std::string>(), 16, right - left),
           " font-weight=\"600\"");
  svg.text(left, 52, "start", 12, colour::soft,
           fmt::format("{} cases  ·  {}  ·  step {} s  ·  {} s each  ·  {} passed", cases,
                       summary.at("method").get<std::string>(),
                       number_text(number_or_nan(summary.at("step_s"))),
                       number_text(number_or_nan(summary.at("duration_s"))),
                       summary.at("passed").get<std::int64_t>()));
  double top = first;
  for (const Histogram& h : all) {
    draw(svg, h, axis, top);
    top += tall(h);
  }
  svg.text((left + right) / 2, height - gap + 46 - 10, "middle", 11.5, colour::soft,
           "largest relative error over a run");
  return svg.finish();
}

std::string replot_ensemble(const std::filesystem::path& folder) {
  const auto json = folder / "ensemble.json", svg = folder / "ensemble.svg";
  if (!std::filesystem::exists(json))
    throw InvalidArgument(fmt::format(
        "{} has no ensemble.json, expected the results of a finished ensemble", folder.string()));
  try {
    write_aside(svg, ensemble_plot(folder / "ensemble.h5", read_file(json)));
  } catch (const Json::exception& e) {
    throw InvalidArgument(fmt::format("{} is damaged: {}", json.string(), e.what()));
  }
  put_in_place(svg);
  return svg.string();
}

}  // namespace porthos::scene
