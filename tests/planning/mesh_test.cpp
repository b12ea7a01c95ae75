// Plans whose steps are halved until their cost settles.
#include "planning/mesh.h"

#include <gtest/gtest.h>

#include "planning/end_time.h"
#include "tests/planning/problems.h"

namespace porthos::planning::mesh_test {
namespace {

/// The swing-up of a cart and pendulum, whose optimum is 58.8076675 (KnownAnswers.CartPole), from
/// steps of 0.125 s. Control: the first mesh is further off than the tolerance.
TEST(Mesh, HalvesUntilTheCostSettles) {
  const double exact = 58.807667458;
  for (const auto& [stages, tolerance] : {std::pair{2, 1e-6}, {3, 1e-8}, {4, 1e-10}}) {
    Problem p = test::cart_pole_swing_up(stages, 16);
    p.inputs = Inputs::at_stages;
    Plan plan = solve(p, straight(p, {1, M_PI, 0, 0}));
    ASSERT_EQ(plan.status, Plan::Status::optimal);
    const auto meshes =
        refine(p, plan, tolerance, [](Problem& q, const Trajectory& g) { return solve(q, g); });
    std::printf("  gauss%d, tolerance %.0e:", 2 * stages, tolerance);
    for (const Mesh& m : meshes) std::printf("  %g s %.9f", m.step, m.cost);
    std::printf("\n");
    EXPECT_TRUE(settled(meshes, tolerance));
    EXPECT_EQ(plan.cost, meshes.back().cost);
    EXPECT_EQ(p.intervals * p.step(), 2);
    EXPECT_GT(meshes.size(), 2u);
    EXPECT_GT(std::fabs(meshes.front().cost / exact - 1), tolerance);
    EXPECT_LT(std::fabs(plan.cost / exact - 1), std::max(tolerance, 1e-9));
  }
}

/// With an end time that is free, each mesh finds its own: rest to rest against the closed form of
/// the finest, (36 θ²/(w (1 - 1/N²)))^¼.
TEST(Mesh, EndTimesFollow) {
  Problem p = test::unit_mass(1.3, 2, 5);
  const EndTime free{.weight = 2};
  const auto solver = [&](Problem& q, const Trajectory& g) { return solve_end_time(q, g, free); };
  Plan plan = solver(p, straight(p, {1.3, 0}));
  const auto meshes = refine(p, plan, 1e-3, solver);
  const double exact =
      std::pow(36 * 1.3 * 1.3 / (2 * (1 - 1.0 / (p.intervals * p.intervals))), 0.25);
  std::printf("  %zu meshes, N = %d, T off by %.1e (bound 1e-8)\n", meshes.size(), p.intervals,
              std::fabs(p.duration / exact - 1));
  EXPECT_GT(p.intervals, 5);
  EXPECT_NEAR(p.duration, exact, 1e-8 * exact);
}

/// Used-up halvings are told, and what cannot be refined is refused.
TEST(Mesh, ComesToAnEnd) {
  const auto solver = [](Problem& q, const Trajectory& g) { return solve(q, g); };
  Problem p = test::cart_pole_swing_up(2, 16);
  Plan plan = solve(p, straight(p, {1, M_PI, 0, 0}));
  const auto meshes = refine(p, plan, 1e-12, solver, 1);
  EXPECT_EQ(meshes.size(), 2u);
  EXPECT_FALSE(settled(meshes, 1e-12));
  EXPECT_THROW(refine(p, plan, 0, solver), InvalidArgument);
  plan.status = Plan::Status::no_progress;
  EXPECT_THROW(refine(p, plan, 1e-3, solver), InvalidArgument);
}

}  // namespace
}  // namespace porthos::planning::mesh_test
