// Stiff systems: where the fixed point fails Newton goes on, at O(n) a sweep, and its solution is
// as good.
#include <gtest/gtest.h>

#include "integrators/core/stagnation.h"
#include "integrators/methods/gauss.h"
#include "phs/system/user_model.h"
#include "tests/support/gauss.h"
#include "tests/support/robots.h"
#include "tests/support/stiff.h"

namespace porthos::integrators::stiff_test {
namespace {

using phs::Quad;
using test::stiff_chain;

std::unique_ptr<Integrator> method(const char* name, const phs::Model& model, double h, Solver s) {
  Options o;
  o.solver = s;
  return make_integrator(name, model, h, o);
}
Outcome run(Integrator& m, phs::State& s, int steps) {
  for (int i = 0; i < steps; ++i)
    if (const Outcome o = m.step(s); o != Outcome::ok) return o;
  return Outcome::ok;
}
double sweeps_per_step(const Integrator& m) {
  return double(m.cost().sweeps) / double(m.cost().steps);
}
/// Largest difference of two states, relative to the largest position or momentum.
double difference(const phs::State& a, const std::vector<Quad>& b) {
  double worst = 0;
  const size_t n = a.x.size() / 2;
  for (size_t half = 0; half < 2; ++half) {
    double d = 0, size = 1e-300;
    for (size_t k = half * n; k < half * n + n; ++k) {
      d = std::max(d, std::fabs(double(Quad(a.x[k]) + Quad(a.lo[k]) - b[k])));
      size = std::max(size, std::fabs(double(b[k])));
    }
    worst = std::max(worst, d / size);
  }
  return worst;
}
std::vector<Quad> exact(const phs::State& s) {
  std::vector<Quad> x(s.x.begin(), s.x.end());
  for (size_t k = 0; k < x.size(); ++k) x[k] += Quad(s.lo[k]);
  return x;
}

// Joint springs of k·m g l up to a million, h ω up to thousands: against the dense solver and
// against 113 bits.
TEST(Stiff, JointSpringsConvergeInFewSweepsAndToTheSameSolution) {
  const double h = 0.05;
  for (const double k : {1e3, 1e4, 1e5, 1e6})
    for (const double damping : {0.0, 1.0}) {
      const auto robot = stiff_chain(8, k, damping);
      phs::State a = robot.start, d = robot.start, f = robot.start;
      const auto tree = method("gauss12", *robot.model, h, Solver::newton_articulated),
                 dense = method("gauss12", *robot.model, h, Solver::newton_dense),
                 fixed = method("gauss12", *robot.model, h, Solver::fixed_point);
      EXPECT_NE(fixed->step(f), Outcome::ok) << "the control must fail, else nothing is stiff";
      EXPECT_TRUE(f == robot.start);
      const int steps = 10;
      ASSERT_EQ(run(*tree, a, steps), Outcome::ok) << k;
      ASSERT_EQ(run(*dense, d, steps), Outcome::ok) << k;
      const auto reference = gauss_reference(
          *robot.model, {robot.start.x.begin(), robot.start.x.end()}, Quad(h), steps, 6);
      const double to_dense = difference(a, exact(d)), to_113 = difference(a, reference);
      std::printf(
          "  k = %.0e m g l, damping %g: sweeps %.1f (12)  against dense %.1e  against 113 bits "
          "%.1e (2e-13)\n",
          k, damping, sweeps_per_step(*tree), to_dense, to_113);
      EXPECT_LE(sweeps_per_step(*tree), 12);
      EXPECT_LE(to_dense, 2e-13);
      EXPECT_LE(to_113, 2e-13);
      EXPECT_EQ(tree->cost().factorisations > 0, true);
    }
}

// Where both converge, Newton and the fixed point are one method to rounding.
TEST(Stiff, AgreesWithTheFixedPointAtResolvedSteps) {
  const auto robot = stiff_chain(8, 100, 0);
  const double h = 0.002;
  const int steps = 50;
  const auto reference = gauss_reference(*robot.model, {robot.start.x.begin(), robot.start.x.end()},
                                         Quad(h), steps, 8);
  for (const Solver solver : {Solver::fixed_point, Solver::newton_articulated, Solver::newton_dense,
                              Solver::newton_krylov}) {
    phs::State s = robot.start;
    const auto m = method("gauss16", *robot.model, h, solver);
    ASSERT_EQ(run(*m, s, steps), Outcome::ok);
    const double error = difference(s, reference);
    std::printf("  %-20s sweeps %.1f   against 113 bits %.1e   bound 2e-15\n", to_string(solver),
                sweeps_per_step(*m), error);
    EXPECT_LE(error, 2e-15);
  }
}

// A free-floating stiff arm for long: momentum stays at rounding, the energy of the resolved motion
// too.
TEST(Stiff, KeepsMomentumAndEnergy) {
  const auto robot = stiff_chain(6, 1e5, 0, 0.2, true);
  test::Gauge gauge(*robot.model);
  const auto H0 = gauge.energy(robot.start);
  const auto I0 = gauge.invariants(robot.start);
  phs::State s = robot.start;
  const auto m = method("gauss12", *robot.model, 0.02, Solver::automatic);
  double energy = 0, angular = 0, linear = 0;
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(m->step(s), Outcome::ok);
    energy = std::max(energy, std::fabs(double((gauge.energy(s) - H0) / H0)));
    angular = std::max(angular, gauge.error("angular_momentum", s, I0));
    linear = std::max(linear, gauge.error("linear_momentum", s, I0));
  }
  std::printf("  5000 steps: energy %.1e (1e-9)  angular %.1e (2e-14)  linear %.1e (2e-14)  %s\n",
              energy, angular, linear, m->remark().c_str());
  EXPECT_LE(energy, 1e-9);
  EXPECT_LE(angular, 2e-14);
  EXPECT_LE(linear, 2e-14);
}

// The exact Jacobian of stiff steps, by duals that go through the same Newton iteration, is
// symplectic.
TEST(Stiff, NewtonStepsAreSymplectic) {
  const auto robot = stiff_chain(3, 1e4, 0);
  const size_t n = robot.start.x.size(), half = n / 2;
  std::vector<double> Psi(n * n);
  // In units in which the entries of the Jacobian are of one size: momenta by √(K I).
  const double unit = 10;
  for (size_t j = 0; j < n; ++j) {
    phs::BasicState<phs::Dual> s(robot.model->description(),
                                 {robot.start.x.begin(), robot.start.x.end()});
    s.x[j].d = j < half ? 1 : unit;
    Options o;
    o.solver = Solver::newton_articulated;
    const auto m = make_basic_integrator<phs::Dual>("gauss8", *robot.model, 0.05, o);
    for (int i = 0; i < 2; ++i) ASSERT_EQ(m->step(s), Outcome::ok);
    for (size_t i = 0; i < n; ++i) Psi[i * n + j] = (s.x[i].d + s.lo[i].d) / (i < half ? 1 : unit);
  }
  double defect = 0, size = 0;
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) {
      double sum = i + half == j ? -1.0 : j + half == i ? 1.0 : 0.0;
      for (size_t k = 0; k < half; ++k)
        sum += Psi[k * n + i] * Psi[(k + half) * n + j] - Psi[(k + half) * n + i] * Psi[k * n + j];
      defect = std::max(defect, std::fabs(sum));
      size = std::max(size, std::fabs(Psi[i * n + j]));
    }
  std::printf("  defect %.1e   bound 1e-12 (entries up to %.1g)\n", defect, size);
  EXPECT_LE(defect, 1e-12 * std::max(1.0, size * size));
}

