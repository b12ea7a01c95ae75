#include "integrators/control/taken_steps.h"

#include "integrators/control/controlled.h"
#include "integrators/control/event.h"

namespace porthos::integrators {

TakenSteps taken_steps(const phs::Model& model,
                       const std::function<std::unique_ptr<Integrator>()>& make,
                       const phs::State& start, double end, const std::atomic<bool>* stop) {
  EventStepper stepper(model, make, {}, {.samples = 1, .to_grid = false, .all_turns = true});
  const auto* control = dynamic_cast<const Controlled*>(&stepper.method());
  if (!control)
    throw InvalidArgument("method '" + stepper.method().declaration().name +
                          "' has no step control, expected make_controlled()");
  TakenSteps r;
  r.end = start;
  for (double t = control->time(start); t < end; t = control->time(r.end)) {
    const bool stopped = stop && stop->load(std::memory_order_relaxed);
    r.outcome = stopped ? Outcome::failed : stepper.step(r.end, end).outcome;
    if (r.outcome != Outcome::ok) {
      r.remark = stopped ? "the run was stopped"
                         : "the step at t = " + number(t) + " s: " + to_string(r.outcome);
      break;
    }
    r.steps.push_back({control->taken(), r.end.origin, r.end.origin_lo});
  }
  return r;
}

}  // namespace porthos::integrators
