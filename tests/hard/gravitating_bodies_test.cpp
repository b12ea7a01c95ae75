// Bodies that attract each other. Must hold: the outer solar system over 1e7 days at 400 days a
// step, energy and angular momentum at round-off, as a random walk; the Pythagorean three bodies to
// their first close approach. Must fail: rk4; and every fixed step, gauss16's too, in the
// Pythagorean encounters: they need step control.
#include "tests/support/energy_run.h"
#include "tests/support/problems.h"

namespace porthos::gravitating_bodies_test {
namespace {

/// Sun (with the inner planets), Jupiter, Saturn, Uranus, Neptune, Pluto on 5 September 1994:
/// Hairer, Lubich, Wanner 2006, table I.2.2. AU, day, mass of the Sun; here with the centre of mass
/// at rest.
struct OuterSolarSystem {
  test::GravitatingBodies bodies{2.95912208286e-4,
                                 {1.00000597682, 0.000954786104043, 0.000285583733151,
                                  0.0000437273164546, 0.0000517759138449, 1 / 1.3e8}};
  const double q[6][3] = {{0, 0, 0},
                          {-3.5023653, -3.8169847, -1.5507963},
                          {9.0755314, -3.0458353, -1.6483708},
                          {8.3101420, -16.2901086, -7.2521278},
                          {11.4707666, -25.7294829, -10.8169456},
                          {-15.5387357, -25.2225594, -3.1902382}};
  const double v[6][3] = {{0, 0, 0},
                          {0.00565429, -0.00412490, -0.00190589},
                          {0.00168318, 0.00483525, 0.00192462},
                          {0.00354178, 0.00137102, 0.00055029},
                          {0.00288930, 0.00114527, 0.00039677},
                          {0.00276725, -0.00170702, -0.00136504}};
  std::vector<double> state() const {
    const auto& m = bodies.m;
    double mean[3] = {}, total = 0;
    for (size_t i = 0; i < 6; ++i) {
      total += m[i];
      for (size_t a = 0; a < 3; ++a) mean[a] += m[i] * v[i][a];
    }
    std::vector<double> x(36);
    for (size_t i = 0; i < 6; ++i)
      for (size_t a = 0; a < 3; ++a) {
        x[3 * i + a] = q[i][a];
        x[18 + 3 * i + a] = m[i] * (v[i][a] - mean[a] / total);
      }
    return x;
  }
};

TEST(GravitatingBodies, OuterSolarSystem) {
  const OuterSolarSystem system;
  const phs::UserModel<test::GravitatingBodies> model{system.bodies};
  const phs::State start(model.description(), system.state());
  const auto run = [&](const char* method) {
    return test::energy_run(method, model, start, 400, 25000,
                            {.samples = 25000, .invariant = "angular_momentum"});
  };
  const auto ours = run("gauss16"), rk4 = run("rk4");
  // IRKGL16 (Antonana, Makazaga, Murua) shows 2.5e-14 on its plot of the same span and step, from
  // DE430 start values.
  test::keeps("gauss16 energy, 1e7 days at 400 (IRKGL16: 2.5e-14)", ours.energy, 2.5e-14);
  test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
  EXPECT_FALSE(ours.drifts);
  test::keeps("gauss16 angular momentum", ours.invariant, test::random_walk(25000));
  test::breaks("rk4 energy", rk4.energy, 1e-6);
  test::breaks("rk4 angular momentum", rk4.invariant, 1e-6);
}

// Masses 3, 4, 5 at rest in the corners opposite the sides 3, 4, 5 (Burrau 1913; Szebehely, Peters
// 1967).
TEST(GravitatingBodies, PythagoreanNeedsMoreThanFixedSteps) {
  const phs::UserModel<test::GravitatingBodies> model{test::GravitatingBodies{1, {3, 4, 5}}};
  std::vector<double> x(18, 0.0);
  x[0] = 1;
  x[1] = 3;
  x[3] = -2;
  x[4] = -1;
  x[6] = 1;
  x[7] = -1;
  const phs::State start(model.description(), x);
  const auto run = [&](const char* method, double t, int per_unit) {
    return test::energy_run(method, model, start, 1.0 / per_unit, std::int64_t(t * per_unit),
                            {.samples = 1 << 20});
  };
  test::keeps("gauss16 energy, h = 1/256, to t = 1.5", run("gauss16", 1.5, 256).energy, 1e-14);
  test::breaks("rk4, the same", run("rk4", 1.5, 256).energy, 1e-12);
  for (const int per_unit : {256, 1024, 4096, 16384}) {
    const auto r = run("gauss16", 16, per_unit);
    std::printf("  h = 1/%d: %s t = %.4f\n", per_unit, r.ok ? "came to" : "no convergence at",
                double(r.end.step) / per_unit);
    test::breaks("gauss16 energy to t = 16", r.energy, 1e-8);
  }
}

}  // namespace
}  // namespace porthos::gravitating_bodies_test
