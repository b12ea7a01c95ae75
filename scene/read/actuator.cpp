#include "scene/read/actuator.h"

#include <fmt/format.h>

#include <set>

#include "mechanics/mechanical_model.h"
#include "phs/network/elements.h"
#include "scene/read/element.h"
#include "scene/read/toml_table-inl.h"
#include "vsa/catalogue.h"
#include "vsa/formula.h"
#include "vsa/table.h"

namespace porthos::scene {
namespace {

using DriveKind = vsa::Drive::Kind;

/// `effort`: unit of what drives this coordinate; `angle`: its own.
vsa::Drive read_drive(const Table& t, const std::string& angle) {
  vsa::Drive d;
  const std::string kind = t.choice("drive");
  const std::vector<std::pair<const char*, Names>> own{
      {"fixed", {}},
      {"torque",
       {"command", "inertia", "gear", "viscous", "coulomb", "smoothing", "torque_limit",
        "rate_limit", "gyroscopics"}},
      {"position",
       {"command", "inertia", "gear", "viscous", "coulomb", "smoothing", "torque_limit",
        "rate_limit", "kp", "kd", "gyroscopics"}},
      {"rate", {"command", "rate_limit"}},
      {"servo", {"command", "servo"}}};
  static const std::set<std::string> losses{"viscous", "coulomb", "smoothing"};
  for (size_t i = 0; i < own.size(); ++i) {
    if (kind != own[i].first) continue;
    d.kind = DriveKind(i);
    for (const SchemaKey& key : schema_of("actuator.drive")->keys)
      if (key.name != "start" && key.name != "drive" && t.has(key.name.c_str()) &&
          std::find(own[i].second.begin(), own[i].second.end(), key.name) == own[i].second.end())
        t.fail(key.name.c_str(),
               fmt::format("is given with drive = \"{}\", expected {}", kind,
                           !own[i].second.empty()       ? joined(own[i].second)
                           : losses.count(key.name) > 0 ? "none: losses of the joint are an "
                                                          "[[element]] of type damper or friction"
                                                        : "no more keys"));
  }
  if (d.kind == DriveKind::fixed) return d;
  if (t.has("gyroscopics") && t.text("gyroscopics", "\"neglected\"") != "neglected")
    t.fail("gyroscopics",
           "is not \"neglected\", and a scene offers nothing else: a rotor with its gyroscopic "
           "moment is a body of the mechanism (vsa/rotor_body.h)");
  const std::string unit = d.kind == DriveKind::torque ? " of N m"
                           : d.kind == DriveKind::rate ? " of " + angle + "/s"
                                                       : " of " + angle;
  t.require("command", "a table with one of the keys constant, sine, profile");
  d.command = read_signal(t.table("command"), unit);
  if (d.kind == DriveKind::torque || d.kind == DriveKind::position) {
    d.inertia = t.number("inertia");
    d.gear = t.number("gear");
    d.viscous = t.not_negative("viscous");
    d.torque_limit = t.number_or("torque_limit", HUGE_VAL);
    if (t.has("coulomb") != t.has("smoothing"))
      t.fail(t.has("coulomb") ? "coulomb" : "smoothing",
             "is given alone, expected coulomb and smoothing or neither");
    if (t.has("coulomb"))
      d.friction =
          phs::friction({.coulomb = t.number("coulomb"), .smoothing = t.number("smoothing")});
  }
  d.rate_limit = t.number_or("rate_limit", HUGE_VAL);
  if (d.kind == DriveKind::position) {
    d.kp = t.not_negative("kp");
    d.kd = t.not_negative("kd");
  }
  if (d.kind == DriveKind::servo) d.p = t.numbers<3>("servo", " p1, p2, p3");
  return d;
}

void read_limits(const Table& t, vsa::Limits& l) {
  l.deflection = t.number_or("deflection", l.deflection);
  l.stop_stiffness = t.number_or("stop_stiffness", l.stop_stiffness);
  l.sigma_stop_stiffness = t.number_or("sigma_stop_stiffness", l.sigma_stop_stiffness);
  if (!t.has("sigma")) return;
  const auto range = t.numbers<2>("sigma", " (lower and upper)");
  l.sigma_lower = range[0];
  l.sigma_upper = range[1];
}

/// The parameters of a family: numbers, or arrays where the family needs one.
vsa::Values read_parameters(const Table& t, const std::string& family) {
  vsa::Values v;
  for (const auto& f : vsa::families()) {
    if (f.name != family) continue;
    Names known;
    for (const auto& k : f.keys) known.push_back(k.name);
    const Table p = t.table("parameters", known);
    for (const auto& k : f.keys) {
      if (!p.has(k.name.c_str())) continue;
      const std::string unit = " of " + k.unit;
      v[k.name] =
          k.list ? p.list(k.name.c_str(), unit) : std::vector{p.number(k.name.c_str(), unit)};
    }
  }
  return v;
}

/// An energy of the user's own, whose parameters have names of hers.
vsa::Formula read_formula(const Table& t) {
  vsa::Formula f;
  f.energy = t.text("energy", "a formula, as \"0.5*k*phi^2\"");
  if (!t.has("parameters")) return f;
  Names names;
  for (const auto& [name, value] : t.raw("parameters", "a table of numbers by name"))
    names.push_back(name.str());
  const Table p = t.table("parameters", names);
  for (const auto& name : names) {
    const std::string key(name);
    f.parameters[key] = p.number(key.c_str(), "");
  }
  return f;
}

vsa::ElasticPtr read_table(const Table& t, std::string& remark) {
  const auto table = t.content("table");
  const vsa::TorqueErrors errors{t.not_negative("smoothing"), t.not_negative("relative_smoothing")};
  const auto m = vsa::parse_measurements(table.text, table.path, errors);
  remark = m.remark;
  vsa::Limits limits;
  if (t.has("limits")) read_limits(t.table("limits"), limits);
  return vsa::tabulated(m, limits, 0.02, errors);
}

vsa::ElasticPtr read_elastic(const Table& t, std::string& remark) {
  const int given = t.has("device") + t.has("family") + t.has("table");
  if (given != 1)
    refuse(t.where(),
           fmt::format("[[actuator]] has {} of the keys device, family and table, expected one",
                       given));
  if (t.has("parameters") && !t.has("family"))
    t.fail("parameters", "are given without a family, expected both or neither");
  for (const char* key : {"smoothing", "relative_smoothing"})
    if (t.has(key) && !t.has("table"))
      t.fail(key, "is given without a table, expected both or neither");
  const bool by_formula = t.has("family") && t.choice("family") == "formula";
  if (t.has("energy") && !by_formula)
    t.fail("energy", "is given without family = \"formula\", expected both or neither");
  if (t.has("table")) return read_table(t, remark);
  vsa::Limits limits;
  vsa::Values values;
  std::string family;
  if (t.has("device")) {
    const auto& d = vsa::device(t.text("device", "the name of a device"));
    vsa::elastic_of(d);  // refuses one without a model
    family = d.family;
    limits = d.limits;
    for (const auto& p : d.parameters) values[p.name] = p.value;
  } else {
    family = t.choice("family");
    if (family != "formula" && t.has("parameters")) values = read_parameters(t, family);
  }
  if (t.has("limits")) read_limits(t.table("limits"), limits);
  if (!by_formula) return vsa::make_elastic(family, values, limits);
  auto energy = vsa::formula(read_formula(t), limits);
  if (!energy->traits().remark.empty())
    remark = fmt::format("the energy of {}: {}", t.where(), energy->traits().remark);
  return energy;
}

void add_overshoot(const Table& t, const char* of, std::string& remark) {
  if (!t.has(of) || !t.table(of).has("command")) return;
  const std::string odd = overshoot(t.table(of).table("command"));
  if (odd.empty()) return;
  remark += fmt::format("{}{}: {}.command: {}", remark.empty() ? "" : "; ", t.where(), of, odd);
}

}  // namespace

ActuatorPlace place_of(const JointActuator& actuator, const phs::Description& description) {
  ActuatorPlace place;
  for (const auto& block : description.blocks) {
    if (block.name == actuator.name + ".link") place.link = block.at;
    if (block.name == actuator.name + ".theta") {
      place.theta = block.at;
      place.momentum_of_theta = block.momentum;
    }
    if (block.name == actuator.name + ".sigma") {
      place.sigma = block.at;
      place.momentum_of_sigma = block.momentum;
    }
  }
  return place;
}

std::vector<JointActuator> read_actuators(const Table& scene) {
  std::vector<JointActuator> list;
  scene.each_of("actuator", "joint", [&](const std::string& joint, const Table& t) {
    JointActuator j;
    j.joint = joint;
    j.where = t.where();
    j.name = t.has("name") ? t.text("name", "text") : joint + ".actuator";
    at_line(j.where, [&] {
      vsa::Actuator& a = j.actuator;
      a.elastic = read_elastic(t, j.remark);
      const auto& traits = a.elastic->traits();
      t.require("theta", "a table with the key drive");
      const Table theta = t.table("theta");
      a.theta = read_drive(theta, "rad");
      if (theta.has("start")) j.theta = theta.number("start", std::string(" of rad"));
      if (!traits.translation_invariant && !j.theta)
        theta.missing("start", "a number of rad: this spring is at rest at no one angle");
      if (traits.sigma.empty()) {
        if (t.has("sigma"))
          t.fail("sigma",
                 fmt::format(
                     "is given, but the energy of '{}' does not depend on sigma, expected none",
                     traits.family));
      } else {
        t.require("sigma", fmt::format("a table with the keys start [{}] ({}) and drive",
                                       traits.sigma_unit, traits.sigma));
        const Table sigma = t.table("sigma");
        a.sigma = read_drive(sigma, traits.sigma_unit);
        j.sigma = sigma.number("start", fmt::format(" of {}", traits.sigma_unit));
        if (t.has("table") && a.sigma.kind != vsa::Drive::Kind::fixed && !traits.remark.empty())
          j.remark += fmt::format("{}{}: {}", j.remark.empty() ? "" : "; ", j.where, traits.remark);
      }
      a.damping = t.not_negative("damping");
      if (t.has("damper")) a.damper = read_signal(t.table("damper"), " of N m s/rad");
      if (t.has("damper_limit")) a.damper_limit = t.number("damper_limit");
      for (const char* of : {"theta", "sigma"}) add_overshoot(t, of, j.remark);
      vsa::actuator_model(a);  // refuses what does not fit together
    });
    list.push_back(std::move(j));
  });
  return list;
}

void add_actuators(phs::Network& n, const mechanics::MechanicalModel& model,
                   const std::vector<JointActuator>& actuators) {
  for (const auto& j : actuators) {
    const auto at = joint_place(model, j.where, "actuator '" + j.name + "'", j.joint);
    for (const auto& c : model.mechanism().coordinates())
      if (c.q == at.q && c.unit != "rad")
        throw InvalidArgument(
            fmt::format("{}: actuator '{}': '{}' slides, expected a joint that turns: the energies "
                        "of actuators "
                        "are of angles (at a slide: an [[element]] of type \"spring\")",
                        j.where, j.name, j.joint));
    at_line(j.where, [&] { vsa::attach(n, j.name, at.port, j.actuator); });
  }
}

std::vector<std::pair<std::string, std::vector<double>>> start_actuators(
    const mechanics::MechanicalModel& model, const std::vector<JointActuator>& actuators,
    std::span<const double> q) {
  std::vector<std::pair<std::string, std::vector<double>>> list;
  for (const auto& j : actuators) {
    const std::string who = "actuator '" + j.name + "'";
    const double link = q[size_t(joint_place(model, j.where, who, j.joint).q)];
    list.emplace_back(j.name, at_line(j.where, [&] {
                        return vsa::actuator_start(who, j.actuator, link, j.theta.value_or(link),
                                                   j.sigma);
                      }));
  }
  return list;
}

std::vector<std::string> command_jumps(const std::vector<JointActuator>& actuators,
                                       const phs::Description& description,
                                       std::span<const double> x) {
  std::vector<std::string> notes;
  for (const auto& j : actuators) {
    const ActuatorPlace place = place_of(j, description);
    const auto look = [&](const char* motor, const vsa::Drive& drive, int at) {
      if (drive.kind != vsa::Drive::Kind::position || at < 0) return;
      const double start = x[size_t(at)], command = (*drive.command)(0.0);
      if (!(std::fabs(command - start) > 0.1)) return;
      notes.push_back(fmt::format(
          "{}: actuator '{}': its {} starts at {:.4g} and the command at {:.4g}, a jump: expected "
          "start = {:.4g}, or a command that begins at the start (a sine has the key offset)",
          j.where, j.name, motor, start, command, command));
    };
    look("theta", j.actuator.theta, place.theta);
    look("sigma", j.actuator.sigma, place.sigma);
  }
  return notes;
}

}  // namespace porthos::scene
