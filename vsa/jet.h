#pragma once
#include <array>

#include "phs/scalars/power.h"

namespace porthos::vsa {

/// A number with its N partial derivatives, over any scalar T of phs/scalars/scalar.h: forward
/// differentiation of an energy in doubles, lanes, duals and 113 bits. Jet<Jet<T>> has second
/// derivatives.
template <class T, int N>
struct Jet {
  T v{};                 ///< value
  std::array<T, N> d{};  ///< derivatives

  Jet() = default;
  Jet(double value) : v(value) { d.fill(T(0.0)); }
  Jet(const T& value, int direction)  ///< the variable itself
      : v(value) {
    d.fill(T(0.0));
    d[size_t(direction)] = T(1.0);
  }

  friend Jet operator+(Jet a, const Jet& b) {
    a.v = a.v + b.v;
    for (size_t i = 0; i < N; ++i) a.d[i] = a.d[i] + b.d[i];
    return a;
  }
  friend Jet operator-(Jet a, const Jet& b) {
    a.v = a.v - b.v;
    for (size_t i = 0; i < N; ++i) a.d[i] = a.d[i] - b.d[i];
    return a;
  }
  friend Jet operator-(Jet a) {
    a.v = -a.v;
    for (T& x : a.d) x = -x;
    return a;
  }
  friend Jet operator*(const Jet& a, const Jet& b) {
    Jet r;
    r.v = a.v * b.v;
    for (size_t i = 0; i < N; ++i) r.d[i] = a.d[i] * b.v + a.v * b.d[i];
    return r;
  }
  friend Jet operator/(const Jet& a, const Jet& b) {
    Jet r;
    r.v = a.v / b.v;
    for (size_t i = 0; i < N; ++i) r.d[i] = (a.d[i] - r.v * b.d[i]) / b.v;
    return r;
  }
  friend auto operator<(const Jet& a, const Jet& b) { return a.v < b.v; }
};

/// f(a) from the value and the slope of f at a.
template <class T, int N>
Jet<T, N> chain(const Jet<T, N>& a, const T& value, const T& slope) {
  Jet<T, N> r;
  r.v = value;
  for (size_t i = 0; i < N; ++i) r.d[i] = slope * a.d[i];
  return r;
}
template <class T, int N>
Jet<T, N> sqrt(const Jet<T, N>& a) {
  using phs::sqrt;
  const T r = sqrt(a.v);
  return chain(a, r, T(0.5) / r);
}
template <class T, int N>
Jet<T, N> exp(const Jet<T, N>& a) {
  using phs::exp;
  const T r = exp(a.v);
  return chain(a, r, r);
}
template <class T, int N>
Jet<T, N> log(const Jet<T, N>& a) {
  using phs::log;
  return chain(a, T(log(a.v)), T(1.0) / a.v);
}
template <class T, int N>
Jet<T, N> tanh(const Jet<T, N>& a) {
  using phs::tanh;
  const T r = tanh(a.v);
  return chain(a, r, T(1.0) - r * r);
}
template <class T, int N>
Jet<T, N> atan(const Jet<T, N>& a) {
  using phs::atan;
  return chain(a, T(atan(a.v)), T(1.0) / (T(1.0) + a.v * a.v));
}
template <class T, int N>
Jet<T, N> sinh(const Jet<T, N>& a) {
  using phs::cosh, phs::sinh;
  return chain(a, T(sinh(a.v)), T(cosh(a.v)));
}
template <class T, int N>
Jet<T, N> cosh(const Jet<T, N>& a) {
  using phs::cosh, phs::sinh;
  return chain(a, T(cosh(a.v)), T(sinh(a.v)));
}
template <class T, int N>
Jet<T, N> pow(const Jet<T, N>& a, double p) {
  using phs::pow;
  return chain(a, T(pow(a.v, p)), T(p) * pow(a.v, p - 1));
}
template <class T, int N>
void sincos(const Jet<T, N>& a, Jet<T, N>& s, Jet<T, N>& c) {
  using phs::sincos;
  T sv, cv;
  sincos(a.v, sv, cv);
  s = chain(a, sv, cv);
  c = chain(a, cv, -sv);
}
/// For a mask of lanes; phs::select handles a bool.
template <class Mask, class T, int N>
requires(!std::is_same_v<Mask, bool>) Jet<T, N> select(const Mask& m, const Jet<T, N>& a,
                                                       const Jet<T, N>& b) {
  using phs::select;
  Jet<T, N> r;
  r.v = select(m, a.v, b.v);
  for (size_t i = 0; i < N; ++i) r.d[i] = select(m, a.d[i], b.d[i]);
  return r;
}

/// The scalar underlying nested derivatives.
template <class T>
struct Below {
  using type = T;
};
template <class T, int N>
struct Below<Jet<T, N>> : Below<T> {};

/// One lane of the value, for table look-up only; it never enters a result.
template <class T>
double lane(const T& x, int i) {
  if constexpr (phs::is_pack<T>)
    return x[i];
  else {
    (void)i;
    return phs::to_double(x);
  }
}
template <class T, int N>
double lane(const Jet<T, N>& x, int i) {
  return lane(x.v, i);
}

/// The constants f(0), f(1), ... as the lanes of a T.
template <class T, class F>
T gather(F f) {
  using B = typename Below<T>::type;
  if constexpr (!phs::is_pack<B>) {
    return T(f(0));
  } else {
    B b(0.0);
    for (int i = 0; i < phs::lanes<B>; ++i) b.set(i, f(i));
    if constexpr (std::is_same_v<T, B>) {
      return b;
    } else {
      T r(0.0);
      auto innermost = [&b](auto& self, auto& x) -> void {
        if constexpr (requires { x.v = b; })
          x.v = b;
        else
          self(self, x.v);
      };
      innermost(innermost, r);
      return r;
    }
  }
}

}  // namespace porthos::vsa
