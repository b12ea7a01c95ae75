#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/assemble/outputs.h"
#include "scene/assemble/steps.h"
#include "scene/compare/auto_method.h"
#include "scene/session/detail/info_facts.h"
#include "scene/session/info.h"

namespace porthos::scene {
namespace {

using InfoJson = nlohmann::ordered_json;

/// null where there is none; JSON has no infinity.
InfoJson or_null(const std::optional<double>& x) { return x ? InfoJson(*x) : InfoJson(); }

InfoJson model_facts(const Scene& s, const mechanics::Mechanism& m) {
  return {{"name", m.name()},
          {"file", s.urdf_path},
          {"base", s.urdf.base == mechanics::UrdfOptions::Base::free ? "free" : "fixed"},
          {"links", m.bodies().size()},
          {"moving_bodies", m.body_count()},
          {"mass_kg", m.total_mass()},
          {"degrees_of_freedom", m.nv()}};
}

InfoJson states(const Assembly& a) {
  InfoJson list = InfoJson::array();
  for (const StateFacts& f : state_facts(a)) {
    InfoJson one = {{"name", f.block->name}, {"kind", f.kind},        {"at", f.block->at},
                    {"size", f.block->size}, {"unit", f.block->unit}, {"start", f.start}};
    if (f.block->momentum >= 0)
      one["momentum"] = {
          {"at", f.block->momentum}, {"unit", f.block->momentum_unit}, {"start", f.momentum}};
    list.push_back(std::move(one));
  }
  return list;
}

InfoJson accounts(const phs::Description& d) {
  InfoJson supplied = InfoJson::array(), dissipated = InfoJson::array();
  for (const auto& p : d.powers)
    if (p.kind != phs::PowerKind::observed)
      (p.kind == phs::PowerKind::supplied ? supplied : dissipated).push_back(p.name);
  return {{"stored", d.storages}, {"supplied", supplied}, {"dissipated", dissipated}};
}

InfoJson invariants(const phs::Description& d) {
  InfoJson list = InfoJson::array();
  list.push_back({{"name", "energy"}, {"size", 1}, {"degree", nullptr}, {"unit", "J"}});
  for (const auto& i : d.invariants)
    list.push_back({{"name", i.name},
                    {"size", i.size},
                    {"degree", i.degree ? InfoJson(i.degree) : InfoJson()},
                    {"unit", i.unit}});
  return list;
}

InfoJson constraints(const Assembly& a) {
  const auto facts = constraint_facts(a);
  if (!facts) return nullptr;
  InfoJson blocks = InfoJson::array();
  for (const auto& b : facts->blocks)
    blocks.push_back({{"name", b.name},
                      {"kind", b.kind},
                      {"rows", b.rows},
                      {"independent", b.independent},
                      {"unique_reaction", b.unique}});
  return {{"rows", facts->rows},
          {"rank", facts->rank},
          {"smallest_pivot", facts->pivot},
          {"blocks", blocks}};
}

InfoJson integrator(const Scene& s) {
  const Steps steps = steps_of(s);
  return {{"method", s.method},
          {"step_s", s.step},
          {"steps", steps.total},
          {"duration_s", steps.time(steps.total)},
          {"record_every_s", double(steps.every) * s.step}};
}

InfoJson plan(const Scene& s, const Assembly& a) {
  InfoJson j = InfoJson::object();
  for (const auto& row : plan_rows(s, a)) {
    std::string name = row[0];
    std::replace(name.begin(), name.end(), ' ', '_');
    j[name] = row[1];
  }
  return j;
}

InfoJson controllers(const Scene& s, const Assembly& a) {
  InfoJson list = InfoJson::array();
  for (size_t i = 0; i < a.certificates.size(); ++i) {
    const Controller& c = s.controllers[i];
    list.push_back({{"name", c.name},
                    {"type", c.type},
                    {"rate_Hz", c.rate > 0 ? InfoJson(c.rate) : InfoJson()},
                    {"tank_J", c.tank ? InfoJson(c.tank->level) : InfoJson()},
                    {"certificate", InfoJson::parse(a.certificates[i].json())}});
  }
  return list;
}

InfoJson outputs(const Scene& s, const Assembly& a) {
  InfoJson list = InfoJson::array();
  if (s.outputs.empty()) return list;
  for (const OutputColumn& o : output_columns(s, a))
    list.push_back({{"name", o.name}, {"size", o.size}, {"unit", o.unit}});
  return list;
}

InfoJson stops(const Scene& s) {
  InfoJson list = InfoJson::array();
  for (const Stop& stop : s.stops)
    list.push_back({{"output", stop.output},
                    {stop.above ? "above" : "below", stop.limit},
                    {"fails", stop.is_requirement()},
                    {"ends", stop.ends}});
  return list;
}

InfoJson not_simulated(const Scene& s, const mechanics::Mechanism& m) {
  InfoJson list = InfoJson::array();
  for (const LeftOut& j : left_out_facts(m, s.urdf.use_friction)) {
    InfoJson one = {{"joint", j.joint}};
    if (j.lower || j.upper)
      one["limits"] = {{"lower", or_null(j.lower)}, {"upper", or_null(j.upper)}, {"unit", j.unit}};
    if (j.friction > 0) one["friction"] = {{"value", j.friction}, {"unit", j.friction_unit}};
    list.push_back(std::move(one));
  }
  return list;
}

InfoJson notes(const Assembly& a) {
  InfoJson list = InfoJson::array();
  for (const auto& n : a.notes) list.push_back({{"where", n.where}, {"text", n.text}});
  return list;
}

InfoJson events(const Scene& scene, const Assembly& a) {
  InfoJson list = InfoJson::array();
  for (const EventFacts& e : event_facts(scene, a)) {
    list.push_back({{"event", e.what}, {"when", e.when}});
    if (e.apart) list.back()["apart_at_start_m"] = *e.apart;
    if (e.reach) list.back()["reach_m"] = *e.reach;
  }
  return list;
}

}  // namespace

std::string info_json(const Scene& asked, const Assembly& assembly) {
  const Scene scene = with_method_chosen(asked, assembly);
  refuse_as_run(scene, assembly);
  const mechanics::Mechanism& m = *assembly.mechanism;
  const auto& d = assembly.model->description();
  InfoJson ports = InfoJson::array();
  for (const auto& p : d.ports)
    ports.push_back({{"name", p.name},
                     {"size", p.size},
                     {"input_unit", p.input_unit},
                     {"output_unit", p.output_unit}});
  const EvaluationCost ns = evaluation_cost(assembly);
  const InfoJson j = {{"title", scene.title},
                      {"model", model_facts(scene, m)},
                      {"states", states(assembly)},
                      {"ports", ports},
                      {"energy_accounts", accounts(d)},
                      {"invariants", invariants(d)},
                      {"constraints", constraints(assembly)},
                      {"integrator", integrator(scene)},
                      {"plan", plan(scene, assembly)},
                      {"controllers", controllers(scene, assembly)},
                      {"events", events(scene, assembly)},
                      {"outputs", outputs(scene, assembly)},
                      {"stops", stops(scene)},
                      {"not_simulated", not_simulated(scene, m)},
                      {"notes", notes(assembly)},
                      {"evaluation_ns", {{"one_state", ns.one}, {"each_of_eight", ns.of_eight}}}};
  return j.dump(2) + "\n";
}

}  // namespace porthos::scene