TEST(Stiff, ChoiceIsAutomaticAndReported) {
  const auto soft = stiff_chain(5, 1, 0), stiff = stiff_chain(5, 1e5, 0);
  phs::State s = soft.start;
  auto m = method("gauss16", *soft.model, 0.01, Solver::automatic);
  ASSERT_EQ(run(*m, s, 50), Outcome::ok);
  EXPECT_EQ(m->remark(), "");
  EXPECT_EQ(m->cost().factorisations, 0);
  s = stiff.start;
  m = method("gauss16", *stiff.model, 0.01, Solver::automatic);
  ASSERT_EQ(run(*m, s, 50), Outcome::ok);
  EXPECT_EQ(m->remark(), "Newton, articulated, in 50 of 50 solutions");
  // Another one goes on from its memory, and counts on, whatever it is told of the cost.
  std::vector<double> memory;
  m->save(memory);
  const auto resumed = method("gauss16", *stiff.model, 0.01, Solver::automatic);
  resumed->restore(memory);
  ASSERT_EQ(run(*resumed, s, 7), Outcome::ok);
  EXPECT_EQ(resumed->remark(), "Newton, articulated, in 57 of 57 solutions");
}

// Long steps need Newton, short ones of the same run do not: the fixed point comes back, and Newton
// again.
TEST(Stiff, TheFixedPointComesBack) {
  const auto robot = stiff_chain(5, 1e4, 0);
  phs::State s = robot.start;
  const auto m = method("gauss16", *robot.model, 0.02, Solver::automatic);
  ASSERT_EQ(run(*m, s, 100), Outcome::ok);
  EXPECT_EQ(m->remark(), "Newton, articulated, in 100 of 100 solutions");
  for (int i = 0; i < 400; ++i) ASSERT_EQ(m->step_by(s, 0.0005), Outcome::ok);
  const auto calm = m->cost();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(m->step_by(s, 0.0005), Outcome::ok);
  const double sweeps = double(m->cost().sweeps - calm.sweeps) / 100;
  EXPECT_EQ(m->cost().factorisations, calm.factorisations);
  ASSERT_EQ(run(*m, s, 100), Outcome::ok);
  std::printf("  %s; sweeps of the short steps %.1f\n", m->remark().c_str(), sweeps);
  EXPECT_GT(m->cost().factorisations, calm.factorisations);
}

