// Controlled methods as integrators: clock, reversal, restart, landing, dense output, damped
// systems, refusals.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/step_control.h"
#include "integrators/methods/gauss.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/kepler.h"
#include "tests/support/robots.h"

namespace porthos::integrators::step_control_contract_test {
namespace {

using phs::Quad;
const phs::UserModel<test::Kepler> kepler{test::Kepler{}};
const phs::UserModel<test::DrivenPendulum> driven{test::DrivenPendulum{}};
constexpr StepControl both[] = {StepControl::time_transformed, StepControl::reversible};

ControlOptions by_radius() {
  using Scale = test::PowerOfRadius<3>;
  return {.scale = std::make_shared<phs::UserTimeScale<Scale>>(Scale{})};
}
phs::State kepler_state(double e) { return {kepler.description(), test::kepler_start(e)}; }

// The clock is the sum of the steps taken to 106 bits, so time() is that sum rounded: against 113
// bits, and against a plain sum as the control. The plain sum walks at random and may come home at
// the end, so the control takes its largest distance on the way.
TEST(StepControl, ClockIsTheSumOfItsSteps) {
  for (const StepControl kind : both) {
    phs::State s = kepler_state(0.9);
    const auto method = make_controlled(kind, "gauss4", kepler, 0.1, by_radius());
    Quad exact = 0;
    double plain = 0, astray = 0;
    double smallest = HUGE_VAL, largest = 0;
    for (int i = 0; i < 100'000; ++i) {
      const Quad before = Quad(s.origin) + s.origin_lo;
      ASSERT_EQ(method->step(s), Outcome::ok);
      const double taken = double(Quad(s.origin) + s.origin_lo - before);
      exact += taken;
      plain += taken;
      astray = std::max(astray, std::fabs(double(plain - exact)));
      smallest = std::min(smallest, taken);
      largest = std::max(largest, taken);
    }
    const double t = method->time(s), ulp = std::nextafter(t, HUGE_VAL) - t;
    std::printf(
        "  %-16s t = %.6f: off by %.2f ulp   bound 1; plain sum off by %.0f ulp (10); steps %.4f "
        "to %.3f\n",
        to_string(kind), t, double((t - exact) / ulp), astray / ulp, smallest, largest);
    EXPECT_LE(std::fabs(double((t - exact) / ulp)), 1);
    EXPECT_GT(astray, 10 * ulp) << "the control must see something";
    EXPECT_GT(largest, 20 * smallest);
  }
}

// Forth with h, back with -h and the memory of the way forth.
TEST(StepControl, RunsBackAsItRanForth) {
  const auto robot = test::ets_vii(5);
  for (const StepControl kind : both)
    for (const char* name : {"gauss8", "stormer_verlet"}) {
      const auto forth = make_controlled(kind, name, *robot.model, 0.125, {.rate = 0.5});
      phs::State s = robot.start;
      for (int i = 0; i < 200; ++i) ASSERT_EQ(forth->step(s), Outcome::ok);
      const double away = s.time(0);
      const auto back = make_controlled(kind, name, *robot.model, -0.125, {.rate = 0.5});
      back->restore(forth->memory());
      for (int i = 0; i < 200; ++i) ASSERT_EQ(back->step(s), Outcome::ok);
      double worst = 0;
      for (size_t i = 0; i < s.x.size(); ++i)
        worst = std::max(worst,
                         std::fabs(s.x[i] - robot.start.x[i]) / (1 + std::fabs(robot.start.x[i])));
      std::printf(
          "  %-16s %-14s %.1f s forth and back: state off by %.1e, time by %.1e   bounds 1e-12\n",
          to_string(kind), name, away, worst, std::fabs(s.time(0)));
      EXPECT_LE(worst, 1e-12);
      EXPECT_LE(std::fabs(s.time(0)), 1e-12);
    }
}

TEST(StepControl, KeepsMomentumAndVariesItsStep) {
  const auto robot = test::ets_vii(8);
  test::Gauge gauge(*robot.model);
  const auto start = gauge.invariants(robot.start);
  const auto H0 = gauge.energy(robot.start);
  for (const StepControl kind : both) {
    phs::State s = robot.start;
    const auto method = make_controlled(kind, "gauss16", *robot.model, 0.2, {.rate = 2});
    double smallest = HUGE_VAL, largest = 0, t = 0, energy = 0;
    for (int i = 0; i < 2000; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok);
      smallest = std::min(smallest, method->time(s) - t);
      largest = std::max(largest, method->time(s) - t);
      t = method->time(s);
      energy = std::max(energy, std::fabs(double((gauge.energy(s) - H0) / H0)));
    }
    const double L = gauge.error("angular_momentum", s, start),
                 P = gauge.error("linear_momentum", s, start),
                 xi = gauge.error("quaternion_norm.base.attitude", s, start);
    std::printf(
        "  %-16s steps %.3f to %.3f s, L %.1e  P %.1e  |xi|^2 %.1e   bounds 5e-14; H %.1e   bound "
        "1e-13\n",
        to_string(kind), smallest, largest, L, P, xi, energy);
    EXPECT_LE(std::max({L, P, xi}), 5e-14);
    EXPECT_LE(energy, 1e-13);
    EXPECT_GT(largest, 1.1 * smallest);
  }
}

// step, step_by, a restart in between: the same bits as without it.
TEST(StepControl, RestartIsContinuation) {
  const auto robot = test::ets_vii(5);
  for (const StepControl kind : both) {
    const auto make = [&] {
      return make_controlled(kind, "gauss12", *robot.model, 0.125, {.rate = 0.5});
    };
    const auto steps = [](Integrator& m, phs::State& s, int n) {
      for (int i = 0; i < n; ++i) ASSERT_EQ(m.step(s), Outcome::ok);
    };
    phs::State through = robot.start, stopped = robot.start;
    const auto one = make(), first = make(), second = make();
    steps(*one, through, 60);
    steps(*first, stopped, 60);
    ASSERT_EQ(one->step_by(through, 0.01), Outcome::ok);
    ASSERT_EQ(first->step_by(stopped, 0.01), Outcome::ok);
    steps(*one, through, 17);
    steps(*first, stopped, 17);
    second->restore(first->memory());
    steps(*one, through, 123);
    steps(*second, stopped, 123);
    EXPECT_TRUE(through == stopped) << to_string(kind);
    EXPECT_EQ(one->memory(), second->memory()) << to_string(kind);

    phs::State forgotten = robot.start;
    const auto third = make(), fourth = make();
    steps(*third, forgotten, 77);
    steps(*fourth, forgotten, 140);
    EXPECT_FALSE(through == forgotten) << "control: without the memory it is another run";
    EXPECT_THROW(second->restore(std::vector<double>(3)), InvalidArgument);
  }
}

TEST(StepControl, StepByLandsOnTheClock) {
  for (const StepControl kind : both) {
    phs::State s = kepler_state(0.6);
    const auto method = make_controlled(kind, "gauss16", kepler, 0.2, by_radius());
    for (int i = 0; i < 50; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
    const double period = 2 * M_PI, aim = period * std::ceil(method->time(s) / period);
    while (true) {
      phs::State next = s;
      ASSERT_EQ(method->step(next), Outcome::ok);
      if (method->time(next) > aim) break;
      s = next;
    }
    ASSERT_EQ(method->step_by(s, aim - s.origin - s.origin_lo), Outcome::ok);
    EXPECT_EQ(method->time(s), aim) << to_string(kind);
    const auto start = test::kepler_start(0.6);
    for (size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(s.x[i], start[i], 2e-12) << to_string(kind) << ": a whole number of periods";
  }
}

// Fractions are of physical time: against a step_by to that time.
TEST(StepControl, DenseOutputIsInPhysicalTime) {
  for (const StepControl kind : both) {
    phs::State before = kepler_state(0.6);
    const auto method = make_controlled(kind, "gauss16", kepler, 0.2, by_radius());
    for (int i = 0; i < 5; ++i) ASSERT_EQ(method->step(before), Outcome::ok);
    phs::State after = before;
    ASSERT_EQ(method->step(after), Outcome::ok);
    const double h = method->time(after) - method->time(before);
    for (double theta : {0.0, 0.3, 0.7, 1.0}) {
      std::vector<double> x(4);
      ASSERT_TRUE(method->interpolate(after, theta, x));
      phs::State there = before;
      if (theta > 0) {
        const auto other = make_integrator("gauss16", kepler, h);
        ASSERT_EQ(other->step_by(there, theta * h), Outcome::ok);
      }
      for (size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(x[i], there.x[i], 1e-9) << to_string(kind) << theta;
    }
  }
}

// What is lost to damping and gained from a drive is paid out of p_t: the solution is that of the
// plain method.
TEST(StepControl, TimeTransformedSolvesDampedAndDrivenSystems) {
  const phs::State start(driven.description(), {1.0, 0.3});
  const double end = 20;
  const auto plain = make_integrator("gauss16", driven, 0.02);
  phs::State reference = start;
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(plain->step(reference), Outcome::ok);
  for (const StepControl kind : both) {
    phs::State s = start;
    const auto method = make_controlled(kind, "gauss16", driven, 0.4, {.rate = 1});
    while (true) {
      phs::State next = s;
      ASSERT_EQ(method->step(next), Outcome::ok);
      if (method->time(next) >= end) break;
      s = next;
    }
    ASSERT_EQ(method->step_by(s, end - method->time(s)), Outcome::ok);
    const double error = test::distance(test::unwrapped(driven.description(), s),
                                        test::unwrapped(driven.description(), reference));
    std::printf(
        "  %-16s driven and damped, 20 s in %lld steps: %.1e from the plain method   bound 1e-11\n",
        to_string(kind), (long long)s.step, error);
    EXPECT_LE(error, 1e-11);
  }
}

/// A method of a tolerance takes steps of its own inside those of the control.
TEST(StepControl, TakesMethodsOfATolerance) {
  phs::State s = kepler_state(0.9);
  const auto method =
      make_controlled(StepControl::time_transformed, "radau15", kepler, 0.1, by_radius());
  const auto energy = kepler.instantiate<double>();
  const double H = energy->hamiltonian(s.x);
  double smallest = HUGE_VAL, largest = 0, worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const double before = method->time(s);
    ASSERT_EQ(method->step(s), Outcome::ok);
    smallest = std::min(smallest, method->time(s) - before);
    largest = std::max(largest, method->time(s) - before);
    worst = std::max(worst, std::fabs(energy->hamiltonian(s.x) / H - 1));
  }
  std::printf("  radau15, steps %.4f to %.3f: energy off by %.1e   bound 1e-12\n", smallest,
              largest, worst);
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(largest, 10 * smallest);
}

TEST(StepControl, RefusesNonsense) {
  const auto robot = test::ets_vii();
  const auto text = [&](auto&& make) -> std::string {
    try {
      make();
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "accepted";
  };
  const auto with = [&](StepControl kind, const char* method, ControlOptions c) {
    return text([&] { make_controlled(kind, method, *robot.model, 0.1, c); });
  };
  using enum StepControl;
  EXPECT_EQ(with(reversible, "rk4", {}),
            "method 'rk4' is not symmetric: the reversible step control needs one that is");
  EXPECT_EQ(
      with(time_transformed, "cvode_adams", {}),
      "method 'cvode_adams' chooses its steps itself: step control is for methods of a fixed step");
  EXPECT_EQ(with(time_transformed, "gauss4", {.rate = -1}),
            "rate of a time scale is -1.000000 rad/s, expected a finite number above 0");
  EXPECT_EQ(with(reversible, "gauss4", {.rate = 1, .length = NAN}),
            "length of a time scale is nan m, expected a finite number, 0 or more");
  EXPECT_EQ(
      text([] { make_reversible("gauss4", kepler, 0.1); }),
      "'kepler' has no angle and no rotation: a time scale from rates needs a length [m] for its "
      "linear coordinates");
  EXPECT_EQ(text([] { step_control_of("adaptive"); }),
            "unknown step control 'adaptive', expected one of fixed, time_transformed, reversible");
  EXPECT_EQ(with(fixed, "rk4", {}), "accepted");
}

// Steps that grow too long for the density to follow are a status; the state is left as it was.
TEST(StepControl, LostDensityIsAStatus) {
  const phs::State start = kepler_state(0.9);
  phs::State s = start;
  const auto method = make_reversible("gauss4", kepler, 3.0, by_radius());
  Outcome o = Outcome::ok;
  phs::State before = s;
  for (int i = 0; i < 100 && o == Outcome::ok; ++i) {
    before = s;
    o = method->step(s);
  }
  EXPECT_NE(o, Outcome::ok);
  EXPECT_TRUE(s == before);
}

}  // namespace
}  // namespace porthos::integrators::step_control_contract_test
