// Limits of inputs and states against a closed form, and what a problem refuses.
#include <gtest/gtest.h>

#include "tests/planning/problems.h"

namespace porthos::planning::limits_test {
namespace {

using Vec = std::vector<double>;

/// A unit mass from rest to rest by `way` within a second.
Problem mass(double way, int intervals = 20) { return test::unit_mass(way, 1, intervals); }

/// With |u| <= U the optimum is u_k = clamp(b (N - 1 - 2k), U), with b so that the way is right.
TEST(Limits, OfInputs) {
  const int N = 20;
  const double U = 4.4, way = 1, h = 1.0 / N;
  const auto way_of = [&](double b, Vec* u = nullptr) {
    double x = 0, v = 0;
    for (int k = 0; k < N; ++k) {
      const double a = std::min(U, std::max(-U, b * (N - 1 - 2 * k)));
      x += h * v + 0.5 * h * h * a;
      v += h * a;
      if (u) u->push_back(a);
    }
    return x;
  };
  double low = 0, high = 100;
  for (int i = 0; i < 200; ++i) (way_of((low + high) / 2) < way ? low : high) = (low + high) / 2;
  Vec exact;
  way_of(low, &exact);
  Problem p = mass(way, N);
  p.limits = {{-U}, {U}, {}, {}};
  const Plan plan = solve(p, straight(p, {way, 0}));
  double off = 0, beyond = -HUGE_VAL, free = 0;
  for (size_t k = 0; k < exact.size(); ++k) {
    off = std::max(off, std::fabs(plan.motion.u[k] - exact[k]));
    beyond = std::max(beyond, std::fabs(plan.motion.u[k]) - U);
  }
  p.limits = {};
  const Plan without = solve(p, straight(p, {way, 0}));
  for (const double u : without.motion.u) free = std::max(free, std::fabs(u));
  std::printf(
      "  u off by %.1e (bound 1e-6: the last barrier is 1e-10), beyond the limit by %.1e (0), %d "
      "at it, %d iterations; "
      "without a limit up to %.2f\n",
      off, beyond, plan.active_limits, plan.iterations, free);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_LT(off, 1e-6);
  EXPECT_LE(beyond, 0);
  EXPECT_GE(plan.active_limits, 8);
  EXPECT_GT(free, U + 1);
}

/// A speed limit of 1.2 on a way of 1 in a second: the mass cruises at it. Continuous optimum: the
/// speed rises along a parabola for a time a = 3 (1 - way/V)/2 and cruises; J = 8/3 V²/a.
TEST(Limits, OfStates) {
  const double V = 1.2, a = 1.5 * (1 - 1 / V), continuous = 8. / 3 * V * V / a;
  double before = HUGE_VAL;
  for (const int N : {40, 160}) {
    Problem p = mass(1, N);
    p.limits.state_lower = {-no_limit, -V};
    p.limits.state_upper = {no_limit, V};
    const Plan plan = solve(p, straight(p, {1, 0}));
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    double beyond = -HUGE_VAL;
    for (size_t k = 1; k < plan.motion.x.size(); k += 2)
      beyond = std::max(beyond, plan.motion.x[k] - V);
    const double off = std::fabs(plan.cost / continuous - 1);
    std::printf(
        "  N = %d: speed beyond the limit by %.1e (bound 0), J off the continuous one by "
        "%.1e, %d iterations\n",
        N, beyond, off, plan.iterations);
    EXPECT_LE(beyond, 0);
    EXPECT_GT(plan.active_limits, N / 4);
    EXPECT_LT(off, before / 6);  // order 2: sixteenfold; the ends of the cruise fall anywhere
    before = off;
  }
  EXPECT_LT(before, 2e-3);
}

/// The same limit of x' at the stages, by a barrier. Control: without it the mass goes at 1.5.
TEST(Limits, OfRates) {
  const double V = 1.2, a = 1.5 * (1 - 1 / V), continuous = 8. / 3 * V * V / a;
  double before = HUGE_VAL;
  for (const int N : {40, 160}) {
    Problem p = mass(1, N);
    const Plan without = solve(p, straight(p, {1, 0}));
    p.limits.rate = {V, no_limit};
    const Plan plan = solve(p, straight(p, {1, 0}));
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    double most = 0, free = 0;
    for (size_t k = 1; k < plan.motion.x.size(); k += 2) {
      most = std::max(most, std::fabs(plan.motion.x[k]));
      free = std::max(free, std::fabs(without.motion.x[k]));
    }
    const double off = std::fabs(plan.cost / continuous - 1);
    std::printf(
        "  N = %d: speed up to %.9f (limit %g), %.3f without; J off the continuous one by "
        "%.1e, %d iterations, residual %.1e\n",
        N, most, V, free, off, plan.iterations, plan.residual);
    EXPECT_LT(most, V * (1 + 1e-3 * 40 / N));  // at the ends, between which the stages are
    EXPECT_GT(free, 1.49);
    EXPECT_LT(off, before / 6);
    before = off;
  }
  EXPECT_LT(before, 2e-3);
}

/// The largest speed of the cart.
double fastest(const Problem& p, const Plan& plan) {
  Problem fine = p;
  fine.intervals = 20 * p.intervals;
  const Vec x = resample(p, plan.motion, fine).x;
  double most = 0;
  for (size_t k = 4; k < x.size(); k += 4)
    most = std::max(most, std::fabs(x[k] - x[k - 4]) / fine.step());
  return most;
}

/// The swing-up whose cart may go at a part of the speed of its free optimum, from a line and from
/// that optimum, which is too fast: the same optimum.
TEST(Limits, OfTheRateOfACart) {
  Problem p = test::cart_pole_swing_up(2, 40);
  const Plan free = solve(p, straight(p, {1, M_PI, 0, 0}));
  const double speed = fastest(p, free);
  for (const double part : {0.95, 0.9, 0.7}) {
    p.limits.rate = {part * speed, no_limit, no_limit, no_limit};
    const Plan plan = solve(p, straight(p, {1, M_PI, 0, 0})), again = solve(p, free.motion);
    std::printf(
        "  limit %.4f m/s: fastest %.4f; cost %.6f, from the free one off by %.1e; free %.6f; "
        "%d active; %d and %d iterations\n",
        p.limits.rate[0], fastest(p, plan), plan.cost, std::fabs(again.cost / plan.cost - 1),
        free.cost, plan.active_limits, plan.iterations, again.iterations);
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    EXPECT_EQ(again.status, Plan::Status::optimal);
    EXPECT_LT(fastest(p, plan), 1.02 * p.limits.rate[0]);  // between the stages, of 50 ms
    EXPECT_GT(plan.cost, free.cost);
    EXPECT_GT(plan.active_limits, 0);
    EXPECT_NEAR(again.cost, plan.cost, 1e-8 * plan.cost);
  }
}

/// At 0.795 and 0.8 of that speed the way leads by a stationary point that is no minimum, at J =
/// 67.3 and 66.75, where steps without the second derivatives of f creep for hundreds of
/// iterations. Beyond it is an optimum, at 0.8 in the valley of another motion. IPOPT finds both
/// (Ipopt.LimitsOfRates).
TEST(Limits, LeavesAStationaryPointThatIsNoMinimum) {
  Problem p = test::cart_pole_swing_up(2, 40);
  const Trajectory line = straight(p, {1, M_PI, 0, 0});
  const Plan free = solve(p, line);
  const double speed = fastest(p, free);
  for (const auto& [part, cost] : {std::pair(0.795, 67.2815018), std::pair(0.8, 58.6549190)}) {
    p.limits.rate = {part * speed, no_limit, no_limit, no_limit};
    for (const Trajectory& guess : {line, free.motion}) {
      const Plan plan = solve(p, guess);
      std::printf("  %.3f of the free speed: %s, J = %.7f, %d iterations (bound 199)\n", part,
                  to_string(plan.status), plan.cost, plan.iterations);
      EXPECT_EQ(plan.status, Plan::Status::optimal);
      EXPECT_NEAR(plan.cost, cost, 2e-7);
      EXPECT_LT(plan.iterations, 200);
      EXPECT_LT(fastest(p, plan), 1.02 * p.limits.rate[0]);
    }
  }
}

/// A mass in the plane goes round a disc of radius 1/2 m, from (-1, 0) to (1, 0) m in 2 s, at rest
/// at both ends, at least ∫u². The optimum touches the disc at one instant, above or below: with
/// half the time h = 1 s, J = 12·2²/2³ + 2·12 (1/2)²/h³ = 12. Control: a straight line costs 6.
TEST(Limits, OfADistance) {
  double before = HUGE_VAL;
  for (const int N : {10, 20, 40}) {
    const Problem p = test::round_a_disc(N);
    Problem free = p;
    free.limits = {};
    EXPECT_NEAR(solve(free, straight(p, {1, 0, 0, 0})).cost, 6, 0.1);
    for (const double side : {1, -1}) {
      const Plan plan = solve(p, test::beside_the_disc(p, side));
      double least = HUGE_VAL;
      for (size_t k = 0; k < plan.motion.x.size(); k += 4)
        least = std::min(least, std::hypot(plan.motion.x[k], plan.motion.x[k + 1]));
      const double off = std::fabs(plan.cost / 12 - 1);
      std::printf(
          "  N = %d: J off the continuous one by %.1e, distance down to %.6f m, %d iterations, "
          "residual %.1e\n",
          N, off, least, plan.iterations, plan.residual);
      EXPECT_EQ(plan.status, Plan::Status::optimal);
      EXPECT_GT(side * plan.motion.x[size_t(2 * N + 1)], 0.49) << "on the side of the guess";
      EXPECT_GT(least, 0.5 - 0.7 / (N * N));  // between the stages: order 2
      EXPECT_LT(off, side > 0 ? before / 3 : before * 1.01);
      before = off;
    }
  }
  EXPECT_LT(before, 2e-3);
}

/// The swing-up with a force limit that its free optimum exceeds, and a short track.
TEST(Limits, OfACartPole) {
  Problem p = test::cart_pole_swing_up(2, 40);
  p.limits.input_lower = {-12};
  p.limits.input_upper = {12};
  p.limits.state_lower = {-0.3, -no_limit, -no_limit, -no_limit};
  p.limits.state_upper = {1.05, no_limit, no_limit, no_limit};
  const Plan plan = solve(p, straight(p, {1, M_PI, 0, 0}));
  double most = 0, left = HUGE_VAL, right = -HUGE_VAL;
  for (const double u : plan.motion.u) most = std::max(most, std::fabs(u));
  for (size_t k = 0; k < plan.motion.x.size(); k += 4) {
    left = std::min(left, plan.motion.x[k]);
    right = std::max(right, plan.motion.x[k]);
  }
  std::printf("  %s after %d iterations, J = %.6f, |u| <= %.9f, cart in [%.9f, %.9f], %d active\n",
              to_string(plan.status), plan.iterations, plan.cost, most, left, right,
              plan.active_limits);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_LE(most, 12);
  EXPECT_GE(left, -0.3);
  EXPECT_LE(right, 1.05);
  EXPECT_GT(plan.cost, 57.94);
  EXPECT_GT(plan.active_limits, 0);
}

void expect_refused(Problem p, const std::string& words, const PlannerOptions& o = {}) {
  const Trajectory guess{Vec(size_t(p.intervals + 1) * 2), Vec(size_t(p.intervals))};
  try {
    (void)solve(p, guess, o);
    ADD_FAILURE() << "not refused: " << words;
  } catch (const InvalidArgument& e) {
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
  }
}

TEST(Limits, Refusals) {
  Problem p = mass(1);
  p.limits = {{1}, {1}, {}, {}};
  expect_refused(p, "limits of input 0: lower is 1, upper 1, expected lower < upper");
  p = mass(1);
  p.limits.state_lower = {0};
  expect_refused(p, "lower limits of states has 1 entries, expected 2");
  p = mass(1);
  p.stages = 9;
  expect_refused(p, "stages is 9, expected 1 to 8");
  p = mass(1);
  p.duration = 0;
  expect_refused(p, "duration is 0 s, expected more than 0");
  p = mass(1);
  p.goals[0].rate = 1;
  expect_refused(p, "a goal has several of a row, a rate and a number or none, expected one");
  p = mass(1);
  p.goals[0].row[0].first = 2;
  expect_refused(p, "a goal names state number 2, expected 0 to 1");
  p = mass(1);
  p.cost.input = {-1};
  expect_refused(p, "a weight is -1, expected 0 or more");
  p = mass(1);
  p.cost.drawn = {{0, 0, 1, 0}};
  expect_refused(p, "drawn power has weight 1 and smoothing 0 W");
  p = mass(1);
  p.limits = {{-1}, {1}, {}, {}};
  expect_refused(p, "any_extremal takes no limits", {.any_extremal = true});
  EXPECT_THROW(dynamics_of(test::cart_pole(), {"slide.torque"}), InvalidArgument);
}

/// A goal that no input reaches is told as such, and no plan is claimed.
TEST(Limits, UnreachableGoals) {
  Problem p = mass(1);
  p.dynamics = function_dynamics(2, 1, [](double, auto x, auto u, auto dx) {
    dx[0] = x[1] + 0.0 * u[0];
    dx[1] = u[0] * 0.0;
  });
  const Plan plan = solve(p, straight(p, {1, 0}));
  EXPECT_EQ(plan.status, Plan::Status::unreachable) << to_string(plan.status);
}

}  // namespace
}  // namespace porthos::planning::limits_test
