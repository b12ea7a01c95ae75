#include "scene/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/check.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;

void check(RunReport& r, const char* name, double value, double limit) {
  r.checks.push_back({name, value, limit, value <= limit});  // NaN fails
}

/// Only what is an invariant is checked.
void check_kept(RunReport& r, const char* name, bool kept, double value,
                const std::optional<double>& limit) {
  if (!limit) return;
  if (kept)
    check(r, name, value, *limit);
  else
    r.notes.push_back(
        fmt::format("{} is not an invariant of this system and was not checked", name));
}

/// Steps forth with h and back with -h; distance from the start, relative to the largest coordinate
/// (at least 1) and the largest momentum. Infinite if a step fails.
double forth_and_back(const Scene& scene, const Assembly& a, std::int64_t steps) {
  const phs::Description& d = a.model->description();
  phs::State s = a.initial;
  std::vector<double> size(s.x.size(), 0.0);
  std::vector<double> memory;  // of the way forth: a controlled method finds its steps again by it
  for (const double h : {scene.step, -scene.step}) {
    const auto integrator = make_integrator(scene, *a.model, h);
    if (!memory.empty()) integrator->restore(memory);
    for (std::int64_t i = 0; i < steps; ++i) {
      if (integrator->step(s) != Outcome::ok) return HUGE_VAL;
      for (size_t k = 0; k < s.x.size(); ++k) size[k] = std::max(size[k], std::fabs(s.x[k]));
    }
    if (scene.step_control != integrators::StepControl::fixed) memory = integrator->memory();
  }
  const size_t half = size_t(a.mechanism ? a.mechanism->nq() : int(s.x.size()) / 2);
  const double q_size = std::max(1.0, *std::max_element(size.begin(), size.begin() + long(half)));
  const double p_size = std::max(1e-300, *std::max_element(size.begin() + long(half), size.end()));
  std::vector<double> off(s.x.size());
  for (size_t k = 0; k < off.size(); ++k)
    off[k] = (s.x[k] - a.initial.x[k]) + (s.lo[k] - a.initial.lo[k]);
  size_t turn = 0;
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle) {
      off[size_t(b.at)] += double(s.turns[turn] - a.initial.turns[turn]) * phs::two_pi_hi;
      ++turn;
    }
  double worst = 0;
  for (size_t k = 0; k < off.size(); ++k)
    worst = std::max(worst, std::fabs(off[k]) / (k < half ? q_size : p_size));
  return worst;
}

void check_axioms(RunReport& r, const Assembly& a) {
  const auto report = phs::check(*a.model);
  for (const auto& axiom : report.axioms) {
    const std::string name = "axiom: " + axiom.axiom;
    r.checks.push_back({name, axiom.worst, axiom.limit, axiom.holds()});
  }
}

}  // namespace

void judge(RunReport& r, const Scene& scene, const Meter& meter) {
  const Limits& limits = scene.verify;
  if (r.outcome != Outcome::ok) {
    r.checks.push_back({"outcome", double(static_cast<int>(r.outcome)), 0, false});
    r.notes.push_back(
        fmt::format("the run ended at t = {} s: {}", r.simulated_s, to_string(r.outcome)));
  }
  if (limits.energy) check(r, "energy", r.energy.max_rel_error, *limits.energy);
  const bool pushed = !r.impulses.rows.empty() && !r.space;
  const auto thrusts = [](const ImpulseRow& row) { return row.type == "thruster"; };
  if (pushed && limits.linear_momentum &&
      std::any_of(r.impulses.rows.begin(), r.impulses.rows.end(), thrusts))
    check(r, "linear_momentum (less impulses)", r.impulses.linear_left, *limits.linear_momentum);
  else if (limits.linear_momentum && meter.linear_is_structure())
    r.notes.push_back(
        "linear_momentum: the centre of mass moved in closed form, nothing was left to check");
  else
    check_kept(r, "linear_momentum", meter.has_linear(), r.linear_momentum_error,
               limits.linear_momentum);
  for (const ImpulseRow& row : r.impulses.rows)
    if (row.propellant_kg > 0)
      r.notes.push_back(fmt::format(
          "thruster '{}' took {:.4g} kg of propellant; masses and inertias of the links are held "
          "constant",
          row.name, row.propellant_kg));
  if (pushed && limits.angular_momentum)
    check(r, "angular_momentum (less impulses)", r.impulses.angular_left, *limits.angular_momentum);
  else if (r.space && limits.angular_momentum)
    check(r, "angular_momentum (less impulses)", r.space->angular_defect, *limits.angular_momentum);
  else
    check_kept(r, "angular_momentum", meter.has_angular(), r.angular_momentum_error,
               limits.angular_momentum);
  if (limits.quaternion_norm && meter.has_rotations())
    check(r, "quaternion_norm", r.quaternion_norm_error, *limits.quaternion_norm);
  if (r.space && limits.orbital) check(r, "orbital", r.space->orbital.relative(), *limits.orbital);
  if (r.space && limits.coupling)
    check(r, "coupling", r.space->coupling.relative(), *limits.coupling);
  if (!r.space && (limits.orbital || limits.coupling))
    r.notes.push_back("orbital and coupling are ledgers of an [orbit] and were not checked");
  if (limits.balance)
    check(r, "balance", std::fabs(r.defect_J) / std::max(r.energy.scale_J, r.turned_over_J),
          *limits.balance);
}

void judge_symmetry(RunReport& r, const Scene& scene, const Assembly& a) {
  check_axioms(r, a);
  if (!scene.verify.symmetry) return;
  for (const auto& d : integrators::catalogue())
    if (d.name == scene.method && d.symmetric == integrators::Claim::fails) {
      r.notes.push_back(fmt::format(
          "{} is not a symmetric method: going forth and back was not checked", d.name));
      return;
    }
  const auto steps = std::min<std::int64_t>(100, std::llround(scene.duration / scene.step));
  check(r, "symmetry", forth_and_back(scene, a, steps), *scene.verify.symmetry);
}

bool RunReport::passed() const {
  return outcome == Outcome::ok && !interrupted &&
         std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.pass; });
}

}  // namespace porthos::scene
