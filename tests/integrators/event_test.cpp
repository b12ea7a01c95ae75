// Events are steps: their times against closed forms, their energy against runs that continue from
// an interpolated state.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/event.h"
#include "integrators/control/step_control.h"
#include "tests/support/kepler.h"
#include "tests/support/pendulum.h"
#include "tests/support/robots.h"

namespace porthos::integrators::event_test {
namespace {

using X = std::span<const double>;
const phs::UserModel<test::Pendulum> pendulum{test::Pendulum{}};
const phs::UserModel<test::Kepler> kepler{test::Kepler{}};
constexpr double amplitude = 2.5;

phs::State at_rest() { return {pendulum.description(), {amplitude, 0}}; }
long double pendulum_period() { return 4 * std::comp_ellint_1l(std::sin(amplitude / 2.0L)); }
double zero_crossing(double, X x) { return x[0]; }

EventStepper stepper(const char* method, double h, std::vector<Event> events, EventOptions o = {}) {
  return {pendulum, [=] { return make_integrator(method, pendulum, h); }, std::move(events), o};
}
EventStepper stepper(const char* method, double h, Crossing direction) {
  return stepper(method, h, {{zero_crossing, direction}});
}

TEST(Event, PendulumPassesItsLowestPointWhenTheEllipticIntegralSays) {
  const double T = double(pendulum_period());
  for (const auto& [direction, first, next] : {std::tuple{Crossing::falling, 0.25, 1.0},
                                               {Crossing::rising, 0.75, 1.0},
                                               {Crossing::both, 0.25, 0.5}}) {
    auto run = stepper("gauss16", 0.2, direction);
    phs::State s = at_rest();
    double worst = 0, g = 0;
    int trials = 0;
    for (int k = 0; k < 10; ++k) {
      const EventResult r = run.run_to(s, 1e3);
      ASSERT_EQ(r.outcome, Outcome::ok);
      ASSERT_EQ(r.event, 0);
      EXPECT_EQ(r.rising, s.x[1] > 0);
      EXPECT_TRUE(direction == Crossing::both || r.rising == (direction == Crossing::rising));
      worst = std::max(worst, std::fabs(run.time(s) - (first + k * next) * T));
      g = std::max(g, std::fabs(r.g));
      trials = std::max(trials, r.trials);
    }
    std::printf(
        "  crossings of %s: times off by %.1e s of %.0f   bound 2e-13, |g| %.1e   bound 1e-15, %d "
        "trials at most\n",
        direction == Crossing::both     ? "both"
        : direction == Crossing::rising ? "rising"
                                        : "falling",
        worst, run.time(s), g, trials);
    EXPECT_LE(worst, 2e-13);
    EXPECT_LE(g, 1e-15);
    EXPECT_LE(trials, 8);
  }
}

// The event has the order of the method; the zero of the dense output, s + 1 near the end of a
// step, does not.
TEST(Event, HasTheOrderOfTheMethod) {
  const double exact = double(0.75L * pendulum_period());
  for (const auto& [name, order, h] : {std::tuple{"gauss4", 4, 0.1},
                                       {"gauss6", 6, 0.1},
                                       {"rk4", 4, 0.02},
                                       {"stormer_verlet", 2, 0.02}}) {
    const auto error = [&, name = name](double step) {
      auto run = stepper(name, step, Crossing::rising);
      phs::State s = at_rest();
      EXPECT_EQ(run.run_to(s, 100).event, 0);
      return std::fabs(run.time(s) - exact);
    };
    const double coarse = error(h), fine = error(h / 2), measured = std::log2(coarse / fine);
    std::printf("  %-14s error of the event's time %.1e, %.1e at half the step: order %.2f\n", name,
                coarse, fine, measured);
    EXPECT_NEAR(measured, order, 0.35) << name;
  }
}

// Stopping a run at 1000 events must not cost energy. Controls: the run goes on from the dense
// output, and from the chord.
TEST(Event, EnergyAfterAThousandEvents) {
  test::Gauge gauge(pendulum);
  const auto measure = [&](const phs::State& s) { return gauge.energy(s); };
  const long double H0 = measure(at_rest());
  const double h = 0.25;
  const auto interpolated = [&](bool chord) {
    const auto method = make_integrator("gauss16", pendulum, h);
    phs::State s = at_rest();
    int events = 0;
    while (events < 1000) {
      phs::State after = s;
      EXPECT_EQ(method->step(after), Outcome::ok);
      if ((s.x[0] < 0) == (after.x[0] < 0)) {
        s = after;
        continue;
      }
      const auto at = [&](double theta, std::vector<double>& x) {
        if (!chord) return (void)method->interpolate(after, theta, x);
        for (size_t i = 0; i < 2; ++i) x[i] = s.x[i] + theta * (after.x[i] - s.x[i]);
      };
      double a = 0, b = 1;
      std::vector<double> x(2);
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (a + b);
        at(middle, x);
        ((x[0] < 0) == (s.x[0] < 0) ? a : b) = middle;
      }
      at(b, x);
      s = phs::State(pendulum.description(), x);
      if (std::fabs(x[0]) < 1e-14) s.x[0] = std::copysign(1e-14, after.x[0]);
      ++events;
    }
    return std::fabs(double((measure(s) - H0) / H0));
  };
  auto run = stepper("gauss16", h, Crossing::both);
  phs::State s = at_rest();
  double worst = 0;
  for (int k = 0; k < 1000; ++k) {
    const EventResult r = run.run_to(s, 1e9);
    ASSERT_EQ(r.event, 0) << k;
    worst = std::max(worst, std::fabs(double((measure(s) - H0) / H0)));
  }
  const double dense = interpolated(false), chord = interpolated(true);
  std::printf(
      "  1000 events: energy error %.1e at most   bound 1e-14; continued from the dense output "
      "%.1e, from the chord %.1e\n",
      worst, dense, chord);
  EXPECT_LE(worst, 1e-14);
  EXPECT_GT(dense, 100 * worst);
  EXPECT_GT(chord, 100 * worst);
}

// Apsides of an eccentric orbit, under every step control.
TEST(Event, ApsidesOfAnOrbit) {
  const auto scale =
      std::make_shared<phs::UserTimeScale<test::PowerOfRadius<2>>>(test::PowerOfRadius<2>{});
  const auto radial = [](double, X x) { return x[0] * x[2] + x[1] * x[3]; };
  for (const auto& [kind, h] : {std::pair{StepControl::fixed, 0.02},
                                {StepControl::time_transformed, 0.2},
                                {StepControl::reversible, 0.2}}) {
    EventStepper run(kepler,
                     [&, kind = kind, h = h] {
                       return make_controlled(kind, "gauss16", kepler, h, {.scale = scale});
                     },
                     {{radial, Crossing::rising}, {radial, Crossing::falling}});
    phs::State s(kepler.description(), test::kepler_start(0.7));
    double worst = 0, radius = 0;
    int trials = 0;
    for (int k = 1; k <= 200; ++k) {
      const EventResult r = run.run_to(s, 1e9);
      ASSERT_EQ(r.event, k % 2 ? 1 : 0) << "apocentre first, then pericentre";
      worst = std::max(worst, std::fabs(run.time(s) - k * M_PI));
      radius = std::max(radius, std::fabs(std::hypot(s.x[0], s.x[1]) - (k % 2 ? 1.7 : 0.3)));
      trials += r.trials;
    }
    std::printf(
        "  %-16s 200 apsides: times off by %.1e of 628   bound 3e-11, radii by %.1e   bound 1e-13, "
        "%.1f trials each\n",
        to_string(kind), worst, radius, trials / 200.0);
    EXPECT_LE(worst, 3e-11);
    EXPECT_LE(radius, 1e-13);
  }
}

// The state handed back may be changed: a ball that bounces, in a field that is not a polynomial.
struct Ball {  // H = p²/2 + log cosh(y) + y
  phs::Description description() const {
    phs::Description d;
    d.name = "ball";
    d.nx = 2;
    d.blocks = {{"height", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] + x[0] + phs::log(T(0.5) * (phs::exp(x[0]) + phs::exp(-x[0])));
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(1.0) + phs::tanh(x[0]);
    e[1] = x[1];
  }
};

TEST(Event, AThousandBounces) {
  const phs::UserModel<Ball> ball{Ball{}};
  test::Gauge gauge(ball);
  for (const Crossing direction : {Crossing::falling, Crossing::both}) {
    EventStepper run(ball, [&] { return make_integrator("gauss16", ball, 0.3); },
                     {{[](double, X x) { return x[0]; }, direction}});
    phs::State s(ball.description(), {1, 0});
    const long double H0 = gauge.energy(s);
    double first = 0, worst = 0, period = 0;
    for (int k = 0; k < 1000; ++k) {
      const EventResult r = run.run_to(s, 1e9);
      ASSERT_EQ(r.event, 0);
      ASSERT_FALSE(r.rising) << "a bounce is no crossing";
      s.x[1] = -s.x[1];
      s.lo[1] = -s.lo[1];
      worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0) / H0)));
      if (k == 0) first = run.time(s);
      period = (run.time(s) - first) / std::max(1, k);
    }
    std::printf(
        "  1000 bounces: energy %.1e   bound 2e-14, mean period %.15f, twice the first fall "
        "%.15f\n",
        worst, period, 2 * first);
    EXPECT_LE(worst, 2e-14);
    EXPECT_NEAR(period, 2 * first, 1e-13);
  }
}

