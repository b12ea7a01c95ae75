#include "scene/session/report_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/json-inl.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;

RunReport::Named named(const Json& j) {
  RunReport::Named list;
  for (const auto& [name, joule] : j.items()) list.emplace_back(name, joule.get<double>());
  return list;
}
std::int64_t count(const Json& j) {
  if (j.is_number_float()) throw InvalidArgument(j.dump() + " is no count");
  return j.get<std::int64_t>();
}
/// The place of a note; -1: none.
std::int16_t note_at(const Json& summary, const char* key) {
  const std::int64_t at = summary.value(key, std::int64_t(-1));
  return at >= 0 && at < std::int64_t(summary.at("notes").size()) ? std::int16_t(at) : -1;
}

space::LedgerReport read_ledger(const Json& j, const char* name) {
  const Json& l = j[name];
  return {name,
          json_number(l.at("initial_J")),
          json_number(l.at("change_J")),
          json_number(l.at("defect_J")),
          json_number(l.at("largest_defect_J")),
          json_number(l.at("scale_J")),
          json_number(l.at("turned_over_J")),
          named(l.at("works_J"))};
}
space::SpaceReport read_space(const Json& j) {
  space::SpaceReport s;
  s.orbital = read_ledger(j, "orbital");
  s.coupling = read_ledger(j, "coupling");
  s.harmonics = read_ledger(j, "harmonics");
  const Json& L = j.at("angular_momentum");
  s.angular_momentum = json_number(L.at("largest_kg_m2_s"));
  s.angular_impulse = json_number(L.at("gradient_impulse_kg_m2_s"));
  s.angular_defect = json_number(L.at("largest_relative_defect"));
  s.next_order = json_number(j.at("neglected_next_order"));
  return s;
}

Impulses read_impulses(const Json& j) {
  Impulses all;
  for (const auto& [name, i] : j.at("impulses").items()) {
    ImpulseRow row{.name = name, .type = i.at("type")};
    row.angular = i.at("angular_impulse_Nms").get<std::array<double, 3>>();
    if (i.contains("impulse_Ns")) {
      row.impulse = i.at("impulse_Ns").get<std::array<double, 3>>();
      row.on_s = i.at("on_s");
      row.propellant_kg = i.at("propellant_kg");
    }
    all.rows.push_back(row);
  }
  if (j.contains("momentum_less_impulses")) {
    all.linear_left = json_number(j.at("momentum_less_impulses").at("linear"));
    all.angular_left = json_number(j.at("momentum_less_impulses").at("angular"));
  }
  return all;
}

RunReport report_of(const Json& j, const phs::State& end) {
  RunReport r;
  r.steps = count(j.at("steps"));
  r.records = count(j.at("records"));
  r.simulated_s = json_number(j.at("simulated_s"));
  r.cpu_s = json_number(j.at("cpu_s"));
  r.wall_s = json_number(j.at("wall_s"));
  r.cost.evaluations = count(j.at("evaluations"));
  r.cost.steps = r.steps;
  const double sweeps = json_number(j.at("sweeps_per_step")) * double(r.steps);
  r.cost.factorisations = j.contains("factorisations") ? count(j.at("factorisations")) : 0;
  if (std::abs(sweeps) < 1e18) r.cost.sweeps = std::llround(sweeps);
  const Json &e = j.at("energy"), &b = j.at("balance");
  r.energy = {json_number(e.at("initial_J")),
              json_number(e.at("scale_J")),
              json_number(e.at("max_abs_error_J")),
              json_number(e.at("max_rel_error")),
              json_number(e.at("rms_rel_error")),
              json_number(e.at("growth_exponent")),
              json_number(e.at("drift_per_s")),
              e.at("drift_is_significant").get<bool>(),
              j.contains("centre_of_mass"),
              named(e.at("scale_parts_J")),
              e.value("swing_growth", 1.0),
              json_number(e.value("jump_s", Json())),
              json_number(e.value("jump", Json())),
              e.value("jump_then", ""),
              e.value("slows", false),
              growth_unknown(e.value("growth_unknown", "")),
              e.value("kinks", false)};
  r.looks = count(j.at("looks"));
  r.linear_momentum_error = json_number(j.at("linear_momentum").at("max_rel_error"));
  r.angular_momentum_error = json_number(j.at("angular_momentum").at("max_rel_error"));
  r.quaternion_norm_error = json_number(j.at("quaternion_norm").at("max_error"));
  if (j.contains("constraints")) {
    const Json& c = j.at("constraints");
    r.constraint_rows = c.at("rows");
    r.constraint_gap = json_number(c.at("max_gap"));
    r.constraint_slip = json_number(c.at("max_slip"));
  }
  r.stored_J = json_number(b.at("stored_J"));
  r.supplied_J = json_number(b.at("supplied_J"));
  r.dissipated_J = json_number(b.at("dissipated_J"));
  r.defect_J = json_number(b.at("defect_J"));
  r.turned_over_J = json_number(b.at("turned_over_J"));
  r.storages = named(b.at("storages"));
  r.ports = named(b.at("ports"));
  r.losses = named(b.at("losses"));
  if (b.contains("delivered")) r.delivered = named(b.at("delivered"));
  for (const auto& [key, list] : {std::pair{"impacts", &r.impacts}, {"slips", &r.slips}})
    if (j.contains(key))
      for (const auto& [name, i] : j.at(key).items())
        list->push_back({name, count(i.at("count")), i.at("first_s").get<std::vector<double>>()});
  for (const auto& c : j.at("checks"))
    r.checks.push_back({c.at("name"), json_number(c.at("value")), json_number(c.at("limit")),
                        c.at("pass"), c.at("telling")});
  for (const auto& n : j.at("not_applicable"))
    r.not_applicable.push_back({n.at("name"), n.at("why"), n.value("undecided", false)});
  for (const auto& n : j.at("notes")) r.notes.push_back(n);
  r.delivered_note = note_at(j, "delivered_note");
  r.newton_note = note_at(j, "newton_note");
  if (j.contains("momentum"))
    for (const auto& [name, m] : j.at("momentum").items())
      r.momentum.push_back({name, json_number(m.at("start_Nms")), json_number(m.at("end_Nms")),
                            json_number(m.at("largest_Nms"))});
  if (j.contains("outputs"))
    for (const auto& [name, o] : j.at("outputs").items())
      r.outputs.push_back({name, o.at("unit"), json_number(o.at("start")), json_number(o.at("end")),
                           json_number(o.at("least")), json_number(o.at("largest"))});
  if (j.contains("stopped_by")) {
    const Json& s = j.at("stopped_by");
    r.stopped = {s.at("name"), s.at("condition"), json_number(s.at("at_s")), s.at("fails")};
  }
  if (j.contains("ledgers")) r.space = read_space(j.at("ledgers"));
  if (j.contains("impulses")) r.impulses = read_impulses(j);
  r.final_state = end;
  return r;
}

}  // namespace

RunReport read_report(const std::filesystem::path& folder, const phs::State& end) try {
  return report_of(Json::parse(read_file(folder / "summary.json")), end);
} catch (const nlohmann::json::exception& e) {
  throw InvalidArgument(fmt::format("{}: {}, expected the summary of a run",
                                    (folder / "summary.json").string(), e.what()));
}

}  // namespace porthos::scene
