#pragma once
#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// What a run through the events of a scene showed.
struct PhasePilot {
  double until = 0;         ///< time up to which it came [s]
  double error = HUGE_VAL;  ///< largest relative energy error, as a verdict measures it
};

/// Runs the phases of a scene that states its method, in memory, with the bits of the run itself.
/// It ends early at `cpu_limit` CPU seconds, where the method fails, and before an event that is
/// impossible.
PhasePilot pilot_phases(const Scene& scene, const Assembly& assembly, double cpu_limit);

}  // namespace porthos::scene
