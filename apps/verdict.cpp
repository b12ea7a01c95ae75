#include "apps/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/files/text_table.h"
#include "scene/run/growth_words.h"
#include "scene/run/verdict.h"

namespace porthos::apps {
namespace {

using scene::RunReport;
using scene::TextRows;

std::string checks_text(const RunReport& r) {
  TextRows rows{{"check", "value", "limit"}};
  for (const auto& c : r.checks)
    if (c.name == "outcome")
      rows.push_back({"end reached", "no", "-", "FAIL"});
    else
      rows.push_back({c.name, fmt::format("{:.3g}", c.value), fmt::format("{:.3g}", c.limit),
                      c.pass ? "pass" : "FAIL"});
  for (const auto& n : r.not_applicable)
    rows.push_back({n.name, "-", "-", "not applicable: " + n.why});
  return scene::aligned(rows);
}

std::string energy_text(const RunReport& r) {
  const auto& e = r.energy;
  const std::string start = fmt::format("start {:.9g} J{}, ", e.initial_J,
                                        e.about_centre ? " about the centre of mass" : "");
  const std::string error = "the error " + scene::growth_words(r);
  if (scene::only_start(r)) return start + error;
  const std::string seen = fmt::format("seen at {} records and {} steps between\n            {}",
                                       r.records, r.looks, error);
  if (scene::energy_overflowed(r))
    return fmt::format("{}error max {:.3g} J, {}", start, e.max_abs_error_J, seen);
  std::string scale;
  double parts = 0;
  for (const auto& [name, joule] : e.scale_parts) {
    scale += fmt::format("{}{} {:.3g}", scale.empty() ? "" : " + ", name, joule);
    parts += joule;
  }
  if (scene::next_to_nothing_moves(e))
    scale = "the energy at the start, beside which next to nothing moves";
  else if (e.scale_J > 1.001 * parts && !scale.empty())
    scale = "exchanged by sources and losses; stored: " + scale;
  const std::string rms =
      std::isfinite(e.rms_rel_error) ? fmt::format(", rms {:.3g} relative", e.rms_rel_error) : "";
  return fmt::format(
             "{}error max {:.3g} J = {:.3g} relative{}\n            relative to {:.4g} J ({}), {}",
             start, e.max_abs_error_J, e.max_rel_error, rms, e.scale_J,
             scale.empty() ? "no energy stored" : scale, seen) +
         (e.drift_is_significant
              ? ""
              : fmt::format("; drift {:.2g} per s, not significant", e.drift_per_s));
}

/// Three ledgers, never one total.
std::string space_text(const RunReport& r) {
  const auto& s = *r.space;
  TextRows rows{{"ledger", "start J", "change J", "largest residual J", "relative"}};
  const auto add = [&](const char* name, double start, double change, double defect, double rel) {
    rows.push_back({name, fmt::format("{:.6g}", start), fmt::format("{:.6g}", change),
                    fmt::format("{:.3g}", defect), fmt::format("{:.3g}", rel)});
  };
  const auto& o = s.orbital;
  add("orbital", o.initial, o.change, o.largest_defect, o.relative());
  add("internal", r.energy.initial_J, r.stored_J, r.energy.max_abs_error_J, r.energy.max_rel_error);
  for (const auto* l : {&s.coupling, &s.harmonics})
    if (l->scale > 0) add(l->name.c_str(), l->initial, l->change, l->largest_defect, l->relative());
  return scene::aligned(rows) +
         fmt::format(
             "            coupling: the gradient exchanged {:.4g} J, the residual is {:.2g} of "
             "that\n",
             s.coupling.turned_over,
             s.coupling.turned_over > 0 ? s.coupling.largest_defect / s.coupling.turned_over
                                        : 0.0) +
         fmt::format(
             "            angular momentum up to {:.4g} kg m^2/s, impulse of {} "
             "{:.4g}, what is left {:.2g} relative\n",
             s.angular_momentum,
             r.impulses.rows.empty() ? "the gradient" : "gradient, thrusters and torquers",
             s.angular_impulse, s.angular_defect) +
         fmt::format("            neglected next order of the gradient {:.2g} relative\n",
                     s.next_order);
}

std::string momentum_text(const RunReport& r) {
  TextRows rows{{"momentum", "start N m s", "end N m s", "largest N m s", "seen at"}};
  for (const auto& m : r.momentum)
    rows.push_back({m.name, fmt::format("{:.6g}", m.start), fmt::format("{:.6g}", m.end),
                    fmt::format("{:.6g}", m.largest),
                    m.at_steps ? "all steps" : "records (more: [run] extrema)"});
  return scene::aligned(rows);
}

std::string impulses_text(const RunReport& r) {
  TextRows rows{{"actuator", "impulse N s", "angular impulse N m s", "on s", "propellant kg"}};
  const auto three = [](const std::array<double, 3>& a) {
    return fmt::format("{:.5g} {:.5g} {:.5g}", a[0], a[1], a[2]);
  };
  for (const auto& i : r.impulses.rows) {
    const bool thruster = i.type == "thruster";
    rows.push_back({i.name, thruster ? three(i.impulse) : "-", three(i.angular),
                    thruster ? fmt::format("{:.6g}", i.on_s) : "-",
                    i.propellant_kg > 0 ? fmt::format("{:.4g}", i.propellant_kg) : "-"});
  }
  std::string text = scene::aligned(rows);
  if (!r.space)
    text += fmt::format(
        "            momenta less impulses: linear off by {:.2g}, angular by {:.2g}, relative\n",
        r.impulses.linear_left, r.impulses.angular_left);
  return text;
}

std::string cost_text(const RunReport& r) {
  const double steps = r.cost.steps > 0 ? double(r.cost.steps) : 1;
  return fmt::format("{:.3g} s CPU, {:.3g} us per step, {:.2f} iterations per step, {} evaluations",
                     r.cpu_s, 1e6 * r.cpu_s / steps, double(r.cost.sweeps) / steps,
                     r.cost.evaluations);
}

}  // namespace

const char* verdict_word(scene::Verdict v) {
  return v == scene::Verdict::fail ? "FAIL" : to_string(v);
}

std::string verdict_text(const RunReport& r, const std::string& out, bool has_page) {
  std::string text =
      r.method == "recorded"
          ? fmt::format("{}: recorded, {}, {:.6g} s\n\n", r.title, rows_words(r), r.simulated_s)
          : fmt::format("{}: {}, {} steps {} {} s, {} s simulated\n\n", r.title, r.method, r.steps,
                        r.step_control == integrators::StepControl::fixed
                            ? "of"
                            : fmt::format("({}) from", to_string(r.step_control)),
                        r.step_s, r.simulated_s);
  text += checks_text(r) + "\n";
  if (r.space) text += space_text(r) + "\n";
  if (!r.momentum.empty()) text += momentum_text(r) + "\n";
  if (!r.impulses.rows.empty()) text += impulses_text(r) + "\n";
  text += "energy      " + energy_text(r) + "\n";
  if (r.method != "recorded") text += "cost        " + cost_text(r) + "\n";  // the judge's own
  const std::string pictures = std::string("run.h5, energy_error.svg, ledger.svg, motion.svg") +
                               (r.space ? ", ledgers.svg" : "");
  const char* page = has_page ? ", report.html" : "";
  text += r.phases == 0 ? fmt::format("results     {}/: summary.json, {}{}\n", out, pictures, page)
                        : fmt::format("results     {}/: summary.json; phase_1{}: {}{}\n", out,
                                      r.phases > 1 ? fmt::format(" … phase_{}", r.phases) : "",
                                      pictures, has_page ? "; report.html" : "");
  for (const auto& note : r.notes) text += "note        " + note + "\n";
  text += fmt::format("verdict     {}\n", verdict_word(r.verdict()));
  return text;
}

}  // namespace porthos::apps
