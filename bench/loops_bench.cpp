// What a step of spark16 costs per loop: chains of windows, where each loop shares a crank with the
// next, and independent four-bars; and a step of gauss16 on their trees alone.
#include <benchmark/benchmark.h>

#include "integrators/core/integrator.h"
#include "mechanics/constraints/maximal.h"
#include "tests/support/linkages.h"

namespace porthos::bench {
namespace {

void step(benchmark::State& state, test::Linkage (*make)(int), bool tree) {
  const int N = int(state.range(0));
  test::Linkage l = make(N);
  const auto x = l.start();
  if (tree) l.spec = {};
  const auto model = l.model();
  phs::State s(model.description(), x);
  const auto method = integrators::make_integrator(tree ? "gauss16" : "spark16", model, 1. / 256);
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
  using benchmark::Counter;
  state.counters["sweeps"] = double(method->cost().sweeps) / double(method->cost().steps);
  state.counters["time_per_loop"] =
      Counter(N, Counter::kIsIterationInvariantRate | Counter::kInvert);
}
/// D and its factors at one state.
void factor(benchmark::State& state, test::Linkage (*make)(int)) {
  const int N = int(state.range(0));
  test::Linkage l = make(N);
  const auto x = l.start();
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  std::vector<double> g(size_t(rows->count()));
  rows->place(x, g);
  for (auto _ : state) benchmark::DoNotOptimize(rows->factor(x));
  using benchmark::Counter;
  state.counters["time_per_loop"] =
      Counter(N, Counter::kIsIterationInvariantRate | Counter::kInvert);
}
test::Linkage chain_of_windows(int N) { return test::windows(N, true); }

/// A step of spark16 in either coordinates: its time, and the rows.
void coordinates(benchmark::State& state, test::Linkage (*make)(int), bool maximal) {
  test::Linkage l = make(int(state.range(0)));
  const auto x = l.start();
  auto model = std::make_unique<mechanics::MechanicalModel>(l.model());
  phs::State s(model->description(), x);
  if (maximal) {
    const auto form = mechanics::maximal_form(l.parts, l.spec);
    auto other = std::make_unique<mechanics::MechanicalModel>(
        std::make_shared<mechanics::Mechanism>(form.parts.build()),
        std::vector<mechanics::BodyPort>(), form.constraints);
    s = mechanics::maximal_state(*model, s, *other);
    model = std::move(other);
  }
  const auto method = integrators::make_integrator("spark16", *model, 1. / 512);
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) {
      state.SkipWithError("the step failed");
      break;
    }
  state.counters["sweeps"] = double(method->cost().sweeps) / double(method->cost().steps);
  state.counters["rows"] = double(model->description().constraint_count());
}
/// n rods on hinges with alternating axes, on a free base.
test::Linkage arm(int n) {
  mechanics::MechanismBuilder b("arm");
  test::Linkage l;
  for (int i = 0; i <= n; ++i) {
    auto body =
        test::rod("body" + std::to_string(i), i == 0 ? "world" : "body" + std::to_string(i - 1),
                  i < 2 ? 0 : 0.3, 0, i == 0 ? 1 : 0.3, i == 0 ? 150 : 2);
    if (i == 0) body.joint.type = "free";
    if (i % 3 == 1) body.joint.axis = {0, 1, 0};
    if (i % 3 == 2) body.joint.axis = {1, 0.5, 0};
    b.add(body);
  }
  l.mechanism = std::make_shared<mechanics::Mechanism>(b.build());
  l.q = l.mechanism->neutral();
  l.v.assign(size_t(l.mechanism->nv()), 0.2);
  for (int i = 0; i < n; ++i) l.q[size_t(7 + i)] = 0.3 + 0.1 * i;
  l.parts = b;
  return l;
}

BENCHMARK_CAPTURE(coordinates, arm_reduced, arm, false)->Arg(7)->Arg(70);
BENCHMARK_CAPTURE(coordinates, arm_maximal, arm, true)->Arg(7)->Arg(70);
BENCHMARK_CAPTURE(coordinates, scissors_reduced, test::scissors, false)->Arg(10);
BENCHMARK_CAPTURE(coordinates, scissors_maximal, test::scissors, true)->Arg(10);
BENCHMARK_CAPTURE(coordinates, lattice_reduced, test::lattice, false)->DenseRange(2, 10, 2);
BENCHMARK_CAPTURE(coordinates, lattice_maximal, test::lattice, true)->DenseRange(2, 10, 2);
BENCHMARK_CAPTURE(step, windows, chain_of_windows, false)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(step, windows_tree, chain_of_windows, true)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(step, four_bars, test::four_bars, false)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(step, four_bars_tree, test::four_bars, true)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(factor, windows, chain_of_windows)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(factor, four_bars, test::four_bars)->RangeMultiplier(10)->Range(1, 1000);

}  // namespace
}  // namespace porthos::bench
