#include "scene/run/phase_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/run/loop_events.h"
#include "scene/run/phase_parts.h"
#include "scene/run/stop_values.h"

namespace porthos::scene {
namespace {

void check(const Scene& s) {
  const bool fixed = s.step_control == integrators::StepControl::fixed;
  for (const Event& e : s.events) {
    if (e.type == Event::Type::close) check_closing(s, e);
    if (e.waits() || e.carried) continue;
    const double steps = e.at / s.step;
    if (!(e.at > 0 && e.at < s.duration))
      throw InvalidArgument(
          fmt::format("{}: the event is at {:g} s, expected a time inside the run, "
                      "between 0 and {:g} s",
                      e.where, e.at, s.duration));
    if (fixed && std::fabs(steps - std::round(steps)) > 1e-9 * steps)
      throw InvalidArgument(fmt::format(
          "{}: the event is at {:g} s, {:g} steps of {:g} s, expected a whole number of steps",
          e.where, e.at, steps, s.step));
  }
  for (const Event& e : s.events) {
    if (e.type != Event::Type::lock) continue;
    const auto refuse = [&](const std::string& who) {
      throw InvalidArgument(fmt::format(
          "{}: the event locks joint '{}', and the motor of {} would go on turning against it: "
          "expected a joint without one",
          e.where, e.name, who));
    };
    const auto at_it = [&](const std::string& joint) {
      return joint == e.name || joint.starts_with(e.name + ".");
    };
    for (const JointActuator& a : s.actuators)
      if (at_it(a.joint)) refuse("actuator '" + a.name + "'");
    for (const Element& m : s.elements)
      if (m.motor && at_it(m.joint)) refuse("element '" + m.name + "'");
  }
}

/// The latest end of a phase that begins at `from`: the next event that has a time, or the end of
/// the run.
double end_after(const Scene& s, double from) {
  double end = s.duration;
  for (const Event& e : s.events)
    if (!e.waits() && e.at > from) end = std::min(end, e.at);
  return end;
}

bool on_ground(const mechanics::MovingMechanism& moving) {
  const auto& all = moving.parts.bodies();
  const auto* loops = moving.model->constraint_set();
  return (loops && loops->on_the_world()) ||
         std::any_of(all.begin(), all.end(), [](const mechanics::BodySpec& b) {
           return b.parent == "world" && b.joint.type != "free";
         });
}

mechanics::MovingMechanism moving_at_start(const Assembly& a, MotorStates& motors,
                                           OrbitApart& orbit) {
  mechanics::MovingMechanism m(a.parts);
  m.model = a.mechanical;
  if (const auto* loops = a.mechanical->constraint_set()) m.constraints = loops->spec();
  m.state = a.initial;
  orbit.take_off(m.state);
  motors.take_off(a, m.state);
  return m;
}

}  // namespace

std::vector<std::shared_ptr<const phs::Model>> rehearse(const Scene& scene,
                                                        const Assembly& assembly) {
  check(scene);
  (void)make_integrator(scene, *assembly.model, scene.step);  // what no event changes
  OrbitApart orbit(assembly);
  MotorStates motors(scene);
  mechanics::MovingMechanism moving = moving_at_start(assembly, motors, orbit);
  Latching latching(scene);
  std::vector<std::shared_ptr<const phs::Model>> models{assembly.model};
  std::vector<Event> events = scene.events;
  for (Event& e : events) {
    if (e.waits()) e.at = e.after;
    e = without_limits(std::move(e));
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.at < b.at; });
  for (size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    moving.time = e.at;
    if (e.waits()) (void)Latching::margin(scene, moving, moving.state, 0, e);  // refuses names
    apply_one(scene, e, moving, latching, orbit);
    if (i + 1 < events.size() && events[i + 1].at == e.at && !e.waits()) continue;
    const Scene phase = phase_of(scene, moving, latching, scene.duration);
    try {
      const Assembly a = assembly_of_phase(phase, assembly, moving, motors, orbit);
      models.push_back(a.model);
      (void)make_integrator(phase, *a.model, phase.step);
    } catch (const InvalidArgument& why) {
      throw InvalidArgument(fmt::format("{}: after the {}: {}", e.where, text(e), why.what()));
    }
  }
  return models;
}

PhaseSequence::PhaseSequence(const Scene& scene, const Assembly& assembly)
    : scene_(scene),
      whole_assembly_(assembly),
      orbit_(assembly),
      motors_(scene),
      moving_(moving_at_start(assembly, motors_, orbit_)),
      latching_(scene),
      whole_(scene) {
  phase_.assembly = assembly;
  for (const Event& e : scene.events) {
    if (e.waits()) waiting_.push_back(&e);
    if (e.carried) happen(e);
  }
  happen_at_once();
}

/// Whether a waiting event can happen at once.
bool PhaseSequence::can_happen(const Event& e) const {
  return Latching::margin(scene_, moving_, moving_.state, from_, e) >= 0;
}

void PhaseSequence::happen(const Event& e) {
  Event now = e;
  if (e.waits()) {
    now = without_limits(std::move(now));
    now.at = from_;
  }
  const bool was_on_ground = on_ground(moving_);
  std::erase(waiting_, &e);  // also one that is impossible
  const auto impact = apply_one(scene_, now, moving_, latching_, orbit_);
  whole_.add(e, impact, was_on_ground || on_ground(moving_));
  happened_.push_back({&e, from_, impact});
  assembled_ = false;
}

