#pragma once
#include <cstring>

#include "mechanics/joint_list.h"
#include "mechanics/mechanism.h"

/// Where bodies are in their parents, and what that does to twists, wrenches and inertias. The
/// transforms of axial bodies are screws (Node::axial), those of the others matrices.
namespace porthos::mechanics::passes {

/// Sine and cosine of every angle. Doubles are evaluated four at a time, with identical bits.
template <class T>
void sines(const Mechanism& m, Workspace<T>& w, const T* q) {
  for (const Node& n : m.nodes())
    if (n.turn >= 0) w.angle[size_t(n.turn)] = q[n.q];
  if constexpr (std::is_same_v<T, double>) {
    for (size_t i = 0; i < w.angle.size(); i += 4) {
      phs::Pack4 a, s, c;
      std::memcpy(&a, &w.angle[i], sizeof a);
      sincos(a, s, c);
      std::memcpy(&w.sine[i], &s, sizeof s);
      std::memcpy(&w.cosine[i], &c, sizeof c);
    }
  } else {
    for (size_t i = 0; i < w.turn_angle.size(); ++i) sincos(w.angle[i], w.sine[i], w.cosine[i]);
  }
}

/// The pose of a body in its parent, from the screw of a joint about z with its zero.
template <class T>
Transform<T> pose(const Node& n, const Screw<T>& z) {
  if (!n.axial) {
    const Mat3<T> P(n.placement.R);
    return {{fma(z.c, P.x, z.s * P.y), fma(z.c, P.y, -(z.s * P.x)), P.z},
            fma(z.d, P.z, Vec3<T>(n.placement.r))};
  }
  const auto [c, s, d] = constant<T>(n.tilt.screw);
  Transform<T> X{{{z.c, c * z.s, s * z.s}, {-z.s, c * z.c, s * z.c}, {T(0.0), -s, c}},
                 {d, -s * z.d, c * z.d}};
  const auto before = constant<T>(n.before.screw);
  for (Vec3<T>* a : {&X.R.x, &X.R.y, &X.R.z, &X.r}) screw::turn<2>(before, *a);
  X.r.z = X.r.z + before.d;
  return X;
}
/// The same for any joint.
template <class J, class T>
Transform<T> pose(const Node& n, const T* q, const Angle<T>& angle) {
  if constexpr (J::about_z) {
    return pose(n, constant<T>(n.zero) * J::screw(n, q, angle));
  } else {
    return J::place(n, q, angle);
  }
}
/// The same with its own sine and cosine.
template <class J, class T>
Transform<T> place(const Node& n, const T* q, T turn_angle) {
  Angle<T> a{T(0.0), T(1.0), turn_angle};
  if (n.turn >= 0) sincos(q[0], a.sine, a.cosine);
  return pose<J>(n, q, a);
}

/// Whether joint J is about z; void: a joint that is not known, which may be.
template <class J>
inline constexpr bool about_z = J::about_z;
template <>
inline constexpr bool about_z<void> = true;

/// Where body i is in its parent, once `sines` has been called: as screws if it is axial, else as
/// X_i.
template <class J, class T>
[[gnu::always_inline]] inline void place_body(const Node& n, Workspace<T>& w, size_t i,
                                              const T* q) {
  Angle<T> angle{T(0.0), T(1.0), T(0.0)};
  if (n.turn >= 0) {
    const size_t k = size_t(n.turn);
    angle = {w.sine[k], w.cosine[k], w.turn_angle[k]};
  }
  if constexpr (J::about_z) {
    w.screw[i] = constant<T>(n.zero) * J::screw(n, q + n.q, angle);
    if (!n.axial) w.X[i] = pose(n, w.screw[i]);
  } else {
    w.X[i] = J::place(n, q + n.q, angle);
  }
}
/// X_i of the axial bodies, after place_body.
template <class T>
void place_axial_bodies(const Mechanism& m, Workspace<T>& w) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].axial) w.X[i] = pose(nodes[i], w.screw[i]);
}

/// Screws of the axial bodies and X_i of the others.
template <class T>
void place_joints(const Mechanism& m, Workspace<T>& w, const T* q) {
  sines(m, w, q);
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) { place_body<decltype(J)>(n, w, i, q); });
  }
}
/// X_i(q) of all bodies, and the screws.
template <class T>
void place_bodies(const Mechanism& m, Workspace<T>& w, const T* q) {
  place_joints(m, w, q);
  place_axial_bodies(m, w);
}

