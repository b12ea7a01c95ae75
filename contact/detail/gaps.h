#pragma once
#include <algorithm>
#include <vector>

#include "contact/contact.h"
#include "mechanics/kinematics.h"
#include "mechanics/passes-inl.h"

namespace porthos::contact {

/// Poses of the bodies, and gaps of all pairs and stops of a model, at coordinates q.
template <class T>
class Gaps {
 public:
  using Placed = ContactModel::Placed;

  Gaps(const ContactModel& model, const Placed& placed)
      : w(model.mechanism()),
        pose(model.mechanism().nodes().size()),
        touch(placed.points),
        d(placed.pairs.size()),
        origin(placed.pairs.size()),
        depth(2 * placed.stops.size()),
        model_(model),
        placed_(placed) {}

  void set_turn_angles(std::span<const T> angles) {
    std::copy_n(angles.begin(), w.turn_angle.size(), w.turn_angle.begin());
  }
  void place(std::span<const T> q) {
    if (touch.empty())
      mechanics::passes::place_bodies(model_.mechanism(), w, q.data());
    else
      mechanics::forward_kinematics<T>(model_.mechanism(), w, q, pose);
    for (size_t k = 0; k < placed_.pairs.size(); ++k) {
      const ContactModel::Pair& p = placed_.pairs[k];
      const Transform<T> A = world(p.node_a, p.a.pose), B = world(p.node_b, p.b.pose);
      origin[k] = A.r;
      d[k] = B.r - A.r;
      touches<T>(p.a, p.b, {A.R, B.R, d[k]}, std::span(touch).subspan(p.first, p.points));
    }
    for (size_t k = 0; k < placed_.stops.size(); ++k) {
      const auto& at = placed_.stops[k];
      const Stop& s = model_.stops()[k];
      const T turn = at.turn < 0 ? T(0.0) : w.turn_angle[size_t(at.turn)];
      depth[2 * k] = (T(s.lower) - q[at.q]) - turn;
      depth[2 * k + 1] = (q[at.q] - T(s.upper)) + turn;
    }
  }

  mechanics::Workspace<T> w;
  std::vector<Transform<T>> pose;  ///< of the nodes in the world, if there are pairs
  std::vector<Touch<T>> touch;     ///< per point
  std::vector<Vec3<T>> d, origin;  ///< per pair: from A's shape to B's, and A's in the world
  std::vector<T> depth;            ///< per stop: beyond its lower and its upper limit

 private:
  Transform<T> world(int node, const Pose& at) const {
    const auto own = mechanics::converted<T>(at);
    return node < 0 ? own : pose[size_t(node)] * own;
  }

  const ContactModel& model_;
  const Placed& placed_;
};

}  // namespace porthos::contact
