#pragma once
#include <algorithm>

#include "mechanics/kinematics.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

namespace porthos::test {

/// The largest difference of the bodies' places [m] and axes in the world, in the states x of a and
/// y of b, which has bodies of the same names.
inline double apart(const mechanics::MechanicalModel& a, const phs::State& x,
                    const mechanics::MechanicalModel& b, const phs::State& y) {
  const auto poses = [](const mechanics::MechanicalModel& model, const phs::State& s) {
    const mechanics::Mechanism& m = model.mechanism();
    mechanics::Workspace<double> w(m);
    w.set_turns(s.turns);
    std::vector<mechanics::Pose> nodes(m.nodes().size());
    mechanics::forward_kinematics<double>(m, w, std::span(s.x).first(size_t(m.nq())), nodes);
    return nodes;
  };
  const auto at_x = poses(a, x), at_y = poses(b, y);
  double most = 0;
  for (const auto& body : a.mechanism().bodies()) {
    const auto p = mechanics::body_pose<double>(a.mechanism(), body, at_x);
    const auto q = mechanics::body_pose<double>(b.mechanism(), b.mechanism().body(body.name), at_y);
    most = std::max({most, norm(p.r - q.r), norm(p.R.x - q.R.x), norm(p.R.z - q.R.z)});
  }
  return most;
}

}  // namespace porthos::test
