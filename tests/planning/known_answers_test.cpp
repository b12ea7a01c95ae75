// Problems whose optimum is known in closed form or to many digits, and what fails where it must.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/planning/problems.h"

namespace porthos::planning::known_answers_test {
namespace {

using Vec = std::vector<double>;
using Clock = std::chrono::steady_clock;

/// The least time of three solutions [ms].
double milliseconds(const Problem& p, const Trajectory& guess) {
  double least = HUGE_VAL;
  for (int i = 0; i < 3; ++i) {
    const auto t = Clock::now();
    (void)solve(p, guess);
    least = std::min(least, std::chrono::duration<double, std::milli>(Clock::now() - t).count());
  }
  return least;
}

/// ∫u² of held torques from rest to rest, J = 12 I²θ²/(T³ (1 - 1/N²)). Control: continuous torques
/// cost less by the factor 1 - 1/N².
TEST(KnownAnswers, RestToRest) {
  Problem p = test::unit_mass(1.3, 2, 10);
  for (int s : {1, 2, 8}) {
    p.stages = s;
    const Plan plan = solve(p, straight(p, {0, 0}));
    const double exact = 12 * 1.3 * 1.3 / (8 * (1 - 1. / 100));
    std::printf("  gauss%d: J off by %.1e (bound 1e-14 relative), %d iterations\n", 2 * s,
                plan.cost / exact - 1, plan.iterations);
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    EXPECT_NEAR(plan.cost / exact, 1, 1e-14);
    EXPECT_NEAR(plan.cost, 2.56060606060606, 1e-13);
    EXPECT_LE(plan.iterations, 3);
  }
  p.stages = 2;
  p.inputs = Inputs::at_stages;
  const Plan continuous = solve(p, straight(p, {0, 0}));
  EXPECT_NEAR(continuous.cost / (12 * 1.3 * 1.3 / 8), 1, 1e-14);  // u is linear in time
}

/// The loop of least ½∫|u|² that lifts z' = ½(x u2 - y u1) to a is a circle: 2π a/T.
TEST(KnownAnswers, Heisenberg) {
  Problem p;
  p.dynamics = function_dynamics(3, 2, [](double, auto x, auto u, auto dx) {
    dx[0] = u[0];
    dx[1] = u[1];
    dx[2] = 0.5 * (x[0] * u[1] - x[1] * u[0]);
  });
  const double a = 0.7, T = 1.5;
  p.duration = T;
  p.stages = 8;
  p.intervals = 10;
  p.inputs = Inputs::at_stages;
  p.start = {0, 0, 0};
  p.cost.input = {0.5, 0.5};
  p.goals = test::ends_at({0, 0, a});
  Trajectory guess = straight(p, {0, 0, a});
  for (size_t i = 0; i < guess.u.size(); ++i)  // a rough square
    guess.u[i] = (i % 2 ? 1 : -1) * (i < guess.u.size() / 2 ? 1.0 : -1.0);
  follow_inputs(p, guess);
  const Plan plan = solve(p, guess);
  const double exact = 2 * M_PI * a / T;
  std::printf("  J off by %.1e (bound 1e-12 relative), %d iterations, residual %.1e\n",
              plan.cost / exact - 1, plan.iterations, plan.residual);
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  EXPECT_NEAR(plan.cost / exact, 1, 1e-12);
  // ∂J/∂a = 2π/T: the costate of z, which is constant
  EXPECT_NEAR(plan.costates[2] / (-2 * M_PI / T), 1, 1e-10);
  EXPECT_NEAR(plan.goal_multipliers[2], plan.costates[2], 1e-10);
}

/// The planar space robot with two links (base 10 kg, 1 kg m², joint at 0.5 m; links 2 kg, 1 m, 1/6
/// kg m²) without momentum: joint rates are the inputs, θ of the base follows.
std::unique_ptr<Dynamics> planar_robot() {
  return function_dynamics(3, 2, [](double, auto x, auto u, auto dx) {
    using T = typename decltype(dx)::value_type;
    using phs::sincos;
    T s1, c1, s2, c2, s12, c12;
    sincos(T(x[0]), s1, c1);
    sincos(T(x[1]), s2, c2);
    sincos(T(x[0] + x[1]), s12, c12);
    const T C0 = 13. / 3 + (15. * c1 + 11. * c2 + 5. * c12) / 7.,
            C1 = 55. / 21 + 15. * c1 / 14. + 11. * c2 / 7. + 5. * c12 / 14.,
            C2 = 25. / 42 + 11. * c2 / 14. + 5. * c12 / 14.;
    dx[0] = u[0];
    dx[1] = u[1];
    dx[2] = -(C1 * u[0] + C2 * u[1]) / C0;
  });
}

/// Round the unit square of joint angles the base turns by the area integral of the curvature.
TEST(KnownAnswers, PlanarHolonomy) {
  Problem p;
  p.dynamics = planar_robot();
  p.stages = 8;
  p.duration = 4;
  p.intervals = 16;
  p.start = {0, 0, 0};
  p.cost.input = {1, 1};
  Trajectory loop = straight(p, p.start);
  for (int k = 0; k < 16; ++k) {
    loop.u[size_t(2 * k)] = k / 4 == 0 ? 1 : k / 4 == 2 ? -1 : 0;
    loop.u[size_t(2 * k + 1)] = k / 4 == 1 ? 1 : k / 4 == 3 ? -1 : 0;
  }
  follow_inputs(p, loop);
  const double turned = loop.x.back();
  std::printf("  the base turns off by %.1e rad (bound 1e-15)\n", turned + 0.024598506347241097);
  EXPECT_NEAR(turned, -0.024598506347241097, 1e-15);
}

/// A_j = c_j/c_0 there, from the dynamics: θ' = -A·φ'.
double connection(Dynamics& d, double phi1, double phi2, int j) {
  const double t = 0, x[] = {phi1, phi2, 0}, u[] = {j == 1 ? 1.0 : 0.0, j == 2 ? 1.0 : 0.0};
  double f[3];
  d.field({&t, 1}, x, u, f);
  return -f[2];
}
/// F = ∂1 A2 - ∂2 A1 by central differences, for guesses.
double curvature(Dynamics& d, double phi1, double phi2) {
  const double e = 1e-4;
  return (connection(d, phi1 + e, phi2, 2) - connection(d, phi1 - e, phi2, 2) -
          connection(d, phi1, phi2 + e, 1) + connection(d, phi1, phi2 - e, 1)) /
         (2 * e);
}

Problem planar_reorientation(int stages, int intervals) {
  Problem p;
  p.dynamics = planar_robot();
  p.stages = stages;
  p.duration = 1;
  p.intervals = intervals;
  p.inputs = Inputs::at_stages;
  p.start = {0.5, 1, 0};
  p.cost.input = {0.5, 0.5};
  p.goals = test::ends_at({0.5, 1, 0.3});
  return p;
}

/// The loops of extremal length that turn the base by 0.3 rad keep their speed √(2J).
void expect_steady_speed(const Plan& plan) {
  EXPECT_EQ(plan.status, Plan::Status::optimal);
  double off = 0;
  for (size_t i = 0; i < plan.motion.u.size(); i += 2)
    off = std::max(off, std::fabs(std::hypot(plan.motion.u[i], plan.motion.u[i + 1]) /
                                      std::sqrt(2 * plan.cost) -
                                  1));
  std::printf("  J = %.12f, costate of θ %.8f, %d iterations, speed varies by %.1e\n", plan.cost,
              plan.costates[2], plan.iterations, off);
  EXPECT_LT(off, 1e-9);
}

/// The extremal of the facts is no minimum: only the mode for any extremal stays there.
TEST(KnownAnswers, PlanarExtremal) {
  const Problem p = planar_reorientation(8, 40);
  Trajectory guess = straight(p, p.start);
  double phi1 = 0.5, phi2 = 1, heading = 2.594588;
  const size_t count = guess.u.size() / 2, fine = 16;
  for (size_t i = 0; i < count; ++i) {  // at constant speed, turning with the curvature
    guess.u[2 * i] = 9.5717 * std::cos(heading);
    guess.u[2 * i + 1] = 9.5717 * std::sin(heading);
    for (size_t j = 0; j < fine; ++j) {
      const double dt = 1 / double(count * fine);
      phi1 += dt * 9.5717 * std::cos(heading);
      phi2 += dt * 9.5717 * std::sin(heading);
      heading -= dt * 80.178 * curvature(*p.dynamics, phi1, phi2);
    }
  }
  follow_inputs(p, guess);
  const Plan plan = solve(p, guess, {.any_extremal = true});
  expect_steady_speed(plan);
  std::printf("  J off by %.1e (bound 1e-11)\n", plan.cost - 45.808437497609);
  EXPECT_NEAR(plan.cost, 45.808437497609, 1e-11);
  EXPECT_NEAR(std::fabs(plan.costates[2]), 80.17779821, 1e-8);
  EXPECT_LT(solve(p, guess).cost, 11.4);  // the solver for minima leaves it
}

/// From a circle the solver finds a much shorter loop, which satisfies the same conditions.
TEST(KnownAnswers, PlanarMinimum) {
  const Problem p = planar_reorientation(8, 40);
  Trajectory guess = straight(p, p.start);
  for (size_t i = 0; i < guess.u.size() / 2; ++i) {
    const double a = 2.59 - 2 * M_PI * double(i) / double(guess.u.size() / 2);
    guess.u[2 * i] = 9.5 * std::cos(a);
    guess.u[2 * i + 1] = 9.5 * std::sin(a);
  }
  follow_inputs(p, guess);
  const Plan plan = solve(p, guess);
  expect_steady_speed(plan);
  EXPECT_LT(plan.cost, 11.4);
}

/// Kelly's cart and pendulum: extremals to 12 digits, of two of them the solver finds by itself.
TEST(KnownAnswers, CartPole) {
  // the first guess is a straight line; 20 steps of gauss4 find one valley, 40 the other
  const Problem fine = test::cart_pole_swing_up(8, 40);
  struct {
    int intervals;
    double cost, first_input;
  } const cases[] = {{20, 57.944780306729, -6.8611473224}, {40, 58.807667458170, 1.8646665526}};
  for (const auto& c : cases) {
    const Problem coarse = test::cart_pole_swing_up(2, c.intervals);
    const Plan first = solve(coarse, straight(coarse, {1, M_PI, 0, 0}));
    EXPECT_EQ(first.status, Plan::Status::optimal);
    const Plan plan = solve(fine, resample(coarse, first.motion, fine));
    EXPECT_EQ(plan.status, Plan::Status::optimal);
    const double u0 = input_signal(fine, plan.motion, 0)->operator()(0.0);
    std::printf("  J off by %.1e (bound 1e-10), u(0) by %.1e, %d + %d iterations, residual %.1e\n",
                plan.cost - c.cost, u0 - c.first_input, first.iterations, plan.iterations,
                plan.residual);
    EXPECT_NEAR(plan.cost, c.cost, 1e-10);
    EXPECT_NEAR(u0, c.first_input, 1e-6);
  }
}

TEST(KnownAnswers, CartPoleIsFast) {
  const Problem p = test::cart_pole_swing_up(2, 40);
  const auto guess = straight(p, {1, M_PI, 0, 0});
  const Plan plan = solve(p, guess);
  std::printf("  %d iterations (bound 20), %.1f ms\n", plan.iterations, milliseconds(p, guess));
  EXPECT_LE(plan.iterations, 20);
}

}  // namespace
}  // namespace porthos::planning::known_answers_test
