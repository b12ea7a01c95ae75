#include "scene/read/run_reader-inl.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "integrators/catalogue.h"
#include "integrators/core/integrator.h"

namespace porthos::scene {
namespace {

constexpr double most_steps = 1e15;

// --- values from a file or from a command line: `where` is "file:line:column" or "--step" ---

void check_method(const std::string& method, const std::string& where) {
  Names known;
  for (const auto& d : integrators::catalogue()) known.push_back(d.name);
  known.push_back(auto_method);
  if (std::find(known.begin(), known.end(), method) != known.end()) return;
  const auto near = near_enough(method, known);
  refuse(where, fmt::format("method is '{}', expected {} that porthos methods lists; one added by "
                            "a program is known to that program alone",
                            method, near.empty() ? "one" : fmt::format("'{}' or another", near)));
}

/// Checks that the method suits the step control; the message names the place in the scene.
void check_control(const Scene& s, const std::string& where) {
  if (s.step_control == integrators::StepControl::fixed) return;
  const char* control = to_string(s.step_control);
  if (s.method == auto_method)
    refuse(where, fmt::format("step_control is \"{}\", but auto chooses a fixed step, expected "
                              "step_control = \"fixed\"",
                              control));
  if (!integrators::knows_method(s.method)) return;  // of results
  const auto& d = integrators::declaration_of(s.method);
  if (d.rival)
    refuse(where, fmt::format("step_control is \"{}\", but {} chooses its steps itself, expected "
                              "step_control = \"fixed\"",
                              control, s.method));
  if (d.needs.contacts)
    refuse(where, fmt::format("step_control is \"{}\", but the impacts of {} have no size of step "
                              "that a control could choose, expected step_control = \"fixed\"",
                              control, s.method));
  if (s.step_control == integrators::StepControl::reversible &&
      d.symmetric != integrators::Claim::holds)
    refuse(where,
           fmt::format("step_control is \"{}\", but {} is not symmetric, expected a symmetric "
                       "method",
                       control, s.method));
}

void check_step_count(double step, double duration, const std::string& where) {
  if (duration < step)
    refuse(where,
           fmt::format("duration is {} s, expected at least one step of {} s", duration, step));
  if (duration / step > most_steps)
    refuse(where, fmt::format("duration is {} s, {:.3g} steps of {} s, expected at most {:g} steps",
                              duration, duration / step, step, most_steps));
}

/// The interval, in whole steps, that gives about a thousand records.
double default_record_every(double step, double duration) {
  if (step == 0) return 0;  // auto has not chosen yet
  return std::max(1.0, std::round(duration / 1000 / step)) * step;
}

void read_target(const Table& t, Scene& s) {
  if (!t.has("target_energy_error")) return;
  if (s.method != auto_method)
    t.fail("target_energy_error", "is given without method = \"auto\", expected both or neither");
  const double error = t.number("target_energy_error");
  if (!(error > 0 && error < 1))
    t.fail("target_energy_error", fmt::format("is {}, expected a number between 0 and 1", error));
  s.target_energy_error = error;
}

void read_step_control(const Table& t, Scene& s) {
  if (t.has("step_control")) {
    s.step_control = integrators::step_control_of(t.choice("step_control"));
    check_control(s, t.at("step_control"));
  }
  for (const auto& [key, to] : {std::pair{"step_control_rate", &s.control_rate},
                                {"step_control_length", &s.control_length}}) {
    if (!t.has(key)) continue;
    if (s.step_control == integrators::StepControl::fixed)
      t.fail(key, "is given without a step_control, expected both or neither");
    *to = t.positive(key);
  }
}

}  // namespace

void read_integrator(const Table& t, Scene& s) {
  if (t.has("method")) {
    s.method = t.text("method", "the name of a method");
    if (!t.of_results()) check_method(s.method, t.at("method"));  // one added by a program is kept
  }
  if (s.method != auto_method) t.require("step", "a number of seconds");
  if (t.has("step")) s.step = t.seconds("step");
  s.rtol = t.number("rtol");
  if (!(s.rtol > 0 && s.rtol < 1))
    t.fail("rtol", fmt::format("is {}, expected a number between 0 and 1", s.rtol));
  s.iteration_tolerance = t.number("iteration_tolerance");
  if (!(s.iteration_tolerance >= 0 && s.iteration_tolerance < 1))
    t.fail("iteration_tolerance",
           fmt::format("is {}, expected 0 (iterate to rounding) or a number below 1",
                       s.iteration_tolerance));
  if (s.iteration_tolerance > 0 && s.method == auto_method)
    t.fail("iteration_tolerance", "is given with method = \"auto\", expected one of both");
  read_target(t, s);
  read_step_control(t, s);
}

void read_monitor(const Table& t, Scene& s) {
  integrators::MonitorOptions m;
  for (const auto& [key, to] : {std::pair{"limit", &m.limit}, {"step_limit", &m.step_limit}}) {
    if (!t.has(key)) continue;
    *to = t.number(key);
    if (!(*to >= 1e-14)) t.fail(key, fmt::format("is {}, expected 1e-14 or more", *to));
  }
  m.action = integrators::on_violation_of(t.choice("action"));
  m.project = t.boolean("project");
  if (m.limit == 0 && m.step_limit == 0 && !m.project)
    refuse(t.where(), "[monitor] has nothing to watch, expected limit, step_limit or project");
  if (m.action == integrators::OnViolation::repeat && m.step_limit == 0)
    t.fail("action", "is \"repeat\" without a step_limit, expected both");
  s.monitor = m;
}

void read_run(const Table& t, Scene& s) {
  s.duration = t.seconds("duration");
  if (s.step > 0) check_step_count(s.step, s.duration, t.at("duration"));
  s.record_every_given = t.has("record_every");
  s.record_every =
      s.record_every_given ? t.seconds("record_every") : default_record_every(s.step, s.duration);
  s.low_words = t.boolean("low_words");
  const std::string extrema = t.choice("extrema");
  s.extrema = extrema == "none"    ? Extrema::none
              : extrema == "state" ? Extrema::state
                                   : Extrema::all;
  if (t.has("checkpoint_every")) s.checkpoint_every = t.seconds("checkpoint_every");
  if (t.has("case")) s.of_case = t.whole("case") + 1;
}

void read_verify(const Table& t, Scene& s) {
  Limits& l = s.verify;
  const auto limit = [&](const char* key, std::optional<double>& to) {
    if (t.has(key)) to = t.not_negative(key);
  };
  limit("energy", l.energy);
  limit("linear_momentum", l.linear_momentum);
  limit("angular_momentum", l.angular_momentum);
  limit("quaternion_norm", l.quaternion_norm);
  limit("balance", l.balance);
  limit("symmetry", l.symmetry);
  limit("step_halving", l.step_halving);
  limit("orbital", l.orbital);
  limit("coupling", l.coupling);
  limit("constraints", l.constraints);
  if (!l.any()) l = default_limits(s.orbit.has_value());
}

void check_pieces(const Scene& s) {
  for (const Element& e : s.elements) {
    if (e.period == 0) continue;
    const std::string what = fmt::format("'{}' has pieces of {} s", e.name, e.period);
    if (s.method == auto_method)
      refuse(e.where,
             fmt::format("method = \"auto\" cannot choose a step here: expected method and step, "
                         "since {}",
                         what));
    if (s.step_control != integrators::StepControl::fixed)
      refuse(e.where, what + ", which steps of a step_control pass: expected steps of one size");
    if (!integrators::knows_method(s.method)) return;  // of results
    const auto& method = integrators::declaration_of(s.method);
    if (method.rival || method.order == 0)
      refuse(e.where,
             fmt::format("{}, and {} chooses its steps itself: expected a method with steps "
                         "of one size",
                         what, s.method));
    const double steps = e.period / s.step;
    if (std::fabs(steps - std::round(steps)) > 1e-9 * steps || steps < 0.5)
      refuse(e.where, fmt::format("{} and the step is {} s, expected a whole number of steps in a "
                                  "piece",
                                  what, s.step));
  }
}

void apply(Scene& scene, const Overrides& overrides) {
  Scene s = scene;  // all or nothing
  if (overrides.method) {
    check_method(s.method = *overrides.method, "--method");
    check_control(s, "--method");
  }
  if (overrides.step) check_seconds("step", s.step = *overrides.step, "--step");
  if (overrides.duration) check_seconds("duration", s.duration = *overrides.duration, "--duration");
  if (s.step == 0 && s.method != auto_method)
    refuse("--method",
           fmt::format("the scene states no step for {}, expected --step too", s.method));
  if (s.step > 0 && (overrides.step || overrides.duration)) {
    check_step_count(s.step, s.duration, overrides.duration ? "--duration" : "--step");
    if (!s.record_every_given) s.record_every = default_record_every(s.step, s.duration);
  }
  check_pieces(s);
  scene = std::move(s);
}

}  // namespace porthos::scene
