#pragma once
#include "phs/system/state.h"

/// What soft stops of joints have to do with the trouble of a run, and a step that resolves them:
/// a tenth of a contact of the joint, with the inertia that resists it alone and the rate that it
/// has at the end of the run.
namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// Of a run whose step failed where a joint meets a soft stop: says in RunReport::trouble with
/// which step to begin. Before judge(). @param end  the last good state
void advise_at_soft_stops(RunReport& report, const Scene& scene, const Assembly& assembly,
                          const phs::State& end);
/// Adds a note on soft limits, at which no step ends: a likely cause of an energy that fails. After
/// judge().
void note_soft_limits(RunReport& report, const Scene& scene, const Assembly& assembly,
                      const phs::State& end);

}  // namespace porthos::scene
