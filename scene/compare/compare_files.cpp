#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene/compare/advice.h"
#include "scene/compare/compare.h"
#include "scene/compare/work_precision_plot.h"
#include "scene/files/files.h"
#include "scene/files/text_table.h"
#include "scene/run/provenance.h"
#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;  // writes non-finite numbers as null

Json number_or_null(const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); }
Json number_or_null(double tolerance) { return tolerance > 0 ? Json(tolerance) : Json(nullptr); }

std::optional<double> order_at(const MethodTrials& m, size_t i) {
  return i > 0 ? observed_order(m.trials[i - 1], m.trials[i]) : std::nullopt;
}

Json trial(const MethodTrials& m, size_t i) {
  const Trial& t = m.trials[i];
  const RunReport& r = t.report;
  return {{"method", m.method.name},
          {"family", m.method.family},
          {"order", m.method.order},
          {"rival", m.method.rival},
          {"step_s", t.setting.step},
          {"rtol", number_or_null(t.setting.rtol)},
          {"iteration_tolerance", number_or_null(t.setting.iteration_tolerance)},
          {"step_control", to_string(t.setting.control)},
          {"step_control_rate", number_or_null(t.setting.control_rate)},
          {"step_control_length", number_or_null(t.setting.control_length)},
          {"outcome", t.complete() ? "ok" : t.failure},
          {"simulated_s", r.simulated_s},
          {"steps", r.steps},
          {"evaluations", r.cost.evaluations},
          {"cpu_s", r.cpu_s},
          {"energy",
           {{"max_rel_error", r.energy.max_rel_error},
            {"rms_rel_error", r.energy.rms_rel_error},
            {"growth_exponent", r.energy.growth_exponent},
            {"growth_unknown", to_string(r.energy.unknown)},
            {"drift_per_s", r.energy.drift_per_s},
            {"drift_is_significant", r.energy.drift_is_significant}}},
          {"linear_momentum_error", r.linear_momentum_error},
          {"angular_momentum_error", r.angular_momentum_error},
          {"quaternion_norm_error", r.quaternion_norm_error},
          {"trajectory_error", number_or_null(t.trajectory_error)},
          {"observed_order", number_or_null(order_at(m, i))}};
}

Json trials(const Comparison& c) {
  Json list = Json::array();
  for (const auto& m : c.methods)
    for (size_t i = 0; i < m.trials.size(); ++i) list.push_back(trial(m, i));
  return list;
}

Json lyapunov(const Sensitivity& s) {
  return {{"exponent_per_s", s.exponent_per_s},
          {"time_s", s.chaotic ? Json(1 / s.exponent_per_s) : Json(nullptr)},
          {"chaotic", s.chaotic},
          {"observed_s", s.observed_s},
          {"growth", s.growth}};
}

Json trajectory(const Comparison& c) {
  Json j = {{"time_s", c.trajectory_time_s}, {"growth_limit", trajectory_growth}};
  j["reference"] = c.reference ? Json(c.reference->made_by) : Json(nullptr);
  j["reference_error"] = c.reference ? Json(c.reference->error) : Json(nullptr);
  return j;
}

Json advice(const Advice& a) {
  Json list = Json::array();
  for (const Reach& r : a.reaching)
    list.push_back({{"method", r.of->method.name},
                    {"step_s", r.step_s},
                    {"rtol", number_or_null(r.rtol)},
                    {"iteration_tolerance", number_or_null(r.iteration_tolerance)},
                    {"step_control", to_string(r.of->control)},
                    {"step_control_rate", number_or_null(r.control_rate)},
                    {"step_control_length", number_or_null(r.control_length)},
                    {"cpu_s", r.cpu_s},
                    {"or_coarser", r.at_most},
                    {"drifts", r.drifts}});
  return {{"target", a.target}, {"sentence", a.sentence}, {"reaching", list}};
}

Json cut_short(const Comparison& c) {
  Json list = Json::array();
  for (const auto& m : c.methods)
    if (m.cut_short) list.push_back(m.label());
  return list;
}

