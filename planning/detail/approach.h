#pragma once
#include "planning/detail/shooting.h"
#include "planning/planner.h"

namespace porthos::planning::detail {

/// Motions that come ever closer to the goals: the cost plus νᵀc + ½ρ|c|² of the goals' errors c is
/// lessened by Gauss-Newton steps that are motions themselves (differential dynamic programming;
/// Mayne 1966, Int. J. Control 3), and ν and ρ grow until the goals are near. Slower than Newton's
/// iteration and surer: every step lessens one function. Inputs keep their limits by being cut off.
/// @param v  unknowns of `shooting`; they become the last motion
/// @return the iterations; -1: the inputs of v cannot be followed
int approach(Shooting& shooting, Vector& v, const PlannerOptions& options);

}  // namespace porthos::planning::detail
