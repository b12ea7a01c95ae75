#include "scene/plan/obstacles.h"

#include <fmt/format.h>

#include <cmath>

#include "phs/error.h"

namespace porthos::scene {

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
      if (!p.goals[i].row.empty() && !(std::fabs(off) <= 1e-3))
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

}  // namespace porthos::scene
