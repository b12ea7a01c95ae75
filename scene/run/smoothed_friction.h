#pragma once
#include "phs/system/state.h"

/// What smoothed friction, of elements and of motors, has to do with the trouble of a run.
namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// Adds a note on the steepest smoothed friction where a step is longer than twice the time
/// inertia / slope in which it would take the rate away, and the run ended early, its energy fails,
/// or its rates ring. Names a step that resolves it. After judge().
/// @param end    the last good state, at which the inertia is taken
/// @param rings  whether rates at the ends of steps are not those of their coordinates (EndRates)
void note_smoothed_friction(RunReport& report, const Scene& scene, const Assembly& assembly,
                            const phs::State& end, bool rings);

}  // namespace porthos::scene
