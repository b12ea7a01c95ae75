#pragma once
#include "mechanics/spatial.h"

/// Unit quaternions (w, x, y, z), body to parent, and their T*R⁴ lift (formulation: docs/mathematics.md).
namespace porthos::mechanics {

template <class T>
struct Quaternion {
  T w;
  Vec3<T> v;

  static Quaternion load(const T* a) { return {a[0], {a[1], a[2], a[3]}}; }
  void store(T* a) const { a[0] = w, a[1] = v.x, a[2] = v.y, a[3] = v.z; }
  T norm2() const { return w * w + dot(v, v); }
  Quaternion conj() const { return {w, -v}; }
};

template <class T>
Quaternion<T> operator*(const Quaternion<T>& a, const Quaternion<T>& b) {
  return {a.w * b.w - dot(a.v, b.v), a.w * b.v + b.w * a.v + cross(a.v, b.v)};
}
/// a ∘ (0, u)
template <class T>
Quaternion<T> operator*(const Quaternion<T>& a, const Vec3<T>& u) {
  return {-dot(a.v, u), a.w * u + cross(a.v, u)};
}

/// R(ξ/|ξ|), defined for every ξ ≠ 0.
template <class T>
Mat3<T> rotation_matrix(const Quaternion<T>& q) {
  const T s = T(2.0) / q.norm2();
  const T x = s * q.v.x, y = s * q.v.y, z = s * q.v.z;
  const T wx = q.w * x, wy = q.w * y, wz = q.w * z;
  const T xx = q.v.x * x, xy = q.v.x * y, xz = q.v.x * z, yy = q.v.y * y, yz = q.v.y * z, zz = q.v.z * z;
  const T one(1.0);
  return {{one - (yy + zz), xy + wz, xz - wy}, {xy - wz, one - (xx + zz), yz + wx}, {xz + wy, yz - wx, one - (xx + yy)}};
}

/// Body momentum of the lift: m = ½ Im(ξ̄ π).
template <class T>
Vec3<T> body_momentum(const Quaternion<T>& xi, const Quaternion<T>& pi) {
  return T(0.5) * (xi.w * pi.v - pi.w * xi.v - cross(xi.v, pi.v));
}
/// The lift of a body momentum with ξ·π = 0:  π = (2/|ξ|²) ξ ∘ m.
template <class T>
Quaternion<T> lift_momentum(const Quaternion<T>& xi, const Vec3<T>& m) {
  return xi * ((T(2.0) / xi.norm2()) * m);
}

/// The lifted field (exactly canonical, on and off the unit sphere):
///   ξ' = ½ ξ ∘ ω,   π' = ½ π ∘ ω + (2/|ξ|²) ξ ∘ t
/// with ω the body rate and t the body torque -∂H/∂φ at fixed m. Source: McLachlan, Modin, Verdier 2013
/// (arXiv:1308.6620) for the idea.
template <class T>
void lifted_field(const Quaternion<T>& xi, const Quaternion<T>& pi, const Vec3<T>& w, const Vec3<T>& t, T* xi_dot, T* pi_dot) {
  const Vec3<T> half_w = T(0.5) * w;
  (xi * half_w).store(xi_dot);
  const Quaternion<T> a = pi * half_w, b = xi * ((T(2.0) / xi.norm2()) * t);
  Quaternion<T>{a.w + b.w, a.v + b.v}.store(pi_dot);
}

}  // namespace porthos::mechanics
