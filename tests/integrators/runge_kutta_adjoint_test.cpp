// Tangent and adjoint of Runge-Kutta steps that are no Gauss steps, through StepPieces: against
// each other, and by parameters against 113 bits. Their slopes by the start: step_pieces_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/derivatives/step_variation.h"
#include "tests/integrators/end_and_steps.h"
#include "tests/integrators/run_cost.h"

namespace porthos::integrators::runge_kutta_adjoint_test {
namespace {

using run_cost::product, run_cost::random_vector;
using test::Problem;
using Side = StepVariation::Side;
using Vec = std::vector<double>;

/// The largest |λ_n·δ_n - λ_N·δ_N|, of the moduli.
double off_constant(const Problem& p, const std::string& method, int steps,
                    const std::function<void(CollocationTable<double>&)>& change = {}) {
  const size_t n = p.start.x.size();
  StepPieces pieces(method, *p.model, p.h);
  auto of_adjoint = pieces.table();
  if (change) change(of_adjoint);
  const auto tangent = make_step_variation(*p.model, pieces, Side::tangent);
  const auto adjoint = make_step_variation(*p.model, of_adjoint, Side::adjoint);
  TwoWords delta(random_vector(n, 1)), lambda(random_vector(n, 2));
  std::vector<Vec> numbers, deltas{delta.x};
  std::vector<std::vector<std::int64_t>> turns;
  phs::State state = p.start;
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(pieces.step(state), Outcome::ok);
    for (size_t k = 0; k < pieces.count(); ++k) {
      tangent->at(pieces[k], state.turns);
      EXPECT_EQ(tangent->advance(delta), Outcome::ok);
      const size_t size = pieces.numbers().size() / pieces.count();
      const auto piece = pieces.numbers().subspan(k * size, size);
      numbers.emplace_back(piece.begin(), piece.end());
      turns.push_back(state.turns);
      deltas.push_back(delta.x);
    }
  }
  const double at_end = product(lambda.x, delta.x).first;
  double worst = 0;
  for (size_t i = numbers.size(); i-- > 0;) {
    adjoint->at(pieces.at(numbers[i], 0), turns[i]);
    EXPECT_EQ(adjoint->advance(lambda), Outcome::ok);
    const auto [now, moduli] = product(lambda.x, deltas[i]);
    worst = std::max(worst, std::fabs(now - at_end) / moduli);
  }
  return worst;
}

/// Controls: a_ij divided by the weight of its row instead of its column, and equal weights.
TEST(RungeKuttaAdjoint, IsTheTransposeOfTheTangent) {
  for (const auto& [problem, method] : {std::pair{test::double_pendulum(), "rk4"},
                                        {test::floating_arm(), "rk4"},
                                        {test::double_pendulum(), "radau15"},
                                        {test::floating_arm(), "radau15"}}) {
    const int steps = 20;
    const double mine = off_constant(problem, method, steps);
    const double by_row = off_constant(problem, method, steps, [](CollocationTable<double>& t) {
      const auto n = size_t(t.s);
      for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j < n; ++j) t.mu[i * n + j] *= t.b[j] / t.b[i];
    });
    const double weights = off_constant(problem, method, steps, [](CollocationTable<double>& t) {
      t.b.assign(t.b.size(), 1 / double(t.s));
    });
    std::printf(
        "  %-15s %-8s off by %.1e of the moduli (bound 1e-14); with a_ij by b_i %.1e, with equal "
        "weights %.1e\n",
        problem.name.c_str(), method, mine, by_row, weights);
    EXPECT_LT(mine, 1e-14);
    EXPECT_GT(by_row, 1e-4);
    EXPECT_GT(weights, 1e-4);
  }
}

