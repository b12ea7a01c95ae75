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
#include "scene/files/json-inl.h"
#include "scene/files/text_table.h"
#include "scene/plot/svg.h"

namespace porthos::scene {
namespace {

constexpr double width = 860, left = 70, right = 830, panel = 150, first = 96, gap = 74;
constexpr int bins_per_decade = 8;

std::string error_text(double x) { return x > 0 ? scientific(x) : "0"; }

using Json = nlohmann::ordered_json;

/// Along which the numbers of a histogram stand: decades of errors, where an error of exactly 0
/// counts at the left end, or numbers as they are.
struct Axis {
  double low = -17, high = -12;  ///< of the logarithms, or of the numbers
  bool decades = true;
  int bins() const { return decades ? int(high - low) * bins_per_decade : 60; }
  double place(double v) const {
    return std::clamp(!decades ? v : v > 0 ? std::log10(v) : low, low, high);
  }
  double x(double v) const { return left + (right - left) * (place(v) - low) / (high - low); }
  int bin(double v) const {
    return std::clamp(int(std::floor((place(v) - low) / (high - low) * bins())), 0, bins() - 1);
  }
};

/// Of a relative error over the cases that reached their end, or of a number that a requirement
/// limits over all that have it.
struct Histogram {
  std::string name, dataset;  ///< of ensemble.h5 and, of errors, ensemble.json
  std::optional<double> limit;
  std::string words = {};  ///< beside the name
  Axis axis = {};
  double least = 0, median = std::nan(""), most_of_all = std::nan(""), largest = 0;
  std::vector<std::int64_t> count = {};
  void add(double v) { ++count[size_t(axis.bin(v))]; }
};

std::vector<Histogram> histograms(const Json& summary) {
  std::vector<Histogram> all;
  for (const char* name : {"energy", "linear momentum", "angular momentum"}) {
    Histogram h{name, std::string(name) + "_error", {}};
    std::ranges::replace(h.dataset, ' ', '_');
    if (!summary.contains(h.dataset)) continue;
    const Json& spread = summary.at(h.dataset);
    h.least = json_number(spread.at("min"));
    h.median = json_number(spread.at("median"));
    h.most_of_all = json_number(spread.at("q95"));
    h.largest = json_number(spread.at("max"));
    if (summary.contains("limits") && summary["limits"].contains(h.dataset))
      h.limit = json_number(summary["limits"][h.dataset]);
    h.words = fmt::format("median {}  ·  95 % below {}  ·  largest (▲) {}{}", error_text(h.median),
                          error_text(h.most_of_all), error_text(h.largest),
                          h.limit ? "  ·  limit " + error_text(*h.limit) : "");
    all.push_back(std::move(h));
  }
  return all;
}

/// One number a case.
template <class T>
std::vector<T> numbers_of(const Hdf5Reader& file, const std::string& name, std::int64_t cases,
                          std::int64_t columns = 1, std::int64_t column = 0) {
  if (file.dataset(name).size() != cases * columns)
    throw InvalidArgument(fmt::format("ensemble.h5 is damaged: {} has {} numbers, expected {}",
                                      name, file.dataset(name).size(), cases * columns));
  std::vector<T> all(static_cast<size_t>(cases * columns));
  file.read(name, all.data());
  if (columns == 1) return all;
  std::vector<T> v;
  for (std::int64_t i = 0; i < cases; ++i) v.push_back(all[size_t(i * columns + column)]);
  return v;
}

/// The numbers that requirements limit, at the records, along axes that reach their limits unless
/// the bars would be lost beside them. Not of results of earlier versions.
std::vector<Histogram> of_requirements(const Json& summary, const Hdf5Reader& file,
                                       std::int64_t cases) {
  std::vector<Histogram> all;
  const Json limited = summary.value("requirements", Json::object());
  for (const auto& [check, w] : limited.items()) {
    if (!w.contains("limit")) continue;
    const std::string is = w.at("is"), output = w.at("output"), unit = w.at("unit");
    Histogram h{fmt::format("{}: {} {} at the records{}", check, is, output,
                            unit.empty() || unit == "1" ? "" : " [" + unit + "]"),
                "outputs/" + is, w.at("limit").get<double>()};
    const auto names = lines_of(file.texts(h.dataset)["columns"]);
    const auto column = std::ranges::find(names, output) - names.begin();
    std::vector<double> values;
    for (const double v :
         numbers_of<double>(file, h.dataset, cases, std::int64_t(names.size()), column))
      if (std::isfinite(v)) values.push_back(v);
    if (values.empty()) continue;
    std::ranges::sort(values);
    h.least = values.front();
    h.largest = values.back();
    h.axis = {h.least, h.largest, false};
    const double span = h.largest - h.least, limit = *h.limit;
    const bool near = limit > h.least - 6 * span && limit < h.largest + 6 * span;
    if (near) h.axis = {std::min(h.least, limit), std::max(h.largest, limit), false};
    if (!(h.axis.high > h.axis.low)) h.axis.high = h.axis.low + std::max(1e-12, std::fabs(h.least));
    h.words =
        fmt::format("{} (▲) {}  ·  {} {}{}", is, number_text(json_number(w.at("value")), false, 4),
                    is == "largest" ? "at most" : "at least", number_text(limit, false, 6),
                    near ? "" : ", outside of the picture");
    if (is == "least") h.largest = h.least;  // the mark stands at the worst
    if (!near) h.limit.reset();
    h.count.assign(size_t(h.axis.bins()), 0);
    for (const double v : values) h.add(v);
    all.push_back(std::move(h));
  }
  return all;
}

void draw_ticks(Svg& svg, const Axis& axis, double top, double bottom) {
  const auto tick = [&](double x, const std::string& text) {
    svg.rule(x, top, x, bottom, colour::grid, 1);
    svg.text(x, bottom + 18, "middle", 11, colour::soft, text);
  };
  if (axis.decades) {
    for (int d = int(axis.low); d <= int(axis.high); ++d)
      tick(axis.x(std::pow(10.0, d)), power_of_ten(d));
    return;
  }
  const double step = round_step(axis.high - axis.low, 6);
  for (double k = std::ceil(axis.low / step); k * step <= axis.high; ++k)
    tick(axis.x(k * step), number_text(k * step, false, 6));
}

void draw(Svg& svg, const Histogram& h, double top) {
  const Axis& axis = h.axis;
  const double bottom = top + panel;
  svg.text(left, top - 8, "start", 12.5, colour::ink,
           fit_text(h.name, 12.5, right - left - text_width(h.words, 11.5) - 12));
  if (axis.decades && h.largest == 0) {
    svg.text(left, top + 14, "start", 12, colour::soft, "exactly 0 in every case");
    return;
  }
  const auto most = std::max<std::int64_t>(1, *std::max_element(h.count.begin(), h.count.end()));
  draw_ticks(svg, axis, top, bottom);
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
  svg.text_upwards(left - 34, 0.5 * (top + bottom), 11, colour::soft, "cases");
  const double largest = axis.x(h.largest);
  svg.marker(2, largest, bottom - 7, 5, colour::lines[0], colour::lines[0]);
  for (const double q : {h.median, h.most_of_all})
    if (std::isfinite(q))
      svg.rule(axis.x(q), top, axis.x(q), bottom, colour::ink, 1.2, " stroke-dasharray=\"4 3\"");
  if (h.limit && (!axis.decades || *h.limit > 0))
    svg.rule(axis.x(*h.limit), top, axis.x(*h.limit), bottom, colour::alarm, 1.6);
  svg.text(right, top - 8, "end", 11.5, colour::soft, h.words);
}

}  // namespace

std::string ensemble_plot(const std::filesystem::path& h5, const std::string& json) {
  const Json summary = Json::parse(json);
  const std::int64_t cases = summary.at("cases").get<std::int64_t>();
  auto all = histograms(summary);
  Axis axis;
  const auto reach = [&](double error) {
    if (!(error > 0) || !std::isfinite(error)) return;
    axis.low = std::min(axis.low, std::max(-20.0, std::floor(std::log10(error))));
    axis.high = std::max(axis.high, std::floor(std::log10(error)) + 1);
  };
  for (const Histogram& h : all)
    for (const double x : {h.least, h.largest, h.limit.value_or(0)}) reach(x);
  const Hdf5Reader file(h5);
  const auto status = numbers_of<std::int64_t>(file, "status", cases);
  for (Histogram& h : all) {
    h.axis = axis;
    h.count.assign(size_t(axis.bins()), 0);
    const auto errors = numbers_of<double>(file, h.dataset, cases);
    for (size_t i = 0; i < errors.size(); ++i)
      if (status[i] == 0) h.add(errors[i]);
  }
  const size_t of_errors = all.size();
  for (Histogram& h : of_requirements(summary, file, cases)) all.push_back(std::move(h));
  const auto tall = [](const Histogram& h) {
    return h.axis.decades && h.largest == 0 ? 24 + 0.6 * gap : panel + gap;
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
                       number_text(json_number(summary.at("step_s"))),
                       number_text(json_number(summary.at("duration_s"))),
                       summary.at("passed").get<std::int64_t>()));
  double top = first;
  for (size_t k = 0; k < all.size(); ++k) {
    draw(svg, all[k], top);
    top += tall(all[k]);
    if (k + 1 == of_errors)
      svg.text((left + right) / 2, top - gap + 44, "middle", 11.5, colour::soft,
               "largest relative error over a run");
  }
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
