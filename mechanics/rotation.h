#pragma once
#include "mechanics/spatial.h"

/// Unit quaternions (w, x, y, z), body to parent, and their T*R⁴ lift (formulation:
/// docs/mathematics.md).
namespace porthos::mechanics {

/// The quaternion w + v·(i, j, k).
template <class T>
struct Quaternion {
  T w;
  Vec3<T> v;

  static Quaternion load(const T* a) { return {a[0], {a[1], a[2], a[3]}}; }
  void store(T* a) const {
    a[0] = w;
    a[1] = v.x;
    a[2] = v.y;
    a[3] = v.z;
  }
  T norm2() const { return fma(w, w, dot(v, v)); }
  Quaternion conj() const { return {w, -v}; }
};

/// a ∘ b, the Hamilton product.
template <class T>
Quaternion<T> operator*(const Quaternion<T>& a, const Quaternion<T>& b) {
  return {fma(a.w, b.w, -dot(a.v, b.v)), fma(a.w, b.v, fma(b.w, a.v, cross(a.v, b.v)))};
}
/// a ∘ (0, u)
template <class T>
Quaternion<T> operator*(const Quaternion<T>& a, const Vec3<T>& u) {
  return {-dot(a.v, u), fma(a.w, u, cross(a.v, u))};
}

/// c = 1 - 1/|ξ|², so that x/|ξ|² = x - c x.
///
/// The form x·(1/|ξ|²) has a biased rounding error: on the unit sphere |ξ|² and its inverse are
/// next to 1, where doubles are twice as dense below as above. The bias is 3e-17 on average and
/// always has the same sign. In a free-floating arm, which used that form then, it caused a
/// linear loss of energy of 5e-18 per second (relative). Here |ξ|² - 1 is summed in halves, so
/// nothing is rounded near 1. No bias is visible at 5e-20 (tests/mechanics/bias_test.cpp).
template <class T>
T norm_defect(const Quaternion<T>& q) {
  const T half(0.5);
  const T d = ((q.w * q.w + q.v.x * q.v.x) - half) + ((q.v.y * q.v.y + q.v.z * q.v.z) - half);
  return d / (T(1.0) + d);
}

/// R(ξ/|ξ|), defined for every ξ ≠ 0.
template <class T>
Mat3<T> rotation_matrix(const Quaternion<T>& q) {
  const T c = norm_defect(q), one(1.0), two(2.0);
  const auto over_norm2 = [&](T x) { return x - c * x; };
  const T xx = q.v.x * q.v.x, yy = q.v.y * q.v.y, zz = q.v.z * q.v.z;
  const T xy = q.v.x * q.v.y, xz = q.v.x * q.v.z, yz = q.v.y * q.v.z;
  const T wx = q.w * q.v.x, wy = q.w * q.v.y, wz = q.w * q.v.z;
  return {
      {one - over_norm2(two * (yy + zz)), over_norm2(two * (xy + wz)), over_norm2(two * (xz - wy))},
      {over_norm2(two * (xy - wz)), one - over_norm2(two * (xx + zz)), over_norm2(two * (yz + wx))},
      {over_norm2(two * (xz + wy)), over_norm2(two * (yz - wx)),
       one - over_norm2(two * (xx + yy))}};
}

/// Body momentum of the lift: m = ½ Im(ξ̄ π).
template <class T>
Vec3<T> body_momentum(const Quaternion<T>& xi, const Quaternion<T>& pi) {
  return T(0.5) * fma(xi.w, pi.v, fma(-pi.w, xi.v, cross(pi.v, xi.v)));
}
/// The lift of a body momentum m, with ξ·π = 0:  π = (2/|ξ|²) ξ ∘ m.
template <class T>
Quaternion<T> lift_momentum(const Quaternion<T>& xi, const Vec3<T>& m) {
  return xi * (T(2.0) * (m - norm_defect(xi) * m));
}
/// The transpose of that lift, of a covector e on ξ:  (2/|ξ|²) Im(ξ̄ e).
template <class T>
Vec3<T> transposed_lift(const Quaternion<T>& xi, const Quaternion<T>& e) {
  const Vec3<T> m = T(4.0) * body_momentum(xi, e);
  return m - norm_defect(xi) * m;
}

/// The lifted field (exactly canonical, on and off the unit sphere):
///   ξ' = ½ ξ ∘ ω,   π' = ½ π ∘ ω + (2/|ξ|²) ξ ∘ t
/// with ω the body rate and t the body torque -∂H/∂φ at fixed m. Source: McLachlan, Modin, Verdier
/// 2013 (arXiv:1308.6620) for the idea.
template <class T>
void lifted_field(const Quaternion<T>& xi, const Quaternion<T>& pi, const Vec3<T>& w,
                  const Vec3<T>& t, T* xi_dot, T* pi_dot) {
  const Vec3<T> half_w = T(0.5) * w;
  (xi * half_w).store(xi_dot);
  const Quaternion<T> a = pi * half_w, b = xi * (T(2.0) * (t - norm_defect(xi) * t));
  Quaternion<T>{a.w + b.w, a.v + b.v}.store(pi_dot);
}

}  // namespace porthos::mechanics