/// By a mass, a spring, friction and a torque that depends on time. Differences in 113 bits with
/// Richardson's extrapolation: their error
/// is of the order of the step to the fourth, 1e-22.
/// Control: another method, whose slope is off by the error of one
/// of them.
TEST(RungeKuttaAdjoint, ParametersAreThoseOf113Bits) {
  const int steps = 20;
  const auto problem = [](const Vec& z) {
    Problem p = test::double_pendulum();
    p.h = 1. / 64;
    p.model = run_cost::pendulum(z[0], z[1], z[2], z[3]);
    return p;
  };
  const Problem p = problem({1, 1, 1, 1});
  const auto slopes = [&](const char* method) {
    const auto r =
        gradient_of_run(method, *p.model, p.start, p.h, steps, end_and_steps::objective());
    EXPECT_EQ(r.outcome, Outcome::ok) << r.remark;
    const auto by = [&](const std::string& name) {
      const auto at = std::ranges::find(r.names, name);
      EXPECT_NE(at, r.names.end()) << name;
      return r.parameters[size_t(at - r.names.begin())];
    };
    // the mass with its centre kept, half a metre along -y, and the inertia about it
    const double mass = by("link0.mass") - 0.5 * by("link0.moment.y") +
                        0.25 * (by("link0.inertia.xx") + by("link0.inertia.zz"));
    return Vec{mass, by("hard.factor"), by("dry.factor"), by("push.factor")};
  };
  for (const auto& [name, other] :
       {std::pair{"rk4", "gauss16"}, {"radau15", "rk4"}, {"semi_implicit_euler", "rk4"}}) {
    const char* method = name;
    const Vec mine = slopes(method), others = slopes(other);
    for (size_t a = 0; a < 4; ++a) {
      const auto once = [&](double by) {
        Vec up(4, 1.0), down(up);
        up[a] += by;
        down[a] -= by;
        return (end_and_steps::cost_in_113_bits(problem(up), method, 0, steps, 0) -
                end_and_steps::cost_in_113_bits(problem(down), method, 0, steps, 0)) /
               phs::Quad(2 * by);
      };
      const double expected = double((4 * once(0x1p-19) - once(0x1p-18)) / 3);
      const double off = std::fabs(mine[a] / expected - 1),
                   control = std::fabs(others[a] / expected - 1);
      const char* names[] = {"mass", "hard", "dry", "push"};
      std::printf("  %-8s %-5s %.10g, off by %.1e (bound 1e-12); of %s %.1e\n", method, names[a],
                  mine[a], off, other, control);
      EXPECT_LT(off, 1e-12) << names[a];
      EXPECT_GT(control, 1e-9) << names[a];
    }
  }
}

/// Steps that contain several of radau15, not always as many, in memory and taken again. Control:
/// half as long steps, whose ends count in the cost too.
TEST(RungeKuttaAdjoint, TakesAsManyPiecesAsAStepHas) {
  Problem p = test::double_pendulum();
  p.start.x = {3.1, 0.1, 6, 1};  // turns over
  p.h /= 4;
  const int steps = 20;
  StepPieces pieces("radau15", *p.model, p.h);
  EXPECT_EQ(pieces.count(), 0U) << "not known before a step";
  phs::State state = p.start;
  std::vector<size_t> counts;
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(pieces.step(state), Outcome::ok);
    counts.push_back(pieces.count());
    const StepPiece last = pieces[pieces.count() - 1];
    EXPECT_NEAR(last.t + last.h, (i + 1) * p.h, 1e-15);
  }
  EXPECT_NE(state.turns, p.start.turns);
  const auto [least, most] = std::ranges::minmax(counts);
  const auto objective = end_and_steps::objective();
  const auto r = gradient_of_run("radau15", *p.model, p.start, p.h, steps, objective);
  const double off = end_and_steps::off(r, p, "radau15", steps, 0);
  std::printf("  %zu to %zu pieces in a step: off by %.1e of the moduli, bound 1e-13\n", least,
              most, off);
  EXPECT_LT(least, most);
  EXPECT_LT(off, 1e-13);
  const auto again =
      gradient_of_run("radau15", *p.model, p.start, p.h, steps, objective, {.memory = 20'000});
  EXPECT_GT(again.steps_taken, r.steps_taken);
  EXPECT_EQ(again.start, r.start);
  const auto shorter = gradient_of_run("radau15", *p.model, p.start, p.h / 2, 2 * steps, objective);
  EXPECT_GT(std::fabs(shorter.start[0] / r.start[0] - 1), 1e-3);
}

}  // namespace
}  // namespace porthos::integrators::runge_kutta_adjoint_test
