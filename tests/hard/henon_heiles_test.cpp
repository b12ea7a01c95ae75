// Henon & Heiles 1964. Must hold: gauss16 follows the regular orbit of the reference to its
// conditioning, and keeps the energy at round-off where the motion is chaotic (H = 1/8) over 1e5
// time units. Must fail: rk4 at the same step, in both; the chaotic orbit must really be chaotic (a
// perturbation of 1e-12 grows to the size of the motion), or nothing is shown.
#include "tests/integrators/problems.h"

#include "tests/support/energy_run.h"

namespace porthos::henon_heiles_test {
namespace {

const phs::UserModel<test::HenonHeiles> model{test::HenonHeiles{}};
const double h = 0.25;

phs::State at(std::vector<double> x) { return phs::State(model.description(), std::move(x)); }

TEST(HenonHeiles, RegularOrbitOfTheReference) {
  const auto file = test::read_json(test::data_file("reference/k_henon_heiles_regular.json"));
  const auto worst = [&](const char* name) {
    auto s = at(test::numbers(file["initial_state"]));
    const auto method = integrators::make_integrator(name, model, h);
    const test::RowError error(file["outputs"]);
    double ratio = 0;
    size_t k = 0;
    for (const auto& o : file["outputs"]) {
      while (double(s.step) * h < test::number(o["t"]))
        EXPECT_EQ(method->step(s), integrators::Outcome::ok);
      const double bound = test::double_bound(test::number(file["sensitivity_by_time"][k++]));
      ratio = std::max(ratio, error(s.x, test::numbers(o["group0"])) / bound);
    }
    return ratio;
  };
  test::keeps("gauss16 to t = 1000, worst error / max(1e-12, 1e-14 kappa)", worst("gauss16"), 1);
  test::breaks("rk4, the same", worst("rk4"), 1e3);
}

/// q1 = 0 and p1 from the energy.
phs::State of_energy(double H, double q2, double p2) {
  const double V = q2 * q2 / 2 - q2 * q2 * q2 / 3;
  return at({0, q2, std::sqrt(2 * (H - V) - p2 * p2), p2});
}

TEST(HenonHeiles, EnergyInTheChaoticSea) {
  const auto start = of_energy(0.125, -0.25, 0);
  auto moved = start;
  moved.x[1] += 1e-12;
  const auto ours = test::energy_run("gauss16", model, start, h, 400000, {.samples = 20000});
  const auto a = test::energy_run("gauss16", model, start, h, 4000),
             b = test::energy_run("gauss16", model, moved, h, 4000);
  double apart = 0;
  for (size_t i = 0; i < 4; ++i) apart = std::max(apart, std::fabs(a.end.x[i] - b.end.x[i]));
  test::breaks("growth of a perturbation of 1e-12 by t = 1000", apart, 1e-3);
  test::keeps("gauss16 energy to t = 1e5", ours.energy, test::random_walk(400000));
  test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
  EXPECT_FALSE(ours.drifts);
  test::breaks("rk4 energy to t = 1e5", test::energy_run("rk4", model, start, h, 400000).energy,
               1e-6);
}

}  // namespace
}  // namespace porthos::henon_heiles_test
