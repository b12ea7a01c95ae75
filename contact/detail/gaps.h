#pragma once
#include <algorithm>
#include <vector>

#include "contact/contact.h"
#include "mechanics/kinematics.h"
#include "mechanics/passes-inl.h"

namespace porthos::contact {

/// Poses of the bodies, and gaps of placed pairs and stops, at coordinates q; forces at their
/// points.
template <class T>
class Gaps {
 public:
  using Placed = ContactModel::Placed;

  Gaps(const mechanics::Mechanism& mechanism, const Placed& placed)
      : w(mechanism),
        pose(mechanism.nodes().size()),
        touch(placed.points),
        d(placed.pairs.size()),
        origin(placed.pairs.size()),
        depth(2 * placed.stops.size()),
        force(size_t(mechanism.nv())),
        mechanism_(mechanism),
        placed_(placed) {}

  void set_turn_angles(std::span<const T> angles) {
    std::copy_n(angles.begin(), w.turn_angle.size(), w.turn_angle.begin());
  }
  void place(std::span<const T> q) {
    place_bodies(q);
    for (size_t k = 0; k < placed_.pairs.size(); ++k) place_pair(k);
  }
  /// The bodies and the stops alone.
  void place_bodies(std::span<const T> q) {
    if (touch.empty())
      mechanics::passes::place_bodies(mechanism_, w, q.data());
    else
      mechanics::forward_kinematics<T>(mechanism_, w, q, pose);
    for (size_t k = 0; k < placed_.stops.size(); ++k) {
      const auto& at = placed_.stops[k];
      const T turn = at.turn < 0 ? T(0.0) : w.turn_angle[size_t(at.turn)];
      depth[2 * k] = (T(at.lower) - q[at.q]) - turn;
      depth[2 * k + 1] = (q[at.q] - T(at.upper)) + turn;
    }
  }
  /// One pair, after place_bodies().
  void place_pair(size_t k) {
    const ContactModel::Pair& p = placed_.pairs[k];
    const Transform<T> A = world(p.node_a, p.a.pose), B = world(p.node_b, p.b.pose);
    origin[k] = A.r;
    d[k] = B.r - A.r;
    touches<T>(p.a, p.b, {A.R, B.R, d[k]}, std::span(touch).subspan(p.first, p.points));
  }

  // --- forces: wrenches on the nodes and joint forces --------------------------------------------
  void begin_forces() {
    for (auto& g : w.g) g = mechanics::passes::zero_force<T>();
    std::fill(force.begin(), force.end(), T(0.0));
  }
  /// A force on B at point i, and its opposite on A.
  void push_apart(size_t pair, size_t i, const Vec3<T>& f) {
    const ContactModel::Pair& p = placed_.pairs[pair];
    if (p.node_b >= 0) push(p.node_b, arm(p.node_b, pair, i), f);
    if (p.node_a >= 0) push(p.node_a, arm(p.node_a, pair, i), -f);
  }
  /// Adds the joint forces of all wrenches to `force`, leaf to root.
  void collect() {
    const auto& nodes = mechanism_.nodes();
    for (size_t i = placed_.pairs.empty() ? 0 : nodes.size(); i-- > 0;) {
      const mechanics::Node& n = nodes[i];
      mechanics::visit_joint(n.type, [&](auto J) {
        mechanics::unroll<decltype(J)::nv>([&](auto k) {
          T& f = force[size_t(n.v + k)];
          f = f + decltype(J)::template project<k>(n, w.g[i]);
        });
      });
      if (n.parent >= 0) w.g[size_t(n.parent)] += w.X[i].to_parent(w.g[i]);
    }
  }
  /// Velocity of B relative to A at point i, world axes, by the twists in w.V.
  Vec3<T> apart(size_t pair, size_t i) const {
    const ContactModel::Pair& p = placed_.pairs[pair];
    Vec3<T> v{T(0.0), T(0.0), T(0.0)};
    if (p.node_b >= 0) v += velocity(p.node_b, arm(p.node_b, pair, i));
    if (p.node_a >= 0) v = v - velocity(p.node_a, arm(p.node_a, pair, i));
    return v;
  }

  mechanics::Workspace<T> w;
  std::vector<Transform<T>> pose;  ///< of the nodes in the world, if there are pairs
  std::vector<Touch<T>> touch;     ///< per point
  std::vector<Vec3<T>> d, origin;  ///< per pair: from A's shape to B's, and A's in the world
  std::vector<T> depth;            ///< per stop: beyond its lower and its upper limit
  std::vector<T> force;            ///< per freedom

 private:
  Transform<T> world(int node, const Pose& at) const {
    const auto own = mechanics::converted<T>(at);
    return node < 0 ? own : pose[size_t(node)] * own;
  }

  /// From the origin of a node's frame to point i of a pair, world axes.
  Vec3<T> arm(int node, size_t pair, size_t i) const {
    return (origin[pair] - pose[size_t(node)].r) + touch[i].at;
  }
  void push(int node, const Vec3<T>& at, const Vec3<T>& f) {
    const Mat3<T>& R = pose[size_t(node)].R;
    const Vec3<T> own = R.tmul(f);
    w.g[size_t(node)] += mechanics::Force<T>{cross(R.tmul(at), own), own};
  }
  Vec3<T> velocity(int node, const Vec3<T>& at) const {
    const Mat3<T>& R = pose[size_t(node)].R;
    const mechanics::Motion<T>& V = w.V[size_t(node)];
    return R * plus_cross(V.v, V.w, R.tmul(at));
  }

  const mechanics::Mechanism& mechanism_;
  const Placed& placed_;
};

}  // namespace porthos::contact
