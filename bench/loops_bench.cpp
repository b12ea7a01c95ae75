// What a step of spark16 costs per loop: chains of windows, where each loop shares a crank with the
// next, and independent four-bars.
#include <benchmark/benchmark.h>

#include "integrators/core/integrator.h"
#include "tests/support/linkages.h"

namespace porthos::bench {
namespace {

void spark16_step(benchmark::State& state, test::Linkage (*make)(int)) {
  const int N = int(state.range(0));
  test::Linkage l = make(N);
  const auto x = l.start();
  const auto model = l.model();
  phs::State s(model.description(), x);
  const auto method = integrators::make_integrator("spark16", model, 1. / 256);
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

BENCHMARK_CAPTURE(spark16_step, windows, chain_of_windows)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(spark16_step, four_bars, test::four_bars)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(factor, windows, chain_of_windows)->RangeMultiplier(10)->Range(1, 1000);
BENCHMARK_CAPTURE(factor, four_bars, test::four_bars)->RangeMultiplier(10)->Range(1, 1000);

}  // namespace
}  // namespace porthos::bench
