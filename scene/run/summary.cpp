#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "mechanics/rotation.h"
#include "scene/run/growth_words.h"
#include "scene/run/provenance.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;  // writes non-finite numbers as null

Json slice(std::span<const double> values, int at, int size) {
  if (size == 1) return values[size_t(at)];
  return std::vector<double>(values.begin() + at, values.begin() + at + size);
}

/// The true angle of an angle block: x + lo + 2π·turns.
double angle(const phs::State& s, int at, size_t turn) {
  constexpr long double two_pi = 6.283185307179586476925286766559005768394L;
  const long double x = static_cast<long double>(s.x[size_t(at)]) + s.lo[size_t(at)];
  return static_cast<double>(x + two_pi * static_cast<long double>(s.turns[turn]));
}

/// The rate of a place along the axes of the parent, of a joint that turns too: v has it along the
/// body's.
std::vector<double> in_parent(const mechanics::Mechanism& m, const mechanics::JointCoordinates& c,
                              std::span<const double> q, std::span<const double> v) {
  const auto turns = [&](const auto& other) {
    return other.joint == c.joint && other.kind == phs::BlockKind::rotation;
  };
  const auto beside = std::ranges::find_if(m.coordinates(), turns);
  mechanics::Vec3d rate{v[size_t(c.v)], v[size_t(c.v) + 1], v[size_t(c.v) + 2]};
  if (beside != m.coordinates().end())
    rate = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[size_t(beside->q)])) *
           rate;
  return {rate.x, rate.y, rate.z};
}

/// inner: the state as integrated. Rates are computed from it, so they have no rounding error of a
/// common velocity.
Json final_state(const Assembly& a, double t, const phs::State& inner) {
  WorldView view(a);
  const phs::State& s = view(t, inner);
  Json q = Json::object(), rates = Json::object(), p = Json::object();
  size_t turn = 0;
  const int mechanical = a.mechanism ? 2 * a.mechanism->nq() : 0;
  for (const auto& b : a.model->description().blocks) {  // elements and systems of the user's own
    if (b.at < mechanical) continue;
    q[b.name] = slice(s.x, b.at, b.size);
    if (b.momentum >= 0) p[b.name] = slice(s.x, b.momentum, b.size);
  }
  if (!a.mechanism) return {{"q", q}, {"p", p}};
  const auto& m = *a.mechanism;
  auto v = a.mechanical->rates(std::span(inner.x).first(size_t(mechanical)), inner.turns);
  const auto added = view.added_rates();
  for (size_t i = 0; i < added.size(); ++i) v[i] = double(v[i] + added[i]);
  for (const auto& c : m.coordinates()) {
    q[c.name] = slice(s.x, c.q, c.nq);
    if (c.kind == phs::BlockKind::angle) q[c.name] = angle(s, c.q, turn++);
    rates[c.name] = c.kind == phs::BlockKind::linear && c.nv == 3 ? Json(in_parent(m, c, s.x, v))
                                                                  : slice(v, c.v, c.nv);
    p[c.name] = slice(s.x, m.nq() + c.q, c.nq);
  }
  return {{"q", q}, {"v", rates}, {"p", p}};
}

Json energy(const RunReport& r) {
  const EnergyReport& e = r.energy;
  Json parts = Json::object();
  for (const auto& [name, joule] : e.scale_parts) parts[name] = joule;
  const bool seen = !only_start(r), known = seen && !energy_overflowed(r);
  return {{"initial_J", e.initial_J},
          {"scale_J", e.scale_J},
          {"scale_parts_J", parts},
          {"max_abs_error_J", seen ? e.max_abs_error_J : NAN},
          {"max_rel_error", known ? e.max_rel_error : NAN},
          {"rms_rel_error", known ? e.rms_rel_error : NAN},
          {"growth_exponent", e.growth_exponent},
          {"drift_per_s", e.drift_per_s},
          {"drift_is_significant", e.drift_is_significant},
          {"swing_growth", e.swing_growth},
          {"jump_s", e.jump_s},
          {"jump", e.jump},
          {"jump_then", e.jump_then},
          {"slows", e.slows},
          {"growth_unknown", to_string(e.unknown)},
          {"kinks", e.kinks},
          {"growth", growth_words(r)}};
}

