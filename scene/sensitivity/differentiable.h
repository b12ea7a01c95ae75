#pragma once
#include "integrators/control/taken_steps.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/steps.h"

namespace porthos::scene {

/// The scene as its run has slopes: the centre of mass stays in the equations.
/// @param command  that asks for them, for the message;  instead: as differentiable_steps()
/// @param fixed_motors  whether [[actuator]]s are taken whose motors are fixed: where their starts
///   are differentiated too, which follow the joint
/// @throws InvalidArgument for other [[actuator]]s
Scene scene_with_slopes(Scene scene, const std::string& command, const std::string& instead,
                        bool fixed_motors = false);

/// The steps of a scene whose run is one smooth map of its start and its parameters: what
/// integrators::gradient_of_run() differentiates is then what porthos run computes.
/// @throws InvalidArgument naming the table or key whose effect it would miss: events, an orbit,
///   stops, a repeating or projecting monitor, contacts and joint stops that switch; as
///   integrators::StepPieces
/// @param instead  the way out, at the end of the sentence
Steps differentiable_steps(
    const Scene& scene, const Assembly& assembly,
    const std::string& instead = "; an [ensemble] over a parameter gives differences instead");

/// The steps of a run that a gradient takes again: with a step control those which the run took,
/// whose sizes are constants of the gradient.
struct RunSteps {
  Steps steps;  ///< of one size
  bool controlled = false;
  integrators::TakenSteps taken = {};

  std::int64_t count() const {
    return controlled ? std::int64_t(taken.steps.size()) : steps.whole();
  }
  double last() const { return controlled ? 0 : steps.last; }
};
/// @param steps  differentiable_steps();  stop: as integrators::taken_steps()
RunSteps run_steps(const Scene& scene, const Assembly& assembly, const Steps& steps,
                   const std::atomic<bool>* stop = nullptr);

/// What is told of slopes of a run under a step control; `end` is the state that they are of.
std::vector<std::string> notes_on_control(const Scene& scene, const RunSteps& run,
                                          const phs::Description& d, const phs::State& end);

}  // namespace porthos::scene
