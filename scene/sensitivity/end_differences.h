#pragma once
#include "scene/sensitivity/sensitivity.h"

namespace porthos::scene {

/// How the end of a scene's run depends on the inputs `request.by`, by differences of whole runs
/// (ridders.h), which tell their error: of every scene that runs, events, sampled controllers,
/// actuators, stops, orbits and contacts included. The quantities are the numbers of all
/// [[output]]s at the end and, as "tip.x.least" and ".largest", over the run; without an orbit the
/// places, the rates and the energy of EndQuantities too.
///
/// Where the end jumps or has a kink by an input, as where an event just happens or just does not,
/// the error is as large as the slope. Inputs are independent of each other and run in
/// parallel, with the same bits for any number of threads. Cost: 24 runs an input.
/// @throws InvalidArgument as Unknowns and run_in_memory(); for a quantity that is none
EndSensitivity end_differences(const Scene& scene, const SensitivityRequest& request);

}  // namespace porthos::scene
