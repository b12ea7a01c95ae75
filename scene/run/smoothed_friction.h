#pragma once
#include "phs/system/state.h"

/// What smoothed friction, of elements and of motors, has to do with the trouble of a run.
namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// Adds a note on the steepest smoothed friction where a step did not converge or rates ring, and a
/// step is longer than twice the time inertia / slope in which it would take the rate away; or
/// where the energy fails and a step is twice as long again. Names a step that resolves it: up to
/// twice that time the steps of all methods tried converged. After judge().
/// @param end    the last good state, at which the inertia is taken
/// @param rings  whether rates at the ends of steps are not those of their coordinates (EndRates)
void note_smoothed_friction(RunReport& report, const Scene& scene, const Assembly& assembly,
                            const phs::State& end, bool rings);

}  // namespace porthos::scene
