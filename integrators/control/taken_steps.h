#pragma once
#include <atomic>
#include <functional>

#include "integrators/derivatives/run_gradient.h"

namespace porthos::integrators {

/// A run under a step control, as a gradient takes it again.
struct TakenSteps {
  Outcome outcome = Outcome::ok;  ///< if not ok, the run ended before its time
  std::string remark;             ///< then: where and why
  std::vector<TakenStep> steps;   ///< GradientOptions::taken
  phs::State end;                 ///< the last state of the run
};

/// Takes the run from `start` to the time `end` [s], the last step up to it. Steps of `reversible`
/// are those of the method, so a gradient's run has the bits of this one; of `time_transformed`
/// they are in another time, and its run is off by the method's error. 24 bytes a step.
/// @param make  the step control (make_controlled);  stop: true: give up, the outcome is `failed`
/// @throws InvalidArgument for a method without step control, and as EventStepper
TakenSteps taken_steps(const phs::Model& model,
                       const std::function<std::unique_ptr<Integrator>()>& make,
                       const phs::State& start, double end,
                       const std::atomic<bool>* stop = nullptr);

}  // namespace porthos::integrators
