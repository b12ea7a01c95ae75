// End times that are free: against closed forms, and against plans of durations beside them.
#include "planning/end_time.h"

#include <gtest/gtest.h>

#include "tests/planning/problems.h"
#include "tests/support/bounds.h"

namespace porthos::planning::end_time_test {
namespace {

using test::breaks;
using test::keeps;

constexpr double theta = 1.3;

/// A unit mass from rest to rest over theta within two seconds at the cost ∫u².
Problem mass(int intervals) { return test::unit_mass(theta, 2, intervals); }

/// A pendulum with friction that is lifted, at a cost of torque, rate and energy drawn.
Problem pendulum(double duration) {
  Problem p;
  p.dynamics = function_dynamics(2, 1, [](double, auto x, auto u, auto dx) {
    using std::sin;
    dx[0] = 1.7 * x[1];
    dx[1] = u[0] - 0.2 * x[1] - 2.5 * sin(x[0]);
  });
  p.duration = duration;
  p.intervals = 12;
  p.stages = 3;
  p.start = {0.1, 0};
  p.cost.input = {1};
  p.cost.rate = {0.3, 0};
  p.cost.drawn = {{0, 0, 0.4, 0.1}};
  p.goals = {{{{0, 1.0}}, -1, 1.1}, {{}, 0, 0.0}};
  return p;
}

/// J = 12 θ²/(T³ (1 - 1/N²)): the slope at a stated duration.
TEST(EndTime, SlopeOfTheClosedForm) {
  const Problem p = mass(10);
  const Plan plan = solve(p, straight(p, {0, 0}));
  const double exact = -36 * theta * theta / (16 * (1 - 1. / 100));
  keeps("dJ/dT against -36 θ²/(T⁴ (1 - 1/N²)), relative",
        std::fabs(plan.duration_slope / exact - 1), 1e-12);
}

/// The slope of a nonlinear problem with every kind of cost, against differences of the cost.
TEST(EndTime, SlopeAgainstDifferences) {
  for (const Inputs inputs : {Inputs::held, Inputs::at_stages}) {
    const auto at = [&](double duration) {
      Problem p = pendulum(duration);
      p.inputs = inputs;
      return solve(p, straight(p, {1.1, 0}), {.tolerance = 1e-12});
    };
    const double e = 1e-3, middle = at(2).duration_slope;
    const double difference =
        (8 * (at(2 + e).cost - at(2 - e).cost) - at(2 + 2 * e).cost + at(2 - 2 * e).cost) /
        (12 * e);
    keeps("dJ/dT against differences, relative", std::fabs(difference / middle - 1), 1e-9);
    breaks("control: the mean cost alone", std::fabs(at(2).cost / 2 / middle - 1), 1e-1);
  }
}

/// θ in the time at which w T + 12 θ²/(T³ (1 - 1/N²)) is least, from a start below and above it.
TEST(EndTime, RestToRest) {
  const double w = 3.7, N = 10;
  const double exact = std::pow(36 * theta * theta / (w * (1 - 1 / (N * N))), 0.25);
  for (const double start : {0.2, 2.0, 40.0}) {
    Problem p = mass(int(N));
    p.duration = start;
    const Plan plan = solve_end_time(p, straight(p, {theta, 0}), {.weight = w});
    ASSERT_EQ(plan.status, Plan::Status::optimal);
    std::printf("  from %g s: %.12g s, %d iterations\n", start, p.duration, plan.iterations);
    keeps("T against (36 θ²/w)^¼, relative", std::fabs(p.duration / exact - 1), 1e-9);
    keeps("the cost, relative", std::fabs(plan.cost / (w * exact * 4 / 3) - 1), 1e-12);
  }
}

/// With a limit of the torque and hardly any cost but the time: 2 √(θ/u) and a torque that switches
/// once. The cost ε ∫u² makes it longer: with s² = 3 (1 - T_min²/T²), the share of the time in
/// which the torque is inside its limits, w = -ε u² d/dT [T (1 - 2 s/3)].
TEST(EndTime, LeastTimeOfLimitedTorque) {
  const double most = 0.8, shortest = 2 * std::sqrt(theta / most);
  double before = HUGE_VAL;
  for (const double weight : {1e-1, 1e-2, 1e-3}) {
    Problem p = mass(80);
    p.duration = 5;
    p.inputs = Inputs::at_stages;
    p.cost.input = {weight};
    p.limits.input_lower = {-most};
    p.limits.input_upper = {most};
    const Plan plan = solve_end_time(p, straight(p, {theta, 0}), {.weight = 1});
    ASSERT_EQ(plan.status, Plan::Status::optimal);
    const auto slope = [&](double T) {
      const double s = std::sqrt(3 * (1 - shortest * shortest / (T * T))),
                   ds = 3 * shortest * shortest / (T * T * T * s);
      return 1 + weight * most * most * (1 - 2 * s / 3 - 2 * T * ds / 3);
    };
    double low = shortest, high = 1.1 * shortest;
    while (high - low > 1e-14) (slope(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
    std::printf("  weight %g: %.8f s, continuous %.8f s, without cost %.8f s; %d iterations\n",
                weight, p.duration, low, shortest, plan.iterations);
    keeps("T against the continuous one, relative", std::fabs(p.duration / low - 1), 1e-3);
    EXPECT_LT(p.duration, before);
    EXPECT_GT(p.duration, shortest * (1 - 1e-4));
    before = p.duration;
  }
}

/// A plan of a stated duration beside the free one costs more.
TEST(EndTime, ItsNeighboursCostMore) {
  const double w = 0.9;
  Problem p = pendulum(1.5);
  const Plan best = solve_end_time(p, straight(p, {1.1, 0}), {.weight = w});
  ASSERT_EQ(best.status, Plan::Status::optimal);
  keeps("slope of the cost by the duration, of the weight", std::fabs(best.duration_slope / w + 1),
        1e-9);
  for (const double by : {0.98, 1.02}) {
    const Problem beside = pendulum(p.duration * by);
    const Plan plan = solve(beside, best.motion);
    EXPECT_GT(plan.cost + w * beside.duration, best.cost * (1 + 1e-6)) << by;
  }
}

TEST(EndTime, StopsAtItsLimits) {
  for (const auto& [shortest, longest, expected] :
       {std::tuple{2.5, no_limit, 2.5}, {0.0, 1.2, 1.2}}) {
    Problem p = mass(10);
    p.duration = expected == 2.5 ? 6 : 0.5;
    const Plan plan = solve_end_time(p, straight(p, {theta, 0}),
                                     {.weight = 3.7, .shortest = shortest, .longest = longest});
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    EXPECT_EQ(p.duration, expected);
  }
}

TEST(EndTime, WhatIsRefused) {
  Problem p = mass(10);
  const auto why = [&](EndTime free) {
    return test::refusal([&] { solve_end_time(p, straight(p, {theta, 0}), free); });
  };
  EXPECT_NE(why({.weight = 0}).find("weight of the duration is 0"), std::string::npos);
  EXPECT_NE(why({.weight = 1, .shortest = 3}).find("outside of its limits 3 and inf"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::planning::end_time_test
