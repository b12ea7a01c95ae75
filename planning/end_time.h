#pragma once
#include "planning/planner.h"

namespace porthos::planning {

/// An end time that is free: `weight` is the cost of a second.
struct EndTime {
  double weight = 1;
  double shortest = 0, longest = no_limit;  ///< limits of the duration [s]
};

/// solve() for the duration at which cost + weight · duration is least, with as many intervals: the
/// zero of Plan::duration_slope + weight by regula falsi (Illinois; Dowell, Jarratt 1971), each
/// plan from the one before. A duration that has no plan, as with torques that are too small for
/// it, counts as too short. The search begins at problem.duration.
/// @param problem  of dynamics and goals that do not depend on the time; its duration becomes that
///   of the plan
/// @return the plan, whose cost includes weight · duration; its iterations and evaluations are
///   those of all durations that were tried, its history that of the last one. Not optimal if no
///   duration has a plan
/// @throws InvalidArgument as solve(); for a weight that is not positive, limits that exclude
///   problem.duration
Plan solve_end_time(Problem& problem, const Trajectory& guess, const EndTime& free,
                    const PlannerOptions& options = {});

}  // namespace porthos::planning
