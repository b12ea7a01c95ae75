#pragma once
#include <string>
#include <vector>

#include "scene/plan/plan_scene.h"

namespace porthos::scene {

/// What may keep a plan from its goals, a clause each: the goals that the inputs found so far miss,
/// and by how much, and the inputs that are at a limit most of the time.
std::vector<std::string> obstacles(const PlanProblem& made, const planning::Trajectory& found);

}  // namespace porthos::scene
