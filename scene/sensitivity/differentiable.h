#pragma once
#include "scene/assemble/assembly.h"
#include "scene/assemble/steps.h"

namespace porthos::scene {

/// The scene as its run has slopes: the centre of mass stays in the equations.
/// @param command  that asks for them, for the message;  instead: as differentiable_steps()
/// @throws InvalidArgument for [[actuator]]s
Scene scene_with_slopes(Scene scene, const std::string& command, const std::string& instead);

/// The steps of a scene whose run is one smooth map of its start and its parameters: what
/// integrators::gradient_of_run() differentiates is then what porthos run computes.
/// @throws InvalidArgument naming the table or key whose effect it would miss: events, an orbit,
///   stops, a repeating or projecting monitor, a step control, contacts and joint stops that
///   switch; as integrators::StepPieces
/// @param instead  the way out, at the end of the sentence
Steps differentiable_steps(
    const Scene& scene, const Assembly& assembly,
    const std::string& instead = "; an [ensemble] over a parameter gives differences instead");

}  // namespace porthos::scene
