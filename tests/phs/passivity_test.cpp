// The dissipation inequality along data: closed forms, simulated motors, and data that break it.
#include "phs/linear/passivity.h"

#include <cmath>
#include <random>
#include <vector>

#include "integrators/catalogue.h"
#include "integrators/core/integrator.h"
#include "phs/error.h"
#include "tests/support/bounds.h"
#include "tests/support/linear_benchmarks.h"

namespace porthos::phs::passivity_test {
namespace {

using test::breaks, test::keeps;
using Vec = std::vector<double>;

struct Data {
  Vec t, power, H;
  PassivityReport report() const { return passivity(t, power, H); }
};

/// A spring of 1 N/m whose end moves as sin t: u·y = sin t cos t, H = ½ sin² t. `gain` scales the
/// power, which a true spring has at 1.
Data spring(int n, double gain = 1, bool uneven = false) {
  Data d;
  for (int i = 0; i <= n; ++i) {
    const double s = double(i) / n, t = 10 * (uneven ? s * (0.3 + 0.7 * s) : s);
    d.t.push_back(t);
    d.power.push_back(gain * std::sin(t) * std::cos(t));
    d.H.push_back(std::sin(t) * std::sin(t) / 2);
  }
  return d;
}

TEST(Passivity, QuadratureErrorStatedIsNoLessThanTheTrueOne) {
  for (const bool uneven : {false, true})
    for (const int n : {50, 200, 800, 3200}) {
      const auto r = spring(n, 1, uneven).report();
      const double error = std::fabs(r.supplied - std::pow(std::sin(10.0), 2) / 2);
      std::printf("  %4d %s samples: error %.1e, stated %.1e, violation %.1e\n", n,
                  uneven ? "uneven" : "even  ", error, r.quadrature, r.violation);
      EXPECT_LE(error, r.quadrature);
      EXPECT_LE(r.violation, r.quadrature) << "a spring gives back what it got and no more";
      EXPECT_LE(r.quadrature, 10 * std::pow(10.0 / n, 3)) << "order 3";
    }
  std::mt19937_64 rng(1);
  std::normal_distribution<double> number;
  Data cubic;
  for (int i = 0; i < 12; ++i) {
    const double t = 0.25 * i;
    cubic.t.push_back(t);
    cubic.power.push_back(t * t * (t - 2));
    cubic.H.push_back(0);
  }
  // The first and the last interval have one parabola each, with errors that are equal and cancel
  // on a cubic.
  const double T = 2.75, exact = T * T * T * (T / 4 - 2.0 / 3);
  keeps("cubic power, equal intervals", std::fabs(cubic.report().supplied - exact), 1e-13);
}

TEST(Passivity, FindsEnergyFromNowhere) {
  EXPECT_TRUE(spring(400).report().passive());
  EXPECT_TRUE(spring(400, -1).report().violation > 0.5) << "the power with the wrong sign";
  // Power understated by 1 %: H gains 0.01·½ more than supplied in the quarter period from any zero
  // of sin.
  const auto r = spring(400, 0.99).report();
  keeps("1 % from nowhere, violation against 0.005", std::fabs(r.violation - 0.005), 1e-5);
  EXPECT_FALSE(r.passive());
  EXPECT_NEAR(std::sin(r.from * 10.0 / 400), 0, 0.05);
  EXPECT_NEAR(std::fabs(std::sin(r.to * 10.0 / 400)), 1, 0.01);
}

TEST(Passivity, FindsItInTheMiddle) {  // the end alone looks passive
  Data d;
  for (int i = 0; i <= 100; ++i) {
    d.t.push_back(i);
    d.power.push_back(0);
    d.H.push_back(i < 40 ? 10 - 0.2 * i : 2.1);
  }
  for (int i = 60; i <= 100; ++i) d.H[size_t(i)] = 3 - 0.02 * (i - 60);
  const auto r = d.report();
  EXPECT_LT(d.H.back(), d.H.front());
  EXPECT_DOUBLE_EQ(r.violation, 0.9);
  EXPECT_EQ(r.from, 40u);
  EXPECT_EQ(r.to, 60u);
  EXPECT_FALSE(r.passive());
}

TEST(Passivity, AJumpIsATimeGivenTwice) {
  Data d{{0, 1, 1, 2, 3, 3, 4}, {0, 0, 2, 2, 2, 0, 0}, {0, 0, 0, 2, 4, 4, 4}};
  const auto r = d.report();
  EXPECT_DOUBLE_EQ(r.supplied, 4);
  EXPECT_EQ(r.quadrature, 0);
  EXPECT_TRUE(r.passive());
  const Data smooth{{0, 1, 2, 3, 4}, {0, 0, 2, 2, 0}, {0, 0, 2, 4, 4}};
  breaks("the same without: quadrature error stated", smooth.report().quadrature, 0.1);
}

/// A DC motor on an oscillator, by Gauss 8; its output is the current, or by mistake the flux: Gᵀx
/// in place of GᵀQx.
Data motor_run(bool flux_for_current) {
  const test::DcMotor motor;
  const auto system = motor.system();
  // The voltage is the first state of an oscillator of 20 rad/s, in feedback with the motor and
  // loaded by its current.
  const LinearSystem whole(
      {.J = {{0, -motor.k, 1, 0}, {motor.k, 0, 0, 0}, {-1, 0, 0, -20}, {0, 0, 20, 0}},
       .R = {{motor.Ra, 0, 0, 0}, {0, motor.b, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0}},
       .Q = {{1 / motor.La, 0, 0, 0}, {0, 1 / motor.Jm, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}},
       .G = {{0}, {0}, {0}, {1}}},
      "motor on an oscillator");
  const auto model = whole.to_model();
  const double h = 1e-3;
  const auto gauss = integrators::make_integrator("gauss8", *model, h);
  State state(model->description(), {0.02, 0.001, 0, 3});
  Data d;
  for (int i = 0; i <= 2000; ++i) {
    const auto& x = state.x;
    const double motor_state[] = {x[0], x[1]}, current = x[0] / motor.La;
    d.t.push_back(i * h);
    d.power.push_back(x[2] * (flux_for_current ? x[0] : current));
    d.H.push_back(system.hamiltonian(motor_state));
    if (gauss->step(state) != integrators::Outcome::ok) throw InvalidArgument("gauss8 failed");
  }
  return d;
}

TEST(Passivity, OfASimulatedMotor) {
  const auto r = motor_run(false).report();
  std::printf("  supplied %.4f J, violation %.1e, quadrature %.1e\n", r.supplied, r.violation,
              r.quadrature);
  EXPECT_TRUE(r.passive());
  EXPECT_LT(r.quadrature, 1e-3 * r.supplied);
  const auto wrong = motor_run(true).report();
  breaks("flux in place of current as the output, violation", wrong.violation,
         100 * wrong.quadrature);
  EXPECT_FALSE(wrong.passive());
}

TEST(Passivity, RefusesDataOutOfOrder) {
  EXPECT_THROW(passivity({}, {}, {}), InvalidArgument);
  EXPECT_THROW(passivity(Vec{0, 1}, Vec{0}, Vec{0, 0}), InvalidArgument);
  EXPECT_THROW(passivity(Vec{0, 1, 0.5}, Vec{0, 0, 0}, Vec{0, 0, 0}), InvalidArgument);
  EXPECT_THROW(passivity(Vec{0, 1}, Vec{0, NAN}, Vec{0, 0}), InvalidArgument);
}

}  // namespace
}  // namespace porthos::phs::passivity_test
