// ETS-VII turns its base by 10 degrees with its arm alone; the acrobot swings up.
#include <gtest/gtest.h>

#include <chrono>

#include "integrators/core/integrator.h"
#include "phs/network/network.h"
#include "tests/planning/problems.h"
#include "tests/support/robots.h"

namespace porthos::planning::swing_and_turn_test {
namespace {

using Vec = std::vector<double>;
using Clock = std::chrono::steady_clock;

std::string port(int joint) { return "joint_" + std::to_string(joint) + ".torque"; }

/// From rest to rest within 100 s, joint torques held over each second, least ∫ rates² of the
/// joints. The state: position 0-2, attitude 3-6, joints 7-12, then the momenta.
Problem turn_about_y(const test::Robot& robot, double angle) {
  std::vector<std::string> ports;
  for (int i = 1; i <= 6; ++i) ports.push_back(port(i));
  Problem p;
  p.dynamics = dynamics_of(robot.model, ports);
  p.stages = 2;
  p.duration = 100;
  p.intervals = 100;
  p.start = robot.start.x;
  p.cost.input = Vec(6, 1e-6);
  p.cost.rate = Vec(26, 0.0);
  for (size_t k = 7; k < 13; ++k) p.cost.rate[k] = 1;
  p.goals = attitude_goals(3, {std::cos(angle / 2), 0, std::sin(angle / 2), 0});
  for (int k = 20; k < 26; ++k) p.goals.push_back({{{k, 1.0}}, -1, 0});
  return p;
}

TEST(EtsVii, TurnsItsBase) {
  const auto robot = test::ets_vii(0);
  const double angle = 10 * M_PI / 180;
  const Problem p = turn_about_y(robot, angle);
  const auto begin = Clock::now();
  const Plan plan = solve(p, straight(p, p.start), {.approach = true});
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("  %s, J = %.9f, %d + %d iterations, residual %.1e (bound 1e-9), %.2f s\n",
              to_string(plan.status), plan.cost, plan.approach, plan.iterations, plan.residual,
              seconds);
  ASSERT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_LT(plan.residual, 1e-9);

  // the torques through the house's integrator
  phs::Network n("ets_vii");
  n.add("plant", robot.model).main("plant");
  for (int i = 0; i < 6; ++i)
    n.source("torque " + std::to_string(i), "plant." + port(i + 1),
             input_signal(p, plan.motion, i));
  const auto model = n.build();
  phs::State state(model->description(), p.start);
  const auto method = integrators::make_integrator("gauss4", *model, 1);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(method->step(state), integrators::Outcome::ok);
  const double turned = 2 * std::atan2(state.x[5], state.x[3]);
  double momentum = 0, other = std::max(std::fabs(state.x[4]), std::fabs(state.x[6]));
  for (size_t k = 13; k < 26; ++k) momentum = std::max(momentum, std::fabs(state.x[k]));
  std::printf("  replayed: turned off by %.1e rad (bound 1e-12), other axes %.1e, momenta %.1e\n",
              turned - angle, other, momentum);
  EXPECT_NEAR(turned, angle, 1e-12);
  EXPECT_LT(other, 1e-12);
  EXPECT_LT(momentum, 1e-11);
}

/// Without momentum a base that is turned back by its arm has the attitude of its joints' path, so
/// a loop of the joints is needed where they must return: here by a degree.
TEST(EtsVii, TurnsItsBaseWithJointsThatReturn) {
  const auto robot = test::ets_vii(0);
  Problem p = turn_about_y(robot, 1 * M_PI / 180);
  for (int k = 7; k < 13; ++k) p.goals.push_back({{{k, 1.0}}, -1, p.start[size_t(k)]});
  Trajectory guess = straight(p, p.start);
  for (int k = 0; k < 100; ++k) {  // joints 2 and 3 go round
    const double s = 2 * M_PI * (k + 0.5) / 100;
    guess.u[size_t(6 * k + 1)] = 0.2 * std::cos(s);
    guess.u[size_t(6 * k + 2)] = -0.1 * std::sin(s);
  }
  follow_inputs(p, guess);
  const Plan plan = solve(p, guess, {.approach = false});
  std::printf("  %s, J = %.9f, %d + %d iterations, residual %.1e\n", to_string(plan.status),
              plan.cost, plan.approach, plan.iterations, plan.residual);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  for (size_t k = 7; k < 13; ++k)
    EXPECT_NEAR(plan.motion.x[plan.motion.x.size() - 26 + k], p.start[k], 1e-9);
}

/// The cart's force draws at least what the pendulum gains, 2 m g l, and less than in the plan of
/// least ∫ force², which is where the solver begins.
TEST(CartPole, DrawsLittleEnergy) {
  Problem p = test::cart_pole_swing_up(3, 40);
  const Plan least_force = solve(p, straight(p, {1, M_PI, 0, 0}));
  ASSERT_EQ(least_force.status, Plan::Status::optimal);
  p.cost.input = {1e-3};
  p.cost.drawn = {{0, 0, 1, 0.5}};
  const Plan plan = solve(p, least_force.motion);
  const double gained = 2 * 0.3 * 9.81 * 0.5, of_force = plan.history.front().cost;
  std::printf("  %s: %.4f J instead of %.4f J, least possible %.4f J; %d iterations\n",
              to_string(plan.status), plan.cost, of_force, gained, plan.iterations);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_GT(plan.cost, gained);
  EXPECT_LT(plan.cost, 0.8 * of_force);
}

/// An arm that moves from posture to posture with weight on the base's rate turns it less.
TEST(EtsVii, DisturbsItsBaseLittle) {
  const auto robot = test::ets_vii(0);
  Problem p = turn_about_y(robot, 0);
  p.goals.clear();
  for (int k = 0; k < 6; ++k) {
    p.goals.push_back({{{7 + k, 1.0}}, -1, p.start[size_t(7 + k)] + (k % 2 ? -0.5 : 0.6)});
    p.goals.push_back({{{20 + k, 1.0}}, -1, 0});
  }
  Vec end = p.start;
  for (size_t k = 0; k < 6; ++k) end[7 + k] += k % 2 ? -0.5 : 0.6;
  // ∫|ω|² from the attitudes a second apart
  const auto restlessness = [&](const Plan& plan) {
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    double sum = 0;
    for (size_t k = 26; k < plan.motion.x.size(); k += 26)
      for (size_t i = 3; i < 7; ++i)
        sum += 4 * std::pow(plan.motion.x[k + i] - plan.motion.x[k - 26 + i], 2);
    return sum;
  };
  const Plan straightest = solve(p, straight(p, end));
  for (size_t k = 3; k < 7; ++k) p.cost.rate[k] = 4e5;  // |ω|² = 4 |ξ'|²
  const Plan calm = solve(p, straightest.motion);
  std::printf(
      "  integral of |rate of the base|^2: %.3e instead of %.3e rad^2/s; %d and %d iterations\n",
      restlessness(calm), restlessness(straightest), straightest.iterations, calm.iterations);
  EXPECT_LT(restlessness(calm), 0.9 * restlessness(straightest));
}

/// One of the acrobot's many swing-ups, from a table of four digits (tests/data/README.md).
TEST(Acrobot, SwingsUp) {
  const Problem p = test::acrobot_swing_up();
  const Trajectory guess = test::acrobot_guess(p);
  const auto begin = Clock::now();
  const Plan first = solve(p, guess);
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  Problem fine = p;
  fine.stages = 8;
  fine.intervals = 160;
  const Plan plan = solve(fine, resample(p, first.motion, fine));
  std::printf("  J off by %.1e (bound 1e-8), %d iterations in %.3f s, then %d; residual %.1e\n",
              plan.cost - 22.44030018, first.iterations, seconds, plan.iterations, plan.residual);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_NEAR(plan.cost, 22.44030018, 1e-8);
}

/// Straight lines with sines of torque, of which the motion knows nothing: where the first way of
/// the iteration stops, as it does from each of these, the careful one finds optima of some.
TEST(Acrobot, SwingsUpFromAfar) {
  Problem p = test::acrobot_swing_up();
  p.stages = 2;
  int found = 0;
  for (const auto& [size, periods] : {std::pair(0.0, 1), {2.0, 2}, {2.0, 4}, {5.0, 2}, {5.0, 4}}) {
    Trajectory guess = straight(p, {M_PI, 0, 0, 0});
    for (size_t i = 0; i < guess.u.size(); ++i)
      guess.u[i] = size * std::sin(2 * M_PI * periods * double(i) / double(guess.u.size()));
    const Plan plan = solve(p, guess);
    std::printf("  %g N m, %d periods: %s after %d iterations, J = %.6f\n", size, periods,
                to_string(plan.status), plan.iterations, plan.cost);
    found += plan.status == Plan::Status::optimal;
  }
  EXPECT_GE(found, 2) << "of five";
}

}  // namespace
}  // namespace porthos::planning::swing_and_turn_test
