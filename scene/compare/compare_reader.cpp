#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/compare/compare.h"
#include "scene/compare/work_precision_plot.h"
#include "scene/files/files.h"
#include "scene/files/json-inl.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;

Trial trial_of(const Json& run) {
  Trial t;
  t.report.cpu_s = json_number(run.at("cpu_s"));
  t.report.energy.max_rel_error = json_number(run.at("energy").at("max_rel_error"));
  if (const std::string outcome = run.at("outcome"); outcome != "ok") t.failure = outcome;
  if (run.at("trajectory_error").is_number()) t.trajectory_error = run["trajectory_error"];
  return t;
}

/// The trials of compare.json as far as their picture needs them.
Comparison comparison_of(const Json& j) {
  Comparison c;
  c.title = j.at("title");
  c.duration_s = json_number(j.at("duration_s"));
  c.by_energy = j.at("error") == "energy";
  c.interrupted = j.at("interrupted");
  const Json& trajectory = j.at("trajectory");
  c.trajectory_time_s = json_number(trajectory.at("time_s"));
  if (trajectory.at("reference_error").is_number())
    c.reference.emplace().error = trajectory["reference_error"];
  for (const Json& run : j.at("runs")) {
    MethodTrials m;
    m.method.name = run.at("method");
    m.method.family = run.at("family");
    m.method.rival = run.at("rival");
    m.short_sweeps = run.at("iteration_tolerance").is_number();
    m.control = integrators::step_control_of(run.at("step_control").get<std::string>());
    if (c.methods.empty() || c.methods.back().label() != m.label()) c.methods.push_back(m);
    c.methods.back().trials.push_back(trial_of(run));
  }
  return c;
}

}  // namespace

std::string replot_comparison(const std::filesystem::path& folder) {
  const auto json = folder / "compare.json", svg = folder / "work_precision.svg";
  if (!std::filesystem::exists(json))
    throw InvalidArgument(fmt::format(
        "{} has no compare.json, expected the results of porthos compare", folder.string()));
  try {
    const Json j = Json::parse(read_file(json));
    write_aside(svg,
                work_precision_plot(comparison_of(j), json_number(j.at("advice").at("target"))));
  } catch (const Json::exception& e) {
    throw InvalidArgument(fmt::format("{} is damaged: {}", json.string(), e.what()));
  }
  put_in_place(svg);
  return svg.string();
}

}  // namespace porthos::scene
