// Derivatives of runs of splittings, whose steps are differentiated as a whole in duals, and of
// the semi-implicit Euler method. By its parameters: runge_kutta_adjoint_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/derivatives/tangent_run.h"
#include "tests/integrators/end_and_steps.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/split_systems.h"

namespace porthos::integrators::dual_step_adjoint_test {
namespace {

using namespace end_and_steps;
using test::Problem;
using Side = StepVariation::Side;

Problem free_body() { return test::user_problem(test::FreeBody{}, {0.3, 1.1, -0.4}, 0.1); }
/// It turns over.
Problem rotor(bool driven) { return test::user_problem(test::Rotor{driven}, {3.0, 1.5}, 0.1); }
Problem damped() {
  Problem p = test::double_pendulum();
  p.name = "damped";
  p.model = run_cost::pendulum(1, 1, 1, 1);
  p.h = 1. / 64;
  return p;
}

/// Control: the slopes of the midpoint rule.
TEST(DualStepAdjoint, HasTheSlopesOf113Bits) {
  for (const auto& [problem, method, steps] : {std::tuple{henon_heiles(), "lie_trotter", 20},
                                               {henon_heiles(), "strang", 20},
                                               {henon_heiles(), "blanes_moan6", 10},
                                               {free_body(), "strang", 20},
                                               {free_body(), "mclachlan4_splitting", 10},
                                               {rotor(true), "blanes_moan4", 20},
                                               {test::double_pendulum(), "semi_implicit_euler", 20},
                                               {damped(), "semi_implicit_euler", 20},
                                               {test::floating_arm(), "semi_implicit_euler", 5}}) {
    const Problem& p = problem;
    const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    const double mine = off(r, p, method, steps, 0);
    const double apart = apart_from_midpoint(r, p, steps);
    std::printf(
        "  %-15s %-20s off by %.1e of the moduli (bound 1e-13); of the midpoint rule %.1e\n",
        p.name.c_str(), method, mine, apart);
    EXPECT_LT(mine, 1e-13);
    EXPECT_GT(apart, 1e-5);
  }
}

/// λ·δ over a step. Control: the tangent's matrix in the place of its transpose.
TEST(DualStepAdjoint, IsTheTransposeOfTheTangent) {
  for (const auto& [problem, method] : {std::pair{free_body(), "blanes_moan4"},
                                        {rotor(true), "strang"},
                                        {test::floating_arm(), "semi_implicit_euler"}}) {
    const Problem& p = problem;
    StepPieces pieces(method, *p.model, p.h);
    const auto tangent = make_step_variation(*p.model, pieces, Side::tangent),
               adjoint = make_step_variation(*p.model, pieces, Side::adjoint);
    phs::State state = p.start;
    const Vec before = run_cost::random_vector(p.start.x.size(), 1),
              lambda = run_cost::random_vector(p.start.x.size(), 2);
    ASSERT_EQ(pieces.step(state), Outcome::ok);
    const auto carried = [&](StepVariation& by, const Vec& from) {
      TwoWords v(from);
      by.at(pieces[0], state.turns);
      EXPECT_EQ(by.advance(v), Outcome::ok);
      return v.x;
    };
    const auto [at_end, moduli] = run_cost::product(lambda, carried(*tangent, before));
    const double mine = run_cost::product(carried(*adjoint, lambda), before).first,
                 control = run_cost::product(carried(*tangent, lambda), before).first;
    std::printf("  %-15s %-20s off by %.1e of the moduli (bound 1e-14); not transposed %.1e\n",
                p.name.c_str(), method, std::fabs(mine - at_end) / moduli,
                std::fabs(control - at_end) / moduli);
    EXPECT_LT(std::fabs(mine - at_end), 1e-14 * moduli);
    EXPECT_GT(std::fabs(control - at_end), 1e-4 * moduli);
  }
}

/// All steps longer alike, and a running cost by the trapezoidal rule, by differences of the cost
/// itself; from checkpoints, over a turn.
TEST(DualStepAdjoint, RunsHaveDurationsRunningCostsAndTurns) {
  const Objective o{.end = weighted(1), .sampled = {}, .running = weighted(1)};
  const int steps = 40;
  for (const auto& [problem, name] : {std::pair{rotor(false), "strang"},
                                      {free_body(), "lie_trotter"},
                                      {test::double_pendulum(), "semi_implicit_euler"}}) {
    const Problem& p = problem;
    const char* method = name;
    const auto of = [&](double by, double longer, size_t memory = 1'000'000) {
      auto start = p.start;
      const Vec d = direction(start.x.size());
      for (size_t i = 0; i < d.size(); ++i) start.x[i] += by * d[i];
      return gradient_of_run(method, *p.model, start, p.h * (1 + longer), steps, o,
                             {.memory = memory});
    };
    expect_slopes_of_differences(method, of, steps * p.h, 0x1p-16);
    const auto r = of(0, 0);
    const auto again = of(0, 0, 2'000);
    EXPECT_GT(again.steps_taken, r.steps_taken);
    EXPECT_EQ(again.start, r.start);
  }
  const Problem turning = rotor(false);
  EXPECT_NE(gradient_of_run("strang", *turning.model, turning.start, 0.1, steps, o).end.turns,
            turning.start.turns);
}

/// The exponents of a symplectic step add up to zero.
TEST(DualStepAdjoint, LyapunovExponentsOfHenonAndHeilesAddUpToZero) {
  const Problem p = henon_heiles();
  const auto s = lyapunov_spectrum("strang", *p.model, p.start, p.h, 1000, {.every = 4});
  ASSERT_EQ(s.outcome, Outcome::ok) << s.remark;
  const double sum = s.exponents[0] + s.exponents[1] + s.exponents[2] + s.exponents[3];
  const auto other =
      lyapunov_spectrum("semi_implicit_euler", *damped().model, damped().start, damped().h, 1000);
  double of_damped = 0;
  for (const double e : other.exponents) of_damped += e;
  std::printf("  sum %.1e, bound 1e-13; with damping %.2g\n", sum, of_damped);
  EXPECT_LT(std::fabs(sum), 1e-13);
  EXPECT_LT(of_damped, -1e-3);
}

}  // namespace
}  // namespace porthos::integrators::dual_step_adjoint_test
