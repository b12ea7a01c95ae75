#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "integrators/core/integrator.h"
#include "scene/run/statistics.h"
#include "tests/support/bounds.h"
#include "tests/support/robots.h"

/// A method at work for N steps, its energy measured in extended precision from value + low word.
namespace porthos::test {

struct EnergyRun {
  bool ok = true;
  double energy = 0;     ///< max |H - H0| / scale
  double exponent = 0;   ///< of the growth of the energy error: 0 bounded, 1/2 random walk, 1 drift
  bool drifts = true;    ///< the energy error has a drift beyond what a random walk explains
  double invariant = 0;  ///< max |I - I0| / |I0| of the invariant asked for
  phs::State end;
};

struct EnergyRunOptions {
  std::int64_t samples = 1000;  ///< measurements, evenly spread; at most one per step
  double scale = 0;             ///< of the energy; 0: |H0|
  std::string invariant = {};   ///< its name in the description; empty: none
  integrators::Options method = {};
};

inline EnergyRun energy_run(const std::string& name, const phs::Model& model,
                            const phs::State& start, double h, std::int64_t steps,
                            const EnergyRunOptions& o = {}) {
  const auto method = integrators::make_integrator(name, model, h, o.method);
  Gauge gauge(model);
  EnergyRun run;
  run.end = start;
  const auto H0 = gauge.energy(start);
  const auto I0 = gauge.invariants(start);
  const long double scale = o.scale != 0 ? (long double)o.scale : std::fabs(H0);
  const auto every = std::max<std::int64_t>(1, steps / o.samples);
  scene::ErrorStatistics errors;
  for (std::int64_t i = 1; i <= steps; ++i) {
    if (method->step(run.end) != integrators::Outcome::ok) {
      run.ok = false;
      run.energy = run.invariant = HUGE_VAL;
      return run;
    }
    if (i % every != 0) continue;
    const double error = double((gauge.energy(run.end) - H0) / scale);
    errors.add(error);
    run.energy = std::max(run.energy, std::fabs(error));
    if (!o.invariant.empty())
      run.invariant = std::max(run.invariant, gauge.error(o.invariant, run.end, I0));
  }
  run.exponent = errors.growth_exponent();
  run.drifts = errors.drift_is_significant();
  return run;
}

/// What rounding does at least: half an ulp of H a step, as a random walk. Where the kinetic energy
/// is larger than
/// |H|, or the mechanism large, more.
inline double random_walk(std::int64_t steps) { return 0x1p-53 * std::sqrt(double(steps)); }

/// The long form of a test: ./dev test --long.
inline bool long_runs() {
  const char* s = std::getenv("PORTHOS_LONG");
  return s && std::string(s) == "1";
}

}  // namespace porthos::test