/// Whether `steps` steps of size h succeed.
bool goes(const test::Robot& robot, const char* name, double h, int steps, Solver solver,
          std::string& note) {
  phs::State s = robot.start;
  const auto m = method(name, *robot.model, h, solver);
  test::Gauge gauge(*robot.model);
  const auto H0 = gauge.energy(s);
  const bool ok = run(*m, s, steps) == Outcome::ok;
  char text[80];
  std::snprintf(text, sizeof text, "%.0f sweeps, energy %.0e", sweeps_per_step(*m),
                std::fabs(double((gauge.energy(s) - H0) / H0)));
  note = ok ? text : "fails";
  return ok;
}

// Passive chains have no springs; what is stiff there is the tension of the links above the free
// end. The exact Jacobian sees it. In wild motion it changes too much within a long step: there
// Newton reaches hardly further.
TEST(Stiff, PassiveChainsAtStepsWhereTheFixedPointFails) {
  const auto hanging = stiff_chain(100, 0, 0, 0.01);
  std::string fixed, chosen;
  const double h = 0.1;
  const bool control = goes(hanging, "gauss16", h, 50, Solver::fixed_point, fixed);
  const bool ours = goes(hanging, "gauss16", h, 50, Solver::automatic, chosen);
  std::printf("  100 links hanging, h = %g: fixed point %s; automatic %s\n", h, fixed.c_str(),
              chosen.c_str());
  EXPECT_FALSE(control);
  EXPECT_TRUE(ours);

  const std::string file = "reference/pinocchio/urdf/chain30.urdf";
  mechanics::UrdfOptions o;
  o.gravity = {0, 0, -9.81};
  const auto m = std::make_shared<mechanics::Mechanism>(
      mechanics::read_urdf(test::data_file(file).string(), o).mechanism);
  std::vector<double> q(30), calm(30), v(30);
  for (size_t i = 0; i < q.size(); ++i) {
    q[i] = 0.3 * std::sin(1.0 + double(i));
    v[i] = 0.5 * std::cos(2.0 + double(i));
    calm[i] = 0.02 * std::sin(1.0 + double(i));
  }
  calm[1] += M_PI / 2;  // straight down
  const auto wild = test::make_robot(m, q, v), still = test::make_robot(m, calm, {});
  for (const auto* robot : {&wild, &still})
    for (double step = 1.0 / 320; step < 0.15; step *= 2) {
      const bool a = goes(*robot, "gauss16", step, 50, Solver::fixed_point, fixed);
      const bool b = goes(*robot, "gauss16", step, 50, Solver::automatic, chosen);
      std::printf("  chain30 %s, h = %-8g fixed point: %-24s automatic: %s\n",
                  robot == &wild ? "thrown " : "hanging", step, fixed.c_str(), chosen.c_str());
      EXPECT_TRUE(b || !a) << "the choice must not lose what the fixed point does";
    }
}

