#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "planning/end_time.h"
#include "scene/plan/path_limits.h"

/// The [plan] of a scene: joint torques that bring it to goals at least cost. Keys:
/// docs/planning.md.
namespace porthos::scene {

/// A joint of [plan.joints].
struct PlannedJoint {
  std::string name;
  std::string where;  ///< "file:line:column"
  bool actuated = true;
  std::optional<double> weight = {};  ///< of ∫ torque²
  double rate_weight = 0, drawn_weight = 0;
  std::optional<double> position = {};  ///< at the end
  std::optional<double> rate = 0;
  std::optional<double> torque_limit = {}, rate_limit = {}, lower = {}, upper = {};
  std::optional<double> momentum_limit = {};  ///< of its momentum's magnitude
  double guess = 0, guess_phase = 0;
};

/// The table [plan] of a scene.
struct PlanScene {
  planning::Inputs inputs = planning::Inputs::held;
  planning::PlannerOptions options;
  double smoothing = 1;  ///< of drawn power [W]
  std::optional<planning::EndTime> end_time = {};
  std::optional<double> mesh_error = {};  ///< relative
  std::vector<PlannedJoint> joints;
  std::vector<PlannedOutput> outputs = {};
  std::optional<std::array<double, 4>> attitude = {};  ///< of the base, at the end
  std::optional<double> attitude_limit = {};           ///< of its angle from the start [rad]
  std::string base_where = {};                         ///< "file:line:column"
  double base_weight = 0;                              ///< of ∫ |ω|²
};

/// Reads [plan] of a scene that has been read.
/// @throws InvalidArgument "file:line:column: …" for a missing table, unknown keys, numbers out of
///   range; for a scene that has what cannot be planned: an orbit, loops, events, controllers,
///   actuators, contacts, a method that is no Gauss method, steps that vary
PlanScene read_plan(const Scene& scene);

/// The problem of a plan.
struct PlanProblem {
  planning::Problem problem;
  planning::Trajectory guess;
  std::vector<std::string> inputs;      ///< joint of each input
  std::vector<std::string> goal_names;  ///< of each goal
};
/// @throws InvalidArgument for a joint the model does not have, a goal of a base that is fixed
PlanProblem plan_problem(const Scene& scene, const Assembly& assembly, const PlanScene& plan);

}  // namespace porthos::scene
