#pragma once
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "phs/scalars/dual.h"
#include "phs/scalars/pack.h"
#include "phs/scalars/quad.h"

/// The closed list of scalars. One source of the mathematics serves them all.
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

// --- select: the only conditional of a kernel ----------------------------------------------------
template <class T>
requires(!is_pack<T>) T select(bool mask, T a, T b) { return mask ? a : b; }
inline bool any(bool mask) { return mask; }

// --- elementary functions, one name for every scalar ---------------------------------------------
inline double sqrt(double x) { return std::sqrt(x); }
inline long double sqrt(long double x) { return std::sqrt(x); }
inline Quad sqrt(Quad x) { return sqrtq(x); }
inline Dual sqrt(Dual x) {
  const double r = std::sqrt(x.v);
  return {r, x.d / (2 * r)};
}

template <class T>
T abs(T x) {
  return select(x < T(0.0), -x, x);
}
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
  inline Dual name(Dual x) {                                      \
    const double f = std::name(x.v);                              \
    return {f, x.d * (derivative)};                               \
  }                                                               \
  template <int W, bool n>                                        \
  Pack<double, W, n> name(Pack<double, W, n> x) {                 \
    return map_lanes([](double y) { return std::name(y); }, x);   \
  }
PORTHOS_UNARY(exp, expq, f)
PORTHOS_UNARY(log, logq, 1 / x.v)
PORTHOS_UNARY(tanh, tanhq, 1 - f * f)
#undef PORTHOS_UNARY

/// The double nearest to x (of a Dual, its value).
inline double to_double(double x) { return x; }
inline double to_double(long double x) { return static_cast<double>(x); }
inline double to_double(Quad x) { return static_cast<double>(x); }
inline double to_double(Dual x) { return x.v; }

}  // namespace porthos::phs

#include "phs/scalars/trig.h"
