#include <fmt/format.h>

#include "phs/network/network.h"
#include "scene/run/limit_notes.h"
#include "scene/run/smoothed_friction.h"
#include "scene/run/soft_stops.h"
#include "scene/run/verdict.h"
#include "scene/run/watched_run.h"
#include "scene/run/whole_notes.h"

/// What a run in progress tells of itself.
namespace porthos::scene {

using integrators::Outcome;

namespace {
/// Whether the method's remark says where and why.
bool remarked(Outcome o) { return o == Outcome::singular || o == Outcome::jammed; }

/// What may have ended a run whose step did not converge: regularised friction is stiff.
std::string note_on_friction(const Scene& s) {
  std::string names;
  for (const SceneContact& c : s.contacts)
    if (c.law.friction > 0 && c.law.creep > 0) add_to_list(names, "'" + c.name + "'");
  if (names.empty()) return "";
  return fmt::format(
      "the friction of {} asks for steps of at most one or two m creep/(friction N), with the mass "
      "m that the point of contact feels and the largest force N there, which a touch-down has: a "
      "smaller step, a larger creep, or method = \"auto\", which tries steps",
      names);
}

/// What gravity's expansion neglects, of bodies that float far apart: a constant acceleration a
/// along the radius moves a body by 4π a/n² along the track in an orbit, and here a = 3/2 n² r²/R.
std::vector<std::string> notes_on_reach(const space::SpaceReport& s) {
  if (!(s.reach > 0)) return {};
  const double R = 1.5 * s.reach / s.next_order, moved = 6 * M_PI * s.reach * s.reach / R;
  if (!(moved > 1)) return {};
  return {fmt::format(
      "bodies float up to {:.4g} m from the common centre of mass: what the expansion of gravity "
      "neglects moves them by up to {:.2g} m an orbit{}",
      s.reach, moved,
      s.reach > 1e-3 * R ? ", and a thousandth of the orbit's radius is passed" : "")};
}

}  // namespace

RunReport WatchedRun::report() const {
  RunReport r;
  r.title = scene_.title;
  r.method = scene_.method;
  r.step_control = scene_.step_control;
  r.step_s = scene_.step;
  r.simulated_s = time();
  r.steps = state_.step;
  r.cost = integrator_->cost();
  ledger_.fill(r, meter_);
  const auto& powers = assembly_.model->description().powers;
  for (const auto& [kind, list] : {std::pair{".impact", &r.impacts}, {".slips", &r.slips}})
    for (size_t i = 0; i + 1 < impacts_.size(); i += 2)
      for (ImpactRow& row : *list)
        if (powers[size_t(impacts_[i])].name == row.name + kind)
          row.first_s.push_back(impacts_[i + 1]);
  if (split_ && split_->ledgers().started()) r.space = split_->ledgers().report();
  r.outcome = outcome_;
  if (outcome_ != Outcome::ok && split_) r.trouble = split_->trouble();
  if (outcome_ != Outcome::ok && r.trouble.empty())
    if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&assembly_.internal()))
      r.trouble = network->hindrance(state_);
  if (remarked(outcome_))
    r.trouble = fmt::format("{} ({})", to_string(outcome_), integrator_->remark());
  r.final_state = state_;
  if (until_ >= stops_from_)
    r.stopped = stopped_by(*ending_stops(scene_)[size_t(until_ - stops_from_)], time());
  else
    r.until = until_;
  r.held = integrator_->sampler().memory();
  r.own_slopes = !assembly_.mechanical;  // a model of the user's own
  return r;
}

Stopped stopped_by(const Stop& stop, double at) { return {stop.name, text(stop), at, stop.fails}; }

void note_stop(RunReport& r, const Stopped& by) {
  r.stopped = by;
  r.notes.push_back(fmt::format("the run ended at {:.17g} s by the stop '{}'{}", by.at, by.name,
                                by.name == by.condition ? "" : ": " + by.condition));
}

void WatchedRun::add_notes(RunReport& r) const {
  note_delivered(r);
  if (r.stopped) note_stop(r, *r.stopped);
  stop_values_.fill(r);
  const auto add = [&](std::vector<std::string> notes) {
    for (auto& note : notes) r.notes.push_back(std::move(note));
  };
  if (!scene_.choice.empty()) r.notes.push_back(scene_.choice);
  add(assembly_.remarks);
  if (assembly_.mechanical) {
    add(notes_on_speeds(*assembly_.mechanical, state_, "at the end"));
    for (const auto& c : assembly_.mechanism->coordinates())
      if (const auto s = scene_.joints.find(c.name); s != scene_.joints.end() &&
                                                     c.kind == phs::BlockKind::angle &&
                                                     std::fabs(s->second.position) > 4 * M_PI)
        r.notes.push_back(
            fmt::format("joint '{}' starts at {:.6g} rad, {:.1f} turns: are they degrees?", c.name,
                        s->second.position, s->second.position / (2 * M_PI)));
  }
  if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&assembly_.internal())) {
    add(network->stories(r.held, assembly_.initial.time(scene_.step)));
    if (scene_.extrema != Extrema::all && !scene_.outputs.empty())
      for (const auto& hold : network->holds())
        if (hold->period < 0.999 * scene_.record_every) {
          r.notes.push_back(
              fmt::format("outputs are those of the records, every {:.6g} s, while '{}' samples "
                          "every {:.6g} s: [run] extrema = \"all\" sees every step",
                          scene_.record_every, hold->name, hold->period));
          break;
        }
    if (const auto waiting = network->waiting(r.held))
      r.checks.push_back({"missed_handovers", double(*waiting), 0, *waiting == 0, false, true});
  }
  if (outcome_ == Outcome::not_converged)
    if (const auto why = note_on_friction(scene_); !why.empty()) r.notes.push_back(why);
  add(notes_on_numbers(scene_, r.cost.sweeps));
  if (const auto remark = integrator_->remark(); !remark.empty() && !remarked(outcome_)) {
    if (integrator_->declaration().rival)
      r.notes.push_back(remark);
    else
      note_newton(r, remark);
  }
  if (!integrator_->port_work().empty() && !integrator_->integrates_power()) {
    r.impulses.integrated = false;
    r.notes.push_back(fmt::format(
        "{} keeps no ledger of its own: works are taken by two Gauss points of each step, whose "
        "error (order 4 in the step) stands in the residual of the balance",
        scene_.method));
  }
  if (r.space) add(notes_on_reach(*r.space));
  end_rates_.fill(r);
  if (monitor_ && !monitor_->text().empty()) r.notes.push_back(monitor_->text());
}

void WatchedRun::judge(RunReport& r) const {
  advise_at_soft_stops(r, scene_, assembly_, state_);
  scene::judge(r, scene_, integrator_->declaration(), meter_);
  note_soft_limits(r, scene_, assembly_, state_);
  note_smoothed_friction(r, scene_, assembly_, state_, end_rates_.ring());
}

}  // namespace porthos::scene
