#pragma once
#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// v + d ε with ε² = 0 over any scalar T: the derivative along one direction, in lanes, in 113
/// bits, of duals again. Dual is the one over double that systems are instantiated in; Tangent
/// serves code that needs a gradient inside an evaluation in T.
template <class T>
struct Tangent {
  T v, d;

  Tangent() = default;
  Tangent(T value) : v(value), d(T(0.0)) {}
  Tangent(double value) requires(!std::is_same_v<T, double>) : v(T(value)), d(T(0.0)) {}
  Tangent(T value, T derivative) : v(value), d(derivative) {}

  friend Tangent operator+(Tangent a, Tangent b) { return {a.v + b.v, a.d + b.d}; }
  friend Tangent operator-(Tangent a, Tangent b) { return {a.v - b.v, a.d - b.d}; }
  friend Tangent operator*(Tangent a, Tangent b) { return {a.v * b.v, a.d * b.v + a.v * b.d}; }
  friend Tangent operator/(Tangent a, Tangent b) {
    const T q = a.v / b.v;
    return {q, (a.d - q * b.d) / b.v};
  }
  friend Tangent operator-(Tangent a) { return {-a.v, -a.d}; }
  friend auto operator<(Tangent a, Tangent b) { return a.v < b.v; }
  friend auto operator>(Tangent a, Tangent b) { return a.v > b.v; }
};

template <class T>
Tangent<T> sqrt(Tangent<T> x) {
  const T r = sqrt(x.v);
  return {r, x.d / (T(2.0) * r)};
}
template <class T>
Tangent<T> exp(Tangent<T> x) {
  const T f = exp(x.v);
  return {f, f * x.d};
}
template <class T>
Tangent<T> log(Tangent<T> x) {
  return {log(x.v), x.d / x.v};
}
template <class T>
void sincos(Tangent<T> x, Tangent<T>& s, Tangent<T>& c) {
  T sv, cv;
  sincos(x.v, sv, cv);
  s = {sv, cv * x.d};
  c = {cv, -(sv * x.d)};
}

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
Tangent<T> asinh(Tangent<T> x) {
  return {asinh(x.v), x.d / sqrt(x.v * x.v + T(1.0))};
}

}  // namespace porthos::phs
