#pragma once
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "phs/scalars/dual.h"
#include "phs/scalars/pack.h"
#include "phs/scalars/quad.h"

/// The closed list of scalars. The same source of the mathematics serves them all.
///
///   double         one state
///   Pack4, Pack8   SIMD lanes: eight Gauss stages, or an ensemble
///   Dual           derivatives
///   long double    64-bit significand: measures energy from value + low word without adding noise
///                  of its own
///   Quad           113-bit significand: reference solutions
///
/// Kernels use + - * /, the functions below and select(mask, a, b); they never branch on a T.
#define PORTHOS_FOR_EACH_SCALAR(X) \
  X(double)                        \
  X(long double)                   \
  X(porthos::phs::Quad)            \
  X(porthos::phs::Dual)            \
  X(porthos::phs::Pack4)           \
  X(porthos::phs::Pack8)

namespace porthos::phs {

template <class T>
inline constexpr int lanes = 1;
template <int W, bool n>
inline constexpr int lanes<Pack<double, W, n>> = W;

template <class T>
inline constexpr bool is_pack = lanes<T> > 1;
template <class T>
inline constexpr bool is_real =
    std::is_same_v<T, double> || std::is_same_v<T, long double> || std::is_same_v<T, Quad>;

/// More digits than double: scalars that measure and refer.
template <class T>
inline constexpr bool is_wide = is_real<T> && !std::is_same_v<T, double>;

// --- select: the only conditional of a kernel ----------------------------------------------------
template <class T>
requires(!is_pack<T>) T select(bool mask, T a, T b) { return mask ? a : b; }
template <int W, class T>
BasicDual<T> select(Mask<W> mask, BasicDual<T> a, BasicDual<T> b) {
  return {select(mask, a.v, b.v), select(mask, a.d, b.d)};
}
inline bool any(bool mask) { return mask; }

// --- elementary functions, one name for every scalar ---------------------------------------------
inline double sqrt(double x) { return std::sqrt(x); }
inline long double sqrt(long double x) { return std::sqrt(x); }
inline Quad sqrt(Quad x) { return sqrtq(x); }
template <class T>
BasicDual<T> sqrt(BasicDual<T> x) {
  const T r = sqrt(x.v);
  return {r, x.d / (T(2.0) * r)};
}

template <class T>
T abs(T x) {
  return select(x < T(0.0), -x, x);
}
inline double abs(double x) { return __builtin_fabs(x); }  // as Pack's: |-0| = 0
template <class T>
T min(T a, T b) {
  return select(b < a, b, a);
}
template <class T>
T max(T a, T b) {
  return select(a < b, b, a);
}

/// Per-lane application of a double function, for functions without a lane-parallel form.
template <class F, int W, bool n>
Pack<double, W, n> map_lanes(F f, Pack<double, W, n> x) {
  Pack<double, W, n> r;
  for (int i = 0; i < W; ++i) r.set(i, f(x[i]));
  return r;
}

#define PORTHOS_UNARY(name, quad_name, derivative)                \
  inline double name(double x) { return std::name(x); }           \
  inline long double name(long double x) { return std::name(x); } \
  inline Quad name(Quad x) { return quad_name(x); }               \
  template <int W, bool n>                                        \
  Pack<double, W, n> name(Pack<double, W, n> x) {                 \
    return map_lanes([](double y) { return std::name(y); }, x);   \
  }                                                               \
  template <class T>                                              \
  BasicDual<T> name(BasicDual<T> x) {                             \
    const T f = name(x.v);                                        \
    return {f, x.d * (derivative)};                               \
  }
PORTHOS_UNARY(exp, expq, f)
PORTHOS_UNARY(log, logq, T(1.0) / x.v)
PORTHOS_UNARY(tanh, tanhq, T(1.0) - f * f)
PORTHOS_UNARY(sinh, sinhq, sqrt(T(1.0) + f * f))
PORTHOS_UNARY(cosh, coshq, sinh(x.v))
PORTHOS_UNARY(atan, atanq, T(1.0) / (T(1.0) + x.v * x.v))
#undef PORTHOS_UNARY

/// log(1 + y) for y >= 0 with small relative error (Kahan's quotient: the error of w = 1 + y
/// cancels).
template <class T>
T log1p(T y) {
  const T one(1.0), w = one + y, d = w - one;
  const auto tiny = !(d > T(0.0));
  return select(tiny, y, y * (log(w) / select(tiny, one, d)));
}
/// asinh with small relative error, the same for x and -x.
template <class T>
T asinh(T x) {
  const T one(1.0), a = abs(x);
  const T y = log1p(a + a * a / (one + sqrt(one + a * a)));
  return select(x < T(0.0), -y, y);
}
template <class T>
BasicDual<T> asinh(BasicDual<T> x) {
  return {asinh(x.v), x.d / sqrt(x.v * x.v + T(1.0))};
}

/// The double nearest to x (of a Dual, its value).
inline double to_double(double x) { return x; }
inline double to_double(long double x) { return static_cast<double>(x); }
inline double to_double(Quad x) { return static_cast<double>(x); }
template <class T>
double to_double(BasicDual<T> x) {
  return to_double(x.v);
}

}  // namespace porthos::phs

#include "phs/scalars/trig.h"
