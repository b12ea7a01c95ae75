#pragma once
#include <optional>
#include <string>
#include <vector>

#include "planning/problem.h"
#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// Limits and goals of a number of an [[output]] in a plan: a table in [plan.outputs].
struct PlannedOutput {
  std::string name;   ///< "clearance", "tip.z"
  std::string where;  ///< "file:line:column"
  std::optional<double> lower = {}, upper = {};
  std::optional<double> value = {}, rate = {};  ///< at the end
};

/// Adds the limits and goals to a problem, as numbers of the state x of the assembly's system.
/// Outputs with the quantities distance and position have them.
/// @param problem     with its dynamics and its start
/// @param goal_names  gets those of the goals
/// @throws InvalidArgument with file and line for another output, for one that is beyond its limits
///   at the start, and as Outputs
void add_outputs(const Scene& scene, const Assembly& assembly,
                 const std::vector<PlannedOutput>& planned, planning::Problem& problem,
                 std::vector<std::string>& goal_names);

/// A limit [rad] of the angle of an attitude from its start, of the squared cosine of half of it.
/// @param at  of the quaternion in x
planning::PathLimit attitude_limit(int at, std::span<const double> start, double angle);

}  // namespace porthos::scene
