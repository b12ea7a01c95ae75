#include "scene/session/memory_run.h"

#include <atomic>

#include "scene/compare/auto_method.h"
#include "scene/run/cpu_clock.h"
#include "scene/run/from_records.h"
#include "scene/run/pace.h"
#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

using Clock = Pace::Clock;

/// A run of one mechanism by a stated method.
RunReport run_one(const Scene& scene, const Assembly& assembly,
                  const std::vector<integrators::Event>& until, const MemoryOptions& o) {
  const auto wall = Clock::now();
  const double cpu = thread_cpu_now();
  const auto spent = [&] { return std::chrono::duration<double>(Clock::now() - wall).count(); };
  FromRecords seen(scene, assembly, RecordLayout(scene, assembly));
  RecordSink record = o.record;
  if (seen.any())
    record = [&](std::span<const double> row) {
      seen.see(row);
      if (o.record) o.record(row);
    };
  WatchedRun run(scene, assembly, until, record);
  bool interrupted = false;
  Pace pace;
  double reported = 0;
  for (run.begin(); run.goes_on(); run.step()) {
    interrupted = o.stop && o.stop->load(std::memory_order_relaxed);
    if (interrupted) break;
    if (!o.progress || !pace.due() || spent() - reported < 0.25) continue;
    reported = spent();
    const double done = run.fraction();
    if (done > 0) o.progress(done, reported, reported * (1 - done) / done);
  }
  RunReport r = run.report();
  r.interrupted = interrupted;
  r.cpu_s = thread_cpu_now() - cpu;
  r.wall_s = spent();
  run.add_notes(r);
  if (interrupted) return r;
  seen.fill(r);
  if (!o.judge) return r;
  run.judge(r);
  judge_beside(r, scene, assembly, o.check_symmetry);
  return r;
}

}  // namespace

RunReport run_in_memory(PhaseSequence& phases, const MemoryOptions& o) {
  MemoryOptions of_phase = o;
  of_phase.progress = {};
  while (const Phase* p = phases.next()) {
    const RunReport r = run_one(p->scene, p->assembly, p->until, of_phase);
    try {
      phases.done(r);
    } catch (const InvalidArgument& why) {
      std::string all = why.what();
      for (const std::string& missed : phases.missed()) all += "; before that " + missed;
      throw InvalidArgument(all);
    }
  }
  return phases.finish();
}

RunReport run_in_memory(const Scene& scene, const Assembly& assembly, const MemoryOptions& o) {
  const Scene chosen = with_method_chosen(scene, assembly);
  if (chosen.events.empty()) return run_one(chosen, assembly, {}, o);
  (void)rehearse(chosen, assembly);
  PhaseSequence phases(chosen, assembly);
  return run_in_memory(phases, o);
}

}  // namespace porthos::scene
