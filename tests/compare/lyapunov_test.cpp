// Growth of deviations, and the reference a trajectory is held against.
#include "scene/compare/lyapunov.h"

#include "integrators/methods/gauss.h"
#include "scene/compare/reference_state.h"
#include "tests/run/scenes.h"
#include "tests/support/gauss.h"

namespace porthos::test::lyapunov_test {
namespace {

scene::Sensitivity observe(const Case& c, double step, double duration) {
  scene::StateScale scale(c.assembly.model->description());
  scene::find_step(c.assembly, step, 100, scale);
  return scene::sensitivity(c.assembly, scale, {.step = step, .duration = duration});
}

Case swinging(const TemporaryFolder& folder, double angle) {
  Case c = pendulum(folder);
  c.scene.joints["shoulder"] = {angle, 0};
  c.assembly = scene::assemble(c.scene);
  return c;
}

TEST(Sensitivity, TellsChaosFromShear) {
  TemporaryFolder folder;
  const auto regular = observe(swinging(folder, 0.1), 0.02, 200);
  const auto chaotic = observe(swinging(folder, 3.0), 0.01, 60);
  std::printf("  small swings: growth %.2g in %g s; wild ones: %.2g in %g s, exponent %.2g per s\n",
              regular.growth, regular.observed_s, chaotic.growth, chaotic.observed_s,
              chaotic.exponent_per_s);
  EXPECT_FALSE(regular.chaotic);
  EXPECT_LT(regular.growth, 1e4);
  EXPECT_TRUE(chaotic.chaotic);
  EXPECT_LT(chaotic.time_of_growth(1e4), chaotic.observed_s);
  EXPECT_EQ(regular.time_of_growth(1e9), regular.observed_s);
}

// Two runs of gauss16 a billionth apart, which know nothing of dual numbers.
TEST(Sensitivity, AgreesWithTwoNearbyRuns) {
  TemporaryFolder folder;
  const Case c = swinging(folder, 3.0);
  const auto& d = c.assembly.model->description();
  const auto tangent = observe(c, 0.01, 60);
  const double t = tangent.time_of_growth(1e5), h = 0.01, apart = 1e-9;
  scene::StateScale scale(d);
  scene::find_step(c.assembly, h, 100, scale);
  phs::State a = c.assembly.initial, b = a;
  b.x[1] += apart;
  const auto one = integrators::make_integrator("gauss16", *c.assembly.model, h);
  const auto two = integrators::make_integrator("gauss16", *c.assembly.model, h);
  while (a.time(h) < t) {
    ASSERT_EQ(one->step(a), integrators::Outcome::ok);
    ASSERT_EQ(two->step(b), integrators::Outcome::ok);
  }
  const double growth =
      scene::distance(scale, scene::unwrapped(d, a), scene::unwrapped(d, b)) / apart;
  std::printf("  after %.3g s: tangent 1e5, nearby runs %.3g\n", t, growth);
  // Another direction to begin with, another norm: the rates agree, the factors within those of the
  // geometry.
  EXPECT_NEAR(std::log(growth) / std::log(1e5), 1, 0.25);
}

// Half powers of two of the first guess; Newton leaves little that does not converge, so the guess
// may stand.
TEST(Sensitivity, FindStepHalvesUntilItWorks) {
  TemporaryFolder folder;
  const Case c = swinging(folder, 1.0);
  scene::StateScale scale(c.assembly.model->description());
  const double h = scene::find_step(c.assembly, 64, 100, scale);
  EXPECT_LE(h, 64);
  EXPECT_EQ(std::log2(64 / h), std::round(std::log2(64 / h)));
}

TEST(Reference, In113BitsWhereItIsAffordableElseTwoRunsThatAgree) {
  TemporaryFolder folder;
  const Case c = swinging(folder, 1.0);
  const auto& d = c.assembly.model->description();
  scene::StateScale scale(d);
  scene::find_step(c.assembly, 0.02, 100, scale);
  const scene::ReferenceOptions o{.time = 2, .step = 0.02, .cpu_limit = 60};
  const auto exact = scene::reference_state(c.assembly, scale, o);
  auto cheap_options = o;
  cheap_options.cpu_limit = 0;
  const auto cheap = scene::reference_state(c.assembly, scale, cheap_options);
  ASSERT_TRUE(exact && cheap);
  EXPECT_TRUE(says(exact->made_by, "113 bits"));
  EXPECT_TRUE(says(cheap->made_by, "gauss16"));
  const auto quad = integrators::gauss_reference(
      *c.assembly.model, {c.assembly.initial.x.begin(), c.assembly.initial.x.end()},
      phs::Quad(2) / 500, 500);
  const std::vector<long double> known(quad.begin(), quad.end());
  const double off = scene::distance(scale, exact->x, known);
  const double cheap_off = scene::distance(scale, cheap->x, known);
  std::printf("  113 bits: off by %.1e, says %.1e; double: off by %.1e, says %.1e\n", off,
              exact->error, cheap_off, cheap->error);
  EXPECT_LE(off, std::max(exact->error, 1e-18));
  EXPECT_LE(cheap_off, 3 * cheap->error + 1e-15);
  EXPECT_LT(cheap->error, 1e-12);
  // Negative control: a coarse run is not the reference.
  const auto coarse = integrators::gauss_reference(
      *c.assembly.model, {c.assembly.initial.x.begin(), c.assembly.initial.x.end()},
      phs::Quad(2) / 40, 40, 2);
  EXPECT_GT(
      scene::distance(scale, exact->x, std::vector<long double>(coarse.begin(), coarse.end())),
      1e-9);
}

}  // namespace
}  // namespace porthos::test::lyapunov_test
