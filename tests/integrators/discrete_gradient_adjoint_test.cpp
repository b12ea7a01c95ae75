// Tangent and adjoint of discrete gradient steps: against 113 bits, by the start and by parameters,
// and against each other.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/derivatives/tangent_run.h"
#include "tests/integrators/end_and_steps.h"
#include "tests/integrators/run_cost.h"

namespace porthos::integrators::discrete_gradient_adjoint_test {
namespace {

using namespace end_and_steps;
using test::Problem;
using Side = StepVariation::Side;

/// With a hard spring, friction of the third power and a torque that depends on time: J, R and
/// sources at the middle.
Problem damped() {
  Problem p = test::double_pendulum();
  p.name = "damped";
  p.model = run_cost::pendulum(1, 1, 1, 1);
  p.h = 1. / 64;
  return p;
}

/// Control: the adjoint of the midpoint rule at the middles of the steps.
TEST(DiscreteGradientAdjoint, HasTheSlopesOf113Bits) {
  for (const auto& [problem, method, steps] : {std::tuple{test::double_pendulum(), "gonzalez", 2},
                                               {test::floating_arm(), "gonzalez", 1},
                                               {damped(), "gonzalez", 2},
                                               {henon_heiles(), "gonzalez", 2},
                                               {test::double_pendulum(), "mean_value", 2},
                                               {test::floating_arm(), "mean_value", 1},
                                               {damped(), "mean_value", 2},
                                               {test::double_pendulum(), "itoh_abe", 4},
                                               {damped(), "itoh_abe", 4},
                                               {test::double_pendulum(), "itoh_abe2", 2},
                                               {henon_heiles(), "itoh_abe2", 2}}) {
    const Problem& p = problem;
    const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    const double mine = off(r, p, method, steps, 0);
    const double apart = apart_from_midpoint(r, p, steps);
    std::printf(
        "  %-15s %-10s off by %.1e of the moduli (bound 1e-13); of the midpoint rule %.1e\n",
        p.name.c_str(), method, mine, apart);
    EXPECT_LT(mine, 1e-13);
    EXPECT_GT(apart, 1e-7);
  }
}

/// Two links with a spring at the second joint.
Problem sprung(double inertia, double stiffness) {
  mechanics::MechanismBuilder b("sprung");
  b.gravity({0, 0, -9.81});
  const char* parent = "world";
  for (const char* name : {"upper", "lower"}) {
    mechanics::BodySpec link;
    link.name = name;
    link.parent = parent;
    link.joint.name = std::string(name) + "_joint";
    link.joint.type = "revolute";
    link.joint.axis = {0, 1, 0};
    link.placement.r = {0, 0, parent == std::string("world") ? 0 : -1.0};
    link.mass = {.mass = 1, .com = {0, 0, -0.5}, .inertia = {0.25, 0, 0, 0.25, 0, 0.125}};
    if (parent != std::string("world")) {
      link.joint.stiffness = stiffness;
      link.mass.inertia.yy = inertia;
    }
    b.add(link);
    parent = name;
  }
  Problem p;
  p.name = "sprung";
  p.model = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
  p.start = phs::State(p.model->description(), {0.7, -0.4, 1.1, 0.5});
  p.h = 1. / 16;
  return p;
}

/// By an inertia and a spring. Differences in 113 bits; their
/// error is of the order of the step squared, 1e-18.
/// Control: the slopes of the midpoint rule.
TEST(DiscreteGradientAdjoint, ParametersAreThoseOf113Bits) {
  const Problem p = sprung(0.25, 8);
  const int steps = 1;
  const auto slopes = [&](const char* method) {
    const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
    Vec by;
    for (const char* name : {"lower.inertia.yy", "lower_joint.stiffness"}) {
      const auto at = std::ranges::find(r.names, name);
      EXPECT_NE(at, r.names.end()) << name;
      by.push_back(at == r.names.end() ? NAN : r.parameters[size_t(at - r.names.begin())]);
    }
    return by;
  };
  const Vec midpoint = slopes("midpoint");
  for (const char* method : {"gonzalez", "mean_value", "itoh_abe", "itoh_abe2"}) {
    const Vec mine = slopes(method);
    for (size_t a = 0; a < 2; ++a) {
      const auto cost = [&](double by) {
        return cost_in_113_bits(a == 0 ? sprung(0.25 + by, 8) : sprung(0.25, 8 + by), method, 0,
                                steps, 0);
      };
      const auto once = [&](double by) { return (cost(by) - cost(-by)) / Quad(2 * by); };
      const double expected = double(once(0x1p-30));
      const double off = std::fabs(mine[a] / expected - 1),
                   control = std::fabs(midpoint[a] / expected - 1);
      std::printf("  %-10s %-9s %.10g, off by %.1e (bound 1e-12); of the midpoint rule %.1e\n",
                  method, a == 0 ? "inertia" : "stiffness", mine[a], off, control);
      EXPECT_LT(off, 1e-12);
      EXPECT_GT(control, 1e-5);
    }
  }
  const Problem lossy = damped();
  const auto r = gradient_of_run("gonzalez", *lossy.model, lossy.start, lossy.h, 1, objective());
  EXPECT_TRUE(r.names.empty()) << "not known with losses and sources";
}

/// λ·δ over a step. Control: the adjoint of the midpoint rule at the middles of the steps.
TEST(DiscreteGradientAdjoint, IsTheTransposeOfTheTangent) {
  for (const auto& [p, method] : {std::pair{test::double_pendulum(), "gonzalez"},
                                  {test::floating_arm(), "gonzalez"},
                                  {damped(), "mean_value"},
                                  {damped(), "itoh_abe2"}}) {
    const size_t n = p.start.x.size();
    StepPieces pieces(method, *p.model, p.h);
    const auto tangent = make_step_variation(*p.model, pieces, Side::tangent),
               adjoint = make_step_variation(*p.model, pieces, Side::adjoint),
               midpoint = make_step_variation(*p.model, gauss_table<double>(1), Side::adjoint);
    phs::State state = p.start;
    TwoWords delta(run_cost::random_vector(n, 1));
    double worst = 0, control = 0;
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(pieces.step(state), Outcome::ok);
      const Vec before = delta.x, lambda = run_cost::random_vector(n, unsigned(2 + i));
      tangent->at(pieces[0], state.turns);
      ASSERT_EQ(tangent->advance(delta), Outcome::ok);
      const auto [after, moduli] = run_cost::product(lambda, delta.x);
      const auto off = [&, expected = after, size = moduli](StepVariation& back) {
        TwoWords v(lambda);
        back.at(pieces[0], state.turns);
        EXPECT_EQ(back.advance(v), Outcome::ok);
        return std::fabs(run_cost::product(v.x, before).first - expected) / size;
      };
      worst = std::max(worst, off(*adjoint));
      control = std::max(control, off(*midpoint));
    }
    std::printf(
        "  %-15s %-10s off by %.1e of the moduli (bound 1e-14); of the midpoint rule %.1e\n",
        p.name.c_str(), method, worst, control);
    EXPECT_LT(worst, 1e-14);
    EXPECT_GT(control, 1e-7);
  }
}

/// All steps longer alike, and a running cost at the middles, by differences of the cost itself.
TEST(DiscreteGradientAdjoint, DurationAndRunningCostAreThoseOfDifferences) {
  const Problem p = sprung(0.25, 8);
  const Objective o{.end = weighted(1), .sampled = {}, .running = weighted(1)};
  const int steps = 20;
  for (const char* method : {"gonzalez", "mean_value"}) {
    const auto of = [&](double by, double longer) {
      auto start = p.start;
      const Vec d = direction(start.x.size());
      for (size_t i = 0; i < d.size(); ++i) start.x[i] += by * d[i];
      return gradient_of_run(method, *p.model, start, p.h * (1 + longer), steps, o);
    };
    expect_slopes_of_differences(method, of, steps * p.h, 0x1p-12);
  }
}

/// A run that turns over, taken again from checkpoints; its monodromy matrix.
TEST(DiscreteGradientAdjoint, RunsHaveTurnsCheckpointsAndTangents) {
  Problem p = test::double_pendulum();
  p.start.x = {3.1, 0.1, 6, 1};
  p.h /= 8;
  const int steps = 30;
  const auto r = gradient_of_run("gonzalez", *p.model, p.start, p.h, steps, objective());
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  EXPECT_NE(r.end.turns, p.start.turns);
  const auto again =
      gradient_of_run("gonzalez", *p.model, p.start, p.h, steps, objective(), {.memory = 3'000});
  EXPECT_GT(again.steps_taken, r.steps_taken);
  EXPECT_EQ(again.start, r.start);
  EXPECT_EQ(again.parameters, r.parameters);
  const auto end = gradient_of_run("gonzalez", *p.model, p.start, p.h, steps,
                                   {.end = weighted(1), .sampled = {}, .running = {}});
  const auto m = monodromy("gonzalez", *p.model, p.start, p.h, steps);
  ASSERT_EQ(m.outcome, Outcome::ok) << m.remark;
  const Vec at_end = phs::with_turns(p.model->description(), m.end);
  Vec g(4);
  test::add_quadratic_gradient(at_end, 1, g);
  double worst = 0, size = 0;
  for (size_t k = 0; k < 4; ++k) {
    double sum = 0;
    for (size_t i = 0; i < 4; ++i) sum += g[i] * m.matrix[i * 4 + k];
    worst = std::max(worst, std::fabs(sum - end.start[k]));
    size = std::max(size, std::fabs(sum));
  }
  std::printf("  tangents off the adjoint by %.1e of the largest, bound 2e-14\n", worst / size);
  EXPECT_LT(worst, 2e-14 * size);
  try {
    (void)gradient_of_run("gonzalez", *p.model, p.start, p.h, 1, objective(),
                          {.direction = Vec(4, 1.0)});
    ADD_FAILURE();
  } catch (const InvalidArgument& e) {
    EXPECT_EQ(std::string(e.what()),
              "a direction of second derivatives is not there for 'gonzalez' (discrete gradients, "
              "splittings, Stormer-Verlet with quaternions), expected Gauss collocation");
  }
}

}  // namespace
}  // namespace porthos::integrators::discrete_gradient_adjoint_test