/// Applies the events whose conditions hold at the start or after another event.
void PhaseSequence::happen_at_once() {
  for (;;) {
    const auto e = std::find_if(waiting_.begin(), waiting_.end(),
                                [&](const Event* w) { return can_happen(*w); });
    if (e == waiting_.end()) return;
    happen(**e);
  }
}

/// Assembles the mechanism in its current form for a run up to `end`.
void PhaseSequence::assemble(double end) {
  phase_.scene = phase_of(scene_, moving_, latching_, end);
  phase_.assembly = assembly_of_phase(phase_.scene, whole_assembly_, moving_, motors_, orbit_);
  phase_.assembly.joined = joined_by(happened_, moving_, *whole_assembly_.mechanical);
  held_.put_in(*phase_.assembly.model);
  assembled_ = true;
}

/// Whether the events have led to a state at which a stop holds: then the run is over.
bool PhaseSequence::stopped() {
  const int k = count_ == 0 ? -1
                            : stop_that_holds(stop_events(scene_, phase_.assembly), phase_.assembly,
                                              from_, phase_.assembly.initial);
  if (k < 0) return false;
  const Stop& stop = *ending_stops(scene_)[size_t(k)];
  note_stop(whole_.report(), stopped_by(stop, from_));
  RunReport here;
  here.stopped = whole_.report().stopped;
  here.simulated_s = from_;
  StopValues values(scene_, phase_.assembly);
  values.see(from_, phase_.assembly.initial, {});
  values.fill(here);
  for (const Check& c : here.checks) whole_.worst(c);
  const double met = StopValue(scene_, phase_.assembly, stop).at(from_, phase_.assembly.initial);
  for (OutputRow& o : whole_.report().outputs)  // no record is of this instant
    if (o.name == stop.output) see_output(o, stop.above ? met : -met);
  more_ = false;
  return true;
}

const Phase* PhaseSequence::next() {
  if (!more_) return nullptr;
  assemble(end_after(scene_, from_));
  if (stopped()) return nullptr;
  phase_.from = from_;
  phase_.waiting = waiting_;
  phase_.until.clear();
  watched_ = phs::State(moving_.model->description(), moving_.state.x);
  nearest_.clear();
  for (const Event* e : waiting_) {
    Nearest& near = nearest_[e];
    near.x = watched_.x;
    const auto margin = [this, e, &near](double t, std::span<const double> x) {
      std::copy_n(x.begin(), watched_.x.size(), watched_.x.begin());
      const double now = Latching::margin(scene_, moving_, watched_, t, *e);
      if (t >= e->after && now > near.margin) {
        near.margin = now;
        near.time = t;
        std::copy(watched_.x.begin(), watched_.x.end(), near.x.begin());
      }
      return now;
    };
    phase_.until.push_back({margin, integrators::Crossing::rising});
  }
  return &phase_;
}

void PhaseSequence::done(const RunReport& r) {
  ++count_;
  whole_.add(r, from_);
  whole_.report().final_state = r.final_state;
  if (r.interrupted || r.outcome != integrators::Outcome::ok) {
    more_ = false;
    broken_off_ = true;
    return;
  }
  held_.keep(*phase_.assembly.model, r.held);
  const Event* met = r.until < 0 ? nullptr : phase_.waiting.at(size_t(r.until));
  double end = phase_.scene.duration;
  if (met) end = std::min(end, r.final_state.time(scene_.step));
  moving_.state = r.final_state;
  orbit_.take_off(moving_.state);
  motors_.take_off(phase_.assembly, moving_.state);
  from_ = moving_.time = end;
  remember_nearest();
  more_ = end < scene_.duration && !r.stopped;
  if (r.stopped) return;
  std::vector<const Event*> due;
  for (const Event& e : scene_.events) {
    const bool waits = std::count(waiting_.begin(), waiting_.end(), &e) > 0;
    if (e.waits() ? &e == met || (waits && can_happen(e)) : e.at == end) due.push_back(&e);
  }
  for (const Event* e : due) happen(*e);
  happen_at_once();
}

/// Tells of those missed, with their check. others: events that are missing besides
void PhaseSequence::tell_missed(int others) {
  RunReport& r = whole_.report();
  const auto notes = missed();
  r.notes.insert(r.notes.end(), notes.begin(), notes.end());
  const double count = double(notes.size()) + others;
  r.checks.push_back({"missed_events", count, 0, count == 0, false});
}

void PhaseSequence::give_up(const std::string& why) {
  tell_missed(1);
  whole_.report().notes.push_back("the run ended before an event that was impossible: " + why);
  more_ = false;
  broken_off_ = true;
}

RunReport PhaseSequence::finish() {
  RunReport& r = whole_.report();
  r.phases = count_;
  whole_.finish();
  if (broken_off_) return r;
  // Events at the last instant have left another mechanism, which no phase has run.
  if (!assembled_) assemble(scene_.duration);
  motors_.put_back(phase_.assembly.internal(), moving_.state);
  orbit_.put_back(moving_.state);
  r.final_state = moving_.state;
  if (std::any_of(scene_.events.begin(), scene_.events.end(), [](auto& e) { return e.waits(); }))
    tell_missed();
  return r;
}

}  // namespace porthos::scene
