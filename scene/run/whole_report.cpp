#include "scene/run/whole_report.h"

#include <algorithm>
#include <cmath>

#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

double size(const mechanics::Vec3d& a) { return std::hypot(a.x, a.y, a.z); }

/// The entry of a name; if missing it is appended.
double& entry(RunReport::Named& list, const std::string& name) {
  for (auto& [known, value] : list)
    if (known == name) return value;
  return list.emplace_back(name, 0.0).second;
}

}  // namespace

WholeReport::WholeReport(const Scene& s) {
  r_.title = s.title;
  r_.method = s.method;
  r_.step_s = s.step;
}

void WholeReport::add(const RunReport& p, double from) {
  add_energy(p.energy, from, r_.records == 0);
  r_.records += p.records;
  r_.looks += p.looks;
  r_.steps = p.steps;
  r_.simulated_s = p.simulated_s;
  r_.cpu_s += p.cpu_s;
  r_.wall_s += p.wall_s;
  r_.cost.steps += p.cost.steps;
  r_.cost.evaluations += p.cost.evaluations;
  r_.cost.sweeps += p.cost.sweeps;
  r_.cost.factorisations += p.cost.factorisations;
  for (const auto at :
       {&RunReport::linear_momentum_error, &RunReport::angular_momentum_error,
        &RunReport::quaternion_norm_error, &RunReport::constraint_gap, &RunReport::constraint_slip})
    r_.*at = std::max(r_.*at, p.*at);
  r_.constraint_rows = std::max(r_.constraint_rows, p.constraint_rows);
  for (const auto at : {&RunReport::stored_J, &RunReport::supplied_J, &RunReport::dissipated_J,
                        &RunReport::defect_J, &RunReport::turned_over_J})
    r_.*at += p.*at;
  add_delivered(p);  // before the works of this phase
  for (const auto list : {&RunReport::storages, &RunReport::ports, &RunReport::losses})
    for (const auto& [name, joule] : p.*list) entry(r_.*list, name) += joule;
  for (const auto list : {&RunReport::impacts, &RunReport::slips})
    for (const ImpactRow& i : p.*list) add_impacts(r_.*list, i);
  for (const MomentumRow& m : p.momentum) add_momentum(m);
  add_outputs(r_.outputs, p.outputs);
  r_.stopped = p.stopped;
  add_impulses(p.impulses);
  for (const Check& c : p.checks) worst(c);
  for (const NotApplicable& n : p.not_applicable) cannot(n);
  notes_.add(r_, p, from);
  r_.outcome = p.outcome;
  r_.interrupted = p.interrupted;
  r_.own_slopes |= p.own_slopes;
  r_.trouble = p.trouble;
  if (p.space && r_.space)
    space::append(*r_.space, *p.space);
  else if (p.space)
    r_.space = p.space;
}

void WholeReport::add_delivered(const RunReport& p) {
  for (const auto& [name, joule] : p.delivered) {
    double before = 0;
    for (const auto list : {&RunReport::ports, &RunReport::losses})
      for (const auto& [known, sum] : r_.*list)
        if (known == name) before = sum;
    double& most = entry(r_.delivered, name);
    most = std::max(most, before + joule);
  }
}

void WholeReport::add_energy(const EnergyReport& p, double from, bool first) {
  EnergyReport& e = r_.energy;
  const bool worst = first || p.max_rel_error > e.max_rel_error;
  if (first) e = p;
  e.slows &= p.slows;
  if (worst) {  // a jump is one phase's
    e.jump_s = p.jump_s + from;
    e.jump = p.jump;
    e.jump_then = p.jump_then;
    e.unknown = p.unknown;
  }
  e.kinks |= p.kinks;
  e.scale_J = std::max(e.scale_J, p.scale_J);
  for (const auto& [name, joule] : p.scale_parts) {
    double& largest = entry(e.scale_parts, name);
    largest = std::max(largest, joule);
  }
  for (const auto at : {&EnergyReport::max_abs_error_J, &EnergyReport::max_rel_error,
                        &EnergyReport::rms_rel_error, &EnergyReport::growth_exponent})
    e.*at = std::fmax(e.*at, p.*at);  // not a number: not known
  if (std::isfinite(e.growth_exponent)) e.unknown = GrowthUnknown::no;
  if (std::fabs(p.drift_per_s) > std::fabs(e.drift_per_s)) e.drift_per_s = p.drift_per_s;
  e.drift_is_significant |= p.drift_is_significant;
  e.swing_growth = std::max(e.swing_growth, p.swing_growth);
}

