#include "mechanics/detail/link_frames.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "mechanics/joint_list.h"

namespace porthos::mechanics {
namespace {

using E = long double;  // rounded once

bool is_about_z(const Node& n) {
  bool result = false;
  visit_joint(n.type, [&](auto J) { result = decltype(J)::about_z; });
  return result;
}
Screw<double> rounded(const Screw<E>& x) { return Screw<double>(x); }
Screw<E> inverse(const Screw<double>& x) { return {x.c, -E(x.s), -E(x.d)}; }

Transform<E> about_x(const Screw<E>& x) {
  return {{{1, 0, 0}, {0, x.c, x.s}, {0, -x.s, x.c}}, {x.d, 0, 0}};
}

Vec3<E> turned_back(const Screw<E>& x, Vec3<E> a) {
  screw::turn_back<2>(x, a);
  return a;
}
/// A placement as three screws, about z, x and z: the axis before, the common normal of the two
/// axes, and the axis after.
struct Placement {
  Screw<double> before, tilt, after;
};

/// The first angle is in (-90°, 90°]. Nothing, if the axes are so nearly parallel that their common
/// normal is far away: frames there would cost digits.
std::optional<Placement> as_screws(const Pose& pose) {
  const auto P = converted<E>(pose);
  const auto unit = [](E c, E s, E d) {
    const E length = std::hypot(c, s);
    return Screw<E>{c / length, s / length, d};
  };
  const auto front = [](E c, E s) { return c > 0 || (c == 0 && s > 0) ? E(1) : E(-1); };
  const E sine = std::hypot(P.R.z.x, P.R.z.y), r_xy = std::hypot(P.r.x, P.r.y);
  Screw<E> before{1, 0, 0}, tilt, after{1, 0, 0};
  if (sine == 0) {  // parallel axes: any common normal will do, this one goes through the child
    const E sign = front(P.r.x, P.r.y);
    if (r_xy > 0) before = unit(sign * P.r.x, sign * P.r.y, 0);
    before.d = P.r.z;
    tilt = {std::copysign(E(1), P.R.z.z), 0, sign * r_xy};
  } else {
    const E sign = front(-P.R.z.y, P.R.z.x), sin_tilt = sign * sine;
    before = unit(-sign * P.R.z.y, sign * P.R.z.x, 0);
    const auto r = turned_back(before, P.r);
    tilt = unit(P.R.z.z, sin_tilt, r.x);
    after.d = -r.y / sin_tilt;
    before.d = r.z - tilt.c * after.d;
  }
  // What is left of R is Rx(tilt) Rz(after), whose first column is (cos, c sin, s sin). For nearly
  // parallel axes the two angles about z are uncertain one by one; this makes their sum right.
  const auto x = turned_back(before, P.R.x);
  after = unit(x.x, tilt.c * x.y + tilt.s * x.z, after.d);
  const E far = 4 * norm(P.r);
  if (std::fabs(before.d) > far || std::fabs(after.d) > far) return {};
  return Placement{rounded(before), rounded(tilt), rounded(after)};
}

class LinkFrames {
 public:
  LinkFrames(std::vector<Node>& nodes, std::vector<BodyFrame>& bodies)
      : nodes_(nodes), bodies_(bodies), children_(nodes.size()), on_(nodes.size()) {
    for (size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i].parent >= 0) children_[size_t(nodes[i].parent)].push_back(i);
    for (size_t i = 0; i < bodies.size(); ++i)
      if (bodies[i].node >= 0) on_[size_t(bodies[i].node)].push_back(i);
  }

  void choose() {
    for (size_t i = 0; i < nodes_.size(); ++i) {
      // The frame of a body suits its first child: no screw before that one's tilt.
      bool first = is_about_z(nodes_[i]);
      for (const size_t k : children_[i]) {
        if (!is_about_z(nodes_[k])) continue;
        auto screws = as_screws(nodes_[k].placement);
        if (!screws || !may_move(k, screws->after)) continue;
        if (first && may_move(i, screws->before)) {
          move(i, screws->before);
          screws->before = {1, 0, 0};
          first = false;
        }
        move(k, {screws->after.c, -screws->after.s, -screws->after.d});
        Node& n = nodes_[k];
        n.axial = true;
        n.before = screws->before;
        n.tilt = screws->tilt;
        n.zero = {1, 0, 0};
        n.placement = converted<double>(pose_about_z(Screw<E>(screws->before)) *
                                        about_x(Screw<E>(screws->tilt)));
      }
    }
  }

 private:
  /// Whether no placement that stays a matrix is rounded, which wider scalars would see: those of
  /// children on other joints are, unless the move is by right angles.
  bool may_move(size_t i, const Screw<double>& x) const {
    const bool right_angle = x.c == 0 || x.s == 0;
    return std::all_of(children_[i].begin(), children_[i].end(), [&](size_t k) {
      return !nodes_[k].axial && (right_angle || is_about_z(nodes_[k]));
    });
  }
  /// The frame of a body becomes the one that a screw about its z axis leads to.
  void move(size_t i, const Screw<double>& x) {
    if (FixedScrew(x).is_identity()) return;
    const Screw<E> back = inverse(x);
    Node& n = nodes_[i];
    n.zero = rounded(Screw<E>(n.zero) * Screw<E>(x));
    RigidInertia<E> moved{n.inertia.m, Vec3<E>(n.inertia.mc), Sym3<E>(n.inertia.I)};
    screw::turn<2>(back, moved);
    screw::shift<2>(back.d, moved);
    n.inertia = {n.inertia.m, Vec3d(moved.mc), Sym3<double>(moved.I)};
    const auto here = pose_about_z(back);
    for (const size_t k : children_[i])
      nodes_[k].placement = converted<double>(here * converted<E>(nodes_[k].placement));
    for (const size_t k : on_[i])
      bodies_[k].pose = converted<double>(here * converted<E>(bodies_[k].pose));
  }

  std::vector<Node>& nodes_;
  std::vector<BodyFrame>& bodies_;
  std::vector<std::vector<size_t>> children_, on_;  ///< nodes and bodies of each node
};

}  // namespace

void choose_link_frames(std::vector<Node>& nodes, std::vector<BodyFrame>& bodies) {
  LinkFrames(nodes, bodies).choose();
}

}  // namespace porthos::mechanics
