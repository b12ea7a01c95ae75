// Gauss-Radau: the formula in 113 bits, what it does not keep at coarse steps, and what its
// accuracy gives instead.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/methods/gauss.h"
#include "integrators/methods/radau15.h"
#include "integrators/tables/radau_table.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/gauss.h"
#include "tests/support/kepler.h"
#include "tests/support/pendulum.h"
#include "tests/support/robots.h"

namespace porthos::integrators::radau15_test {
namespace {

using phs::Quad;
const phs::UserModel<test::Kepler> kepler{test::Kepler{}};
const phs::UserModel<test::Pendulum> pendulum{test::Pendulum{}};
const phs::UserModel<test::DrivenPendulum> driven{test::DrivenPendulum{}};

template <class T>
std::unique_ptr<BasicIntegrator<T>> bare(const phs::Model& model, T h) {
  return make_radau15<T>({.name = "radau15, one step"}, model, h, {}, false);
}

TEST(Radau, TableHasOrderFifteen) {
  const auto& t = radau_table<Quad>();
  // Everhart 1985, table 1: the first spacing.
  EXPECT_NEAR(double(t.c[1] - Quad(0.0562625605369221464656521910318)), 0, 1e-16);
  EXPECT_EQ(t.c[0], Quad(0));
  double worst = 0, next = 0;
  for (int k = 1; k <= 16; ++k) {  // B(k): the quadrature
    Quad sum = 0;
    for (size_t j = 0; j < 8; ++j) {
      Quad power = t.b[j];
      for (int m = 1; m < k; ++m) power *= t.c[j];
      sum += power;
    }
    (k <= 15 ? worst : next) = std::max(k <= 15 ? worst : next, double(phs::abs(sum * k - 1)));
  }
  for (int k = 1; k <= 8; ++k)  // C(8): the stages
    for (size_t i = 1; i < 8; ++i) {
      Quad sum = 0, end = 1;
      for (int m = 0; m < k; ++m) end *= t.c[i];
      for (size_t j = 0; j < 8; ++j) {
        Quad power = t.a[i][j];
        for (int m = 1; m < k; ++m) power *= t.c[j];
        sum += power;
      }
      worst = std::max(worst, double(phs::abs(sum * k - end)));
    }
  std::printf("  order conditions to 15: off by %.1e   bound 1e-30; the 16th by %.1e\n", worst,
              next);
  EXPECT_LE(worst, 1e-30);
  EXPECT_GT(next, 1e-12) << "control: it is not of order 16";
  const auto& d = radau_table<double>();
  for (double h : {0.5, 0.1, 1.0 / 3}) {
    Quad sum = 0;
    for (double w : d.weights(h)) sum += w;
    EXPECT_LE(std::fabs(double(sum - h)), 0x1p-55 * h) << "the weights sum to h";
  }
}

// On a nonlinear system with a mass that depends on q, in 113 bits.
TEST(Radau, OneStepHasOrderFifteen) {
  const auto robot = test::ets_vii(8);
  const std::vector<Quad> start(robot.start.x.begin(), robot.start.x.end());
  const Quad T = Quad(1) / 2;
  const auto exact = gauss_reference(*robot.model, start, T / 24, 24, 12);
  const auto error = [&](int steps) {
    const auto method = bare<Quad>(*robot.model, T / steps);
    phs::BasicState<Quad> s(robot.model->description(), start);
    for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), Outcome::ok);
    for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += s.lo[k];
    return test::distance(s.x, exact);
  };
  const double a = error(6), b = error(12), order = std::log2(a / b);
  std::printf("  errors %.1e, %.1e: order %.2f\n", a, b, order);
  EXPECT_NEAR(order, 15, 0.8);
}

// At coarse steps the formula is neither symplectic nor symmetric and loses a quadratic invariant;
// Gauss beside it does not.
TEST(Radau, KeepsNoStructure) {
  const double h = 1.5;
  const auto defects = [&](auto&& make) {
    const std::vector<double> x0 = test::kepler_start(0.3);
    double Psi[4][4];
    for (size_t j = 0; j < 4; ++j) {
      phs::BasicState<phs::Dual> s(kepler.description(), {x0.begin(), x0.end()});
      s.x[j].d = 1;
      EXPECT_EQ(make(phs::Dual(h))->step(s), Outcome::ok);
      for (size_t i = 0; i < 4; ++i) Psi[i][j] = s.x[i].d + s.lo[i].d;
    }
    double symplectic = 0;
    for (size_t i = 0; i < 4; ++i)
      for (size_t j = 0; j < 4; ++j) {
        double sum = i + 2 == j ? -1.0 : j + 2 == i ? 1.0 : 0.0;
        for (size_t k = 0; k < 2; ++k) sum += Psi[k][i] * Psi[k + 2][j] - Psi[k + 2][i] * Psi[k][j];
        symplectic = std::max(symplectic, std::fabs(sum));
      }
    phs::State s(kepler.description(), x0);
    EXPECT_EQ(make(h)->step(s), Outcome::ok);
    const double L = s.x[0] * s.x[3] - s.x[1] * s.x[2], L0 = x0[0] * x0[3];
    EXPECT_EQ(make(-h)->step(s), Outcome::ok);
    double symmetric = 0;
    for (size_t i = 0; i < 4; ++i) symmetric = std::max(symmetric, std::fabs(s.x[i] - x0[i]));
    return std::array{symplectic, symmetric, std::fabs(L / L0 - 1)};
  };
  const auto radau = defects([&](auto step) { return bare<decltype(step)>(kepler, step); });
  const auto gauss = defects(
      [&](auto step) { return make_basic_integrator<decltype(step)>("gauss16", kepler, step); });
  std::printf(
      "  one step of %.1f: symplectic %.1e, forth and back %.1e, L %.1e   must exceed 1e-9; "
      "gauss16 %.1e, %.1e, %.1e   bound 1e-13\n",
      h, radau[0], radau[1], radau[2], gauss[0], gauss[1], gauss[2]);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(radau[size_t(i)], 1e-9);
    EXPECT_LE(gauss[size_t(i)], 1e-13);
  }
}

