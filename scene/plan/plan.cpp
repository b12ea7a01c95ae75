#include "scene/plan/plan.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "scene/files/files.h"
#include "scene/plan/obstacles.h"
#include "scene/plan/plan_plot.h"
#include "scene/plan/replay_scene.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {

const char* const what_may_help =
    "another duration, wider limits, a shorter step, a rate_weight of 0.05 with a weight of 0.01 "
    "in each joint of [plan.joints], which tame the way, or a guess of the torques "
    "(docs/planning.md)";

namespace {

using Json = nlohmann::ordered_json;

/// "slide", "base.attitude[0]", then the momenta "p.slide"
std::vector<std::string> state_names(const phs::Description& d) {
  std::vector<std::string> names(size_t(d.nx), "x");
  for (const auto& b : d.blocks)
    for (int i = 0; i < b.size; ++i) {
      const std::string index = b.size > 1 ? fmt::format("[{}]", i) : "";
      names[size_t(b.at + i)] = b.name + index;
      if (b.momentum >= 0) names[size_t(b.momentum + i)] = "p." + b.name + index;
    }
  return names;
}

std::string row_of(double t, const double* x, size_t n) {
  std::string row = fmt::format("{}", t);
  for (size_t i = 0; i < n; ++i) row += fmt::format(",{}", x[i]);
  return row;
}

/// Time, states and torques at the ends of the intervals; a torque is that of the interval that
/// begins there.
std::string motion_csv(const PlanProblem& made, const phs::Description& d,
                       const planning::Trajectory& t) {
  const auto& p = made.problem;
  const size_t n = p.start.size(), nw = size_t(p.per_interval()), nu = made.inputs.size();
  std::string text = "time";
  for (const auto& name : state_names(d)) text += "," + name;
  for (const auto& name : made.inputs) text += "," + name + ".torque";
  text += "\n";
  for (int k = 0; k <= p.intervals; ++k) {
    text += row_of(k * p.step(), t.x.data() + size_t(k) * n, n);
    const double* u = t.u.data() + size_t(std::min(k, p.intervals - 1)) * nw;
    for (size_t i = 0; i < nu; ++i) text += fmt::format(",{}", u[i]);
    text += "\n";
  }
  return text;
}

std::string costates_csv(const PlanProblem& made, const phs::Description& d,
                         const std::vector<double>& costates) {
  const size_t n = made.problem.start.size();
  std::string text = "time";
  for (const auto& name : state_names(d)) text += "," + name;
  text += "\n";
  for (int k = 0; k <= made.problem.intervals; ++k)
    text += row_of(k * made.problem.step(), costates.data() + size_t(k) * n, n) + "\n";
  return text;
}

Json plan_json(const PlanReport& r, const PlanProblem& made) {
  const auto& plan = r.plan;
  Json goals = Json::array();
  for (size_t i = 0; i < r.goals.size(); ++i)
    goals.push_back({{"name", r.goals[i]},
                     {"value", made.problem.goals[i].value},
                     {"multiplier", plan.goal_multipliers[i]}});
  Json history = Json::array();
  for (const auto& l : plan.history)
    history.push_back({{"cost", l.cost},
                       {"defect", l.defect},
                       {"stationarity", l.stationarity},
                       {"step", l.step},
                       {"regularisation", l.regularisation}});
  Json meshes = Json::array();
  for (const auto& m : r.meshes) meshes.push_back({{"step_s", m.step}, {"cost", m.cost}});
  return {{"status", to_string(plan.status)},
          {"cost", plan.cost},
          {"residual", plan.residual},
          {"defect", plan.defect},
          {"stationarity", plan.stationarity},
          {"complementarity", plan.complementarity},
          {"approach_iterations", plan.approach},
          {"iterations", plan.iterations},
          {"active_limits", plan.active_limits},
          {"seconds", r.seconds},
          {"method", r.method},
          {"step_s", r.step},
          {"duration_s", r.duration},
          {"duration_slope", plan.duration_slope},
          {"meshes", meshes},
          {"time_weight", r.end_time ? Json(r.end_time->weight) : Json()},
          {"inputs", r.inputs},
          {"input_values", made.problem.inputs == planning::Inputs::held ? "held" : "polynomial"},
          {"goals", goals},
          {"obstacles", r.obstacles},
          {"notes", r.notes},
          {"replays", r.replays()},
          {"replay_distance", std::isfinite(r.replay) ? Json(r.replay) : Json()},
          {"history", history}};
}

/// Runs the replay, compares its end with that of the plan, and measures its energy balance.
void replay(PlanReport& r) {
  const Scene scene = read_scene(r.replay_path);
  const Assembly a = assemble(scene);
  WatchedRun run(scene, a, {}, {});
  for (run.begin(); run.goes_on();) run.step();
  const RunReport report = run.report();
  if (report.outcome != integrators::Outcome::ok) return;
  const auto reached = phs::with_turns(a.model->description(), report.final_state);
  const auto& x = r.plan.motion.x;
  const double* end = x.data() + x.size() - reached.size();
  r.replay = 0;
  r.replay_energy = report.energy.max_rel_error;
  for (size_t i = 0; i < reached.size(); ++i)
    r.replay = std::max(r.replay, std::fabs(reached[i] - end[i]) / (1 + std::fabs(end[i])));
}

/// The solver's plan from the guess. Where the approach leads nowhere it begins at the straight
/// line itself, and `without_approach` says so.
planning::Plan solved(PlanProblem& made, const std::optional<planning::EndTime>& end_time,
                      planning::PlannerOptions options, bool& without_approach) {
  using Status = planning::Plan::Status;
  made.problem.check();
  const double duration = made.problem.duration;
  const auto from_guess = [&]() -> std::optional<planning::Plan> {
    try {
      made.problem.duration = duration;
      return end_time ? planning::solve_end_time(made.problem, made.guess, *end_time, options)
                      : planning::solve(made.problem, made.guess, options);
    } catch (const InvalidArgument&) {  // its first steps have no solution
      return {};
    }
  };
  const auto settled = [](const planning::Plan& p) {
    return p.status == Status::optimal || p.status == Status::stopped;
  };
  auto plan = from_guess();
  if (options.approach && !(plan && settled(*plan))) {
    options.approach = false;
    auto again = from_guess();
    without_approach = again && again->status == Status::optimal;
    if (again && (!plan || settled(*again))) plan = std::move(again);
  }
  if (!plan)
    throw InvalidArgument(std::string("[plan]: the first steps have no solution, expected ") +
                          what_may_help);
  return *std::move(plan);
}

/// Halves the steps of an optimal plan until its cost settles.
std::vector<planning::Mesh> refined(PlanProblem& made, planning::Plan& plan,
                                    const PlanScene& wanted) {
  planning::PlannerOptions options = wanted.options;
  options.approach = false;
  return planning::refine(made.problem, plan, *wanted.mesh_error,
                          [&](planning::Problem& p, const planning::Trajectory& guess) {
                            return wanted.end_time
                                       ? solve_end_time(p, guess, *wanted.end_time, options)
                                       : planning::solve(p, guess, options);
                          });
}

}  // namespace

