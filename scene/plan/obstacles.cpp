#include "scene/plan/obstacles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::scene {
namespace {

/// x' at the begins of the intervals, and at the end with the last inputs; nx numbers each.
std::vector<double> rates_of(const planning::Problem& p, const planning::Trajectory& motion) {
  const size_t nx = p.start.size(), nu = size_t(p.dynamics->nu()), per = size_t(p.per_interval());
  std::vector<double> f(motion.x.size());
  for (size_t k = 0; k * nx < f.size(); ++k) {
    const double t = double(k) * p.step();
    const size_t from = std::min(k * per, motion.u.size() - nu);
    p.dynamics->field({&t, 1}, std::span(motion.x).subspan(k * nx, nx),
                      std::span(motion.u).subspan(from, nu), std::span(f).subspan(k * nx, nx));
  }
  return f;
}

}  // namespace

std::vector<std::string> obstacles(const PlanProblem& made, const planning::Trajectory& found) {
  const planning::Problem& p = made.problem;
  std::vector<std::string> list;
  planning::Trajectory moved = found;
  try {
    planning::follow_inputs(p, moved);
    const double* end = moved.x.data() + moved.x.size() - p.start.size();
    for (size_t i = 0; i < p.goals.size(); ++i) {
      double off = -p.goals[i].value;
      for (const auto& [k, factor] : p.goals[i].row) off += factor * end[k];
      if (p.goals[i].number) off += p.goals[i].number->value(p.duration, {end, p.start.size()});
      if (p.goals[i].rate < 0 && !(std::fabs(off) <= 1e-3))
        list.push_back(fmt::format("goal '{}' is missed by {:.3g}", made.goal_names[i], off));
    }
  } catch (const InvalidArgument&) {
    list.push_back("the motion of the inputs found so far cannot be followed");
  }
  const size_t nu = made.inputs.size();
  for (size_t a = 0; a < nu && !p.limits.input_upper.empty(); ++a) {
    const double low = p.limits.input_lower[a], high = p.limits.input_upper[a];
    const double near = 1e-3 * (high - low);  // infinite without a limit, where none is near
    size_t at = 0, all = 0;
    for (size_t i = a; i < found.u.size(); i += nu, ++all)
      at += std::isfinite(near) && (found.u[i] < low + near || found.u[i] > high - near);
    if (2 * at > all)
      list.push_back(fmt::format("the torque of '{}' is at its limit {:.0f} % of the time",
                                 made.inputs[a], 100 * double(at) / double(all)));
  }
  return list;
}

std::vector<std::string> beyond_limits(const PlanProblem& made, const Assembly& assembly,
                                       const planning::Trajectory& motion) {
  std::vector<std::string> list;
  const size_t nx = made.problem.start.size(), nu = made.inputs.size();
  const auto f = rates_of(made.problem, motion);
  for (const auto& j : assembly.mechanical->mechanism().joint_properties()) {
    const bool turns = j.turn >= 0;
    double least = HUGE_VAL, most = -HUGE_VAL, effort = 0, rate = 0;
    for (size_t i = size_t(j.q); i < motion.x.size(); i += nx) {
      least = std::fmin(least, motion.x[i]);
      most = std::fmax(most, motion.x[i]);
      rate = std::fmax(rate, std::fabs(f[i]));
    }
    const auto input = std::ranges::find(made.inputs, j.joint);
    for (size_t i = size_t(input - made.inputs.begin());
         input != made.inputs.end() && i < motion.u.size(); i += nu)
      effort = std::fmax(effort, std::fabs(motion.u[i]));
    const auto add = [&](const char* what, double value, double limit, const char* unit,
                         const char* key) {
      list.push_back(
          fmt::format("'{}' {} {:.6g} {}, beyond the {:.6g} {} of the model file: state {} in its "
                      "[plan.joints]",
                      j.joint, what, value, unit, limit, unit, key));
    };
    const double slack = 1e-9;  // of a limit that is stated and reached
    if (j.lower && least < *j.lower - slack)
      add("goes to", least, *j.lower, turns ? "rad" : "m", "lower");
    if (j.upper && most > *j.upper + slack)
      add("goes to", most, *j.upper, turns ? "rad" : "m", "upper");
    if (j.rate && *j.rate > 0 && rate > *j.rate * (1 + 1e-6))
      add("moves at", rate, *j.rate, turns ? "rad/s" : "m/s", "rate_limit");
    if (j.effort && *j.effort > 0 && effort > *j.effort * (1 + slack))
      add("takes", effort, *j.effort, turns ? "N m" : "N", "torque_limit");
  }
  return list;
}

}  // namespace porthos::scene
