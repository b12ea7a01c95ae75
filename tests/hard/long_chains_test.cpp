// The free-floating arm and the hundred-link chain. Must hold: with P = 0 the centre of mass of
// ETS-VII stays where it is over 1e5 steps, momentum and energy at round-off; a passive chain of
// 100 links keeps its energy at round-off at a step that resolves it; the largest step whose
// implicit equations the iteration solves is printed. Must fail: rk4 moves the centre of mass, and
// loses the chain's energy.
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "tests/support/energy_run.h"

namespace porthos::long_chains_test {
namespace {

TEST(LongChains, CentreOfMassOfTheFreeArm) {
  const auto robot = test::ets_vii(5);
  const auto& m = robot.model->mechanism();
  mechanics::Workspace<double> w(m);
  const size_t n = size_t(m.nq());
  phs::State start = robot.start;
  for (size_t i = 0; i < 3; ++i) start.x[n + i] = 0;  // P, conjugate to the base's place
  const auto centre = [&](const phs::State& s) {
    return mechanics::centre_of_mass<double>(m, w, std::span<const double>(s.x).first(n));
  };
  const auto c0 = centre(start);
  test::Gauge gauge(*robot.model);
  const auto I0 = gauge.invariants(start);
  ASSERT_EQ(I0[0] * I0[0] + I0[1] * I0[1] + I0[2] * I0[2], 0);

  const auto moved = [&](const char* name, std::int64_t steps, double& energy, double& momentum) {
    const auto method = integrators::make_integrator(name, *robot.model, 0.1);
    phs::State s = start;
    const auto H0 = gauge.energy(s);
    double worst = 0;
    for (std::int64_t i = 1; i <= steps; ++i) {
      if (method->step(s) != integrators::Outcome::ok) return HUGE_VAL;
      if (i % 100) continue;
      const auto d = centre(s) - c0;
      worst = std::max(worst, mechanics::norm(d));
      energy = std::max(energy, double(std::fabs(gauge.energy(s) - H0) / H0));
      const auto& I = gauge.invariants(s);
      for (size_t k = 0; k < 3; ++k) momentum = std::max(momentum, std::fabs(double(I[k])));
    }
    return worst;
  };
  const std::int64_t steps = 100000;
  double energy = 0, momentum = 0, rk4_energy = 0, rk4_momentum = 0;
  const double ours = moved("gauss16", steps, energy, momentum),
               rk4 = moved("rk4", steps / 10, rk4_energy, rk4_momentum);
  // The centre of mass of a base that turns: each step rounds the base's place, a metre, by 1e-16.
  test::keeps("gauss16: centre of mass moved [m]", ours, test::random_walk(steps));
  test::keeps("gauss16: P [kg m/s]", momentum, 0);
  test::keeps("gauss16: energy", energy, test::random_walk(steps));
  test::breaks("rk4: centre of mass moved [m], a tenth of the steps", rk4, 1e-9);
  test::breaks("rk4: energy", rk4_energy, 1e-9);
}

TEST(LongChains, HundredLinks) {
  const size_t n = 100;
  const mechanics::MechanicalModel model(
      test::planar_chain(std::vector<double>(n, 1), std::vector<double>(n, 0.1),
                         std::vector<double>(n, 0.05), std::vector<double>(n, 1. / 1200), 9.81));
  std::vector<double> q(n, 0.02), v(n, 0.0);  // bent to 2 rad over its 10 m, released at rest
  const phs::State start(model.description(), model.state(q, v));
  double h = 1.0 / 16;
  for (bool solved = false; !solved && h > 1e-4;) {
    h /= 2;
    solved = test::energy_run("gauss16", model, start, h, std::int64_t(0.25 / h)).ok;
    std::printf("  h = 1/%g: %s\n", 1 / h, solved ? "converges" : "no convergence");
  }
  test::keeps("1 / largest step that converges [1/s]", 1 / h, 1024);
  const double resolved = 1.0 / 512;
  const std::int64_t steps = 1024;
  const auto ours = test::energy_run("gauss16", model, start, resolved, steps);
  test::keeps("gauss16 energy, h = 1/512, 2 s", ours.energy, test::random_walk(steps));
  test::breaks("rk4 energy, the same",
               test::energy_run("rk4", model, start, resolved, steps).energy, 1e-12);
}

}  // namespace
}  // namespace porthos::long_chains_test
