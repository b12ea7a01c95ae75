#pragma once
#include <atomic>
#include <string>

#include "planning/mesh.h"
#include "scene/plan/plan_scene.h"

namespace porthos::scene {

/// What to change in a scene for which no plan was found: a part of a sentence.
extern const char* const what_may_help;

/// What porthos plan found.
struct PlanReport {
  planning::Plan plan;
  std::vector<std::string> inputs, goals;  ///< names
  std::string method;
  double step = 0, duration = 0;                   ///< [s], of the plan
  std::optional<planning::EndTime> end_time = {};  ///< if it was free
  std::vector<planning::Mesh> meshes = {};         ///< with mesh_error, the first one included
  double seconds = 0;                              ///< wall time of the solver
  /// Largest distance of the end of the replayed run from the planned end, over the state numbers,
  /// each relative to 1 + its size; NaN if the replay failed.
  double replay = 0;
  /// Whether an optimum was found whose replay reaches it: along an unstable motion what the solver
  /// leaves over grows, and torques without feedback do not hold the plan.
  bool replays() const { return plan.status == planning::Plan::Status::optimal && replay <= 1e-3; }
  bool without_approach = false;       ///< the approach led nowhere, the straight line did
  double replay_energy = 0;            ///< largest error of its energy balance, relative
  std::vector<std::string> obstacles;  ///< without a plan: what may be in its way
  std::vector<std::string> notes;      ///< limits of the model file that the plan does not keep
  std::string replay_path;             ///< of the scene that repeats the plan; empty without a plan
};

/// Plans a scene and writes into the folder `out`: plan.json, plan.svg, motion.csv, costates.csv,
/// and, if an optimum was found, replay.toml with model.urdf, which porthos run runs and porthos
/// verify checks. The replay is run once in memory.
/// @throws InvalidArgument as read_plan(), plan_problem() and planning::solve(); IoError
PlanReport plan(const Scene& scene, const Assembly& assembly, const std::string& out,
                const std::atomic<bool>* stop = nullptr);

}  // namespace porthos::scene
