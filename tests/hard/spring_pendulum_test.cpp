// A pendulum on a stiff spring, ω = 50: the step through the resonances of the implicit midpoint rule. Ascher and Reich
// 1999 (SIAM J. Sci. Comput. 21:1045) show the rule in resonance with the stiff spring at large hω. Must hold: gonzalez
// keeps the energy exactly at every step of the sweep, and gauss16 keeps it where it resolves the spring. Must fail:
// midpoint, whose energy error spikes at some steps of the sweep against its neighbours.
#include "tests/support/energy_run.h"
#include "tests/support/problems.h"

namespace porthos {
namespace {

const double omega = 50;
const phs::UserModel<test::SpringPendulum> model{test::SpringPendulum{omega}};

phs::State swinging() {
  return phs::State(model.description(), {std::sin(1.0), -std::cos(1.0) - 0.01, 0, 0});
}

TEST(SpringPendulum, MidpointResonances) {
  const auto energy = [](const char* method, double h_omega) {
    return test::energy_run(method, model, swinging(), h_omega / omega,
                            std::int64_t(100 * omega / h_omega), {.scale = 1})
        .energy;
  };
  double least = HUGE_VAL, most = 0, at = 0, gonzalez = 0;
  for (double h_omega = 0.5; h_omega <= 20; h_omega += 0.5) {
    const double e = energy("midpoint", h_omega), g = energy("gonzalez", h_omega);
    if (std::getenv("VERBOSE")) std::printf("%g %.3e %.3e\n", h_omega, e, g);
    if (e > most) most = e, at = h_omega;
    least = std::min(least, e), gonzalez = std::max(gonzalez, g);
  }
  std::printf("  midpoint: from %.1e to %.1e, at h ω = %g\n", least, most, at);
  test::breaks("midpoint, spike over the smallest error of the sweep", most / least, 10);
  test::keeps("gonzalez, energy at every step", gonzalez, 1e-11);
  double resolved = 0;
  for (double h_omega = 0.5; h_omega <= 1.5; h_omega += 0.25)
    resolved = std::max(resolved, energy("gauss16", h_omega));
  test::keeps("gauss16, h ω <= 1.5, energy", resolved, 1e-12);
}

}  // namespace
}  // namespace porthos
