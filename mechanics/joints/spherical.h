#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// A ball joint. q = quaternion (w, x, y, z) child to joint frame, p = its lift π; joint rates are
/// the child's angular velocity relative to the parent, in the child's axes.
struct Spherical : AxisJoint<0, 1, 2> {
  static constexpr std::string_view name = "spherical";
  static constexpr int nq = 4;
  static constexpr bool lifted = true;
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::rotation, 4, "", "1", "kg m^2/s", "N m", "rad/s"}};

  template <class T>
  static Transform<T> place(const Node& n, const T* q, const Angle<T>&) {
    return {Mat3<T>(n.placement.R) * rotation_matrix(Quaternion<T>::load(q)),
            Vec3<T>(n.placement.r)};
  }
  template <class T>
  static void momentum(const T* q, const T* p, T* mu) {
    const Vec3<T> m = body_momentum(Quaternion<T>::load(q), Quaternion<T>::load(p));
    mu[0] = m.x;
    mu[1] = m.y;
    mu[2] = m.z;
  }
  template <class T>
  static void lift(const T* q, const T* mu, T* p) {
    lift_momentum(Quaternion<T>::load(q), Vec3<T>{mu[0], mu[1], mu[2]}).store(p);
  }
  template <class T>
  static void transposed_lift(const T* q, const T* e, T* y) {
    const Vec3<T> w = mechanics::transposed_lift(Quaternion<T>::load(q), Quaternion<T>::load(e));
    y[0] = w.x;
    y[1] = w.y;
    y[2] = w.z;
  }
  template <class T>
  static void rates(const T* q, const T* v, T* q_dot) {
    (Quaternion<T>::load(q) * (T(0.5) * Vec3<T>{v[0], v[1], v[2]})).store(q_dot);
  }
  /// Torque at fixed body momentum m: t = load - V_lin × h_lin - (V_ang - ω) × m, ω the joint's own
  /// rate. On a root V_ang = ω, so the last term is exactly zero.
  template <class T>
  static void field(const T* q, const T* p, const T* v, const Motion<T>& V, const Force<T>& h,
                    const T* load, T* q_dot, T* p_dot) {
    const auto xi = Quaternion<T>::load(q), pi = Quaternion<T>::load(p);
    const Vec3<T> w{v[0], v[1], v[2]};
    const Vec3<T> t = Vec3<T>{load[0], load[1], load[2]} - cross(V.v, h.f) -
                      cross(V.w - w, body_momentum(xi, pi));
    lifted_field(xi, pi, w, t, q_dot, p_dot);
  }
};

}  // namespace porthos::mechanics
