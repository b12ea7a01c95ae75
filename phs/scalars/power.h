#pragma once
#include "phs/scalars/scalar.h"

/// Powers of every scalar of scalar.h, for the few files that need them.
namespace porthos::phs {

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
