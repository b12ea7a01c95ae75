// What a composition and its ledger cost: a step of gauss16 on ETS-VII with joint elements, with
// and without the ledger, and an evaluation of a network against its members alone.
#include <benchmark/benchmark.h>

#include "bench/chain.h"
#include "integrators/core/integrator.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "phs/network/network.h"

namespace porthos::bench {
namespace {

std::shared_ptr<const mechanics::MechanicalModel> ets_vii() {
  mechanics::UrdfOptions o;
  o.base = mechanics::UrdfOptions::Base::free;
  o.accept_unphysical_inertia = true;
  return std::make_shared<mechanics::MechanicalModel>(std::make_shared<const mechanics::Mechanism>(
      mechanics::read_urdf(PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf", o).mechanism));
}

/// A damper at the first `n` joints, a torque at one.
std::shared_ptr<const phs::Model> with_elements(std::shared_ptr<const phs::Model> arm, int n) {
  phs::Network net("arm");
  net.add("arm", std::move(arm));
  for (int i = 1; i <= n; ++i) {
    const std::string joint = "joint_" + std::to_string(i);
    net.resist(joint + ".friction", "arm." + joint + ".torque", phs::viscous(0.01));
  }
  net.source("drive", "arm.joint_1.torque", phs::constant(0.01));
  return net.build();
}

void gauss16_step(benchmark::State& state, bool ledger) {
  const auto arm = ets_vii();
  const auto model = with_elements(arm, 6);
  const auto& m = arm->mechanism();
  phs::State s(model->description(), arm->state(configuration(m), numbers(size_t(m.nv()), 0.05)));
  const auto method = integrators::make_integrator("gauss16", *model, 0.25, {.port_work = ledger});
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
  state.counters["sweeps"] = double(method->cost().sweeps) / double(method->cost().steps);
}
BENCHMARK_CAPTURE(gauss16_step, with_ledger, true);
BENCHMARK_CAPTURE(gauss16_step, without_ledger, false);

/// 0 elements: the arm alone, no network.
void evaluation(benchmark::State& state) {
  const auto arm = ets_vii();
  const int n = int(state.range(0));
  const std::shared_ptr<const phs::Model> model = n > 0 ? with_elements(arm, n - 1) : arm;
  const auto f = model->instantiate<double>();
  const auto& m = arm->mechanism();
  const auto x = arm->state(configuration(m), numbers(size_t(m.nv()), 0.05));
  std::vector<double> dx(x.size());
  for (auto _ : state) {
    f->field(0, x, {}, dx);
    benchmark::DoNotOptimize(dx.data());
  }
}
BENCHMARK(evaluation)->Arg(0)->Arg(1)->Arg(4)->Arg(7);

}  // namespace
}  // namespace porthos::bench
