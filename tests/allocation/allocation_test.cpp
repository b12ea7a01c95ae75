// No step allocates: every operator new of the program is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "integrators/control/step_control.h"
#include "integrators/core/integrator.h"
#include "integrators/derivatives/step_variation.h"
#include "tests/support/robots.h"
#include "tests/support/rollers.h"
#include "tests/support/split_systems.h"
#include "tests/support/stiff.h"

namespace porthos::test {
std::atomic<long> allocations{0};
}
using porthos::test::allocations;
namespace {
void* counted(std::size_t size, std::size_t alignment) {
  ++allocations;
  if (void* p = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment))
    return p;
  throw std::bad_alloc();
}
}  // namespace

// GCC, once it has inlined both, takes free for the wrong partner of our own operator new.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif
void* operator new(std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new[](std::size_t size) { return counted(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t a) { return counted(size, std::size_t(a)); }
void* operator new[](std::size_t size, std::align_val_t a) { return counted(size, std::size_t(a)); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace porthos::integrators::allocation_test {
namespace {

using test::allocations;

TEST(Allocation, CounterCounts) {
  const long before = allocations;
  std::vector<double> v(100);
  EXPECT_EQ(allocations - before, 1) << v.size();
}

TEST(Allocation, NoneInAStepOfAnyMethod) {
  const auto robot = test::ets_vii(8);
  for (const auto& d : catalogue()) {
    if (d.rival || misfit(d, robot.model->description()))
      continue;  // rivals' memory is their affair
    for (bool lanes : {true, false}) {
      Options o;
      o.lanes = lanes;
      const auto method = make_integrator(d.name, *robot.model, 0.05, o);
      phs::State s = robot.start;
      ASSERT_EQ(method->step(s), Outcome::ok);
      const auto turns = s.turns;
      const long before = allocations;
      bool ok = true;
      for (int i = 0; i < 1000; ++i) ok = ok && method->step(s) == Outcome::ok;
      const long made = allocations - before;
      EXPECT_TRUE(ok) << d.name;
      EXPECT_EQ(made, 0) << d.name << (lanes ? " with" : " without") << " lanes";
      EXPECT_NE(turns, s.turns)
          << "the run must include wraps of the angles, which tell the systems their turns";
    }
  }
}

TEST(Allocation, NoneInTheDerivativeOfAStep) {
  const auto robot = test::ets_vii(8);
  for (const char* method : {"gauss16", "stormer_verlet", "rk4"})
    for (const auto side : {StepVariation::Side::tangent, StepVariation::Side::adjoint}) {
      StepPieces pieces(method, *robot.model, 0.05);
      const auto variation = make_step_variation(*robot.model, pieces, side);
      phs::State state = robot.start;
      TwoWords v(std::vector<double>(state.x.size(), 1.0)), g(variation->parameters().size());
      ASSERT_EQ(pieces.step(state), Outcome::ok);
      const long before = allocations;
      bool ok = true;
      for (int i = 0; i < 100; ++i) {
        ok = ok && pieces.step(state) == Outcome::ok;
        variation->at(pieces[0], state.turns);
        ok = ok && variation->advance(v) == Outcome::ok;
        if (side == StepVariation::Side::adjoint) variation->add_gradient(g);
      }
      EXPECT_EQ(allocations - before, 0) << method;
      EXPECT_TRUE(ok) << method;
    }
}

TEST(Allocation, NoneInAStepWithLoops) {
  auto l = test::four_bar();
  l.spec.couplings.push_back({"follow", {{"crank_joint", 1}, {"coupler_joint", 1}}, 0.3});
  l.spec.loops.clear();
  for (auto linkage : {test::four_bar(), l, test::windows(8, true)}) {
    const auto x = linkage.start();
    const auto model = linkage.model();
    for (const char* name : {"spark16", "spark4", "pgauss16", "pgauss4"})
      for (const bool lanes : {true, false}) {
        Options o;
        o.lanes = lanes;
        const auto method = make_integrator(name, model, 1. / 128, o);
        phs::State s(model.description(), x);
        ASSERT_EQ(method->step(s), Outcome::ok);
        const auto turns = s.turns;
        const long before = allocations;
        bool ok = true;
        for (int i = 0; i < 500; ++i) ok = ok && method->step(s) == Outcome::ok;
        const long made = allocations - before;
        EXPECT_TRUE(ok) << name;
        EXPECT_EQ(made, 0) << name << (lanes ? " with" : " without") << " lanes";
        EXPECT_NE(turns, s.turns);
      }
  }
}

TEST(Allocation, NoneInAStepThatRollsOrIsDriven) {
  const auto motion = phs::moves_from(0.5, {{0.25, 2, 4}});
  for (auto l : {test::rolling_disk(1.25, {0.5, 1, -6}), test::driven_pendulum(motion)}) {
    const auto x = l.start();
    const auto model = l.model();
    for (const bool lanes : {true, false}) {
      const auto method = make_integrator("pgauss8", model, 1. / 128, {.lanes = lanes});
      phs::State s(model.description(), x);
      ASSERT_EQ(method->step(s), Outcome::ok);
      const long before = allocations;
      bool ok = true;
      for (int i = 0; i < 500; ++i) ok = ok && method->step(s) == Outcome::ok;
      const long made = allocations - before;
      EXPECT_TRUE(ok);
      EXPECT_EQ(made, 0) << model.description().name << (lanes ? " with" : " without") << " lanes";
    }
  }
}

TEST(Allocation, NoneInAControlledStep) {
  const auto robot = test::ets_vii(8);
  for (const auto kind : {StepControl::time_transformed, StepControl::reversible}) {
    const auto method = make_controlled(kind, "gauss8", *robot.model, 0.05);
    phs::State s = robot.start;
    ASSERT_EQ(method->step(s), Outcome::ok);
    const auto turns = s.turns;
    const long before = allocations;
    bool ok = true;
    for (int i = 0; i < 1000; ++i) ok = ok && method->step(s) == Outcome::ok;
    const long made = allocations - before;
    EXPECT_TRUE(ok) << to_string(kind);
    EXPECT_EQ(made, 0) << to_string(kind);
    EXPECT_NE(turns, s.turns);
  }
}

TEST(Allocation, NoneInAControlledStepOfALoop) {
  auto l = test::four_bar();  // five rows of rank two
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const auto method = make_controlled(StepControl::reversible, "spark8", model, 0.01);
  for (int i = 0; i < 8; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
  const long before = allocations;
  bool ok = true;
  for (int i = 0; i < 500; ++i) ok = ok && method->step(s) == Outcome::ok;
  const long made = allocations - before;
  EXPECT_TRUE(ok);
  EXPECT_EQ(made, 0);
}

// Splittings do not fit a robot: on kicks and drifts, with wraps, and on offered flows.
TEST(Allocation, NoneInAStepOfASplitting) {
  const phs::UserModel rotor(test::Rotor{});
  const phs::UserModel body(test::FreeBody{});
  for (const phs::Model* model : std::initializer_list<const phs::Model*>{&rotor, &body})
    for (const auto& d : catalogue()) {
      if (!d.needs.flows) continue;
      const auto method = make_integrator(d.name, *model, 0.05);
      phs::State s(model->description(), {0.8, 2.5, -0.6});
      s.x.resize(size_t(model->description().nx));
      s.lo.resize(s.x.size());
      ASSERT_EQ(method->step(s), Outcome::ok);
      const long before = allocations;
      bool ok = true;
      for (int i = 0; i < 1000; ++i) ok = ok && method->step(s) == Outcome::ok;
      EXPECT_EQ(allocations - before, 0) << d.name << " on " << model->description().name;
      EXPECT_TRUE(ok) << d.name;
    }
}

TEST(Allocation, NoneInNewtonSteps) {
  const auto robot = test::stiff_chain(5, 1e4, 0);
  for (const char* name : {"gauss16", "gonzalez", "mean_value"})
    for (const auto solver : {Solver::automatic, Solver::newton_articulated, Solver::newton_dense,
                              Solver::newton_krylov}) {
      Options o;
      o.solver = solver;
      const auto method = make_integrator(name, *robot.model, 0.05, o);
      phs::State s = robot.start;
      const long before = allocations;
      bool ok = true;
      for (int i = 0; i < 200; ++i) ok = ok && method->step(s) == Outcome::ok;
      const long made = allocations - before;
      EXPECT_TRUE(ok) << name;
      EXPECT_GT(method->cost().factorisations, 0) << name;
      EXPECT_EQ(made, 0) << name << ", " << to_string(solver);
    }
}

TEST(Allocation, NoneInAnEvaluation) {
  const auto robot = test::ets_vii();
  const auto system = robot.model->instantiate<double>();
  std::vector<double> x = robot.start.x, e(x), u(12, 0.1), y(12);
  std::vector<double> values(size_t(robot.model->description().invariant_count()));
  const long before = allocations;
  system->hamiltonian(x);
  system->gradient(x, e);
  system->field(0, x, u, e);
  system->invariants(x, values);
  system->output(x, e, y);
  system->apply_input(x, u, e);
  system->apply_structure(x, x, e);
  system->apply_dissipation(x, x, e);
  EXPECT_EQ(allocations - before, 0);
}

TEST(Allocation, NoneInAnEvaluationWithBodyPorts) {
  const auto robot = test::ets_vii();
  const auto mechanism = std::make_shared<mechanics::Mechanism>(robot.model->mechanism());
  const mechanics::MechanicalModel model(
      mechanism, {{"hand", mechanism->bodies().back().name, {0.1, 0.2, 0.3}},
                  {"thruster", mechanism->bodies().front().name, {-1, 0, 0}}});
  const auto system = model.instantiate<double>();
  ASSERT_EQ(model.description().nu, 12 + 2 * 6);
  std::vector<double> x = robot.start.x, e(x), u(24, 0.1), y(24);
  const long before = allocations;
  system->field(0, x, u, e);
  system->field(0, x, {}, e);
  system->output(x, e, y);
  system->apply_input(x, u, e);
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace porthos::integrators::allocation_test
