#include "python/simulation.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "scene/cpu_clock.h"
#include "scene/ledger.h"
#include "scene/steps.h"
#include "scene/verdict.h"

namespace porthos::python {
namespace {

using integrators::Outcome;
using namespace scene;
using Clock = std::chrono::steady_clock;

void require(const Scene& s) {
  const auto positive = [](const char* name, double x) {
    if (!(x > 0) || !std::isfinite(x))
      throw InvalidArgument(
          fmt::format("{} is {}, expected a positive number of seconds", name, x));
  };
  positive("step", s.step), positive("duration", s.duration);
  positive("record_every", s.record_every);
  if (s.method == "auto")
    throw InvalidArgument(
        "method is 'auto', expected a method's name: pilot runs are for scenes with an `out` "
        "folder");
  if (s.step_control != integrators::StepControl::fixed || s.monitor || !s.events.empty() ||
      s.orbit)
    throw InvalidArgument(
        "a scene with a step control, a monitor, events or an orbit cannot run in memory: give it "
        "an "
        "`out` folder");
}

}  // namespace

Simulation simulate(const Scene& scene, const Assembly& assembly, const RunOptions& options) {
  require(scene);
  const auto wall = Clock::now();
  const double cpu = thread_cpu_now();
  const phs::Description& d = assembly.model->description();
  const auto integrator = make_integrator(scene, *assembly.model, scene.step);
  Meter meter(assembly);
  WorldView view(assembly);
  Ledger ledger(d);
  phs::State state = assembly.initial;
  Simulation s{{}, RecordLayout(d, Extrema::none), {}, {}};
  const Steps steps = steps_of(scene);
  if (steps.last > 0) integrator->sampler().refuse("a shorter last step");
  std::vector<double> row(s.layout.size());
  s.rows.reserve(size_t(std::min<std::int64_t>(steps.total / steps.every + 2, 1 << 16)) *
                 row.size());
  Outcome outcome = Outcome::ok;
  phs::State good = state;
  const auto not_finite = [&] { outcome = Outcome::not_finite, state = good; };
  const auto look = [&] {
    const Measured& m = meter.look(state);
    m.finite() ? void(ledger.look(m)) : not_finite();
  };
  const auto record = [&] {
    const Measured& m = meter.measure(state);
    if (!m.finite() || !std::isfinite(meter.initial_J())) return not_finite();
    const double t = steps.time(state.step);
    const double error = ledger.add(t, m, steps.at_record(state.step));
    fill_record(s.layout, t, view(t, state), m, ledger.works(), error, integrator->cost().sweeps,
                {}, row);
    s.rows.insert(s.rows.end(), row.begin(), row.end());
    good = state;
  };
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - wall).count(); };
  record();
  auto told = Clock::now();
  bool stopped = false;
  while (outcome == Outcome::ok && state.step < steps.total) {
    if (options.stop && options.stop->load(std::memory_order_relaxed)) {
      stopped = true;
      break;
    }
    outcome = steps.ends_short(state.step) ? integrator->step_by(state, steps.last)
                                           : integrator->step(state);
    if (outcome != Outcome::ok) break;
    ledger.book(integrator->works());
    if (steps.at_record(state.step) || state.step == steps.total)
      record();
    else if (state.step % steps_to_a_look(integrator->cost()) == 0)
      look();
    if (!options.progress || state.step % 64 != 0) continue;
    if (const auto now = Clock::now(); now - told > std::chrono::milliseconds(250)) {
      const double f = double(state.step) / double(steps.total);
      told = now, options.progress(f, since(), since() * (1 - f) / f);
    }
  }
  RunReport& r = s.report;
  r.title = scene.title, r.method = scene.method, r.step_s = scene.step;
  r.simulated_s = steps.time(state.step), r.steps = state.step;
  r.cpu_s = thread_cpu_now() - cpu, r.wall_s = since();
  r.cost = integrator->cost();
  ledger.fill(r, meter);
  r.outcome = outcome, r.interrupted = stopped, r.final_state = state;
  r.notes = notes_on_numbers(scene, r.cost.sweeps);
  if (const auto remark = integrator->remark(); !remark.empty()) r.notes.push_back(remark);
  if (stopped) return s;
  judge(r, scene, integrator->declaration(), meter);
  judge_beside(r, scene, assembly, options.check_symmetry);
  s.summary = summary_json(scene, assembly, r, r.final_state);
  return s;
}

}  // namespace porthos::python