// Several crossings in one step are told apart by the samples; without samples the ends alone are
// seen.
TEST(Event, SeveralCrossingsInAStep) {
  const auto count = [](int samples, double h) {
    auto run = stepper("gauss16", h, {{[](double, X x) { return std::sin(4 * x[0]); }}},
                       {.samples = samples});
    phs::State s(pendulum.description(), {0.1, 3});
    int events = 0;
    double worst = 0;
    while (true) {
      const EventResult r = run.run_to(s, 20);
      EXPECT_EQ(r.outcome, Outcome::ok);
      if (r.event < 0) break;
      ++events;
      worst = std::max(worst, std::fabs(std::sin(4 * s.x[0])));
    }
    EXPECT_EQ(run.time(s), 20);
    EXPECT_LE(worst, 1e-14);
    const double angle = s.x[0] + phs::two_pi_hi * double(s.turns[0]);
    EXPECT_GT(s.turns[0], 5) << "the run must wrap";
    return std::pair(events, int(std::floor(4 * angle / M_PI)));
  };
  const auto [seen, there] = count(4, 0.4);
  const auto [unseen, same] = count(0, 0.4);
  std::printf("  crossings of sin(4 theta) = 0: %d seen of %d; without samples %d\n", seen, there,
              unseen);
  EXPECT_EQ(seen, there);
  EXPECT_EQ(same, there);
  EXPECT_LT(unseen, there) << "control: the ends of the steps alone miss some";
}

