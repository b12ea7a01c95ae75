#pragma once
#include <string>

#include "scene/plan/plan_scene.h"

namespace porthos::scene {

/// The text of a scene that repeats a plan: the scene without [plan] and [ensemble], with its model
/// in model.urdf and an [[element]] of type "force" at each planned joint.
std::string replay_scene(const Scene& scene, const PlanProblem& problem,
                         const planning::Trajectory& motion);

}  // namespace porthos::scene
