#pragma once
#include <functional>

#include "planning/planner.h"

namespace porthos::planning {

/// One mesh of a refinement.
struct Mesh {
  double step;  ///< [s]
  double cost;
};

/// Halves the steps of a plan until its cost, solved again from the plan before, changes by at most
/// `tolerance` of itself: what is left is about that, over 2^p - 1 with the order p of the mesh.
/// `problem` becomes that of the plan, and `plan` the last one that is optimal.
/// @param solve  of a problem from a guess: planning::solve or solve_end_time with their options
/// @param halvings  at most
/// @return the meshes, the first one included; the last two differ by more than the tolerance where
///   the halvings are used up, or a finer problem was not solved
/// @throws InvalidArgument for a tolerance that is not positive, a plan that is not optimal
std::vector<Mesh> refine(
    Problem& problem, Plan& plan, double tolerance,
    const std::function<Plan(Problem& problem, const Trajectory& guess)>& solve, int halvings = 6);

/// Whether the last two meshes of a refinement agree.
bool settled(const std::vector<Mesh>& meshes, double tolerance);

}  // namespace porthos::planning
