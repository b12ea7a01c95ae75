// Published and independently computed runs of closed-form designs, to the digits given.
#include "tests/energy_shaping/loops.h"

namespace porthos::energy_shaping::reference_runs_test {
namespace {

using test::agrees, test::keeps, test::law_at, test::run_loop, test::Vec;

// Reference states were made by a Runge-Kutta method of order 4 with h = 2.5 to 10 ms and printed
// to 6 to 10 digits: both limit the agreement.
TEST(ReferenceRuns, InertiaWheelPendulum) {
  const InertiaWheelPendulum d;
  const auto loop = inertia_wheel_pendulum(d);
  const Vec x0{3.14, 0, 0, 0};
  agrees("u(0)", law_at(*loop, x0)[0], 53.03527959, 1e-9);
  const double H0 = loop->instantiate<double>()->hamiltonian(x0);
  agrees("H_d(0)", H0, 11.98284246, 1e-9);
  const auto run = run_loop(*loop, x0, {1, 2, 5, 10, 40}, 0.005);
  agrees("H_d(1)", run.at(1).H, -1.9197155, 1e-7);
  agrees("H_d(2)", run.at(2).H, -1.93044411, 1e-7);
  agrees("H_d(5)", run.at(5).H, -1.96635269, 1e-7);
  agrees("H_d(10)", run.at(10).H, -1.98816289, 1e-7);
  agrees("H_d(40)", run.at(40).H, -1.99998613, 1e-7);
  const double x5[] = {-0.044486, 0.328469, -0.025939, 0.51726};
  const double x40[] = {-0.001242, 0.010043, -0.000488, 0.009903};
  for (size_t i = 0; i < 4; ++i) {
    keeps("x(5)", std::fabs(run.at(5).x[i] - x5[i]), 1e-6);
    keeps("x(40)", std::fabs(run.at(40).x[i] - x40[i]), 1e-6);
  }
}

// The published law: u = γ1 sin q1 + kp (q2 + γ2 q1) + kv k3 (p2 + k4 p1), γ1 = 30, γ2 = 4.5, kp =
// 3.75.
TEST(ReferenceRuns, InertiaWheelLawAsPublished) {
  const auto loop = inertia_wheel_pendulum({});
  for (const Vec& x : {Vec{0.3, -1, 0.2, 0.5}, Vec{-2, 4, 1, -3}}) {
    const double u =
        30 * std::sin(x[0]) + 3.75 * (x[1] + 4.5 * x[0]) + 10 * (0.5 / 3.75) * (x[3] + 9 * x[2]);
    agrees("u", law_at(*loop, x)[0], u, 1e-13);
  }
}

TEST(ReferenceRuns, BallAndBeamConverges) {
  const auto loop = ball_and_beam({});
  const auto run = run_loop(*loop, {0.5, 0.3, 0, 0}, {0, 5, 10, 20, 40, 80}, 0.01);
  double last = HUGE_VAL;
  for (const auto& [t, s] : run) {
    std::printf("  t = %4g s: H_d %.6e, ball %+.6f m, beam %+.6f rad\n", t, s.H, s.x[0], s.x[1]);
    EXPECT_LT(s.H, last);
    last = s.H;
    EXPECT_LT(std::fabs(s.x[0]), 1) << "on the bar";
  }
  keeps("H_d(80)/H_d(0)", run.at(80).H / run.at(0).H, 1e-3);
}

TEST(ReferenceRuns, CartPole) {
  const auto loop = cart_pole({});
  const Vec x0{0.5, 0, 0, 0};
  agrees("u(0)", law_at(*loop, x0)[0], 17.59926209653, 1e-12);
  const auto run = run_loop(*loop, x0, {0, 1, 2, 5, 10, 30}, 0.0025);
  const std::map<double, double> H{{0, 40.747949487}, {1, 34.27119622},  {2, 32.30512842},
                                   {5, 30.47301697},  {10, 30.07991258}, {30, 30.00006453}};
  for (const auto& [t, value] : H) agrees("H_d", run.at(t).H, value, 2e-8);
  const double x1[] = {-0.238618, 2.122035, -0.221235, 1.39903};
  for (size_t i = 0; i < 4; ++i) keeps("x(1)", std::fabs(run.at(1).x[i] - x1[i]), 2e-6);
}

TEST(ReferenceRuns, AcrobotSettles) {
  const auto first = acrobot({.a2 = 1, .a3 = 4, .ku = 200, .kv = 2}, nullptr,
                             MatchingOptions{.region = {{-0.5, -1}, {0.5, 1}, 5}});
  // Below 0.02 for good "after about 10 s", one digit; the same time to a step by another method at
  // another step.
  const auto settling = [&](const char* method, double h) {
    const auto integrator = integrators::make_integrator(method, *first, h);
    phs::State s(first->description(), {0.1, 0, 0, 0});
    double last = 0;
    while (double(s.step) * h < 40) {
      if (integrator->step(s) != integrators::Outcome::ok) return HUGE_VAL;
      if (std::hypot(s.x[0], s.x[1]) > 0.02) last = double(s.step) * h;
    }
    return last;
  };
  const double gauss = settling("gauss8", 0.01), rk4 = settling("rk4", 0.002);
  std::printf("  |q| < 0.02 from %.2f s on, by rk4 %.3f s\n", gauss, rk4);
  keeps("settling by two methods [s]", std::fabs(gauss - rk4), 0.0101);
  agrees("settling [s]", gauss, 10, 0.5);

  // As published: M_d⁻¹ = [[5.9058, -0.9997], [-0.9997, 0.3385]], start with the shoulder at 0.5
  // rad.
  Acrobot d{.ku = 200, .kv = 5};
  d.a3 = 2 / (1 - std::sqrt(d.c1 / d.c2));
  const auto loop = acrobot(d);
  const double k = 1 - std::sqrt(d.c1 / d.c2), det = k * d.a3 - 1;
  agrees("M_d⁻¹ (1,1) against the published", d.a3 / det, 5.9058, 4e-4);
  agrees("M_d⁻¹ (2,2) against the published", k / det, 0.3385, 4e-4);
  double peak = 0, settled = 0;
  const auto integrator = integrators::make_integrator("gauss8", *loop, 0.01);
  phs::State s(loop->description(), {0.5, 0, 0, 0});
  for (int i = 0; i < 4000; ++i) {
    peak = std::max(peak, std::fabs(law_at(*loop, s.x)[0]));
    ASSERT_EQ(integrator->step(s), integrators::Outcome::ok);
    if (std::hypot(s.x[0], s.x[1]) > 0.02) settled = double(s.step) * 0.01;
  }
  std::printf("  largest torque %.1f, |q| < 0.02 from %.2f s on\n", peak, settled);
  agrees("largest torque", peak, 179, 5e-3);
  agrees("settled", settled, 16.84, 5e-2);
}

TEST(ReferenceRuns, StronglyCoupledVtol) {
  const auto loop = vtol({});
  const Vec x0{5, 5, 0.5, 0, 0, 0};
  const Vec u = law_at(*loop, x0);
  agrees("u1(0)", u[0], -28.0626, 2e-6);
  agrees("u2(0)", u[1], -22.1334, 2e-6);
  const auto run = run_loop(*loop, x0, {0, 7.5, 30, 60}, 0.01);
  const std::map<double, double> H{
      {0, -14.818008}, {7.5, -19.286061}, {30, -19.358512}, {60, -19.42034876}};
  for (const auto& [t, value] : H) agrees("H_d", run.at(t).H, value, 1e-7);
}

}  // namespace
}  // namespace porthos::energy_shaping::reference_runs_test
