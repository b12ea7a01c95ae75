#include "planning/mesh.h"

#include <fmt/format.h>

#include <cmath>

namespace porthos::planning {

bool settled(const std::vector<Mesh>& meshes, double tolerance) {
  if (meshes.size() < 2) return false;
  const double before = meshes[meshes.size() - 2].cost, now = meshes.back().cost;
  return std::fabs(now - before) <= tolerance * std::fabs(now);
}

std::vector<Mesh> refine(
    Problem& problem, Plan& plan, double tolerance,
    const std::function<Plan(Problem& problem, const Trajectory& guess)>& solve, int halvings) {
  if (!(tolerance > 0))
    throw InvalidArgument(fmt::format("tolerance is {}, expected more than 0", tolerance));
  if (plan.status != Plan::Status::optimal)
    throw InvalidArgument(
        fmt::format("the plan is '{}', expected an optimal one", to_string(plan.status)));
  std::vector<Mesh> meshes{{problem.step(), plan.cost}};
  while (halvings-- > 0 && !settled(meshes, tolerance)) {
    Problem finer = problem;
    finer.intervals *= 2;
    Plan next = solve(finer, resample(problem, plan.motion, finer));
    if (next.status != Plan::Status::optimal) break;
    next.iterations += plan.iterations;
    next.evaluations += plan.evaluations;
    problem = finer;
    plan = std::move(next);
    meshes.push_back({problem.step(), plan.cost});
  }
  return meshes;
}

}  // namespace porthos::planning