// A wrap of the angle from π to -π is no crossing of 0.
TEST(Event, WrapsAreNoCrossings) {
  auto run = stepper("gauss8", 0.1, Crossing::both);
  phs::State s(pendulum.description(), {0.1, 3});
  int events = 0;
  while (s.turns[0] < 10) {
    const EventResult r = run.step(s);
    ASSERT_EQ(r.outcome, Outcome::ok);
    if (r.event >= 0) {
      ++events;
      EXPECT_TRUE(r.rising);
      EXPECT_LE(std::fabs(s.x[0]), 1e-15);
    }
  }
  EXPECT_EQ(events, 9) << "the start is past the first, the tenth turn has only begun";
}

TEST(Event, RunToEndsExactlyAndRefusesNonsense) {
  auto run = stepper("gauss8", 0.3, {{[](double, X) { return 1.0; }}});
  phs::State s = at_rest();
  const EventResult r = run.run_to(s, 10);
  EXPECT_EQ(r.event, -1);
  EXPECT_EQ(run.time(s), 10);
  EXPECT_EQ(s.step, 34);
  EXPECT_THROW(stepper("gauss8", 0.3, {{nullptr}}), InvalidArgument);
  EXPECT_THROW(stepper("gauss8", 0.3, {}, {.samples = -1}), InvalidArgument);
}

