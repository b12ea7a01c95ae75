#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "energy_shaping/matching/designs.h"
#include "integrators/core/integrator.h"
#include "tests/support/bounds.h"

namespace porthos::test {

using Vec = std::vector<double>;

/// H_d and states of a loop's own dynamics at some times.
struct Sample {
  double H;
  Vec x;
};
inline std::map<double, Sample> run_loop(const energy_shaping::ClosedLoop& loop, const Vec& x0,
                                         const Vec& times, double h,
                                         const std::string& method = "gauss8") {
  const auto integrator = integrators::make_integrator(method, loop, h);
  const auto system = loop.instantiate<double>();
  phs::State s(loop.description(), x0);
  std::map<double, Sample> out;
  for (const double t : times) {
    while (double(s.step) * h < t - 0.5 * h)
      if (integrator->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
    out[t] = {system->hamiltonian(s.x), s.x};
  }
  return out;
}

/// u of the law at x, the actuated inputs in order.
inline Vec law_at(const energy_shaping::ClosedLoop& loop, const Vec& x) {
  const auto system = loop.loop<double>();
  Vec u(size_t(loop.plant().description().nu)), out;
  system->law(0.0, x, u);
  for (const int a : loop.actuated()) out.push_back(u[size_t(a)]);
  return out;
}

/// What a value was expected to be, in relative terms of the greater of its size and `scale`.
inline void agrees(const std::string& what, double measured, double expected, double tolerance,
                   double scale = 0) {
  keeps(what, std::fabs(measured - expected) / std::max(std::fabs(expected), scale), tolerance);
}

}  // namespace porthos::test