/// A stiff oscillator that gives its energy only.
struct Bare {
  phs::Description description() const {
    phs::Description d;
    d.name = "bare";
    d.nx = 2;
    d.traits.canonical = true;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[1] * x[1] + T(1e4) * x[0] * x[0]);
  }
};

// Stiff without a solver of its own: dense when small, Krylov when large.
TEST(Stiff, SystemsWithoutASolverOfTheirOwn) {
  for (const int masses : {20, 150}) {
    const phs::UserModel model(test::QuarticChain{.masses = masses, .linear = 1e4});
    std::vector<double> x(size_t(2 * masses));
    for (int i = 0; i < masses; ++i) x[size_t(i)] = 0.5 * std::sin(0.4 * i);
    phs::State s(model.description(), x), fixed = s, other = s;
    const double h = 0.05;
    const auto m = method("gauss8", model, h, Solver::automatic),
               o = method("gauss8", model, h,
                          masses == 20 ? Solver::newton_krylov : Solver::newton_dense);
    EXPECT_NE(method("gauss8", model, h, Solver::fixed_point)->step(fixed), Outcome::ok);
    ASSERT_EQ(run(*m, s, 10), Outcome::ok);
    ASSERT_EQ(run(*o, other, 10), Outcome::ok);
    const double d = difference(s, exact(other));
    std::printf(
        "  %d masses: %s; sweeps %.1f (30), evaluations %.0f a step; against %s %.1e (1e-12)\n",
        masses, m->remark().c_str(), sweeps_per_step(*m), double(m->cost().evaluations) / 10,
        to_string(masses == 20 ? Solver::newton_krylov : Solver::newton_dense), d);
    EXPECT_NE(m->remark().find(masses == 20 ? "dense" : "Krylov"), std::string::npos);
    EXPECT_LE(sweeps_per_step(*m), 30);
    EXPECT_LE(d, 1e-12);
  }
  const phs::UserModel model(test::QuarticChain{.masses = 4});
  EXPECT_THROW(method("gauss8", model, 0.1, Solver::newton_articulated), InvalidArgument);

  // Without a gradient in duals there is no Jacobian: the fixed point alone, and its failure is a
  // status.
  const phs::UserModel bare(Bare{});
  phs::State s(bare.description(), {1, 0});
  EXPECT_EQ(run(*method("gauss8", bare, 0.001, Solver::automatic), s, 10), Outcome::ok);
  EXPECT_NE(method("gauss8", bare, 1, Solver::automatic)->step(s), Outcome::ok);
  EXPECT_THROW(method("gauss8", bare, 0.1, Solver::newton_dense), InvalidArgument);
}

// Each is of order n, an articulated-body recursion; so that a step is, their number must not grow
// with n.
TEST(Stiff, SweepsAndFactorisationsDoNotGrowWithTheBodies) {
  for (const int n : {10, 30, 100, 300}) {
    const auto robot = stiff_chain(n, 1e5, 0);
    phs::State s = robot.start;
    const auto m = method("gauss16", *robot.model, 0.01, Solver::newton_articulated);
    const int steps = 10;
    ASSERT_EQ(run(*m, s, steps), Outcome::ok);
    const double sweeps = double(m->cost().sweeps) / steps;
    std::printf("  %3d bodies: %.1f sweeps a step (25), %ld factorisations in %d steps (5)\n", n,
                sweeps, long(m->cost().factorisations), steps);
    EXPECT_LE(sweeps, 25) << n;
    EXPECT_LE(m->cost().factorisations, 5) << n;
  }
}

