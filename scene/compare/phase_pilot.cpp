#include "scene/compare/phase_pilot.h"

#include "scene/run/cpu_clock.h"
#include "scene/run/phase_sequence.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {

PhasePilot pilot_phases(const Scene& scene, const Assembly& assembly, double cpu_limit) {
  const double begun = thread_cpu_now();
  PhasePilot pilot;
  try {
    PhaseSequence phases(scene, assembly);
    bool ends = false;
    while (const Phase* p = ends ? nullptr : phases.next()) {
      WatchedRun run(p->scene, p->assembly, p->until, {});
      bool in_time = true;
      for (run.begin(); run.goes_on() && in_time; run.step())
        in_time = thread_cpu_now() - begun < cpu_limit;
      RunReport r = run.report();
      ends = r.interrupted = run.goes_on();
      phases.done(r);
      pilot.until = r.simulated_s;
      pilot.error = phases.whole().report().energy.max_rel_error;
    }
  } catch (const InvalidArgument&) {  // the run itself tells of it
  }
  return pilot;
}

}  // namespace porthos::scene