Json balance(const RunReport& r) {
  const auto named = [](const RunReport::Named& list) {
    Json j = Json::object();
    for (const auto& [name, joule] : list) j[name] = joule;
    return j;
  };
  return {{"stored_J", r.stored_J},           {"supplied_J", r.supplied_J},
          {"dissipated_J", r.dissipated_J},   {"defect_J", r.defect_J},
          {"turned_over_J", r.turned_over_J}, {"storages", named(r.storages)},
          {"ports", named(r.ports)},          {"losses", named(r.losses)},
          {"delivered", named(r.delivered)}};
}

Json momentum(const RunReport& r) {
  Json j = Json::object();
  for (const MomentumRow& m : r.momentum)
    j[m.name] = {{"start_Nms", m.start},
                 {"end_Nms", m.end},
                 {"largest_Nms", m.largest},
                 {"largest_of", m.at_steps ? "steps" : "records"}};
  return j;
}

Json outputs(const RunReport& r) {
  Json j = Json::object();
  for (const OutputRow& o : r.outputs)
    j[o.name] = {{"unit", o.unit},
                 {"start", o.start},
                 {"end", o.end},
                 {"least", o.least},
                 {"largest", o.largest}};
  return j;
}

Json impulses(const RunReport& r) {
  Json j = Json::object();
  for (const ImpulseRow& row : r.impulses.rows) {
    Json& one = j[row.name];
    one["type"] = row.type;
    if (row.type != "torquer") one["impulse_Ns"] = row.impulse;
    if (row.type == "thruster") {
      one["on_s"] = row.on_s;
      one["propellant_kg"] = row.propellant_kg;
    }
    one["angular_impulse_Nms"] = row.angular;
  }
  return j;
}

Json ledger(const space::LedgerReport& l) {
  Json works = Json::object();
  for (const auto& [name, joule] : l.works) works[name] = joule;
  return {{"initial_J", l.initial},
          {"change_J", l.change},
          {"works_J", works},
          {"defect_J", l.defect},
          {"largest_defect_J", l.largest_defect},
          {"scale_J", l.scale},
          {"turned_over_J", l.turned_over},
          {"largest_relative_defect", l.relative()}};
}

/// Three ledgers and no total: docs/space.md.
Json ledgers(const RunReport& r) {
  const auto& s = *r.space;
  return {{"orbital", ledger(s.orbital)},
          {"internal",
           {{"initial_J", r.energy.initial_J},
            {"change_J", r.stored_J},
            {"supplied_J", r.supplied_J},
            {"dissipated_J", r.dissipated_J},
            {"defect_J", r.defect_J},
            {"largest_defect_J", r.energy.max_abs_error_J},
            {"scale_J", r.energy.scale_J},
            {"largest_relative_defect", r.energy.max_rel_error}}},
          {"coupling", ledger(s.coupling)},
          {"harmonics", ledger(s.harmonics)},
          {"angular_momentum",
           {{"largest_kg_m2_s", s.angular_momentum},
            {"gradient_impulse_kg_m2_s", s.angular_impulse},
            {"largest_relative_defect", s.angular_defect}}},
          {"neglected_next_order", s.next_order}};
}

/// The part that the method did not integrate: the motion of the centre of mass from 0 to t.
Json centre_of_mass(const CentreOfMass& c, double t) {
  const auto list = [](const CentreOfMass::Vec& a) {
    return Json{double(a.x), double(a.y), double(a.z)};
  };
  const auto P = CentreOfMass::Real(c.mass) * c.velocity(t);
  return {{"motion", "closed form"},
          {"mass_kg", c.mass},
          {"start", {{"position_m", list(c.position(0))}, {"velocity_m_s", list(c.velocity(0))}}},
          {"end", {{"position_m", list(c.position(t))}, {"velocity_m_s", list(c.velocity(t))}}},
          {"gravity_m_s2", list(c.gravity)},
          {"linear_momentum_kg_m_s", list(P)},
          {"kinetic_start_J", c.kinetic_J(0)},
          {"kinetic_end_J", c.kinetic_J(t)},
          {"work_of_gravity_J", c.work_of_gravity_J(t)}};
}

Json checks(const RunReport& r) {
  Json list = Json::array();
  for (const Check& c : r.checks)
    list.push_back({{"name", c.name},
                    {"value", c.value},
                    {"limit", c.limit},
                    {"pass", c.pass},
                    {"telling", c.telling}});
  return list;
}

