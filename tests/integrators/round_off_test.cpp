// The round-off limit: the numbers the project is judged by, each beside its bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>

#include "integrators/methods/gauss.h"
#include "scene/run/statistics.h"
#include "tests/support/bounds.h"
#include "tests/support/gauss.h"
#include "tests/support/robots.h"

namespace porthos::integrators::round_off_test {
namespace {

struct Worst {
  double energy = 0, linear = 0, angular = 0, norm = 0, cpu = 0;
};

double cpu_seconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// Runs for `duration` s, measuring once a second.
Worst long_run(const test::Robot& robot, Integrator& method, double duration) {
  test::Gauge gauge(*robot.model);
  const auto H0 = gauge.energy(robot.start);
  const auto I0 = gauge.invariants(robot.start);
  phs::State s = robot.start;
  Worst w;
  const auto every = std::max<std::int64_t>(1, std::llround(1 / method.step_size()));
  const auto steps = std::llround(duration / method.step_size());
  double mark = cpu_seconds();
  for (std::int64_t i = 1; i <= steps; ++i) {
    const Outcome o = method.step(s);
    EXPECT_EQ(o, Outcome::ok);
    if (o != Outcome::ok) return w;
    if (i % every) continue;
    w.cpu += cpu_seconds() - mark;
    w.energy = std::max(w.energy, std::fabs(double((gauge.energy(s) - H0) / H0)));
    if (I0[0] != 0) w.linear = std::max(w.linear, gauge.error("linear_momentum", s, I0));
    w.angular = std::max(w.angular, gauge.error("angular_momentum", s, I0));
    w.norm = std::max(w.norm, gauge.error("quaternion_norm.base.attitude", s, I0) / 2);
    mark = cpu_seconds();
  }
  return w;
}

TEST(RoundOff, EtsVii) {
  const auto robot = test::ets_vii();
  const auto w = long_run(robot, *make_integrator("gauss16", *robot.model, 0.5), 1e4);
  std::printf(
      "  energy %.1e (2e-13)  angular %.1e (1e-14)  linear %.1e (1e-14)  |xi| %.1e (1e-14)  cpu "
      "%.2f s\n",
      w.energy, w.angular, w.linear, w.norm, w.cpu);
  EXPECT_LE(w.energy, 2e-13);
  EXPECT_LE(w.angular, 1e-14);
  EXPECT_LE(w.linear, 1e-14);
  EXPECT_LE(w.norm, 1e-14);
}

TEST(RoundOff, Rk4FailsTheSameVerdict) {
  const auto robot = test::ets_vii();
  const auto w = long_run(robot, *make_integrator("rk4", *robot.model, 0.5), 1e4);
  std::printf("  rk4: energy %.1e  angular %.1e  |xi| %.1e, each must miss gauss16's bound\n",
              w.energy, w.angular, w.norm);
  EXPECT_GT(w.energy, 2e-13);
  EXPECT_GT(w.angular, 1e-14);
  EXPECT_GT(w.norm, 1e-14);
}

// The growth law of the energy error from 1e3 to 1e5 s: the square root of time, not time.
TEST(RoundOff, EtsViiGrowthExponent) {
  const auto robot = test::ets_vii();
  const auto exponent = [&](const char* name, double from, double to, bool& drifts) {
    test::Gauge gauge(*robot.model);
    const auto method = make_integrator(name, *robot.model, 0.5);
    phs::State s = robot.start;
    scene::ErrorStatistics errors;
    const auto H0 = gauge.energy(s);
    while (double(s.step) * 0.5 < to) {
      for (int i = 0; i < 4; ++i)
        if (method->step(s) != Outcome::ok) return HUGE_VAL;
      if (double(s.step) * 0.5 >= from) errors.add(double((gauge.energy(s) - H0) / H0));
    }
    drifts = errors.drift_is_significant();
    return errors.growth_exponent();
  };
  bool drifts = true, control = false;
  const double ours = exponent("gauss16", 1e3, 1e5, drifts), rk4 = exponent("rk4", 0, 1e4, control);
  std::printf("  growth exponent: gauss16 %.2f (0.65), rk4 %.2f (must drift)\n", ours, rk4);
  EXPECT_LE(ours, 0.65);
  EXPECT_FALSE(drifts);
  EXPECT_TRUE(control);
}

/// The motion is chaotic: it forgets its last bit in a second, and one start in ten whirls so fast
/// somewhere that the step is too long (24 starts: median 3.6e-15, worst 9e-13). So the middle of
/// five starts is judged, which differ by 1e-9.
TEST(RoundOff, FastChaoticCase) {
  auto robot = test::fast_case();
  test::Gauge gauge(*robot.model);
  EXPECT_NEAR(double(gauge.energy(robot.start)), 5.18137534609971, 1e-13);
  std::vector<double> energy;
  for (int k = 0; k < 5; ++k) {
    const auto w = long_run(robot, *make_integrator("gauss16", *robot.model, 0.02), 1000);
    std::printf("  energy %.1e   angular %.1e (2e-15)   cpu %.2f s\n", w.energy, w.angular, w.cpu);
    EXPECT_LE(w.angular, 2e-15);
    energy.push_back(w.energy);
    robot.start.x[7] += 1e-9;
  }
  std::sort(energy.begin(), energy.end());
  test::keeps("energy, median of five starts", energy[2], 5e-15);
}

TEST(RoundOff, FastCaseTrajectoryAgainstCvodeAnd113Bits) {
  const auto robot = test::fast_case();
  phs::State ours = robot.start, rival = robot.start;
  const auto method = make_integrator("gauss16", *robot.model, 0.02);
  for (int i = 0; i < 50; ++i) ASSERT_EQ(method->step(ours), Outcome::ok);
  Options o;
  o.rtol = 1e-13;
  o.atol = 1e-13;
  ASSERT_EQ(make_integrator("cvode_adams", *robot.model, 1.0, o)->step(rival), Outcome::ok);
  const auto reference = gauss_reference(*robot.model, {robot.start.x.begin(), robot.start.x.end()},
                                         phs::Quad(1) / 64, 64, 12);
  const auto state = test::unwrapped(robot.model->description(), ours);
  const double to_reference = test::distance(state, reference);
  const double to_rival = test::distance({rival.x.begin(), rival.x.end()}, state);
  std::printf(
      "  t = 1 s: against 113 bits %.1e (1e-13)   against CVODE, rtol 1e-13: %.1e (1e-10)\n",
      to_reference, to_rival);
  EXPECT_LE(to_reference, 1e-13);
  EXPECT_LE(to_rival, 1e-10);
}

}  // namespace
}  // namespace porthos::integrators::round_off_test
