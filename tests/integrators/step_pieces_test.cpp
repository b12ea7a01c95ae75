// Derivatives of runs whose steps are not one Gauss step: of Störmer-Verlet, Lobatto pairs, HBVM,
// compositions, and with a last step of another size. Against 113 bits, and tangents against
// adjoints.
#include "integrators/derivatives/step_pieces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/tangent_run.h"
#include "tests/integrators/end_and_steps.h"

namespace porthos::integrators::step_pieces_test {
namespace {

using namespace end_and_steps;
using test::Problem;

/// Control: the midpoint rule at that step, whose run is another one.
TEST(StepPieces, HaveTheSlopesOf113Bits) {
  for (const auto& [p, method, steps] : {std::tuple{test::double_pendulum(), "yoshida4", 20},
                                         {test::double_pendulum(), "kahan_li8", 10},
                                         {test::floating_arm(), "suzuki4", 3},
                                         {test::floating_arm(), "kahan_li6", 2},
                                         {test::double_pendulum(), "lobatto6", 20},
                                         {henon_heiles(), "lobatto4", 20},
                                         {test::double_pendulum(), "hbvm4", 20},
                                         {test::floating_arm(), "hbvm6", 3},
                                         {test::double_pendulum(), "stormer_verlet", 20},
                                         {henon_heiles(), "stormer_verlet", 20},
                                         {henon_heiles(), "kahan_li8_sv", 4},
                                         {test::floating_arm(), "stormer_verlet", 10},
                                         {test::floating_arm(), "yoshida4_sv", 3},
                                         {test::double_pendulum(), "rk4", 20},
                                         {test::floating_arm(), "rk4", 10},
                                         {test::floating_arm(), "radau15", 3}}) {
    const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    const double mine = off(r, p, method, steps, 0);
    const auto other = gradient_of_run("midpoint", *p.model, p.start, p.h, steps, objective());
    double apart = 0, size = 0;
    for (size_t i = 0; i < other.start.size(); ++i) {
      apart += std::fabs(other.start[i] - r.start[i]);
      size += std::fabs(r.start[i]);
    }
    std::printf(
        "  %-15s %-14s off by %.1e of the moduli (bound 1e-13); of the midpoint rule %.1e\n",
        p.name.c_str(), method, mine, apart / size);
    EXPECT_LT(mine, 1e-13);
    EXPECT_GT(apart / size, 1e-6);
  }
}

/// ∂J/∂T, all steps longer alike. Control: the slope of the exact flow at the end, ∂J/∂x f(x),
/// which the sampled cost does not know.
TEST(StepPieces, TheDurationHasTheSlopeOf113Bits) {
  for (const auto& [p, method, steps, last] :
       {std::tuple{test::double_pendulum(), "gauss8", 20, 0.3},
        {test::floating_arm(), "gauss16", 3, 0},
        {test::floating_arm(), "kahan_li6", 2, 0},
        {henon_heiles(), "lobatto4", 20, 0},
        {test::double_pendulum(), "stormer_verlet", 20, 0},
        {test::floating_arm(), "stormer_verlet", 10, 0},
        {test::floating_arm(), "yoshida4_sv", 3, 0.4},
        {test::floating_arm(), "rk4", 10, 0.4},
        {test::floating_arm(), "radau15", 3, 0.4}}) {
    const auto r =
        gradient_of_run(method, *p.model, p.start, p.h, steps, objective(), {.last = last * p.h});
    const Quad by = Quad(1e-10);
    const double T = (steps + last) * p.h,
                 expected = double((cost_in_113_bits(p, method, 0, steps, last * p.h, by) -
                                    cost_in_113_bits(p, method, 0, steps, last * p.h, -by)) /
                                   (2 * by)) /
                            T;
    Vec f(p.start.x.size()), g(f.size());
    p.model->instantiate<double>()->field(0, r.end.x, {}, f);
    test::add_quadratic_gradient(r.end.x, 1, g);
    double moduli = 0, flow = 0;
    for (size_t k = 0; k < f.size(); ++k) {
      moduli += std::fabs(g[k] * f[k]);
      flow += g[k] * f[k];
    }
    std::printf(
        "  %-15s %-14s dJ/dT = %.6g, off by %.1e of the moduli (bound 1e-13); of the flow %.1e\n",
        p.name.c_str(), method, r.duration, std::fabs(r.duration - expected) / moduli,
        std::fabs(flow - expected) / moduli);
    EXPECT_LT(std::fabs(r.duration - expected), 1e-13 * moduli);
    EXPECT_GT(std::fabs(flow - expected), 1e-6 * moduli);
  }
  // ∫ 1 dt
  const Problem p = test::floating_arm();
  const Objective time{.end = {}, .sampled = {}, .running = [](double, auto, auto) { return 1.0; }};
  EXPECT_NEAR(gradient_of_run("gauss8", *p.model, p.start, p.h, 5, time).duration, 1, 1e-15);
  EXPECT_TRUE(std::isnan(gradient_of_run("gauss8", *p.model, p.start, p.h, 0, time).duration));
}

/// A run is one that wraps an angle inside a step; a checkpoint is inside it too.
TEST(StepPieces, TurnsAndCheckpointsAreThoseOfTheRun) {
  for (const char* method : {"kahan_li6", "stormer_verlet", "lobatto8", "rk4"}) {
    Problem p = test::double_pendulum();
    p.start.x = {3.1, 0.1, 6, 1};  // turns over
    p.h /= 4;
    const int steps = 60;
    const auto whole = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    EXPECT_NE(whole.end.turns, p.start.turns);
    EXPECT_LT(off(whole, p, method, steps, 0), 1e-12) << method;
    const auto again =
        gradient_of_run(method, *p.model, p.start, p.h, steps, objective(), {.memory = 8'000});
    EXPECT_GT(again.steps_taken, whole.steps_taken);
    EXPECT_EQ(again.start, whole.start) << method;
    EXPECT_EQ(again.parameters, whole.parameters) << method;
  }
}

/// Controls: a run without it, and a last step of the others' size.
TEST(StepPieces, ALastStepMayHaveAnotherSize) {
  for (const auto& [problem, name] : {std::pair{test::double_pendulum(), "gauss8"},
                                      {test::double_pendulum(), "yoshida4"},
                                      {test::floating_arm(), "gauss16"}}) {
    const Problem& p = problem;
    const char* method = name;
    const int steps = 3;
    const double last = 0.3 * p.h;
    const auto slopes = [&](double size) {
      return gradient_of_run(method, *p.model, p.start, p.h, steps, objective(), {.last = size});
    };
    const double mine = off(slopes(last), p, method, steps, last);
    std::printf("  %-15s %-10s off by %.1e of the moduli, bound 1e-13\n", p.name.c_str(), method,
                mine);
    EXPECT_LT(mine, 1e-13);
    const auto r = slopes(last);
    for (const double other : {0.0, p.h}) {
      double apart = 0, size = 0;
      for (size_t i = 0; i < r.start.size(); ++i) {
        apart += std::fabs(slopes(other).start[i] - r.start[i]);
        size += std::fabs(r.start[i]);
      }
      EXPECT_GT(apart / size, 1e-4) << other;
    }
    const auto in_parts = gradient_of_run(method, *p.model, p.start, p.h, steps, objective(),
                                          {.memory = 100, .last = last});
    EXPECT_EQ(in_parts.start, r.start) << "from checkpoints";
  }
}

/// The integral of a running cost, by differences of the cost itself.
TEST(StepPieces, RunningCostsHaveTheWeightsOfThePieces) {
  const Problem p = test::double_pendulum();
  const int steps = 20;
  for (const auto& [name, error] :
       {std::pair{"kahan_li8", 1e-5}, {"rk4", 1e-2}, {"radau15", 1e-5}}) {
    const char* method = name;
    const Objective o{.end = {}, .sampled = {}, .running = weighted(1)};
    const auto of = [&](double by) {
      auto start = p.start;
      const Vec d = direction(start.x.size());
      for (size_t i = 0; i < d.size(); ++i) start.x[i] += by * d[i];
      return gradient_of_run(method, *p.model, start, p.h, steps, o);
    };
    const auto once = [&](double by) { return (of(by).cost - of(-by).cost) / (2 * by); };
    const double expected = (4 * once(0x1p-11) - once(0x1p-10)) / 3;
    const auto r = of(0);
    const Vec d = direction(r.start.size());
    double mine = 0;
    for (size_t i = 0; i < d.size(); ++i) mine += r.start[i] * d[i];
    const double fine = gradient_of_run("gauss16", *p.model, p.start, p.h, steps, o).cost;
    std::printf(
        "  %-10s slope %.9g, differences off by %.1e (bound 1e-8); cost off gauss16's by %.1e\n",
        method, mine, std::fabs(mine / expected - 1), std::fabs(r.cost / fine - 1));
    EXPECT_NEAR(mine, expected, 1e-8 * std::fabs(expected));
    EXPECT_NEAR(r.cost, fine, error * std::fabs(fine));  // to the method's error at this step
  }
}

TEST(StepPieces, TheMonodromyIsTheTransposeOfTheAdjoint) {
  for (const auto& [p, method, steps] : {std::tuple{test::double_pendulum(), "kahan_li8", 30},
                                         {test::double_pendulum(), "lobatto6", 30},
                                         {test::floating_arm(), "stormer_verlet", 10},
                                         {test::floating_arm(), "hbvm4", 2},
                                         {test::floating_arm(), "rk4", 10},
                                         {test::floating_arm(), "radau15", 3}}) {
    const auto m = monodromy(method, *p.model, p.start, p.h, steps);
    ASSERT_EQ(m.outcome, Outcome::ok) << m.remark;
    const size_t n = p.start.x.size();
    double worst = 0, size = 0;
    for (size_t i = 0; i < n; ++i) {
      Objective o;
      o.end = [i](double, std::span<const double> x, std::span<double> g) {
        g[i] = 1;
        return x[i];
      };
      const auto g = gradient_of_run(method, *p.model, p.start, p.h, steps, o);
      for (size_t k = 0; k < n; ++k) {
        worst = std::max(worst, std::fabs(m.matrix[i * n + k] - g.start[k]));
        size = std::max(size, std::fabs(m.matrix[i * n + k]));
      }
    }
    std::printf("  %-15s %-14s off by %.1e of the largest, bound 2e-14\n", p.name.c_str(), method,
                worst / size);
    EXPECT_LT(worst, 2e-14 * size);
  }
}

/// A floating body with another on a ball joint, whose mass has its centre at the joint's body
/// frame: at fixed (q, p) its slope is that of the name. Control: without the slope of κ, which the
/// multipliers depend on, it is 1.9e-4 off.
TEST(StepPieces, ParametersOfQuaternionsAreThoseOf113Bits) {
  const auto pair = [](double mass) {
    mechanics::BodySpec base, tip;
    base.name = "base";
    base.parent = "world";
    base.joint.type = "free";
    base.mass = {.mass = 3, .com = {0, 0, 0}, .inertia = {1, 0, 0, 1.5, 0, 2}};
    tip.name = "tip";
    tip.parent = "base";
    tip.joint.type = "spherical";
    tip.placement.r = {0.5, 0.25, 0};
    tip.mass = {.mass = mass, .com = {0, 0, 0}, .inertia = {0.25, 0, 0, 0.5, 0, 0.375}};
    mechanics::MechanismBuilder b("pair");
    b.add(base).add(tip);
    return std::make_shared<mechanics::MechanicalModel>(
        std::make_shared<mechanics::Mechanism>(b.build()));
  };
  Problem p;
  p.model = pair(1);
  const auto& model = static_cast<const mechanics::MechanicalModel&>(*p.model);
  Vec v(size_t(model.mechanism().nv()));
  for (size_t i = 0; i < v.size(); ++i) v[i] = std::sin(1.0 + double(i));
  p.start = phs::State(model.description(), model.state(model.mechanism().neutral(), v));
  p.h = 1. / 32;
  const int steps = 16;
  const auto r = gradient_of_run("stormer_verlet", model, p.start, p.h, steps, objective());
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  const auto at = std::find(r.names.begin(), r.names.end(), "tip.mass");
  ASSERT_NE(at, r.names.end());
  const double mine = r.parameters[size_t(at - r.names.begin())];
  const auto once = [&](double by) {
    Problem up = p, down = p;
    up.model = pair(1 + by);
    down.model = pair(1 - by);
    return (cost_in_113_bits(up, "stormer_verlet", 0, steps, 0) -
            cost_in_113_bits(down, "stormer_verlet", 0, steps, 0)) /
           Quad(2 * by);
  };
  const double expected = double((4 * once(0x1p-14) - once(0x1p-13)) / 3);
  std::printf("  %.15g, off by %.1e   bound 1e-11\n", mine, std::fabs(mine / expected - 1));
  EXPECT_NEAR(mine, expected, 1e-11 * std::fabs(expected));
}

TEST(StepPieces, OtherMethodsAreRefused) {
  const Problem p = test::double_pendulum();
  for (const char* method : {"spark8", "tao4", "kahan_li8_rattle"}) try {
      StepPieces pieces(method, *p.model, p.h);
      ADD_FAILURE() << method;
    } catch (const InvalidArgument& e) {
      EXPECT_EQ(
          e.what(),
          std::string("derivatives of a run are there for Gauss collocation, Lobatto pairs, HBVM, "
                      "discrete gradients, splittings, stormer_verlet, rk4, radau15, "
                      "semi_implicit_euler and compositions (yoshida4 ...), not for '") +
              method + "'");
    }
}

}  // namespace
}  // namespace porthos::integrators::step_pieces_test