void WholeReport::add_impacts(std::vector<ImpactRow>& all, const ImpactRow& i) {
  for (ImpactRow& known : all)
    if (known.name == i.name) {
      known.count += i.count;
      for (const double t : i.first_s)
        if (int(known.first_s.size()) < ImpactRow::most_times) known.first_s.push_back(t);
      return;
    }
  all.push_back(i);
}

/// A locked wheel keeps its last row.
void WholeReport::add_momentum(const MomentumRow& m) {
  for (MomentumRow& known : r_.momentum)
    if (known.name == m.name) {
      known.end = m.end;
      known.largest = std::max(known.largest, m.largest);
      return;
    }
  r_.momentum.push_back(m);
}

void WholeReport::add_impulses(const Impulses& p) {
  Impulses& given = r_.impulses;
  for (const ImpulseRow& row : p.rows) {
    auto known = std::find_if(given.rows.begin(), given.rows.end(),
                              [&](const ImpulseRow& k) { return k.name == row.name; });
    if (known == given.rows.end()) {
      given.rows.push_back(row);
      continue;
    }
    for (size_t c = 0; c < 3; ++c) {
      known->impulse[c] += row.impulse[c];
      known->angular[c] += row.angular[c];
    }
    known->on_s += row.on_s;
    known->propellant_kg += row.propellant_kg;
  }
  given.linear_left = std::max(given.linear_left, p.linear_left);
  given.angular_left = std::max(given.angular_left, p.angular_left);
}

void WholeReport::add(const Event& e, const mechanics::Impact& i, bool on_ground) {
  entry(r_.losses, text(e)) += i.dissipated_J;
  r_.stored_J += i.driven_J - i.dissipated_J;
  r_.dissipated_J += i.dissipated_J;
  r_.turned_over_J += i.dissipated_J;
  if (std::fabs(i.driven_J) > 1e-15 * r_.turned_over_J) {  // less is rounding
    entry(r_.ports, text(e) + ", motions") += i.driven_J;
    r_.supplied_J += i.driven_J;
    r_.turned_over_J += std::fabs(i.driven_J);
  }
  if (on_ground)
    return cannot({"momentum_across_events", "the model stands on the ground, which takes a part"});
  const auto relative = [](double jump, double of) { return of > 0 ? jump / of : jump; };
  const double jump =
      std::max(relative(i.linear_jump, std::max(size(i.momentum.linear), i.scale.linear)),
               relative(i.angular_jump, std::max(size(i.momentum.angular), i.scale.angular)));
  worst({"momentum_across_events", jump, usual_momentum_jump, jump <= usual_momentum_jump, false});
}

/// A check made in one phase is a check of the run; checks that no phase can make are listed, with
/// the reason in the last one.
void WholeReport::cannot(const NotApplicable& n) {
  const auto same = [&](const auto& known) { return known.name == n.name; };
  if (std::any_of(r_.checks.begin(), r_.checks.end(), same)) return;
  const auto known = std::find_if(r_.not_applicable.begin(), r_.not_applicable.end(), same);
  if (known == r_.not_applicable.end())
    r_.not_applicable.push_back(n);
  else
    *known = n;
}

void WholeReport::worst(const Check& c) {
  std::erase_if(r_.not_applicable, [&](const auto& n) { return n.name == c.name; });
  for (Check& known : r_.checks)
    if (known.name == c.name) {
      if (c.latest) {
        known = c;
        return;
      }
      known.pass &= c.pass;
      known.telling |= c.telling;
      if (!(c.value <= known.value)) known.value = c.value;
      return;
    }
  r_.checks.push_back(c);
}

}  // namespace porthos::scene
