// Methods that keep H to rounding, each beside one that does not.
#include <gtest/gtest.h>

#include "integrators/methods/collocation.h"
#include "tests/support/energy_run.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::integrators::energy_exact_test {
namespace {

/// Largest |H - H0| / |H0|; infinite where a step fails.
double energy_error(const test::Robot& r, const std::string& method, double h, int steps,
                    const Options& o = {}) {
  return test::energy_run(method, *r.model, r.start, h, steps, {.samples = steps, .method = o})
      .energy;
}

// What a step adds is the rounding of sums of h ∇̄H·f whose terms reach the size of H: a random
// walk of u per step. HBVM declares no exact energy, as it loses it at coarser steps, but where the
// motion is resolved it keeps it.
TEST(EnergyExact, AtStepsThatResolveTheMotion) {
  const auto swing = test::swinging_pendulum();
  const auto floating = test::ets_vii(8);
  const auto check = [&](const std::string& name, bool exact) {
    for (const auto* r : {&swing, &floating}) {
      if (misfit(declaration_of(name), r->model->description())) continue;
      const double h = r == &swing ? 0.02 : 0.1;
      const int steps = r == &swing ? 4000 : 1000;
      const double bound = 5e-16 * std::sqrt(double(steps));
      const double error = energy_error(*r, name, h, steps);
      const std::string what = name + (r == &swing ? ", pendulum" : ", ETS-VII");
      exact ? test::keeps(what, error, bound) : test::breaks(what, error, 1e5 * bound);
    }
  };
  for (const char* name :
       {"gonzalez", "mean_value", "itoh_abe", "itoh_abe2", "hbvm8", "hbvm6", "hbvm4"})
    check(name, true);
  for (const char* name : {"midpoint", "gauss4", "stormer_verlet", "rk4"}) check(name, false);
}

// Chaotic swings with a step of a tenth of the fastest period. One panel of 16 points no longer
// integrates ∇H there, so HBVM loses what the panels of the discrete gradients keep.
TEST(EnergyExact, AtLargeSteps) {
  const auto r = test::swinging_pendulum();
  const double h = 0.05;
  test::keeps("gonzalez", energy_error(r, "gonzalez", h, 400), 6e-14);
  test::keeps("mean_value", energy_error(r, "mean_value", h, 400), 6e-14);
  test::breaks("hbvm4", energy_error(r, "hbvm4", h, 400), 6e-14);
  test::breaks("gauss8", energy_error(r, "gauss8", h, 400), 1e-4);
}

// No bias: u√N after N steps, where a bias of u a step would be 4e-12. The control stops its sweeps
// at a tolerance.
TEST(EnergyExact, GrowsLikeTheSquareRootOfTime) {
  const auto r = test::swinging_pendulum();
  const int n = 40000;
  const double bound = test::random_walk(n);
  for (const std::string name : {"hbvm8", "hbvm4", "gonzalez", "mean_value"}) {
    test::keeps(name, energy_error(r, name, 0.01, n), bound);
    test::breaks(name + " with a tolerance",
                 energy_error(r, name, 0.01, n / 10, {.iteration_tolerance = 1e-10}), bound);
  }
}

// The mean value gradient is HBVM with one coefficient: two codes, one method.
TEST(EnergyExact, MeanValueIsHbvmWithOneCoefficient) {
  const auto r = test::swinging_pendulum();
  const double h = 0.01;
  const auto run = [&](Integrator& method) {
    phs::State s = r.start;
    for (int i = 0; i < 50; ++i) EXPECT_EQ(method.step(s), Outcome::ok);
    return test::unwrapped(r.model->description(), s);
  };
  const auto hbvm = run(*make_collocation<double>({.name = "hbvm2", .order = 2},
                                                  hbvm_table<double>(16, 1), *r.model, h, {}));
  const auto mean = run(*make_integrator("mean_value", *r.model, h));
  test::keeps("mean_value and HBVM(16,1) apart", test::distance(mean, hbvm), 1e-14);
  test::breaks("midpoint and HBVM(16,1) apart",
               test::distance(run(*make_integrator("midpoint", *r.model, h)), hbvm), 1e-6);
}

TEST(EnergyExact, LanesEqualSinglePoints) {
  const auto robot = test::ets_vii(5);
  for (const char* name : {"gonzalez", "mean_value", "hbvm4"}) {
    phs::State a = robot.start, b = robot.start;
    const auto lanes = make_integrator(name, *robot.model, 0.1),
               single = make_integrator(name, *robot.model, 0.1, {.lanes = false});
    for (int i = 0; i < 50; ++i) {
      ASSERT_EQ(lanes->step(a), Outcome::ok);
      ASSERT_EQ(single->step(b), Outcome::ok);
    }
    EXPECT_TRUE(a == b) << name;
  }
}

TEST(Hbvm, WithAsManyNodesAsCoefficientsIsGauss) {
  const auto gauss = gauss_table<double>(4), same = hbvm_table<double>(4, 4),
             other = hbvm_table<double>(4, 3);
  double worst = 0, differs = 0;
  for (size_t i = 0; i < 16; ++i) {
    worst = std::max(worst, std::fabs(gauss.mu[i] - same.mu[i]));
    differs = std::max(differs, std::fabs(gauss.mu[i] - other.mu[i]));
  }
  test::keeps("tables of HBVM(4,4) and Gauss apart", worst, 2.3e-16);  // rounded on another side
  test::breaks("HBVM(4,3) and Gauss", differs, 1e-2);
}

}  // namespace
}  // namespace porthos::integrators::energy_exact_test