// --- dense output --------------------------------------------------------------------------------

// Exact at the end; inside, the collocation polynomial has order s + 1 at least over one step (HLW
// 2006, II.1.2 says s + 1 for the local error, so s over a run); measured on steps of a nonlinear
// system against short steps of gauss16.
TEST(DenseOutput, OfGaussHasUniformOrderS) {
  const phs::State start(pendulum.description(), {1.2, 0.7});
  for (int s = 1; s <= 5; ++s) {
    const std::string name = "gauss" + std::to_string(2 * s);
    const auto worst_error = [&](double h) {
      const auto method = make_integrator(name, pendulum, h);
      phs::State after = start;
      EXPECT_EQ(method->step(after), Outcome::ok);
      std::vector<double> x(2);
      EXPECT_TRUE(method->interpolate(after, 1.0, x));
      EXPECT_EQ(x, after.x) << "the end is the state itself";
      EXPECT_TRUE(method->interpolate(after, 0.0, x));
      for (size_t i = 0; i < 2; ++i) EXPECT_NEAR(x[i], start.x[i], 1e-15);
      double worst = 0;
      for (double theta = 0.05; theta < 1; theta += 0.05) {
        method->interpolate(after, theta, x);
        const auto fine = make_integrator("gauss16", pendulum, theta * h);
        phs::State exact = start;
        EXPECT_EQ(fine->step(exact), Outcome::ok);
        for (size_t i = 0; i < 2; ++i) worst = std::max(worst, std::fabs(x[i] - exact.x[i]));
      }
      return worst;
    };
    const double h = 0.2;
    const double coarse = worst_error(h), fine = worst_error(h / 2),
                 order = std::log2(coarse / fine);
    std::printf("  gauss%-2d uniform error over a step %.1e, %.1e: local order %.2f, at least %d\n",
                2 * s, coarse, fine, order, s + 1);
    EXPECT_GT(order, s + 1 - 0.3) << name;
    EXPECT_LT(order, s + 1 + 0.7)
        << name << ": lower than at the ends of steps, which is why no run goes on from it";
  }
}

TEST(DenseOutput, IsSaidToBeAbsentWhereItIs) {
  for (const char* name : {"rk4", "stormer_verlet"}) {
    const auto method = make_integrator(name, pendulum, 0.1);
    phs::State s = at_rest();
    ASSERT_EQ(method->step(s), Outcome::ok);
    std::vector<double> x(2);
    EXPECT_FALSE(method->interpolate(s, 0.5, x)) << name;
  }
}

TEST(Event, WholeStepsStayWhereTheyWereOnTheGrid) {
  const double h = 0.2, T = double(pendulum_period());
  auto run = stepper("gauss16", h, {{zero_crossing}}, {.to_grid = true});
  phs::State s = at_rest(), plain = at_rest();
  const auto method = make_integrator("gauss16", pendulum, h);
  int events = 0;
  double worst = 0, late = 0;
  for (int k = 1; k <= 200; ++k) {
    ASSERT_EQ(method->step(plain), Outcome::ok);
    do {
      const EventResult r = run.step(s);
      ASSERT_EQ(r.outcome, Outcome::ok);
      if (r.event >= 0) late = std::max(late, std::fabs(run.time(s) - (0.25 + 0.5 * events++) * T));
    } while (s.origin_step != 0);
    ASSERT_EQ(s.step, k);
    ASSERT_EQ(run.time(s), method->time(plain)) << "to the bit";
    worst = std::max({worst, std::fabs(s.x[0] - plain.x[0]), std::fabs(s.x[1] - plain.x[1])});
  }
  std::printf("  %d events, off by %.1e s   bound 5e-13; whole steps off by %.1e   bound 1e-12\n",
              events, late, worst);
  EXPECT_EQ(events, 8);
  EXPECT_LE(late, 5e-13);
  EXPECT_LE(worst, 1e-12);
}

