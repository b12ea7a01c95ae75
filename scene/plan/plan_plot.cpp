#include "scene/plan/plan_plot.h"

#include <algorithm>
#include <cmath>

#include "scene/plot/trace_plot.h"

namespace porthos::scene {
namespace {

/// Panels by what they show, in the order they were asked for.
class Panels {
 public:
  std::vector<TraceLine>& operator[](const std::string& what) {
    const auto at = std::ranges::find(list_, what, &TracePanel::what);
    return at != list_.end() ? at->lines : list_.emplace_back(TracePanel{what, {}}).lines;
  }
  std::vector<TracePanel>& list() { return list_; }

 private:
  std::vector<TracePanel> list_;
};

TraceLine level(const std::string& name, double value, double duration, Stroke stroke) {
  return {name, {0, duration}, {value, value}, stroke, {}};
}

/// The torque as the method sees it, each interval from its begin to just before its end.
TraceLine torque(const PlanProblem& made, const planning::Trajectory& motion, size_t input) {
  const auto& p = made.problem;
  const auto signal = planning::input_signal(p, motion, int(input));
  const int parts = p.inputs == planning::Inputs::held ? 1 : 8;
  TraceLine line{made.inputs[input]};
  for (int k = 0; k < p.intervals; ++k)
    for (int i = 0; i <= parts; ++i) {
      const double inside = std::min(double(i) / parts, 1 - 1e-9);
      line.t.push_back((k + double(i) / parts) * p.step());
      line.value.push_back((*signal)((k + inside) * p.step()));
    }
  return line;
}

}  // namespace

std::string plan_plot(const Scene& scene, const Assembly& a, const PlanScene& wanted,
                      const PlanProblem& made, const planning::Trajectory& motion,
                      const std::string& subtitle) {
  const auto& p = made.problem;
  const size_t n = p.start.size();
  Panels panels;
  for (const PlannedJoint& j : wanted.joints) {
    const auto& c = a.mechanism->coordinate(j.name);
    const bool turns = c.unit == "rad";
    const std::string what = turns ? "angle [rad]" : "place [m]";
    TraceLine line{j.name};
    for (int k = 0; k <= p.intervals; ++k) {
      line.t.push_back(k * p.step());
      line.value.push_back(motion.x[size_t(k) * n + size_t(c.q)]);
    }
    panels[what].push_back(std::move(line));
    for (const auto& [limit, end] : {std::pair{j.lower, "lower"}, {j.upper, "upper"}})
      if (limit)
        panels[what].push_back(
            level(std::string(end) + " limit of " + j.name, *limit, p.duration, Stroke::limit));
  }
  std::vector<TraceLine> shares;
  for (size_t i = 0; i < made.inputs.size(); ++i) {
    const auto& c = a.mechanism->coordinate(made.inputs[i]);
    const TraceLine line = torque(made, motion, i);
    panels[(c.unit == "rad" ? "torque [" : "force [") + c.effort_unit + "]"].push_back(line);
    const auto j = std::ranges::find(wanted.joints, made.inputs[i], &PlannedJoint::name);
    if (j == wanted.joints.end() || !j->torque_limit) continue;
    shares.push_back(line);
    for (double& u : shares.back().value) u /= *j->torque_limit;
  }
  if (!shares.empty()) {
    shares.push_back(level("upper limit", 1, p.duration, Stroke::limit));
    shares.push_back(level("lower limit", -1, p.duration, Stroke::limit));
    panels["share of the torque's limit [1]"] = std::move(shares);
  }
  return trace_plot(panels.list(), scene.title, subtitle);
}

}  // namespace porthos::scene
