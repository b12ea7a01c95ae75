#pragma once
#include <array>

#include "mechanics/spatial.h"

/// Gravity beyond the central 1/r: zonal harmonics and third bodies, per unit of mass.
namespace porthos::space {

using mechanics::Mat3;
using mechanics::Vec3;

/// J_2 … J_6 of a planet that is symmetric about its axis. All zero: a point mass.
using Zonals = std::array<double, 5>;

/// Potential [J/kg] and acceleration [m/s²] of the zonal harmonics at r, relative to the planet's
/// centre:
///   V = (μ/r) Σ J_n (a/r)ⁿ P_n(k·r/r),
/// a: the reference radius of the J_n, k: the unit axis. Regular at the poles. Source: Vallado
/// 2013, section 8.6.
template <class T>
T zonal_field(T mu, T a, const Vec3<T>& k, const Zonals& J, const Vec3<T>& r,
              Vec3<T>& acceleration) {
  const T d = mechanics::norm(r), u = dot(k, r) / d, ratio = a / d;
  T P_before(1.0), P = u;            // Legendre's P_{n-1}, P_n
  T D_before(0.0), D(1.0);           // and their derivatives
  T scale = mu / d * ratio, V(0.0);  // (μ/r)(a/r)ⁿ
  T along_r(0.0), along_k(0.0);      // of the gradient, times r
  for (int n = 2; n <= 6; ++n) {
    const T P_next = (T(2.0 * n - 1) * u * P - T(n - 1.0) * P_before) / T(double(n));
    const T D_next = D_before + T(2.0 * n - 1) * P;
    P_before = P;
    P = P_next;
    D_before = D;
    D = D_next;
    scale = scale * ratio;
    const T c = scale * T(J[size_t(n - 2)]);
    V = V + c * P;
    along_r = along_r - c * (T(n + 1.0) * P + u * D);
    along_k = along_k + c * D;
  }
  acceleration = (-T(1.0) / d) * ((along_r / d) * r + along_k * k);
  return V;
}

/// Acceleration [m/s²] at r by a body of parameter mu at s, both relative to the centre of the
/// planet, minus the planet's own acceleration by it:  -(μ/|r-s|³) (r + f(q) s). No nearly equal
/// numbers are subtracted, however distant the body is. Source: Battin 1999, section 8.4.
template <class T>
Vec3<T> third_body_acceleration(T mu, const Vec3<T>& s, const Vec3<T>& r) {
  const Vec3<T> d = r - s;
  const T d2 = dot(d, d), one(1.0), q = dot(r, r - T(2.0) * s) / dot(s, s);
  const T f = q * (T(3.0) + q * (T(3.0) + q)) / (one + (one + q) * phs::sqrt(one + q));
  return (-mu / (d2 * phs::sqrt(d2))) * (r + f * s);
}

}  // namespace porthos::space