Json not_applicable(const RunReport& r) {
  Json list = Json::array();
  for (const NotApplicable& n : r.not_applicable) {
    list.push_back({{"name", n.name}, {"why", n.why}});
    if (n.undecided) list.back()["undecided"] = true;
  }
  return list;
}

/// Notes of the reader of the model file on what it interpreted or left out.
Json model_notes(const Assembly& a) {
  Json list = Json::array();
  for (const auto& note : a.notes) list.push_back(note.where + ": " + note.text);
  return list;
}

Json certificates(const Assembly& a) {
  Json list = Json::array();
  for (const auto& c : a.certificates) list.push_back(Json::parse(c.json()));
  return list;
}

}  // namespace

std::string rows_words(const RunReport& r) {
  const double mean = r.simulated_s / double(r.steps);
  return std::fabs(mean - r.step_s) < 1e-6 * mean
             ? fmt::format("{} rows, {:.6g} s apart", r.steps + 1, mean)
             : fmt::format("{} rows, {:.3g} s apart in the mean", r.steps + 1, mean);
}

std::string summary_json(const Scene& scene, const Assembly& assembly, const RunReport& r,
                         const phs::State& last) {
  Json j;
  j["title"] = r.title;
  j["method"] = r.method;
  j["step_s"] = r.step_s;
  if (r.step_control != integrators::StepControl::fixed)
    j["step_control"] = to_string(r.step_control);
  j["steps"] = r.steps;
  j["simulated_s"] = r.simulated_s;
  j["records"] = r.records;
  j["looks"] = r.looks;
  j["cpu_s"] = r.cpu_s;
  j["wall_s"] = r.wall_s;
  j["evaluations"] = r.cost.evaluations;
  j["sweeps_per_step"] = r.cost.steps > 0 ? double(r.cost.sweeps) / double(r.cost.steps) : 0.0;
  j["factorisations"] = r.cost.factorisations;
  j["outcome"] = to_string(r.outcome);
  j["energy"] = energy(r);
  j["linear_momentum"] = {{"max_rel_error", r.linear_momentum_error}};
  j["angular_momentum"] = {{"max_rel_error", r.angular_momentum_error}};
  j["quaternion_norm"] = {{"max_error", r.quaternion_norm_error}};
  if (r.constraint_rows > 0)
    j["constraints"] = {{"rows", r.constraint_rows},
                        {"max_gap", r.constraint_gap},
                        {"max_slip", r.constraint_slip}};
  j["balance"] = balance(r);
  for (const auto& [key, list] : {std::pair{"impacts", &r.impacts}, {"slips", &r.slips}})
    for (const ImpactRow& i : *list) j[key][i.name] = {{"count", i.count}, {"first_s", i.first_s}};
  if (!r.momentum.empty()) j["momentum"] = momentum(r);
  if (!r.impulses.rows.empty()) {
    j["impulses"] = impulses(r);
    if (!r.space)
      j["momentum_less_impulses"] = {{"linear", r.impulses.linear_left},
                                     {"angular", r.impulses.angular_left}};
  }
  if (!r.outputs.empty()) j["outputs"] = outputs(r);
  if (r.stopped)
    j["stopped_by"] = {{"name", r.stopped->name},
                       {"condition", r.stopped->condition},
                       {"at_s", r.stopped->at},
                       {"fails", r.stopped->fails}};
  if (r.space) j["ledgers"] = ledgers(r);
  if (assembly.centre) j["centre_of_mass"] = centre_of_mass(*assembly.centre, r.simulated_s);
  j["final_state"] = final_state(assembly, r.simulated_s, last);
  j["checks"] = checks(r);
  j["not_applicable"] = not_applicable(r);
  j["verdict"] = to_string(r.verdict());
  j["notes"] = r.notes;
  if (r.delivered_note >= 0) j["delivered_note"] = r.delivered_note;
  if (r.newton_note >= 0) j["newton_note"] = r.newton_note;
  j["model_notes"] = model_notes(assembly);
  if (!assembly.certificates.empty()) j["certificates"] = certificates(assembly);
  for (const auto& [name, value] : provenance(scene)) j["provenance"][name] = value;
  // A title or a joint name that is not UTF-8 must not prevent the summary.
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace porthos::scene