TEST(Event, AnglesWithAllTheirTurns) {
  const auto g = [](double, X x) { return x[0] - 20; };  // three turns and more
  for (const bool all : {false, true}) {
    auto run = stepper("gauss16", 0.1, {{g, Crossing::rising}}, {.all_turns = all});
    phs::State s(pendulum.description(), {0, 3});
    const EventResult r = run.run_to(s, 30);
    EXPECT_EQ(r.event, all ? 0 : -1);
    if (all) {
      EXPECT_NEAR(s.x[0] + phs::two_pi_hi * double(s.turns[0]), 20, 1e-14);
    }
  }
}

// An event that g must exceed: at the instant at which it does, from wherever it comes.
TEST(Event, WhatMustBeExceededIsNotMetByBeingReached) {
  struct Case {
    const char* what;
    double (*g)(double);
    double at;  // of the event, -1: none
  };
  const Case cases[] = {
      {"passes", [](double t) { return t - 1.03; }, 1.03},
      {"rests, then leaves", [](double t) { return t < 1.03 ? t - 1.03 : std::max(0.0, t - 2.47); },
       2.47},
      {"rests within a step",
       [](double t) { return t < 1.03 ? t - 1.03 : std::max(0.0, t - 1.07); }, 1.07},
      {"rests", [](double t) { return std::min(0.0, t - 1.03); }, -1},
      {"touches", [](double t) { return -std::fabs(t - 1); }, -1},
      {"starts there and leaves", [](double t) { return t; }, 0},
      {"starts there, leaves slowly", [](double t) { return t * t * t; }, 0},
      {"starts there, rests", [](double t) { return std::max(0.0, t - 1.03); }, 1.03},
      {"starts there and falls", [](double t) { return -t; }, -1},
      {"jumps", [](double t) { return t < 1.03 ? -0.2 : 0.5; }, 1.03},
      {"jumps from it", [](double t) { return t < 1.03 ? 0 : 0.5; }, 1.03},
      {"jumps at the end of a step", [](double t) { return t < 1 ? -0.2 : 0.5; }, 1}};
  for (const Case& c : cases) {
    const auto g = [&c](double t, X) { return c.g(t); };
    auto run = stepper("gauss8", 0.1, {{g, Crossing::rising, 0.0}}, {.samples = 1});
    phs::State s = at_rest();
    const EventResult r = run.run_to(s, 3);
    EXPECT_EQ(r.event, c.at < 0 ? -1 : 0) << c.what;
    const double off = std::fabs(run.time(s) - (c.at < 0 ? 3 : c.at));
    std::printf("  %s: off by %.1e s   bound 1e-13, %d trials\n", c.what, off, r.trials);
    EXPECT_LE(off, 1e-13) << c.what;
    EXPECT_GT(run.time(s), 0);
    if (std::string(c.what).starts_with("jumps")) {
      EXPECT_GT(r.g, 0) << c.what;
    }
  }
  // Control: reaching it is an event where it counts, and a start there hides what follows.
  const auto reached = [](double t, X) { return std::min(0.0, t - 1); };
  phs::State s = at_rest();
  EXPECT_EQ(stepper("gauss8", 0.1, {{reached, Crossing::rising}}).run_to(s, 3).event, 0);
  s = at_rest();
  const auto leaves = [](double t, X) { return t; };
  EXPECT_EQ(stepper("gauss8", 0.1, {{leaves, Crossing::rising}}).run_to(s, 3).event, -1);
  EXPECT_THROW(stepper("gauss8", 0.1, {{leaves, Crossing::both, 0.0}}), InvalidArgument);
  EXPECT_THROW(stepper("gauss8", 0.1, {{leaves, Crossing::rising, -1.0}}), InvalidArgument);
}

}  // namespace
}  // namespace porthos::integrators::event_test