// Steps of its own choice, to round-off, from e = 0 to e = 0.99. At the pericentre H is the
// difference of numbers (1 + e)/(1 - e) times its size, so one rounding of the state moves it by as
// many units.
TEST(Radau, EnergyOfEccentricOrbits) {
  test::Gauge gauge(kepler);
  for (const double e : {0.0, 0.5, 0.9, 0.99}) {
    phs::State s(kepler.description(), test::kepler_start(e));
    const long double H0 = gauge.energy(s);
    const auto method = make_integrator("radau15", kepler, 2 * M_PI / 10);
    double worst = 0;
    const int periods = 200;
    for (int i = 0; i < 10 * periods; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok) << e;
      worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0) / H0)));
    }
    const double bound = 40 * 0x1p-53 * (1 + (1 + e) / (1 - e));
    std::printf(
        "  e = %.2f, %d periods: energy error %.1e   bound %.1e, %.0f evaluations a period\n", e,
        periods, worst, bound, double(method->cost().evaluations) / periods);
    EXPECT_LE(worst, bound) << e;
  }
}

// Round-off may walk, not march: 2e5 steps of the method times half a unit would be 2e-11, its root
// 5e-14. With weights rounded to one double the energy marches to 1.5e-13 here.
TEST(Radau, EnergyDoesNotDrift) {
  test::Gauge gauge(kepler);
  phs::State s(kepler.description(), test::kepler_start(0));
  const long double H0 = gauge.energy(s);
  const auto method = make_integrator("radau15", kepler, 2 * M_PI);
  double worst = 0;
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(method->step(s), Outcome::ok);
    worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0) / H0)));
  }
  std::printf("  e = 0, 5000 periods: energy error %.1e   bound 5e-14\n", worst);
  EXPECT_LE(worst, 5e-14);
}

// The output step is no step of the method: its size matters to rounding alone.
TEST(Radau, OutputStepsDoNotMatter) {
  const double end = 6 * M_PI;
  std::vector<std::vector<double>> ends;
  for (const int outputs : {1, 7, 40}) {
    phs::State s(kepler.description(), test::kepler_start(0.8));
    const auto method = make_integrator("radau15", kepler, end / outputs);
    for (int i = 0; i < outputs; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
    ends.push_back(s.x);
  }
  const auto start = test::kepler_start(0.8);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(ends[0][i], start[i], 1e-12) << "three periods";
    for (size_t k = 1; k < 3; ++k) EXPECT_NEAR(ends[k][i], ends[0][i], 1e-12);
  }
}

TEST(Radau, DampedDrivenAndBackwards) {
  const phs::State start(driven.description(), {1.0, 0.3});
  phs::State s = start, reference = start;
  const auto fine = make_integrator("gauss16", driven, 0.02);
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(fine->step(reference), Outcome::ok);
  const auto method = make_integrator("radau15", driven, 2.0);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
  const double there = test::distance(test::unwrapped(driven.description(), s),
                                      test::unwrapped(driven.description(), reference));
  const auto back = make_integrator("radau15", driven, -2.0);
  s.origin = 20;
  s.step = 0;
  for (int i = 0; i < 10; ++i) ASSERT_EQ(back->step(s), Outcome::ok);
  const double home = test::distance(test::unwrapped(driven.description(), s),
                                     test::unwrapped(driven.description(), start));
  std::printf(
      "  driven and damped, 20 s: %.1e from gauss16   bound 1e-13; back at the start to %.1e   "
      "bound 1e-11\n",
      there, home);
  EXPECT_LE(there, 1e-13);
  EXPECT_LE(home, 1e-11) << "backwards damping is growth, by exp(2)";
}

// A thousand radians in one advance, and a state that is not a number.
TEST(Radau, OutcomesAreStatuses) {
  phs::State s(pendulum.description(), {0.1, 100});
  ASSERT_EQ(make_integrator("radau15", pendulum, 10.0)->step(s), Outcome::ok);
  EXPECT_GT(s.turns[0], 150);
  s.x[1] = NAN;
  const phs::State before = s;
  EXPECT_EQ(make_integrator("radau15", pendulum, 0.1)->step(s), Outcome::not_finite);
  EXPECT_EQ(s.x[0], before.x[0]);
  EXPECT_EQ(s.step, before.step);
}

}  // namespace
}  // namespace porthos::integrators::radau15_test
