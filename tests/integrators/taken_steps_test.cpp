// Gradients of runs under a step control, whose steps are kept: against 113 bits at the same steps,
// and against runs that choose their steps anew.
#include "integrators/control/taken_steps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "integrators/control/step_control.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/kepler.h"

namespace porthos::integrators::taken_steps_test {
namespace {

using phs::Quad;
using test::Problem;
using Vec = std::vector<double>;

constexpr auto reversible = StepControl::reversible,
               time_transformed = StepControl::time_transformed;

/// On an ellipse of eccentricity 0.6, where steps differ by a factor of four.
Problem kepler() { return test::user_problem(test::Kepler{}, test::kepler_start(0.6), 0.25); }

/// The run of a problem to its time `end`, with steps that shrink from moderate rates on.
TakenSteps taken(const Problem& p, const std::string& method, double end,
                 StepControl control = reversible, double h = 0) {
  ControlOptions options{.rate = 2};
  if (p.name == "kepler")
    options = {.scale = std::make_shared<phs::UserTimeScale<test::PowerOfRadius<2>>>(
                   test::PowerOfRadius<2>{})};
  const double step = h == 0 ? p.h : h;
  auto r = taken_steps(
      *p.model, [&] { return make_controlled(control, method, *p.model, step, options); }, p.start,
      end);
  EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
  return r;
}

Objective end_and_steps() {
  const auto weighted = [](double weight) {
    return [weight](double, std::span<const double> x, std::span<double> g) {
      test::add_quadratic_gradient(x, weight, g);
      return weight * test::quadratic(x);
    };
  };
  return {.end = weighted(1), .sampled = weighted(0.125), .running = {}};
}

RunGradient gradient(const Problem& p, const std::string& method, const TakenSteps& run,
                     size_t memory = size_t(64) << 20) {
  auto r = gradient_of_run(method, *p.model, p.start, p.h, std::int64_t(run.steps.size()),
                           end_and_steps(), {.memory = memory, .taken = run.steps});
  EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
  return r;
}

/// The cost at these steps in 113 bits.
Quad cost(const phs::Model& model, const std::string& method, std::vector<Quad> x, double h,
          std::span<const TakenStep> steps) {
  const auto integrator = make_basic_integrator<Quad>(method, model, Quad(h));
  phs::BasicState<Quad> state(model.description(), x);
  Quad sum = 0;
  for (const TakenStep& step : steps) {
    EXPECT_EQ(integrator->step_by(state, Quad(step.size)), Outcome::ok);
    for (size_t k = 0; k < x.size(); ++k) x[k] = state.x[k] + state.lo[k];
    sum += test::quadratic<Quad>(x) / 8;
  }
  return sum + test::quadratic<Quad>(x);
}

/// The start moved by a part of a direction.
std::vector<Quad> moved(const Problem& p, const Vec& along, Quad by) {
  std::vector<Quad> x(along.size());
  for (size_t i = 0; i < x.size(); ++i) x[i] = Quad(p.start.x[i]) + by * Quad(along[i]);
  return x;
}
double slope(const Problem& p, const std::string& method, const Vec& along,
             std::span<const TakenStep> steps) {
  const Quad by = Quad(1e-10);
  return double((cost(*p.model, method, moved(p, along, by), p.h, steps) -
                 cost(*p.model, method, moved(p, along, -by), p.h, steps)) /
                (2 * by));
}

TEST(TakenSteps, AReversibleRunKeepsItsBits) {
  for (const auto& [p, method, end] : {std::tuple{kepler(), "gauss8", 12.0},
                                       {test::double_pendulum(), "gauss16", 5.0},
                                       {test::double_pendulum(), "kahan_li6", 5.0},
                                       {test::floating_arm(), "gauss12", 5.0},
                                       {test::floating_arm(), "stormer_verlet", 3.0}}) {
    const TakenSteps run = taken(p, method, end);
    const auto [least, most] = std::ranges::minmax_element(run.steps, {}, &TakenStep::size);
    std::printf("  %-15s %-14s %zu steps of %.3g to %.3g s\n", p.name.c_str(), method,
                run.steps.size(), least->size, most->size);
    EXPECT_GT(most->size, 1.05 * least->size);
    EXPECT_EQ(run.end.origin, end);
    EXPECT_EQ(gradient(p, method, run).end, run.end);
    auto other = run;  // control
    other.steps[1].size *= 1 + 1e-12;
    EXPECT_NE(gradient(p, method, other).end.x, run.end.x);
  }
}

/// The plain method at the steps of a run in another time: its end is off by the method's error.
TEST(TakenSteps, OfATransformedTimeAreThePlainMethods) {
  const Problem p = kepler();
  const double h = p.h / 2;
  double before = 0;
  for (const double step : {h, h / 2}) {
    const TakenSteps run = taken(p, "gauss4", 6, time_transformed, step);
    const auto r = gradient(p, "gauss4", run);
    const double off = std::fabs(r.end.x[0] - run.end.x[0]);
    std::printf("  gauss4, h = %.3g: the end is off by %.1e\n", step, off);
    EXPECT_GT(off, 1e-9);
    if (before > 0) {
      EXPECT_NEAR(std::log2(before / off), 4, 0.7);
    }
    before = off;
    EXPECT_EQ(r.end.origin, run.end.origin);
  }
}

/// Control: as many steps of one size, whose run is another one.
TEST(TakenSteps, HaveTheSlopesOf113Bits) {
  for (const auto& [p, method, control, end] :
       {std::tuple{kepler(), "gauss8", reversible, 6.0},
        {kepler(), "stormer_verlet", reversible, 6.0},
        {kepler(), "gauss6", time_transformed, 6.0},
        {test::double_pendulum(), "gauss16", reversible, 2.0},
        {test::double_pendulum(), "yoshida4", reversible, 2.0},
        {test::floating_arm(), "gauss8", reversible, 1.0},
        {test::floating_arm(), "stormer_verlet", reversible, 1.0}}) {
    const TakenSteps run = taken(p, method, end, control);
    const Vec along = run_cost::random_vector(p.start.x.size(), 3);
    const double expected = slope(p, method, along, run.steps);
    const auto r = gradient(p, method, run);
    const auto [mine, moduli] = run_cost::product(r.start, along);
    const auto equal = gradient_of_run(method, *p.model, p.start, end / double(run.steps.size()),
                                       std::int64_t(run.steps.size()), end_and_steps());
    const double other = run_cost::product(equal.start, along).first;
    std::printf(
        "  %-15s %-14s %3zu steps, off by %.1e of the moduli (bound 1e-13); of one size "
        "%.1e\n",
        p.name.c_str(), method, run.steps.size(), std::fabs(mine - expected) / moduli,
        std::fabs(other - expected) / moduli);
    EXPECT_LT(std::fabs(mine - expected), 1e-13 * moduli);
    EXPECT_GT(std::fabs(other - expected), 1e-6 * moduli);
  }
}

TEST(TakenSteps, HaveTheSlopesByParameters) {
  const auto model = [](double mass, double spring) {
    return run_cost::pendulum(mass, spring, 1, 1);
  };
  Problem p = test::double_pendulum();
  p.model = model(1, 1);
  const TakenSteps run = taken(p, "gauss12", 1.5);
  const auto r = gradient(p, "gauss12", run);
  EXPECT_EQ(r.end, run.end);  // a field that depends on the time
  const auto number = [&](const std::string& name) {
    return r.parameters[size_t(std::ranges::find(r.names, name) - r.names.begin())];
  };
  const auto difference = [&](auto model_of) {
    const auto at = [&](double f) {
      return cost(*model_of(f), "gauss12", moved(p, Vec(4), 0), p.h, run.steps);
    };
    const auto once = [&](double by) { return (at(1 + by) - at(1 - by)) / Quad(2 * by); };
    return double((4 * once(0x1p-13) - once(0x1p-12)) / 3);
  };
  const double spring = difference([&](double f) { return model(1, f); }),
               mass = difference([&](double f) { return model(f, 1); });
  // With the centre half a metre along -y and the inertia about it kept.
  const double by_mass = number("link0.mass") - 0.5 * number("link0.moment.y") +
                         0.25 * (number("link0.inertia.xx") + number("link0.inertia.zz"));
  EXPECT_NEAR(number("hard.factor"), spring, 1e-11 * std::fabs(spring));
  EXPECT_NEAR(by_mass, mass, 1e-11 * std::fabs(mass));
}

/// What the change of the steps adds is of the order of the method's error.
TEST(TakenSteps, TheirOwnChangeIsOfTheOrderOfTheError) {
  const Problem p = kepler();
  const Vec along{0.3, -0.2, 0.5, 0.4};
  const auto end_cost = [](const phs::State& s) { return test::quadratic<double>(s.x); };
  const auto apart = [&](double h) {
    const auto anew = [&](double by) {
      Problem q = p;
      for (size_t i = 0; i < along.size(); ++i) q.start.x[i] += by * along[i];
      return end_cost(taken(q, "gauss4", 4, reversible, h).end);
    };
    const double by = 1e-4,
                 whole = (8 * (anew(by) - anew(-by)) - (anew(2 * by) - anew(-2 * by))) / (12 * by);
    auto objective = end_and_steps();
    objective.sampled = {};
    const TakenSteps run = taken(p, "gauss4", 4, reversible, h);
    const auto r = gradient_of_run("gauss4", *p.model, p.start, h, std::int64_t(run.steps.size()),
                                   objective, {.taken = run.steps});
    return std::fabs(run_cost::product(r.start, along).first - whole);
  };
  const double coarse = apart(p.h / 4), fine = apart(p.h / 8);
  std::printf("  gauss4: without it the slope is off by %.1e, at half the step %.1e\n", coarse,
              fine);
  EXPECT_GT(coarse, 1e-6);
  EXPECT_NEAR(std::log2(coarse / fine), 4, 1);
}

TEST(TakenSteps, CheckpointsChangeNoBit) {
  const Problem p = test::floating_arm();
  const TakenSteps run = taken(p, "gauss8", 30);
  const auto whole = gradient(p, "gauss8", run);
  for (const size_t memory : {size_t(200000), size_t(20000)}) {
    const auto r = gradient(p, "gauss8", run, memory);
    EXPECT_GT(r.steps_taken, whole.steps_taken);
    EXPECT_EQ(r.start, whole.start);
    EXPECT_EQ(r.parameters, whole.parameters);
    EXPECT_EQ(r.end, run.end);
  }
}

TEST(TakenSteps, AreRefusedWhereTheyDoNotFit) {
  const Problem p = kepler();
  const auto words = [](auto&& f) {
    try {
      f();
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto plain = [&] { return make_integrator("gauss8", *p.model, p.h); };
  EXPECT_EQ(words([&] { (void)taken_steps(*p.model, plain, p.start, 1); }),
            "method 'gauss8' has no step control, expected make_controlled()");
  const TakenSteps run = taken(p, "gauss8", 1);
  const auto with = [&](std::int64_t steps, double last) {
    return words([&] {
      (void)gradient_of_run("gauss8", *p.model, p.start, p.h, steps, end_and_steps(),
                            {.last = last, .taken = run.steps});
    });
  };
  const auto count = std::int64_t(run.steps.size());
  EXPECT_NE(with(count + 1, 0).find("expected their number"), std::string::npos);
  EXPECT_NE(with(count, 0.1).find("no last step besides"), std::string::npos);
}

}  // namespace
}  // namespace porthos::integrators::taken_steps_test
