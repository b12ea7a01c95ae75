// What a step of gauss16 costs: its stages as lanes and one by one, and an evaluation of all stages
// in the step against one alone. The kernels alone: bench/kernels, bench/peers.
#include <benchmark/benchmark.h>

#include "bench/chain.h"
#include "bench/gradient_bench.h"
#include "integrators/core/integrator.h"
#include "integrators/core/stage_lanes.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"

namespace porthos::bench {
namespace {

using mechanics::Mechanism;
using Model = std::shared_ptr<const Mechanism>;

void per_body(benchmark::State& state, const Mechanism& m, int per_call = 1) {
  using benchmark::Counter;
  state.counters["time_per_body"] = Counter(double(m.body_count() * per_call),
                                            Counter::kIsIterationInvariantRate | Counter::kInvert);
}

phs::State start(const mechanics::MechanicalModel& model, const Mechanism& m) {
  const double fastest = 5.0 / double(m.nv() * m.nv());  // long chains amplify: slower joints
  return {model.description(), model.state(configuration(m), numbers(size_t(m.nv()), fastest))};
}

void gauss16_step(benchmark::State& state, Model m, double h, bool lanes) {
  const mechanics::MechanicalModel model(m);
  phs::State s = start(model, *m);
  integrators::Options o;
  o.lanes = lanes;
  const auto method = integrators::make_integrator("gauss16", model, h, o);
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
  using benchmark::Counter;
  const double steps = double(method->cost().steps);
  state.counters["sweeps"] = double(method->cost().sweeps) / steps;
  state.counters["evaluation"] =
      Counter(double(method->cost().sweeps), benchmark::Counter::kIsRate | Counter::kInvert);
  per_body(state, *m);
}

/// The field of eight stages as a step calls it, near the start of the step's benchmark: a register
/// of stages at a time.
void eight_stages(benchmark::State& state, Model m) {
  constexpr int V = integrators::stage_lanes;
  using Lanes = phs::Pack<double, V>;
  const mechanics::MechanicalModel model(m);
  const auto system = model.instantiate<Lanes>();
  const phs::State s = start(model, *m);
  std::vector<Lanes> x(s.x.size()), f(s.x.size());
  for (size_t k = 0; k < x.size(); ++k)
    for (int i = 0; i < V; ++i) x[k].set(i, s.x[k] * (1 + 1e-3 * i));
  for (auto _ : state)
    for (int done = 0; done < 8; done += V) {
      system->field(Lanes(0.0), x, {}, f);
      benchmark::ClobberMemory();
    }
  per_body(state, *m);
}

Model read(const std::string& path, bool free_base) {
  mechanics::UrdfOptions o;
  o.base = free_base ? mechanics::UrdfOptions::Base::free : mechanics::UrdfOptions::Base::fixed;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  o.accept_unphysical_inertia = true;
  return std::make_shared<Mechanism>(mechanics::read_urdf(path, o).mechanism);
}

/// One gauss16 step with its stages as lanes, and stage by stage: their ratio is what the lanes
/// bring. "evaluation" of the first over eight_stages is what a step adds to its field.
void add_steps(const std::string& name, Model m, double h) {
  benchmark::RegisterBenchmark(("gauss16_step/" + name).c_str(), gauss16_step, m, h, true);
  benchmark::RegisterBenchmark(("gauss16_step_scalar_stages/" + name).c_str(), gauss16_step, m, h,
                               false);
  benchmark::RegisterBenchmark(("eight_stages/" + name).c_str(), eight_stages, m);
}

}  // namespace
}  // namespace porthos::bench

int main(int argc, char** argv) {
  using namespace porthos::bench;
  benchmark::Initialize(&argc, argv);
  const auto ets_vii = read(PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf", true);
  add_steps("ets_vii", ets_vii, 0.25);
  add_steps("sat_panda",
            read(PORTHOS_SOURCE_DIR "/tests/data/reference/pinocchio/urdf/sat_panda.urdf", true),
            0.02);
  for (int n : {10, 100, 1000}) add_steps("chain" + std::to_string(n), chain(n, false), 0.02);
  const auto arm = std::make_shared<porthos::mechanics::MechanicalModel>(ets_vii);
  add_gradients("ets_vii", arm, start(*arm, *ets_vii), 0.25);
  benchmark::RunSpecifiedBenchmarks();
}