TEST(Stiff, AnImpossibleStepIsAStatus) {
  const auto robot = stiff_chain(6, 0, 0);
  phs::State start = robot.start;
  for (size_t i = 6; i < 12; ++i) start.x[i] *= 1e3;  // some hundred turns a second
  for (const Solver solver : {Solver::automatic, Solver::fixed_point, Solver::newton_articulated,
                              Solver::newton_dense, Solver::newton_krylov}) {
    phs::State s = start;
    EXPECT_NE(method("gauss16", *robot.model, 5, solver)->step(s), Outcome::ok)
        << to_string(solver);
    EXPECT_TRUE(s == start) << to_string(solver);
  }
}

// Restart in the middle of Newton: the frozen Jacobian and the state of the choice come back.
// Sweeps that stand still above what usually is rounding end there if, and only if, moves of this
// size are measured to be rounding. Slow contraction above the noise goes on, and standing still
// above it diverges.
TEST(Stiff, OnlyMeasuredNoiseEndsSweepsAboveTheUsual) {
  using enum Stagnation::Verdict;
  const auto last = [](double noise, double ratio) {
    auto stagnation = Stagnation::of<double>();
    stagnation.restart();
    auto verdict = go_on;
    double move = 1e-6;
    int sweeps = 0;
    for (; verdict == go_on && sweeps < 100; ++sweeps) {
      move = sweeps < 5 ? move * 0.2 : move * ratio;  // 3e-10 after five
      verdict = stagnation.after({.changed = true, .change = move});
      if (verdict == go_on && stagnation.wants_noise()) stagnation.set_noise(noise);
    }
    std::printf("  noise %.0e, ratio %.2f: after %d sweeps at %.1e\n", noise, ratio, sweeps, move);
    return std::pair{verdict, sweeps};
  };
  EXPECT_EQ(last(1e-9, 1.0).first, stagnated);
  EXPECT_LT(last(1e-9, 1.0).second, 10);
  EXPECT_EQ(last(1e-12, 1.0).first, diverges) << "as without a measurement";
  EXPECT_EQ(last(1e-12, 0.95).first, go_on) << "it still shrinks";
  EXPECT_EQ(last(1.0, 1.0).first, stagnated);
  // Nothing is noise above 1e-6, whatever was measured.
  auto far = Stagnation::of<double>();
  far.restart();
  far.set_noise(1.0);
  for (int i = 0; i < 8; ++i) EXPECT_EQ(far.after({.changed = true, .change = 1e-4}), go_on);
}

TEST(Stiff, RestartIsContinuation) {
  const auto robot = stiff_chain(5, 1e3, 0.01);
  for (const Solver solver : {Solver::automatic, Solver::newton_dense}) {
    phs::State through = robot.start, stopped = robot.start;
    const auto one = method("gauss8", *robot.model, 0.03, solver),
               first = method("gauss8", *robot.model, 0.03, solver),
               second = method("gauss8", *robot.model, 0.03, solver);
    ASSERT_EQ(run(*one, through, 200), Outcome::ok);
    ASSERT_EQ(run(*first, stopped, 77), Outcome::ok);
    phs::State forgetful = stopped;
    second->restore(first->memory());
    ASSERT_EQ(run(*second, stopped, 123), Outcome::ok);
    EXPECT_TRUE(through == stopped) << to_string(solver);
    const auto third = method("gauss8", *robot.model, 0.03, solver);
    ASSERT_EQ(run(*third, forgetful, 123), Outcome::ok);
    EXPECT_FALSE(through == forgetful) << "the control must differ";
  }
}

}  // namespace
}  // namespace porthos::integrators::stiff_test
