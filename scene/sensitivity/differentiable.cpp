#include "scene/sensitivity/differentiable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integrators/derivatives/step_variation.h"
#include "scene/assemble/contacts.h"

namespace porthos::scene {

Scene scene_with_slopes(Scene scene, const std::string& command, const std::string& instead,
                        bool fixed_motors) {
  const auto is_fixed = [](const JointActuator& a) {
    using Kind = vsa::Drive::Kind;
    return a.actuator.theta.kind == Kind::fixed && a.actuator.sigma.kind == Kind::fixed;
  };
  if (!scene.actuators.empty() && !(fixed_motors && std::ranges::all_of(scene.actuators, is_fixed)))
    throw InvalidArgument(in_file(scene.path) + command + " takes no [[actuator]]" +
                          (fixed_motors ? " whose motor moves" : "") +
                          ": the start of its motor has no slopes" + instead);
  scene.centre_stays = true;
  return scene;
}

Steps differentiable_steps(const Scene& s, const Assembly& a, const std::string& instead) {
  const auto refuse = [&](const std::string& what) {
    throw InvalidArgument(in_file(s.path) + "a gradient takes " + what + instead);
  };
  if (!s.events.empty()) refuse("no [[event]]");
  const auto& mechanical = a.reduced ? a.reduced : a.mechanical;
  if (mechanical && mechanical->constraint_set())
    refuse("no constraints: loops, couplings, rolling bodies, driven joints");
  if (!s.stops.empty()) refuse("no [[stop]], which ends a run where its state says");
  if (s.orbit) refuse("no [orbit]: its splitting has no adjoint here");
  if (jumps(*a.model)) refuse("no rigid contact, rigid joint stop or dry friction: they jump");
  if (switches(s))
    refuse("no contact and no joint stop that begins with a kink, expected law = \"smooth\"");
  using integrators::OnViolation;
  if (s.monitor && (s.monitor->project || s.monitor->action == OnViolation::repeat))
    refuse("no [monitor] that repeats or projects steps");
  try {
    // refuses other methods, and systems and sampled laws without slopes
    (void)integrators::parameters_of_run(s.method, *a.model, s.step);
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(e.what() + instead);
  }
  return steps_of(s);
}

RunSteps run_steps(const Scene& s, const Assembly& a, const Steps& steps,
                   const std::atomic<bool>* stop) {
  RunSteps r{.steps = steps, .controlled = s.step_control != integrators::StepControl::fixed};
  if (r.controlled)
    r.taken = integrators::taken_steps(
        *a.model, [&] { return make_integrator(s, *a.model, s.step); }, a.initial, s.duration,
        stop);
  return r;
}

std::vector<std::string> notes_on_control(const Scene& s, const RunSteps& run,
                                          const phs::Description& d, const phs::State& end) {
  if (!run.controlled) return {};
  std::vector<std::string> notes{
      "the steps are those of the run; their own change is not in the derivative, of the order of "
      "the method's error"};
  if (s.step_control == integrators::StepControl::reversible) return notes;
  const auto here = phs::with_turns(d, end), there = phs::with_turns(d, run.taken.end);
  double apart = 0, size = 0;
  for (size_t k = 0; k < here.size(); ++k) {
    apart = std::max(apart, std::fabs(here[k] - there[k]));
    size = std::max(size, std::fabs(there[k]));
  }
  notes.push_back(fmt::format(
      "{} takes these steps in another time: the slopes are of {} at the same steps, whose end is "
      "off the run's by {:.0e} of its largest number",
      integrators::to_string(s.step_control), s.method, size > 0 ? apart / size : 0));
  return notes;
}

}  // namespace porthos::scene