// --- the table -----------------------------------------------------------------------------------

std::string digits(double x) { return std::isfinite(x) ? fmt::format("{:.1e}", x) : "-"; }

/// Of a quantity that may be none of this scene, and then is 0.
std::string invariant(double error) { return error == 0 ? "-" : digits(error); }

std::string growth(const EnergyReport& e) {
  if (!std::isfinite(e.growth_exponent)) return "-";
  return fmt::format("{:.2f}{}", e.growth_exponent, drifts(e) ? " drift" : "");
}

std::vector<std::string> row(const MethodTrials& m, size_t i) {
  const Trial& t = m.trials[i];
  const RunReport& r = t.report;
  const auto order = order_at(m, i);
  const std::string setting = t.setting.rtol > 0 ? fmt::format("rtol {:.0e}", t.setting.rtol)
                                                 : fmt::format("{:.4g} s", t.setting.step);
  if (!t.complete())
    return {m.label(),
            setting,
            digits(r.cpu_s),
            std::to_string(r.steps),
            std::to_string(r.cost.evaluations),
            fmt::format("at {:.4g} s: {}", r.simulated_s, t.failure)};
  return {m.label(),
          setting,
          digits(r.cpu_s),
          std::to_string(r.steps),
          std::to_string(r.cost.evaluations),
          digits(r.energy.max_rel_error),
          growth(r.energy),
          invariant(r.linear_momentum_error),
          invariant(r.angular_momentum_error),
          invariant(r.quaternion_norm_error),
          t.trajectory_error ? digits(*t.trajectory_error) : "-",
          order ? fmt::format("{:.1f}", *order) : "-"};
}

/// A failed trial's reason is long and must not widen a column: it is removed from the table and
/// appended at the end of its line.
std::string rows_text(const Comparison& c, double target, TrialRows which) {
  TextRows rows{{"method", "step", "CPU [s]", "steps", "evaluations", "energy", "growth",
                 "lin. mom.", "ang. mom.", "|quat.|", "trajectory", "order"}};
  std::vector<std::string> ends{""};
  for (const auto& m : c.methods) {
    if (m.trials.empty()) continue;
    const bool all = which == TrialRows::all;
    const size_t first = all ? 0 : nearest_trial(c, m, target);
    for (size_t i = first; i < (all ? m.trials.size() : first + 1); ++i) {
      auto cells = row(m, i);
      const bool complete = m.trials[i].complete();
      ends.push_back(complete ? "" : "  " + cells.back());
      if (!complete) cells.pop_back();
      rows.push_back(std::move(cells));
    }
  }
  const std::string text = aligned(rows);
  std::string out;
  size_t at = 0;
  for (const auto& end : ends) {
    const size_t stop = text.find('\n', at);
    out += text.substr(at, stop - at) + end + "\n";
    at = stop + 1;
  }
  return out;
}

std::string lyapunov_text(const Comparison& c) {
  const Sensitivity& s = c.sensitivity;
  if (s.observed_s == 0) return "Growth of small deviations: not known.\n";
  if (!s.chaotic)
    return fmt::format(
        "A small deviation grew by {:.2g} in {:.4g} s; no exponential growth was seen in that "
        "time.\n",
        s.growth, s.observed_s);
  return fmt::format(
      "Largest Lyapunov exponent {:.2g} per s (time {:.3g} s), from a tangent run over {:.4g} s.\n",
      s.exponent_per_s, 1 / s.exponent_per_s, s.observed_s);
}

std::string trajectory_text(const Comparison& c) {
  if (!c.reference) return "";
  return fmt::format(
      "Trajectories are compared at {:.4g} s, {} a deviation at the start has grown by {:.0e}.\n"
      "Reference: {}, known to {:.1e}.\n",
      c.trajectory_time_s,
      c.sensitivity.time_of_growth(trajectory_growth) < c.sensitivity.observed_s ? "when"
                                                                                 : "before",
      trajectory_growth, c.reference->made_by, c.reference->error);
}

}  // namespace

