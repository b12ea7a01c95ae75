#pragma once
#include <type_traits>

#include "phs/scalars/fma.h"

namespace porthos::phs {

/// v + d ε with ε² = 0 over a scalar T: d is the derivative along one direction. T may be a Pack,
/// the 113-bit float or again a dual. Systems are instantiated in Dual, the one over double. The
/// others serve code that needs a gradient inside an evaluation in T. Seeding: see derivative.h.
template <class T>
struct BasicDual {
  T v = T(0.0);  ///< value
  T d = T(0.0);  ///< derivative along the seeded direction

  BasicDual() = default;
  BasicDual(T value) : v(value) {}
  BasicDual(double value) requires(!std::is_same_v<T, double>) : v(value) {}
  BasicDual(T value, T derivative) : v(value), d(derivative) {}

  friend BasicDual operator+(BasicDual a, BasicDual b) { return {a.v + b.v, a.d + b.d}; }
  friend BasicDual operator-(BasicDual a, BasicDual b) { return {a.v - b.v, a.d - b.d}; }
  friend BasicDual operator*(BasicDual a, BasicDual b) {
    return {a.v * b.v, a.d * b.v + a.v * b.d};
  }
  friend BasicDual operator/(BasicDual a, BasicDual b) {
    const T q = a.v / b.v;
    return {q, (a.d - q * b.d) / b.v};
  }
  friend BasicDual operator-(BasicDual a) { return {-a.v, -a.d}; }
  friend BasicDual fma(BasicDual a, BasicDual b, BasicDual c) {
    return {fma(a.v, b.v, c.v), fma(a.d, b.v, fma(a.v, b.d, c.d))};
  }
  BasicDual& operator+=(BasicDual b) { return *this = *this + b; }
  BasicDual& operator-=(BasicDual b) { return *this = *this - b; }
  BasicDual& operator*=(BasicDual b) { return *this = *this * b; }

  friend auto operator<(BasicDual a, BasicDual b) { return a.v < b.v; }
  friend auto operator>(BasicDual a, BasicDual b) { return a.v > b.v; }
  friend auto operator<=(BasicDual a, BasicDual b) { return a.v <= b.v; }
  friend auto operator>=(BasicDual a, BasicDual b) { return a.v >= b.v; }
  friend auto operator==(BasicDual a, BasicDual b) { return a.v == b.v; }
};

/// For phs::fma(a, b, c), which does not see the friend; within it that is the better match.
template <class T>
BasicDual<T> fma(BasicDual<T> a, BasicDual<T> b, BasicDual<T> c) {
  return fma(a, b, c);
}

using Dual = BasicDual<double>;

}  // namespace porthos::phs
