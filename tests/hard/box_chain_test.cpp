// Ten equal boxes of 0.3 x 0.3 x 1.5 m on revolute joints, passive under gravity, q and q' uniform
// in ±π/2, h = 1e-3 s: the energy experiment of Lee, Liu, Park, Srinivasa 2016 (WAFR, "A
// linear-time variational integrator for multibody systems"). The best published band on such a
// chain is 1.1e-2 over 1e5 steps (DART's variational integrator, dartsim/dart #2779). Must hold:
// gauss16 keeps the energy to 1e-12 (2e4 steps; 1e6 with PORTHOS_LONG=1). Must fail: stormer_verlet
// (variational, of order 2) and rk4.
#include <random>

#include "tests/support/energy_run.h"

namespace porthos::box_chain_test {
namespace {

std::shared_ptr<const mechanics::Mechanism> boxes(int n) {
  const double a = 0.3, b = 0.3, l = 1.5, m = 1000 * a * b * l;
  mechanics::MechanismBuilder builder("box chain");
  builder.gravity({0, 0, -9.81});
  for (int i = 0; i < n; ++i) {
    mechanics::BodySpec s;
    s.name = "box" + std::to_string(i);
    s.parent = i ? "box" + std::to_string(i - 1) : "world";
    s.joint.type = "revolute";
    s.joint.axis = {1, 0, 0};
    if (i) s.placement.r = {0, 0, -l};
    s.mass = {
        m,
        {0, 0, -l / 2},
        {m * (b * b + l * l) / 12, 0, 0, m * (a * a + l * l) / 12, 0, m * (a * a + b * b) / 12}};
    builder.add(s);
  }
  return std::make_shared<mechanics::Mechanism>(builder.build());
}

TEST(BoxChain, EnergyLONG) {
  const mechanics::MechanicalModel model(boxes(10));
  std::mt19937_64 random(2016);
  const auto uniform = [&] { return (double(random() >> 11) * 0x1p-53 - 0.5) * M_PI; };
  std::vector<double> q(10), v(10);
  for (auto& a : q) a = uniform();
  for (auto& a : v) a = uniform();
  const phs::State start(model.description(), model.state(q, v));
  const std::int64_t steps = test::long_runs() ? 1000000 : 20000;
  const test::EnergyRunOptions o{.samples = 5000};
  const auto ours = test::energy_run("gauss16", model, start, 1e-3, steps, o);
  std::printf("  %lld steps\n", (long long)steps);
  test::keeps("gauss16 energy", ours.energy, 1e-12);
  test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
  EXPECT_FALSE(ours.drifts);
  const std::int64_t few = 20000;
  test::breaks("stormer_verlet energy, 2e4 steps",
               test::energy_run("stormer_verlet", model, start, 1e-3, few, o).energy, 1e-9);
  test::breaks("rk4 energy, 2e4 steps", test::energy_run("rk4", model, start, 1e-3, few, o).energy,
               1e-9);
}

}  // namespace
}  // namespace porthos::box_chain_test
