#include "scene/report_reader.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/files.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;

RunReport::Named named(const Json& j) {
  RunReport::Named list;
  for (const auto& [name, joule] : j.items()) list.emplace_back(name, joule.get<double>());
  return list;
}
double number(const Json& j) { return j.is_number() ? j.get<double>() : NAN; }

space::LedgerReport read_ledger(const Json& j, const char* name) {
  const Json& l = j[name];
  return {name,
          number(l["initial_J"]),
          number(l["change_J"]),
          number(l["defect_J"]),
          number(l["largest_defect_J"]),
          number(l["scale_J"]),
          number(l["turned_over_J"]),
          named(l["works_J"])};
}
space::SpaceReport read_space(const Json& j) {
  space::SpaceReport s;
  s.orbital = read_ledger(j, "orbital"), s.coupling = read_ledger(j, "coupling");
  s.harmonics = read_ledger(j, "harmonics");
  const Json& L = j["angular_momentum"];
  s.angular_momentum = number(L["largest_kg_m2_s"]);
  s.angular_impulse = number(L["gradient_impulse_kg_m2_s"]);
  s.angular_defect = number(L["largest_relative_defect"]);
  s.next_order = number(j["neglected_next_order"]);
  return s;
}

}  // namespace

RunReport read_report(const std::filesystem::path& folder, const phs::State& end) {
  const Json j = Json::parse(read_file(folder / "summary.json"));
  RunReport r;
  r.steps = j["steps"], r.records = j["records"], r.simulated_s = number(j["simulated_s"]);
  r.cpu_s = number(j["cpu_s"]), r.wall_s = number(j["wall_s"]);
  r.cost.evaluations = j["evaluations"], r.cost.steps = r.steps;
  r.cost.sweeps = std::llround(number(j["sweeps_per_step"]) * double(r.steps));
  const Json &e = j["energy"], &b = j["balance"];
  r.energy = {number(e["initial_J"]),       number(e["scale_J"]),
              number(e["max_abs_error_J"]), number(e["max_rel_error"]),
              number(e["rms_rel_error"]),   number(e["growth_exponent"]),
              number(e["drift_per_s"]),     e["drift_is_significant"].get<bool>(),
              named(e["scale_parts_J"])};
  r.looks = j["looks"];
  r.linear_momentum_error = number(j["linear_momentum"]["max_rel_error"]);
  r.angular_momentum_error = number(j["angular_momentum"]["max_rel_error"]);
  r.quaternion_norm_error = number(j["quaternion_norm"]["max_error"]);
  r.stored_J = number(b["stored_J"]), r.supplied_J = number(b["supplied_J"]);
  r.dissipated_J = number(b["dissipated_J"]), r.defect_J = number(b["defect_J"]);
  r.turned_over_J = number(b["turned_over_J"]);
  r.storages = named(b["storages"]), r.ports = named(b["ports"]), r.losses = named(b["losses"]);
  for (const auto& c : j["checks"])
    r.checks.push_back(
        {c["name"], number(c["value"]), number(c["limit"]), c["pass"], c["telling"]});
  for (const auto& n : j["not_applicable"]) r.not_applicable.push_back({n["name"], n["why"]});
  for (const auto& n : j["notes"]) r.notes.push_back(n);
  if (j.contains("momentum"))
    for (const auto& [name, m] : j["momentum"].items())
      r.momentum.push_back(
          {name, number(m["start_Nms"]), number(m["end_Nms"]), number(m["largest_Nms"])});
  if (j.contains("ledgers")) r.space = read_space(j["ledgers"]);
  if (j.contains("impulses")) {
    for (const auto& [name, i] : j["impulses"].items()) {
      ImpulseRow row{.name = name, .type = i["type"]};
      row.angular = i["angular_impulse_Nms"].get<std::array<double, 3>>();
      if (i.contains("impulse_Ns")) {
        row.impulse = i["impulse_Ns"].get<std::array<double, 3>>();
        row.on_s = i["on_s"], row.propellant_kg = i["propellant_kg"];
      }
      r.impulses.rows.push_back(row);
    }
    if (j.contains("momentum_less_impulses"))
      r.impulses.linear_left = number(j["momentum_less_impulses"]["linear"]),
      r.impulses.angular_left = number(j["momentum_less_impulses"]["angular"]);
  }
  r.final_state = end;
  return r;
}

}  // namespace porthos::scene