std::string comparison_json(const Scene& scene, const Comparison& c) {
  Json j;
  j["title"] = c.title;
  j["duration_s"] = c.duration_s;
  j["scene_duration_s"] = c.scene_duration_s;
  j["first_step_s"] = c.step_s;
  j["error"] = c.by_energy ? "energy" : "trajectory";
  j["budget_s"] = c.budget_s;
  j["cpu_s"] = c.cpu_s;
  j["wall_s"] = c.wall_s;
  j["interrupted"] = c.interrupted;
  j["lyapunov"] = lyapunov(c.sensitivity);
  j["trajectory"] = trajectory(c);
  j["runs"] = trials(c);
  j["cut_short"] = cut_short(c);
  j["skipped"] = Json::array();
  for (const auto& [name, reason] : c.skipped)
    j["skipped"].push_back({{"method", name}, {"reason", reason}});
  j["advice"] = advice(advise(c, scene.target()));
  j["notes"] = c.notes;
  for (const auto& [name, value] : provenance(scene)) j["provenance"][name] = value;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string comparison_table(const Scene& scene, const Comparison& c, TrialRows which) {
  std::string text = fmt::format("{}: {:g} s simulated\n", c.title, c.duration_s);
  text += lyapunov_text(c) + trajectory_text(c) + "\n" + rows_text(c, scene.target(), which) + "\n";
  if (which == TrialRows::nearest)
    text += fmt::format(
        "note     of each method the trial nearest to the target {:.2g}; all are in compare.txt "
        "(--all prints them)\n",
        scene.target());
  for (const auto& [name, reason] : c.skipped) text += fmt::format("skipped  {}\n", reason);
  const auto names_of = [&](auto chosen) {
    std::string names;
    for (const auto& m : c.methods)
      if (chosen(m)) add_to_list(names, m.label());
    return names;
  };
  const std::string exact = names_of([&](const auto& m) { return !c.speaks_of(m); });
  if (!exact.empty())
    text += fmt::format(
        "note     not in the advice, since any step keeps their energy (judge them by the "
        "trajectory): {}\n",
        exact);
  if (const auto not_believed = names_of(Comparison::contradicted); !not_believed.empty()) {
    double worst = 0;
    for (const auto& m : c.methods)
      if (Comparison::contradicted(m))
        for (const auto& t : m.trials)
          if (t.complete()) worst = std::fmax(worst, t.report.energy.max_rel_error);
    text += fmt::format(
        "note     declared to keep the energy with any step, and these trials do not: {} (errors "
        "up to {:.2g}, expected below {:g})\n",
        not_believed, worst, no_exact_energy);
  }
  for (const auto& m : c.methods)
    if (const auto order = c.order_below_declared(m))
      text += fmt::format("note     {} is declared of order {}, and these trials show {:.1f}\n",
                          m.label(), m.method.order, *order);
  if (!names_of([](const auto& m) { return m.short_sweeps; }).empty())
    text +=
        "note     \"short\": iterations stopped at the error of the run above with the same step "
        "(iteration_tolerance in a scene)\n";
  const std::string names = names_of([](const auto& m) { return m.cut_short; });
  if (!names.empty())
    text += fmt::format("note     the budget of {:g} s left no room for finer trials of {}\n",
                        c.budget_s, names);
  for (const auto& note : c.notes) text += "note     " + note + "\n";
  if (c.interrupted) text += "note     interrupted: trials are missing\n";
  return text + "\n" + advise(c, scene.target()).sentence + "\n";
}

void write_comparison(const std::string& folder, const Scene& scene, const Comparison& c) {
  write_together(folder, {{"work_precision.svg", work_precision_plot(c, scene.target())},
                          {"compare.txt", comparison_table(scene, c)},
                          {"compare.json", comparison_json(scene, c)}});
}

}  // namespace porthos::scene
