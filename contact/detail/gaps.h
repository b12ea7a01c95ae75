#pragma once
#include <algorithm>
#include <utility>
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

  Gaps(const mechanics::Mechanism& mechanism, const Placed& placed, Ends ends = Ends::fade)
      : w(mechanism),
        pose(mechanism.nodes().size()),
        seat(placed.seats.size()),
        touch(placed.points),
        d(placed.pairs.size()),
        origin(placed.pairs.size()),
        depth(2 * placed.stops.size()),
        force(size_t(mechanism.nv())),
        mechanism_(mechanism),
        placed_(placed),
        ends_(ends) {}

  void set_turn_angles(std::span<const T> angles) {
    std::copy_n(angles.begin(), w.turn_angle.size(), w.turn_angle.begin());
  }
  /// The bodies at a state, turns included, with their surfaces, and the stops.
  void place_bodies(const phs::State& s) {
    std::vector<T> q(size_t(mechanism_.nq())), turns(size_t(mechanism_.angle_count()));
    for (size_t i = 0; i < q.size(); ++i) q[i] = T(s.x[i] + s.lo[i]);
    for (size_t i = 0; i < turns.size(); ++i) turns[i] = T(double(s.turns[i]) * phs::two_pi_hi);
    set_turn_angles(turns);
    place_bodies(std::span<const T>(q));
  }
  void place(std::span<const T> q) {
    place_bodies(q);
    for (size_t k = 0; k < placed_.pairs.size(); ++k) place_pair(k);
  }
  /// The bodies with their surfaces, and the stops.
  void place_bodies(std::span<const T> q) {
    if (seat.empty())
      mechanics::passes::place_bodies(mechanism_, w, q.data());
    else
      mechanics::forward_kinematics<T>(mechanism_, w, q, pose);
    for (size_t k = 0; k < seat.size(); ++k) {
      const ContactModel::Seat& s = placed_.seats[k];
      const auto own = mechanics::converted<T>(s.shape.pose);
      seat[k] = s.node < 0 ? own : pose[size_t(s.node)] * own;
    }
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
    const Transform<T>&A = seat[p.a], &B = seat[p.b];
    origin[k] = A.r;
    d[k] = B.r - A.r;
    touches<T>(placed_.seats[p.a].shape, placed_.seats[p.b].shape, {A.R, B.R, d[k]},
               std::span(touch).subspan(p.first, p.points), ends_);
  }
  /// All pairs, which may have changed.
  void place_pairs() {
    touch.resize(placed_.points);
    d.resize(placed_.pairs.size());
    origin.resize(placed_.pairs.size());
    for (size_t k = 0; k < placed_.pairs.size(); ++k) place_pair(k);
  }

  // --- forces: wrenches on the nodes and joint forces --------------------------------------------
  void begin_forces() {
    for (auto& g : w.g) g = mechanics::passes::zero_force<T>();
    std::fill(force.begin(), force.end(), T(0.0));
  }
  /// A force on B at point i, and its opposite on A.
  void push_apart(size_t pair, size_t i, const Vec3<T>& f) {
    const auto [a, b] = nodes(pair);
    if (b >= 0) push(b, arm(b, pair, i), f);
    if (a >= 0) push(a, arm(a, pair, i), -f);
  }
  /// Adds the joint forces of all wrenches to `force`, leaf to root.
  void collect() {
    for (size_t i = placed_.pairs.empty() ? 0 : mechanism_.nodes().size(); i-- > 0;) collect_at(i);
  }
  /// Of some nodes, which have no children but these, root to leaf.
  void collect(std::span<const size_t> nodes) {
    for (size_t k = nodes.size(); k-- > 0;) collect_at(nodes[k]);
  }
  /// Of the two surfaces of a pair, -1: fixed in the world.
  std::pair<int, int> nodes(size_t pair) const {
    const ContactModel::Pair& p = placed_.pairs[pair];
    return {placed_.seats[p.a].node, placed_.seats[p.b].node};
  }
  /// Velocity of B relative to A at point i, world axes, by the twists in w.V.
  Vec3<T> apart(size_t pair, size_t i) const {
    const auto [a, b] = nodes(pair);
    Vec3<T> v{T(0.0), T(0.0), T(0.0)};
    if (b >= 0) v += velocity(b, arm(b, pair, i));
    if (a >= 0) v = v - velocity(a, arm(a, pair, i));
    return v;
  }

  mechanics::Workspace<T> w;
  std::vector<Transform<T>> pose;  ///< of the nodes in the world, if there are pairs
  std::vector<Transform<T>> seat;  ///< of the surfaces in the world
  std::vector<Touch<T>> touch;     ///< per point
  std::vector<Vec3<T>> d, origin;  ///< per pair: from A's shape to B's, and A's in the world
  std::vector<T> depth;            ///< per stop: beyond its lower and its upper limit
  std::vector<T> force;            ///< per freedom

 private:
  void collect_at(size_t i) {
    const mechanics::Node& n = mechanism_.nodes()[i];
    mechanics::visit_joint(n.type, [&](auto J) {
      mechanics::unroll<decltype(J)::nv>([&](auto k) {
        T& f = force[size_t(n.v + k)];
        f = f + decltype(J)::template project<k>(n, w.g[i]);
      });
    });
    if (n.parent >= 0) w.g[size_t(n.parent)] += w.X[i].to_parent(w.g[i]);
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
  Ends ends_;
};

}  // namespace porthos::contact