/// From the child's axes to the parent's, and back, by a constant screw. Does nothing where the
/// screw does not turn or not shift.
template <int axis, class T, class A>
[[gnu::always_inline]] inline void climb(const FixedScrew& x, A& a) {
  using Turn = FixedScrew::Turn;
  if (x.turn == Turn::any)
    screw::turn<axis>(constant<T>(x.screw), a);
  else if (x.turn == Turn::right)
    screw::turn<axis>(RightAngle<1>{}, a);
  else if (x.turn == Turn::left)
    screw::turn<axis>(RightAngle<-1>{}, a);
  if constexpr (!std::is_same_v<A, Vec3<T>>)
    if (x.screw.d != 0) screw::shift<axis>(T(x.screw.d), a);
}
template <int axis, class T, class A>
[[gnu::always_inline]] inline void descend(const FixedScrew& x, A& a) {
  using Turn = FixedScrew::Turn;
  if constexpr (!std::is_same_v<A, Vec3<T>>)
    if (x.screw.d != 0) screw::shift_back<axis>(T(x.screw.d), a);
  if (x.turn == Turn::any)
    screw::turn_back<axis>(constant<T>(x.screw), a);
  else if (x.turn == Turn::right)
    screw::turn_back<axis>(RightAngle<1>{}, a);
  else if (x.turn == Turn::left)
    screw::turn_back<axis>(RightAngle<-1>{}, a);
}
/// Whether the screw about z shifts. J: void if the joint is not known.
template <class J>
[[gnu::always_inline]] inline bool slides(const Node& n) {
  if constexpr (std::is_base_of_v<Revolute, J>)
    return n.zero.d != 0;
  else
    return true;
}

/// From the child's axes to the parent's, of an axial body: a direction, a wrench, a first moment,
/// a rigid inertia.
template <class J, class T, class A>
[[gnu::always_inline]] inline void climb(const Node& n, const Screw<T>& z, A& a) {
  screw::turn<2>(z, a);
  if constexpr (!std::is_same_v<A, Vec3<T>>)
    if (slides<J>(n)) screw::shift<2>(z.d, a);
  climb<0, T>(n.tilt, a);
  climb<2, T>(n.before, a);
}
/// The same for an articulated inertia. `free`: without its row and column of rotation about z.
template <class J, bool free, class T>
[[gnu::always_inline]] inline void climb(const Node& n, const Screw<T>& z,
                                         ArticulatedInertia<T>& a) {
  screw::turn<2, free>(z, a);
  if (slides<J>(n)) screw::shift<2, free>(z.d, a);
  if constexpr (free) screw::clear_about_z(a);
  climb<0, T>(n.tilt, a);
  climb<2, T>(n.before, a);
}

/// What the parent knows in the axes and about the origin of body i: a twist, a direction.
template <class J, class T>
[[gnu::always_inline]] inline Motion<T> to_child(const Node& n, const Workspace<T>& w, size_t i,
                                                 const Motion<T>& of_parent) {
  if constexpr (about_z<J>) {
    if (n.axial) {
      Motion<T> a = of_parent;
      descend<2, T>(n.before, a);
      descend<0, T>(n.tilt, a);
      if (slides<J>(n)) screw::shift_back<2>(w.screw[i].d, a);
      screw::turn_back<2>(w.screw[i], a);
      return a;
    }
  }
  return w.X[i].to_child(of_parent);
}
template <class J, class T>
[[gnu::always_inline]] inline Vec3<T> to_child(const Node& n, const Workspace<T>& w, size_t i,
                                               const Vec3<T>& of_parent) {
  if constexpr (about_z<J>) {
    if (n.axial) {
      Vec3<T> a = of_parent;
      descend<2, T>(n.before, a);
      descend<0, T>(n.tilt, a);
      screw::turn_back<2>(w.screw[i], a);
      return a;
    }
  }
  return w.X[i].R.tmul(of_parent);
}
/// A wrench or momentum of body i in the axes and about the origin of its parent.
template <class J, class T>
[[gnu::always_inline]] inline Force<T> to_parent(const Node& n, const Workspace<T>& w, size_t i,
                                                 const Force<T>& of_child) {
  if constexpr (about_z<J>) {
    if (n.axial) {
      Force<T> a = of_child;
      climb<J>(n, w.screw[i], a);
      return a;
    }
  }
  return w.X[i].to_parent(of_child);
}
/// A frame on body i in the frame of its parent.
template <class J, class T>
[[gnu::always_inline]] inline Transform<T> to_parent(const Node& n, const Workspace<T>& w, size_t i,
                                                     const Transform<T>& frame) {
  if constexpr (about_z<J>) {
    if (n.axial) {
      Transform<T> X = frame;
      for (Vec3<T>* axis : {&X.R.x, &X.R.y, &X.R.z}) climb<J>(n, w.screw[i], *axis);
      screw::Moment<T> origin{X.r, T(1.0)};  // a point is the first moment of a unit mass there
      climb<J>(n, w.screw[i], origin);
      X.r = origin.mc;
      return X;
    }
  }
  return w.X[i] * frame;
}

}  // namespace porthos::mechanics::passes
