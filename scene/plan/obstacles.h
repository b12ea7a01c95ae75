#pragma once
#include <string>
#include <vector>

#include "scene/plan/plan_scene.h"

namespace porthos::scene {

/// What may keep a plan from its goals, a clause each: the goals that the inputs found so far miss,
/// and by how much, and the inputs that are at a limit most of the time.
std::vector<std::string> obstacles(const PlanProblem& made, const planning::Trajectory& found);

/// The joints that a motion takes beyond the positions or efforts of the model file, a
/// clause each: a plan keeps the limits of [plan.joints] alone.
std::vector<std::string> beyond_limits(const PlanProblem& made, const Assembly& assembly,
                                       const planning::Trajectory& motion);

}  // namespace porthos::scene
