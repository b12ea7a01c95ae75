// The chaotic double pendulum. Must hold: gauss16 keeps the energy to 1e-12 over 1e5 steps, and N
// steps forward then N back return to the start up to what the chaos makes of rounding. Must fail:
// rk4 drifts, and does not come back even where nothing amplifies.
#include "tests/support/energy_run.h"

namespace porthos::double_pendulum_test {
namespace {

const double g = 9.8125;
const mechanics::MechanicalModel model(test::planar_chain({1, 1}, {1, 1}, {1, 1}, {0, 0}, g));

phs::State released(double first, double second) {
  return phs::State(model.description(),
                    model.state(std::vector{first, second}, std::vector{0.0, 0.0}));
}

double apart(const phs::State& a, const phs::State& b) {
  return test::distance(test::unwrapped(model.description(), a),
                        test::unwrapped(model.description(), b));
}

TEST(DoublePendulum, ChaoticEnergy) {
  const double h = 1.0 / 128;
  const auto start = released(2.5, -0.5);
  const test::EnergyRunOptions o{.samples = 20000};
  const auto ours = test::energy_run("gauss16", model, start, h, 100000, o);
  auto moved = start;
  moved.x[0] += 1e-12;
  const auto a = test::energy_run("gauss16", model, start, h, 6400),
             b = test::energy_run("gauss16", model, moved, h, 6400);
  test::breaks("growth of a perturbation of 1e-12 in 50 s", apart(a.end, b.end), 1e-2);
  test::keeps("gauss16 energy, 1e5 steps", ours.energy, 1e-12);
  test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
  EXPECT_FALSE(ours.drifts);
  test::breaks("rk4 energy", test::energy_run("rk4", model, start, h, 100000, o).energy, 1e-9);
  test::breaks("stormer_verlet energy (bounded, second order)",
               test::energy_run("stormer_verlet", model, start, h, 100000, o).energy, 1e-9);
}

/// Distance from the start after n steps forth and n back; beside it, what a perturbation of one
/// ulp grows to in n steps.
struct Return {
  double distance, amplification;
};
Return forth_and_back(const char* name, const phs::State& start, double h, int n) {
  const auto there = test::energy_run(name, model, start, h, n);
  auto moved = start;
  moved.x[0] += 1e-10;
  const auto other = test::energy_run(name, model, moved, h, n);
  const auto back = test::energy_run(name, model, there.end, -h, n);
  EXPECT_TRUE(there.ok && back.ok);
  return {apart(back.end, start), apart(other.end, there.end) / 1e-10};
}

TEST(DoublePendulum, ForthAndBack) {
  const double h = 1.0 / 64;
  for (const int n : {64, 320, 640, 1280}) {
    const auto regular = forth_and_back("gauss16", released(0.7, -0.4), h, n),
               chaotic = forth_and_back("gauss16", released(2.5, -0.5), h, n),
               rk4 = forth_and_back("rk4", released(0.7, -0.4), h, n);
    const std::string at = ", " + std::to_string(n) + " steps";
    test::keeps("gauss16, regular" + at, regular.distance,
                1e-15 * std::sqrt(n) * std::max(1.0, regular.amplification));
    if (n <= 640)  // past 15 s the growth exceeds 1e10: one rounding error fills the energy surface
      test::keeps("gauss16, chaotic" + at, chaotic.distance,
                  1e-15 * std::sqrt(n) * std::max(1.0, chaotic.amplification));
    test::breaks("rk4, regular" + at, rk4.distance, 1e-9);
  }
}

}  // namespace
}  // namespace porthos::double_pendulum_test
