// Tangent and adjoint of Gauss steps and of runs: against each other, against 113 bits, against
// duals, and with controls that fail.
#include "integrators/derivatives/run_gradient.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "integrators/tables/collocation_table.h"
#include "phs/network/network.h"
#include "phs/system/linearised.h"
#include "tests/integrators/problems.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/energy_run.h"

namespace porthos::integrators::run_gradient_test {
namespace {

using namespace run_cost;
using test::Problem;
using Side = StepVariation::Side;

/// The stages of a run, step by step, from the dense output.
struct Path {
  std::vector<Vec> stages;
  std::vector<std::vector<std::int64_t>> turns;
  phs::State end;
};
Path path_of(const Problem& p, const std::string& method, int steps) {
  const int s = gauss_stages(method);
  const auto table = gauss_table<double>(s);
  const auto integrator = make_integrator(method, *p.model, p.h);
  Path run{{}, {}, p.start};
  const size_t n = p.start.x.size();
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(integrator->step(run.end), Outcome::ok);
    Vec Y(size_t(s) * n);
    for (int j = 0; j < s; ++j)
      integrator->interpolate(run.end, table.c[size_t(j)], std::span(Y).subspan(size_t(j) * n, n));
    run.stages.push_back(Y);
    run.turns.push_back(run.end.turns);
  }
  return run;
}

struct Products {
  double worst = 0;     ///< |λ_n·δ_n - λ_N·δ_N|, of the moduli
  double of_start = 0;  ///< the same of λ_0·δ_0
};
/// Carries δ forwards and λ back through the same stages.
Products carry(const Problem& p, const std::string& method, const Path& run,
               const Path* stages_of_adjoint = nullptr) {
  const size_t n = p.start.x.size(), steps = run.stages.size();
  const int s = gauss_stages(method);
  const auto tangent = make_step_variation(*p.model, gauss_table<double>(s), Side::tangent);
  const auto adjoint = make_step_variation(*p.model, gauss_table<double>(s), Side::adjoint);
  TwoWords delta(random_vector(n, 1)), lambda(random_vector(n, 2));
  std::vector<Vec> deltas{delta.x};
  for (size_t i = 0; i < steps; ++i) {
    tangent->at({double(i) * p.h, p.h, run.stages[i]}, run.turns[i]);
    EXPECT_EQ(tangent->advance(delta), Outcome::ok);
    deltas.push_back(delta.x);
  }
  const Path& back = stages_of_adjoint ? *stages_of_adjoint : run;
  const double at_end = product(lambda.x, deltas[steps]).first;
  Products r;
  for (size_t i = steps; i-- > 0;) {
    adjoint->at({double(i) * p.h, p.h, back.stages[i]}, run.turns[i]);
    EXPECT_EQ(adjoint->advance(lambda), Outcome::ok);
    const auto [now, moduli] = product(lambda.x, deltas[i]);
    r.of_start = std::fabs(now - at_end) / moduli;
    r.worst = std::max(r.worst, r.of_start);
  }
  return r;
}

/// Control: with the stages in the tangent's order μ is not transposed.
TEST(RunGradient, AdjointIsTheTransposeOfTheTangent) {
  for (const auto& p : {test::double_pendulum(), test::floating_arm()})
    for (const std::string method : {"gauss16", "gauss12", "gauss8", "gauss6", "gauss2"}) {
      Problem shorter = p;
      if (gauss_stages(method) < 4) shorter.h = p.h / 8;
      const Path run = path_of(shorter, method, 60);
      const auto r = carry(shorter, method, run);
      Path not_transposed = run;
      const size_t n = p.start.x.size();
      for (Vec& Y : not_transposed.stages) {
        const Vec forth = Y;
        for (size_t i = 0; i < Y.size() / n; ++i)
          std::copy_n(forth.end() - std::ptrdiff_t((i + 1) * n), n,
                      Y.begin() + std::ptrdiff_t(i * n));
      }
      const double control = carry(shorter, method, run, &not_transposed).of_start;
      std::printf("  %-15s %-8s off by %.1e of the moduli (bound 1e-14); mu not transposed %.1e\n",
                  p.name.c_str(), method.c_str(), r.worst, control);
      EXPECT_LT(r.worst, 1e-14);
      if (method != "gauss2") {
        EXPECT_GT(control, 1e-10);
      }
    }
}

/// λ_n·δ_n is constant in the course of a run. Control: the continuous adjoint by RK4 at the same
/// step keeps it to its order only.
TEST(RunGradient, BilinearInvariantIsKeptToRounding) {
  Problem p = test::double_pendulum();
  p.start.x = {0.3, 0.2, 0.1, 0.1};  // regular
  const std::string method = "gauss8";
  const int steps = test::long_runs() ? 1'000'000 : 10'000;
  const Path run = path_of(p, method, steps);
  const auto r = carry(p, method, run);

  const auto linear = phs::linearise<double>(*p.model);
  const size_t n = p.start.x.size();
  const int few = 1000;
  const auto integrator = make_integrator(method, *p.model, p.h);
  phs::State state = p.start;
  std::vector<Vec> points{p.start.x};  // every half step
  for (int i = 0; i < few; ++i) {
    EXPECT_EQ(integrator->step(state), Outcome::ok);
    for (const double theta : {0.5, 1.0}) {
      Vec x(n);
      integrator->interpolate(state, theta, x);
      points.push_back(x);
    }
  }
  Vec lambda = random_vector(n, 2), f(n);
  const auto slope = [&](size_t at, const Vec& l) {
    Vec k(n);
    linear->at(0, points[at], f);
    linear->transpose_times(l, k);
    return k;
  };
  const auto plus = [&](const Vec& a, double by, const Vec& b) {
    Vec c = a;
    for (size_t i = 0; i < n; ++i) c[i] += by * b[i];
    return c;
  };
  Path first = run;
  first.stages.resize(few);
  first.turns.resize(few);
  TwoWords delta(random_vector(n, 1));
  const auto tangent = make_step_variation(*p.model, gauss_table<double>(4), Side::tangent);
  for (int i = 0; i < few; ++i) {
    tangent->at({0, p.h, first.stages[size_t(i)]}, first.turns[size_t(i)]);
    EXPECT_EQ(tangent->advance(delta), Outcome::ok);
  }
  const double at_end = product(lambda, delta.x).first;
  for (size_t i = few; i-- > 0;) {
    const Vec k1 = slope(2 * i + 2, lambda), k2 = slope(2 * i + 1, plus(lambda, p.h / 2, k1)),
              k3 = slope(2 * i + 1, plus(lambda, p.h / 2, k2)),
              k4 = slope(2 * i, plus(lambda, p.h, k3));
    for (size_t k = 0; k < n; ++k) lambda[k] += p.h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
  }
  const auto [at_start, moduli] = product(lambda, random_vector(n, 1));
  const double control = std::fabs(at_start - at_end) / moduli;
  // With and without fused multiply-adds the walk's steps are 14 and 64 of a rounding.
  const double bound = 256 * test::random_walk(steps);
  std::printf("  %d steps: off by %.1e of the moduli, bound %.1e;  RK4, %d steps: %.1e\n", steps,
              r.worst, bound, few, control);
  EXPECT_LT(r.worst, bound);
  EXPECT_GT(control, 1e-8);
}

TEST(RunGradient, StartIsThatOf113Bits) {
  for (const auto& [p, method, steps] : {std::tuple{test::double_pendulum(), "gauss16", 40},
                                         {test::double_pendulum(), "gauss6", 40},
                                         {test::floating_arm(), "gauss8", 4},
                                         {test::floating_arm(), "gauss16", 2}}) {
    const size_t n = p.start.x.size();
    const auto r = gradient_of_run(method, *p.model, p.start, p.h, steps, objective());
    ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
    const Vec delta = random_vector(n, 9);
    const Quad step = Quad(1e-10);
    std::vector<Quad> up(n), down(n);
    for (size_t i = 0; i < n; ++i) {
      up[i] = Quad(p.start.x[i]) + step * Quad(delta[i]);
      down[i] = Quad(p.start.x[i]) - step * Quad(delta[i]);
    }
    const Quad J = cost_in_113_bits(*p.model, method, up, p.h, steps),
               K = cost_in_113_bits(*p.model, method, down, p.h, steps);
    const double expected = double((J - K) / (2 * step));
    const auto [mine, moduli] = product(r.start, delta);
    std::printf("  %-15s %-8s %d steps: off by %.1e of the moduli (bound 1e-13), cost by %.1e\n",
                p.name.c_str(), method, steps, std::fabs(mine - expected) / moduli,
                std::fabs(r.cost - double((J + K) / 2)) / std::fabs(r.cost));
    EXPECT_LT(std::fabs(mine - expected), 1e-13 * moduli);
    EXPECT_NEAR(r.cost, double((J + K) / 2), 1e-13 * std::fabs(r.cost));
  }
}

/// By the factors of the forces and the inertial numbers, against runs of changed models.
TEST(RunGradient, ParametersAreThoseOf113Bits) {
  const auto base = pendulum(1, 1, 1, 1);
  const phs::State start(base->description(), {0.7, -0.4, 1.1, 0.5});
  const double h = 0.0625;
  const int steps = 16;
  const auto r = gradient_of_run("gauss12", *base, start, h, steps, objective());
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  const auto number = [&](const std::string& name) {
    const auto at = std::find(r.names.begin(), r.names.end(), name);
    EXPECT_NE(at, r.names.end()) << name;
    return r.parameters[size_t(at - r.names.begin())];
  };
  const std::vector<Quad> x(start.x.begin(), start.x.end());
  const auto difference = [&](auto model_of) {
    const auto once = [&](double by) {
      return (cost_in_113_bits(*model_of(1 + by), "gauss12", x, h, steps) -
              cost_in_113_bits(*model_of(1 - by), "gauss12", x, h, steps)) /
             Quad(2 * by);
    };
    return double((4 * once(0x1p-13) - once(0x1p-12)) / 3);
  };
  const auto compare = [&](const char* what, double mine, double expected) {
    std::printf("  %-6s %.15g, off by %.1e   bound 1e-11\n", what, mine,
                std::fabs(mine / expected - 1));
    EXPECT_NEAR(mine, expected, 1e-11 * std::fabs(expected)) << what;
  };
  compare("hard", number("hard.factor"),
          difference([&](double f) { return pendulum(1, f, 1, 1); }));
  compare("dry", number("dry.factor"), difference([&](double f) { return pendulum(1, 1, f, 1); }));
  compare("push", number("push.factor"),
          difference([&](double f) { return pendulum(1, 1, 1, f); }));
  // A mass with its centre c and the inertia about it kept: first moment mc and inertia about the
  // joint m (c² 1 - c cᵀ) change with it; c is half a metre along -y.
  const double mass = number("link0.mass") - 0.5 * number("link0.moment.y") +
                      0.25 * (number("link0.inertia.xx") + number("link0.inertia.zz"));
  compare("mass", mass, difference([&](double f) { return pendulum(f, 1, 1, 1); }));
}

/// Segments taken again have the bits of the run, at any number of levels.
TEST(RunGradient, CheckpointsChangeNoBit) {
  const Problem p = test::floating_arm();
  const int steps = 300;
  const auto whole = gradient_of_run("gauss8", *p.model, p.start, p.h, steps, objective());
  EXPECT_EQ(whole.steps_taken, steps);
  for (const size_t memory : {size_t(200000), size_t(20000)}) {
    const auto r =
        gradient_of_run("gauss8", *p.model, p.start, p.h, steps, objective(), {.memory = memory});
    std::printf("  %zu bytes: %lld steps instead of %d\n", memory,
                static_cast<long long>(r.steps_taken), steps);
    EXPECT_GT(r.steps_taken, steps);
    EXPECT_EQ(r.start, whole.start);
    EXPECT_EQ(r.parameters, whole.parameters);
    EXPECT_EQ(r.cost, whole.cost);
    EXPECT_EQ(r.end, whole.end);
  }
}

/// Progress grows up to 1, and a gradient can be stopped on its way back too.
TEST(RunGradient, TellsItsProgressAndStops) {
  const Problem p = test::floating_arm();
  std::atomic<bool> stop = false;
  double last = 0, stop_at = 2;
  GradientOptions options{.memory = 20000, .stop = &stop};
  options.progress = [&](double done) {
    EXPECT_GE(done, last);
    last = done;
    stop = done > stop_at;
  };
  const auto gradient = [&] {
    last = 0;
    return gradient_of_run("gauss8", *p.model, p.start, p.h, 1000, objective(), options);
  };
  EXPECT_EQ(gradient().outcome, Outcome::ok);
  EXPECT_GT(last, 0.9);
  EXPECT_LE(last, 1);
  stop_at = 0.85;
  const auto r = gradient();
  EXPECT_EQ(r.outcome, Outcome::failed);
  EXPECT_EQ(r.remark, "the run was stopped");
  EXPECT_LT(last, 0.9);
}

TEST(RunGradient, SeveralCostsHaveTheBitsOfEachAlone) {
  const Problem p = test::floating_arm();
  Objective last;
  last.end = [](double, std::span<const double> x, std::span<double> g) {
    g.back() = 1;
    return x.back();
  };
  const Objective both[] = {objective(), last};
  const GradientOptions options{.memory = 8192};  // from checkpoints
  const auto together = gradients_of_run("gauss8", *p.model, p.start, p.h, 30, both, options);
  ASSERT_EQ(together.size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    const auto alone = gradient_of_run("gauss8", *p.model, p.start, p.h, 30, both[i], options);
    ASSERT_EQ(alone.outcome, Outcome::ok) << alone.remark;
    EXPECT_EQ(together[i].start, alone.start);
    EXPECT_EQ(together[i].parameters, alone.parameters);
    EXPECT_EQ(together[i].cost, alone.cost);
    EXPECT_EQ(together[i].steps_taken, alone.steps_taken) << "the run is shared";
  }
  EXPECT_NE(together[0].start, together[1].start);
}

TEST(RunGradient, GrowthIsToldWhereSquaresOverflow) {
  const Problem p = test::double_pendulum();
  const auto growth = [&](double scale) {
    Objective o;
    o.end = [=](double, std::span<const double> x, std::span<double> g) {
      g[0] = scale;
      return scale * x[0];
    };
    return gradient_of_run("gauss8", *p.model, p.start, p.h, 30, o).growth;
  };
  EXPECT_NEAR(growth(1e200), growth(1), 1e-12);
}

TEST(RunGradient, RefusesWhatItDoesNotCover) {
  const Problem p = test::double_pendulum();
  const auto refused = [&](const std::string& method, const phs::Model& model,
                           const std::string& words) {
    try {
      (void)gradient_of_run(method, model, p.start, p.h, 1, {});
      ADD_FAILURE() << "expected: " << words;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  refused("spark8", *p.model, "not for 'spark8'");
  refused("nonsense", *p.model, "nonsense");
}

/// A stiff spring: the run takes Newton's method, and its derivative a direct solution.
TEST(RunGradient, StiffStepsAreSolvedDirectly) {
  const Problem p = test::double_pendulum();
  phs::Network net("stiff");
  net.add("arm", p.model).potential("shaft", "arm.link0", phs::spring(1e6, p.start.x[0]));
  const auto model = net.build();
  const int steps = 20;
  const auto r = gradient_of_run("gauss8", *model, p.start, p.h, steps, objective());
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  EXPECT_GT(r.adjoint.factorisations, 0);
  const size_t n = p.start.x.size();
  const Vec delta{1e-3, 1, 1, 1};  // the shaft's energy is of the size of the others'
  std::vector<Quad> up(n), down(n);
  const Quad step = Quad(1e-12);
  for (size_t i = 0; i < n; ++i) {
    up[i] = Quad(p.start.x[i]) + step * Quad(delta[i]);
    down[i] = Quad(p.start.x[i]) - step * Quad(delta[i]);
  }
  const Quad J = cost_in_113_bits(*model, "gauss8", up, p.h, steps),
             K = cost_in_113_bits(*model, "gauss8", down, p.h, steps);
  const auto [mine, moduli] = product(r.start, delta);
  const double off = std::fabs(mine - double((J - K) / (2 * step))) / moduli;
  std::printf("  off by %.1e of the moduli, bound 1e-12\n", off);
  EXPECT_LT(off, 1e-12);
}

}  // namespace
}  // namespace porthos::integrators::run_gradient_test