PlanReport plan(const Scene& scene, const Assembly& assembly, const std::string& out,
                const std::atomic<bool>* stop) {
  PlanScene wanted = read_plan(scene);
  wanted.options.stop = stop;
  PlanProblem made = plan_problem(scene, assembly, wanted);
  PlanReport r;
  r.inputs = made.inputs;
  r.goals = made.goal_names;
  r.method = scene.method;
  const auto begin = std::chrono::steady_clock::now();
  r.plan = solved(made, wanted.end_time, wanted.options, r.without_approach);
  if (wanted.mesh_error && r.plan.status == planning::Plan::Status::optimal)
    r.meshes = refined(made, r.plan, wanted);
  r.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  r.duration = made.problem.duration;
  r.step = made.problem.step();
  r.end_time = wanted.end_time;
  r.replay = NAN;
  const std::filesystem::path folder(out);
  make_folder(folder);
  const auto& d = assembly.model->description();
  write_file(folder / "motion.csv", motion_csv(made, d, r.plan.motion));
  write_file(folder / "plan.svg",
             plan_plot(scene, assembly, wanted, made, r.plan.motion,
                       fmt::format("plan over {:g} s by {}: {}, cost {:.6g}", r.duration, r.method,
                                   to_string(r.plan.status), r.plan.cost)));
  write_file(folder / "costates.csv", costates_csv(made, d, r.plan.costates));
  r.notes = beyond_limits(made, assembly, r.plan.motion);
  if (!r.meshes.empty() && !planning::settled(r.meshes, *wanted.mesh_error))
    r.notes.push_back(
        fmt::format("the cost has not settled to mesh_error = {} at steps of {:.6g} "
                    "s, expected a larger one or a method of higher order",
                    *wanted.mesh_error, r.step));
  if (r.plan.status == planning::Plan::Status::optimal) {
    r.replay_path = (folder / "replay.toml").string();
    write_file(folder / "model.urdf", scene.urdf_text);
    for (const auto& [name, content] : scene.files) {
      make_folder((folder / name).parent_path());
      write_file(folder / name, content);
    }
    Scene timed = scene;
    timed.step = r.step;
    timed.duration = r.duration;
    timed.record_every_given = scene.record_every_given && !r.end_time;
    write_file(r.replay_path, replay_scene(timed, made, r.plan.motion));
    replay(r);
    if (!r.replays())
      r.notes.push_back(fmt::format(
          "the replay {}: small errors grow along this motion, and torques without feedback do not "
          "hold it; let a controller follow the plan, or plan a shorter or a stable motion",
          std::isfinite(r.replay) ? fmt::format("ends {:.1e} from the plan", r.replay)
                                  : "does not come to its end"));
  } else {  // no replay of an earlier plan stays
    std::error_code ignored;
    std::filesystem::remove(folder / "replay.toml", ignored);
    r.obstacles = obstacles(made, r.plan.motion);
    if (r.plan.status == planning::Plan::Status::unreachable)
      r.obstacles.push_back(
          "where the solver stopped no torque moves a goal, which need not be so elsewhere");
  }
  write_file(folder / "plan.json", plan_json(r, made).dump(2) + "\n");
  return r;
}

}  // namespace porthos::scene
