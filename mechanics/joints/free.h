#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// Six degrees of freedom. q = (position of the child origin in the parent frame, quaternion child
/// to parent), p = (momentum P conjugate to the position, in parent axes; lift π). Joint rates: the
/// child's twist relative to the parent in its own axes, [angular; linear]. For a body free in the
/// world, P is the linear momentum of its whole tree.
struct Free : AxisJoint<0, 1, 2, 3, 4, 5> {
  static constexpr std::string_view name = "free";
  static constexpr int nq = 7;
  static constexpr bool lifted = true;
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::linear, 3, ".position", "m", "kg m/s", "N", "m/s"},
      CoordinateBlock{phs::BlockKind::rotation, 4, ".attitude", "1", "kg m^2/s", "N m", "rad/s"}};

  template <class T>
  static Transform<T> place(const Node& n, const T* q, const Angle<T>&) {
    const Mat3<T> P(n.placement.R);
    return {P * rotation_matrix(Quaternion<T>::load(q + 3)),
            Vec3<T>(n.placement.r) + P * Vec3<T>{q[0], q[1], q[2]}};
  }
  template <class T>
  static void momentum(const T* q, const T* p, T* mu) {
    const auto xi = Quaternion<T>::load(q + 3);
    const Vec3<T> m = body_momentum(xi, Quaternion<T>::load(p + 3));
    const Vec3<T> l = rotation_matrix(xi).tmul({p[0], p[1], p[2]});
    mu[0] = m.x;
    mu[1] = m.y;
    mu[2] = m.z;
    mu[3] = l.x;
    mu[4] = l.y;
    mu[5] = l.z;
  }
  template <class T>
  static void lift(const T* q, const T* mu, T* p) {
    const auto xi = Quaternion<T>::load(q + 3);
    const Vec3<T> P = rotation_matrix(xi) * Vec3<T>{mu[3], mu[4], mu[5]};
    p[0] = P.x;
    p[1] = P.y;
    p[2] = P.z;
    lift_momentum(xi, Vec3<T>{mu[0], mu[1], mu[2]}).store(p + 3);
  }
  template <class T>
  static void transposed_lift(const T* q, const T* e, T* y) {
    momentum(q, e, y);  // of its linear part
    const auto xi = Quaternion<T>::load(q + 3);
    const Vec3<T> w = mechanics::transposed_lift(xi, Quaternion<T>::load(e + 3));
    y[0] = w.x;
    y[1] = w.y;
    y[2] = w.z;
  }
  template <class T>
  static void rates(const T* q, const T* v, T* q_dot) {
    const auto xi = Quaternion<T>::load(q + 3);
    const Vec3<T> r = rotation_matrix(xi) * Vec3<T>{v[3], v[4], v[5]};
    q_dot[0] = r.x;
    q_dot[1] = r.y;
    q_dot[2] = r.z;
    (xi * (T(0.5) * Vec3<T>{v[0], v[1], v[2]})).store(q_dot + 3);
  }
  /// t = load_ang - V_lin × l - (V_ang - ω) × m and P' = R(load_lin - (V_ang - ω) × l), with l =
  /// RᵀP and ω the joint's own rate. On a root V_ang = ω: P' is the applied force alone, exactly.
  template <class T>
  static void field(const T* q, const T* p, const T* v, const Motion<T>& V, const Force<T>&,
                    const T* load, T* q_dot, T* p_dot) {
    const auto xi = Quaternion<T>::load(q + 3), pi = Quaternion<T>::load(p + 3);
    const Mat3<T> R = rotation_matrix(xi);
    const Vec3<T> w{v[0], v[1], v[2]}, m = body_momentum(xi, pi), l = R.tmul({p[0], p[1], p[2]});
    const Vec3<T> t = Vec3<T>{load[0], load[1], load[2]} - cross(V.v, l) - cross(V.w - w, m);
    const Vec3<T> r_dot = R * Vec3<T>{v[3], v[4], v[5]};
    const Vec3<T> P_dot = R * (Vec3<T>{load[3], load[4], load[5]} - cross(V.w - w, l));
    q_dot[0] = r_dot.x;
    q_dot[1] = r_dot.y;
    q_dot[2] = r_dot.z;
    p_dot[0] = P_dot.x;
    p_dot[1] = P_dot.y;
    p_dot[2] = P_dot.z;
    lifted_field(xi, pi, w, t, q_dot + 3, p_dot + 3);
  }
};

}  // namespace porthos::mechanics
