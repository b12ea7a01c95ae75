#pragma once
#include "phs/scalars/scalar.h"

/// sin and cos, branch-free and identical for double and every lane of a Pack.
///
/// Reduction: x = k π/2 + r with π/2 in three 33-bit pieces, so that every k·piece is exact for |k|
/// < 2²⁰. Polynomials on |r| <= π/4: the minimax coefficients of Sun's fdlibm 5.3 (k_sin.c,
/// k_cos.c), with an error below 1 ulp. Beyond 1e5 rad, which a wrapped angle never reaches, each
/// lane uses the C library.
namespace porthos::phs {

inline constexpr double trig_fast_limit = 1e5;

namespace trig {
inline constexpr double two_over_pi = 6.36619772367581382433e-01;
inline constexpr double round_magic =
    6755399441055744.0;  // 1.5·2⁵²: adding and subtracting rounds to an integer
inline constexpr double pio2_1 = 1.57079632673412561417e+00;
inline constexpr double pio2_2 = 6.07710050630396597660e-11;
inline constexpr double pio2_2t = 2.02226624879595063154e-21;

/// sin(r + tail) for |r| <= π/4.
template <class T>
T sin_kernel(T r, T tail) {
  const T z = r * r, w = z * z;
  const T p = T(8.33333333332248946124e-03) +
              z * (T(-1.98412698298579493134e-04) + z * T(2.75573137070700676789e-06)) +
              z * w * (T(-2.50507602534068634195e-08) + z * T(1.58969099521155010221e-10));
  const T v = z * r;
  return r - ((z * (T(0.5) * tail - v * p) - tail) - v * T(-1.66666666666666324348e-01));
}

/// cos(r + tail) for |r| <= π/4, given sine = sin(r + tail).
template <class T>
T cos_kernel(T r, T tail, T sine) {
  const T z = r * r, w = z * z;
  const T p = z * (T(4.16666666666666019037e-02) +
                   z * (T(-1.38888888888741095749e-03) + z * T(2.48015872894767294178e-05))) +
              w * w *
                  (T(-2.75573143506633035000e-07) +
                   z * (T(2.08757232129817482790e-09) + z * T(-1.13596475577881948265e-11)));
  const T half = T(0.5) * z, c = T(1.0) - half;
  return c + (((T(1.0) - c) - half) + (z * p - sine * tail));
}

template <class T>
void sincos_fast(T x, T& s, T& c) {
  const T magic(round_magic);
  const T k = (x * T(two_over_pi) + magic) - magic;
  const T a = x - k * T(pio2_1);  // exact
  const T kp = k * T(pio2_2);     // exact
  const T b = a - kp;
  const T w = k * T(pio2_2t) - ((a - b) - kp);
  const T r = b - w;
  const T tail = (b - r) - w;
  const T sr = sin_kernel(r, tail), cr = cos_kernel(r, tail, sr);
  const T m = k - T(4.0) * ((k * T(0.25) + magic) - magic);  // quadrant, one of -2 … 2
  const auto odd = abs(m) == T(1.0), half_turn = abs(m) == T(2.0);
  const T s0 = select(odd, cr, sr), c0 = select(odd, sr, cr);
  s = select(half_turn | (m == T(-1.0)), -s0, s0);
  c = select(half_turn | (m == T(1.0)), -c0, c0);
}
}  // namespace trig

inline void sincos(double x, double& s, double& c) {
  if (std::fabs(x) <= trig_fast_limit) return trig::sincos_fast(x, s, c);
  s = std::sin(x);
  c = std::cos(x);  // inf and NaN come here too
}
template <int W, bool n>
void sincos(Pack<double, W, n> x, Pack<double, W, n>& s, Pack<double, W, n>& c) {
  trig::sincos_fast(x, s, c);
  if (any(!(abs(x) <= Pack<double, W, n>(trig_fast_limit)))) {
    for (int i = 0; i < W; ++i) {
      double si, ci;
      sincos(x[i], si, ci);
      s.set(i, si);
      c.set(i, ci);
    }
  }
}
inline void sincos(long double x, long double& s, long double& c) {
  s = std::sin(x);
  c = std::cos(x);
}
inline void sincos(Quad x, Quad& s, Quad& c) { sincosq(x, &s, &c); }
template <class T>
void sincos(BasicDual<T> x, BasicDual<T>& s, BasicDual<T>& c) {
  T sv, cv;
  sincos(x.v, sv, cv);
  s = {sv, cv * x.d};
  c = {cv, -sv * x.d};
}

template <class T>
T sin(T x) {
  T s, c;
  sincos(x, s, c);
  return s;
}
template <class T>
T cos(T x) {
  T s, c;
  sincos(x, s, c);
  return c;
}

}  // namespace porthos::phs
