#pragma once
#include <string>

#include "scene/plan/plan_scene.h"

namespace porthos::scene {

/// plan.svg: places and torques of the planned joints over time, and the torques as shares of their
/// limits, as a complete SVG document.
std::string plan_plot(const Scene& scene, const Assembly& assembly, const PlanScene& wanted,
                      const PlanProblem& made, const planning::Trajectory& motion,
                      const std::string& subtitle);

}  // namespace porthos::scene
