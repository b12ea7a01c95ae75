#pragma once
#include <optional>
#include <string>
#include <vector>

#include "planning/path_number.h"
#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// Limits of a number of an [[output]] in a plan: a table in [plan.outputs].
struct PlannedOutput {
  std::string name;   ///< "clearance", "tip.z"
  std::string where;  ///< "file:line:column"
  std::optional<double> lower = {}, upper = {};
};

/// The limits as numbers of the state x of the assembly's system. Outputs with the quantities
/// distance and position have them.
/// @param start  x at time 0
/// @throws InvalidArgument with file and line for another output, for one that is beyond its limits
///   at the start, and as Outputs
std::vector<planning::PathLimit> path_limits(const Scene& scene, const Assembly& assembly,
                                             const std::vector<PlannedOutput>& planned,
                                             std::span<const double> start);

/// A limit [rad] of the angle of an attitude from its start, of the squared cosine of half of it.
/// @param at  of the quaternion in x
planning::PathLimit attitude_limit(int at, std::span<const double> start, double angle);

}  // namespace porthos::scene
