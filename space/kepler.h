#pragma once
#include <cmath>

#include "mechanics/spatial.h"
#include "phs/error.h"

/// The motion of a point about a fixed centre, r'' = -μ r/|r|³, without a discretisation error.
namespace porthos::space {

using mechanics::Vec3;

/// Position and velocity relative to the centre, inertial axes [m, m/s].
template <class T>
struct PointState {
  Vec3<T> r, v;
};

namespace kepler_detail {

/// The universal functions G_1, G_2, G_3 of (β, s): G_n = sⁿ c_n(βs²) with Stumpff's c_n; G_0 = 1 -
/// β G_2. Series for small βs² (where the closed forms of G_2, G_3 cancel), half arguments
/// otherwise.
template <class T>
void universal_functions(T beta, T s, T& G1, T& G2, T& G3) {
  const T x = beta * s * s;
  if (phs::abs(x) < T(1.0)) {
    T c2(0.5), c3 = T(1.0) / T(6.0), t2 = c2, t3 = c3;
    for (int k = 1; k < 40; ++k) {
      t2 = -t2 * x / T(double((2 * k + 1) * (2 * k + 2)));
      t3 = -t3 * x / T(double((2 * k + 2) * (2 * k + 3)));
      const T before2 = c2, before3 = c3;
      c2 = c2 + t2;
      c3 = c3 + t3;
      if (c2 == before2 && c3 == before3) break;
    }
    G2 = s * s * c2;
    G3 = s * s * s * c3;
    G1 = s - beta * G3;
    return;
  }
  if (beta > T(0.0)) {
    const T w = phs::sqrt(beta);
    T sine, cosine;
    phs::sincos(T(0.5) * w * s, sine, cosine);
    G1 = T(2.0) * sine * cosine / w;
    G2 = T(2.0) * sine * sine / beta;
  } else {
    const T w = phs::sqrt(-beta), e = phs::exp(T(0.5) * w * s), f = T(1.0) / e;
    const T sinh_half = T(0.5) * (e - f), cosh_half = T(0.5) * (e + f);
    G1 = T(2.0) * sinh_half * cosh_half / w;
    G2 = -(T(2.0) * sinh_half * sinh_half / beta);
  }
  G3 = (s - G1) / beta;
}

}  // namespace kepler_detail

/// The state after the time dt, of any size and sign, by one formula for ellipse, parabola and
/// hyperbola. T: double, long double or Quad. The error is a few roundings of T, times the factor
/// by which the motion amplifies a rounding of the start (for large dt: the phase error due to the
/// rounding of the period).
///
/// The universal Kepler equation is solved by Laguerre's iteration inside a bracket, to stagnation.
/// Without the bracket, Newton's or Laguerre's iteration may leave the root at high eccentricity.
/// Position and velocity are updated by increments (f - 1, g, f', g' - 1), so a short step loses no
/// digits. Source: Stumpff 1947; Conway 1986 (Celest. Mech. 39); Wisdom, Hernandez 2015 (MNRAS
/// 453), equations 15 to 27.
/// @throws InvalidArgument if no root is found: the start is at the centre, or not finite
template <class T>
PointState<T> kepler_flow(T mu, const PointState<T>& start, T dt) {
  using kepler_detail::universal_functions;
  const T r0 = mechanics::norm(start.r), zero(0.0), one(1.0);
  const T beta = T(2.0) * mu / r0 - dot(start.v, start.v);  // -2 × energy
  const T eta = dot(start.r, start.v), zeta = mu - beta * r0;
  if (!(r0 > zero) || !(phs::abs(beta) < T(1e300)) || !(phs::abs(dt) < T(1e300)))
    throw InvalidArgument("the point is at the centre of gravity, or its state is not finite");
  if (dt == zero) return start;

  T time = dt;
  // 2π in three doubles, for every T
  const T two_pi =
      T(6.283185307179586232) + (T(2.4492935982947064e-16) + T(-5.989539619436679e-33));
  if (beta > zero) {  // remove whole revolutions
    const T period = two_pi * mu / (beta * phs::sqrt(beta));
    if (phs::abs(time) > T(0.5) * period) {
      const T turns = T(std::floor(phs::to_double(time / period) + 0.5));
      time = time - turns * period;
    }
  }

  T G1, G2, G3;
  const auto time_at = [&](T s) {
    universal_functions(beta, s, G1, G2, G3);
    return r0 * s + eta * G2 + zeta * G3;
  };
  // The left side increases with s at the rate r > 0: bracket the root, then refine.
  const T direction = time < zero ? -one : one;
  T near = zero, far = direction * two_pi / phs::sqrt(phs::abs(beta));
  if (beta <= zero) {
    if (!(phs::abs(far) < phs::abs(time / r0))) far = time / r0;
    for (int i = 0; i < 2000 && (time_at(far) - time) * direction < zero; ++i) {
      near = far;
      far = far * T(2.0);
    }
  }
  T s = time / r0;
  if ((s - far) * direction > zero || beta <= zero) s = T(0.5) * (near + far);
  T smallest = phs::abs(far - near) * T(4.0);
  int stalled = 0;
  for (int i = 0; i < 200; ++i) {
    const T F = time_at(s) - time;
    const T F1 = r0 + eta * G1 + zeta * G2, F2 = eta * (one - beta * G2) + zeta * G1;
    if (F * direction > zero)
      far = s;
    else
      near = s;
    const T root = phs::sqrt(phs::abs(T(16.0) * F1 * F1 - T(20.0) * F * F2));
    T next = s - T(5.0) * F / (F1 + root);
    const bool outside = (next - near) * direction < zero || (next - far) * direction > zero;
    if (outside && phs::abs(far - near) > T(1e-6) * phs::abs(s)) next = T(0.5) * (near + far);
    const T move = phs::abs(next - s);
    s = next;
    if (move == zero) break;
    if (move < smallest) {
      smallest = move;
      stalled = 0;
    } else if (move < T(1e-6) * phs::abs(s) && ++stalled > 2)
      break;
  }
  time_at(s);
  const T r = r0 + eta * G1 + zeta * G2;
  if (!(r > zero)) throw InvalidArgument("the point meets the centre of gravity");
  const T f_1 = -mu * G2 / r0, g = time - mu * G3;
  const T f_dot = -mu * G1 / (r0 * r), g_dot_1 = -mu * G2 / r;
  return {start.r + (f_1 * start.r + g * start.v), start.v + (f_dot * start.r + g_dot_1 * start.v)};
}

}  // namespace porthos::space
