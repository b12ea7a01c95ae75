#pragma once
#include <array>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/constraints/plane_curve.h"
#include "mechanics/passes-inl.h"

/// The rows of a loop joint or a rolling body as functions of the pose X of frame b in frame a:
/// values and wrenches.
namespace porthos::mechanics::constraint_detail {

/// A row's gradient: the wrench on b about its origin, in a's axes. With ω the angular velocity of
/// b relative to a and d' the velocity of its origin in a, both in a's axes, g' = n·ω + f·d'.
template <class T>
struct RowWrench {
  T g;
  Force<T> w;
};

template <class T>
Vec3<T> unit_vector(int axis) {
  Vec3<T> e{T(0.0), T(0.0), T(0.0)};
  e[axis] = T(1.0);
  return e;
}

/// a·a with its rounding error, as (sum, error), for scalars of one or several doubles.
template <class T>
void exact_square(const T& a, T& p, T& e) {
  const T c = T(134217729.0) * a, hi = c - (c - a), lo = a - hi;  // Dekker 1971
  p = a * a;
  e = ((hi * hi - p) + (hi * lo + hi * lo)) + lo * lo;
}

/// d·d - l², in two words where T is made of doubles: rounded once, its error would have a bias
/// that the energy follows.
template <class T>
T squares_minus(const Vec3<T>& d, double length) {
  if constexpr (std::is_same_v<T, double> || phs::is_pack<T>) {
    T sum, rest;
    exact_square(T(length), sum, rest);
    sum = -sum;
    rest = -rest;
    for (int k = 0; k < 3; ++k) {
      T p, e, s;
      exact_square(d[k], p, e);
      s = sum + p;
      const T b = s - sum;
      rest = rest + (((sum - (s - b)) + (p - b)) + e);
      sum = s;
    }
    return sum + rest;
  } else {
    return dot(d, d) - T(length) * T(length);
  }
}

/// d, component k.
template <class T>
RowWrench<T> position_row(const Transform<T>& X, int k) {
  const T o(0.0);
  return {X.r[k], {{o, o, o}, unit_vector<T>(k)}};
}
/// (axis k of a) · u with u fixed in b.
template <class T>
RowWrench<T> axis_row(const Vec3<T>& u, int k) {
  const T o(0.0);
  return {u[k], {cross(u, unit_vector<T>(k)), {o, o, o}}};
}
/// The angle of R about z is φ; pitch sin(φ - d_z/pitch), whose other roots are half a turn away.
template <class T>
RowWrench<T> screw_row(const Transform<T>& X, double pitch) {
  const T o(0.0), h(pitch);
  T s, c;
  sincos(X.r.z / h, s, c);
  // sin φ and cos φ, exact where the z axes coincide
  const Vec3<T>& x = X.R.x;
  const T g = x.y * c - x.x * s, slope = x.x * c + x.y * s;
  const Vec3<T> along = cross(x, unit_vector<T>(1)), across = cross(x, unit_vector<T>(0));
  return {h * g, {h * (c * along - s * across), {o, o, -slope}}};
}
/// The distance's gradient is the normal of the curve, off the curve too.
template <class T>
RowWrench<T> curve_row(const Transform<T>& X, const PlaneCurve& curve) {
  const T o(0.0);
  const auto d = curve.distance(X.r.x, X.r.y);
  return {d.value, {{o, o, o}, {d.nx, d.ny, o}}};
}
template <class T>
RowWrench<T> distance_row(const Transform<T>& X, double length) {
  const T o(0.0), l(length);
  const T scale = T(1.0) / l;
  return {squares_minus(X.r, length) * (T(0.5) * scale), {{o, o, o}, scale * X.r}};
}
/// Twice the vector part of the unit quaternion of R, near 1: half a turn away from it, the rows
/// are not finite.
template <class T>
void weld_rows(const Mat3<T>& R, RowWrench<T>* rows) {
  const T half(0.5), o(0.0);
  const T eta = half * sqrt(T(1.0) + ((R.x.x + R.y.y) + R.z.z));
  const T scale = T(0.25) / eta;
  const Vec3<T> eps = scale * Vec3<T>{R.y.z - R.z.y, R.z.x - R.x.z, R.x.y - R.y.x};
  for (int k = 0; k < 3; ++k) {
    const Vec3<T> e = unit_vector<T>(k);
    rows[k] = {eps[k] + eps[k], {eta * e + cross(eps, e), {o, o, o}}};
  }
}

/// A body that touches the plane z = 0 of a at d + ρ: its height, and the velocity of its point
/// there along x, y. Those two are no values of a function, so their g is 0.
template <class T>
void contact_rows(const T& height, const Vec3<T>& rho, RowWrench<T>* rows) {
  const auto along = [&](int k) {
    return Force<T>{cross(rho, unit_vector<T>(k)), unit_vector<T>(k)};
  };
  rows[0] = {height, along(2)};
  rows[1] = {T(0.0), along(0)};
  rows[2] = {T(0.0), along(1)};
}
template <class T>
void sphere_rows(const Transform<T>& X, double radius, RowWrench<T>* rows) {
  const T r(radius), o(0.0);
  contact_rows(X.r.z - r, {o, o, -r}, rows);
}
/// The lowest point of the rim is where the normal, projected onto the disk, points down.
template <class T>
void disk_rows(const Transform<T>& X, double radius, RowWrench<T>* rows) {
  const Vec3<T>& axle = X.R.z;
  const T upright = sqrt(axle.x * axle.x + axle.y * axle.y);  // sine of the tilt from flat
  const T scale = -T(radius) / upright;
  const Vec3<T> rho{-(scale * axle.z) * axle.x, -(scale * axle.z) * axle.y,
                    scale * (upright * upright)};
  contact_rows(X.r.z - T(radius) * upright, rho, rows);
}

/// All rows of a loop at X. @param out  written, loop.size rows
template <class T>
void evaluate_rows(const ConstraintSet::Loop& loop, const Transform<T>& X, RowWrench<T>* out) {
  for (const Row row : loop.rows) {
    switch (row) {
      case Row::dx:
      case Row::dy:
      case Row::dz:
        *out = position_row(X, int(row) - int(Row::dx));
        break;
      case Row::xz:
        *out = axis_row(X.R.z, 0);
        break;
      case Row::yz:
        *out = axis_row(X.R.z, 1);
        break;
      case Row::zx:
        *out = axis_row(X.R.x, 2);
        break;
      case Row::curve:
        *out = curve_row(X, *loop.curve);
        break;
      case Row::screw:
        *out = screw_row(X, loop.pitch);
        break;
      case Row::distance:
        *out = distance_row(X, loop.length);
        break;
      case Row::weld:
        weld_rows(X.R, out);
        out += 2;
        break;
      case Row::disk:
        disk_rows(X, loop.length, out);
        out += 2;
        break;
      case Row::sphere:
        sphere_rows(X, loop.length, out);
        out += 2;
        break;
      case Row::blade:
        *out = {T(0.0), {passes::zero_force<T>().n, X.R.z}};
        break;
      case Row::spin:
        *out = {T(0.0), {X.R.z, passes::zero_force<T>().f}};
        break;
    }
    ++out;
  }
}

}  // namespace porthos::mechanics::constraint_detail
