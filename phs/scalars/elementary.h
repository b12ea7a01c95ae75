#pragma once
#include "phs/scalars/scalar.h"

/// More functions of every scalar of scalar.h, for the few files that need them.
namespace porthos::phs {

#if defined(__SIZEOF_FLOAT128__)
extern "C" {
/// Of libquadmath, as those of quad.h.
Quad sinhq(Quad);
Quad coshq(Quad);
Quad atanq(Quad);
}
#else
inline Quad sinhq(Quad x) { return std::sinh(wide(x)); }
inline Quad coshq(Quad x) { return std::cosh(wide(x)); }
inline Quad atanq(Quad x) { return std::atan(wide(x)); }
#endif

#define PORTHOS_ELEMENTARY(name, quad_name)                       \
  inline double name(double x) { return std::name(x); }           \
  inline long double name(long double x) { return std::name(x); } \
  inline Quad name(Quad x) { return quad_name(x); }               \
  template <int W, bool n>                                        \
  Pack<double, W, n> name(Pack<double, W, n> x) {                 \
    return map_lanes([](double y) { return std::name(y); }, x);   \
  }
PORTHOS_ELEMENTARY(sinh, sinhq)
PORTHOS_ELEMENTARY(cosh, coshq)
PORTHOS_ELEMENTARY(atan, atanq)
#undef PORTHOS_ELEMENTARY
#define PORTHOS_ELEMENTARY(name, derivative) \
  template <class T>                         \
  BasicDual<T> name(BasicDual<T> x) {        \
    return {name(x.v), x.d * (derivative)};  \
  }
PORTHOS_ELEMENTARY(sinh, cosh(x.v))
PORTHOS_ELEMENTARY(cosh, sinh(x.v))
PORTHOS_ELEMENTARY(atan, T(1.0) / (T(1.0) + x.v * x.v))
#undef PORTHOS_ELEMENTARY

/// x^p, of x > 0 unless p is whole.
inline double pow(double x, double p) { return std::pow(x, p); }
inline long double pow(long double x, double p) { return std::pow(x, static_cast<long double>(p)); }
/// The same with 113 bits.
inline Quad pow(Quad x, double p) { return powq(x, Quad(p)); }
/// The same in each lane.
template <int W, bool n>
Pack<double, W, n> pow(Pack<double, W, n> x, double p) {
  return map_lanes([p](double y) { return std::pow(y, p); }, x);
}
/// The same with its slope, p x^(p - 1).
template <class T>
BasicDual<T> pow(BasicDual<T> x, double p) {
  return {pow(x.v, p), x.d * (T(p) * pow(x.v, p - 1))};
}

/// x^n by multiplications.
template <class T>
T whole_power(const T& x, int n) {
  if (n < 0) return T(1.0) / whole_power(x, -n);
  if (n == 0) return T(1.0);
  if (n == 1) return x;
  const T half = whole_power(x, n / 2), square = half * half;
  return n % 2 == 0 ? square : square * x;
}

}  // namespace porthos::phs
