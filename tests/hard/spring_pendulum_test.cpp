// A pendulum on a stiff spring, through the resonances of the implicit midpoint rule. The rule
// turns a spring of frequency ω by θ = 2 atan(hω/2) a step; where θ = 2π/n the nonlinearity excites
// it (Mandziuk, Schlick 1995, Chem. Phys. Lett. 237:525: n = 3 at hω = 2√3, n = 4 at hω = 2, less
// the spring's own detuning). Must hold: gonzalez keeps the energy exactly at every step it solves,
// gauss16 where it resolves the spring. Must fail: midpoint, whose error leaves its h² law in
// spikes.
#include "tests/support/energy_run.h"
#include "tests/support/problems.h"

namespace porthos::spring_pendulum_test {
namespace {

/// Released at 1 rad with the spring compressed to 1 - depth; error of the energy, in units of m g
/// l.
double energy(const char* method, double depth, double h_omega, double duration) {
  const double omega = 10, l = 1 - depth;
  const phs::UserModel<test::SpringPendulum> model{test::SpringPendulum{omega}};
  const phs::State start(model.description(), {l * std::sin(1.0), -l * std::cos(1.0), 0, 0});
  integrators::Options o;
  o.max_sweeps = 2000;
  return test::energy_run(method, model, start, h_omega / omega,
                          std::int64_t(duration * omega / h_omega), {.scale = 1, .method = o})
      .energy;
}

TEST(SpringPendulum, FourthOrderResonanceOfTheMidpointRule) {
  double least = HUGE_VAL, most = 0, at = 0, gonzalez = 0, gauss = 0;
  for (int k = 50; k <= 89; ++k) {
    const double x = 0.02 * k, e = energy("midpoint", 0.35, x, 100) / (x * x);
    if (e > most && e < HUGE_VAL) {
      most = e;
      at = x;
    }
    least = std::min(least, e);
    if (k % 3 == 0) gonzalez = std::max(gonzalez, energy("gonzalez", 0.35, x, 100));
  }
  for (const double x : {0.25, 0.5, 0.75}) gauss = std::max(gauss, energy("gauss16", 0.35, x, 100));
  std::printf("  midpoint: error / (h ω)² from %.2e to %.2e, at h ω = %.2f\n", least, most, at);
  test::breaks("midpoint, h ω in 1 … 1.78: spread of error / (h ω)²", most / least, 3);
  // 1200 steps; the terms of H reach some 10 times the unit
  test::keeps("gonzalez, h ω in 1 … 1.78", gonzalez, 1e-12);
  test::keeps("gauss16, h ω in 0.25 … 0.75", gauss, 1e-12);
}

// Beyond hω = 2√3 the midpoint rule's equations have several solutions here and the error depends
// on which one the iteration finds; below it, and where the resonance sets in, it does not.
TEST(SpringPendulum, ThirdOrderResonanceOfTheMidpointRule) {
  double off = 0, on = 0, gonzalez = 0;
  for (int k = 30; k <= 35; ++k) {
    const double x = 0.1 * k, e = energy("midpoint", 0.25, x, 400);
    ASSERT_LT(e, HUGE_VAL) << "midpoint's equations are not solved at h ω = " << x;
    if (k <= 31) off = std::max(off, e);
    if (k == 32 || k == 33) on = std::max(on, e);
    gonzalez = std::max(gonzalez, energy("gonzalez", 0.25, x, 400));
  }
  std::printf("  midpoint, h ω in 3, 3.1: energy %.1e\n", off);
  test::breaks("midpoint, h ω in 3.2, 3.3: energy over that", on / off, 10);
  test::keeps("gonzalez, h ω in 3 … 3.5", gonzalez, 1e-12);
}

}  // namespace
}  // namespace porthos::spring_pendulum_test
