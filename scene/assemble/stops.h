#pragma once
#include <vector>

#include "integrators/control/event.h"
#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// The [[stop]]s of a scene as events of its assembly, in their order: each g rises through 0.
/// Scene and assembly must outlive them.
/// @throws InvalidArgument as Outputs; for an output that depends on a sampled controller
std::vector<integrators::Event> stop_events(const Scene& scene, const Assembly& assembly);
/// The first of them whose condition holds at a state, or -1.
int stop_that_holds(const std::vector<integrators::Event>& stops, const Assembly& assembly,
                    double t, const phs::State& s);

}  // namespace porthos::scene
