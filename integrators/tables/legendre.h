#pragma once

namespace porthos::integrators {

/// The most stages of a collocation method.
inline constexpr int most_stages = 16;

/// Legendre's polynomials P_0(x) … P_n(x), n <= most_stages + 1, by their recurrence.
template <class T>
struct Legendre {
  T p[most_stages + 2];
  Legendre(int n, T x) {
    p[0] = T(1.0);
    p[1] = x;
    for (int k = 1; k < n; ++k)
      p[k + 1] = (T(2.0 * k + 1) * x * p[k] - T(double(k)) * p[k - 1]) / T(k + 1.0);
  }
  const T& operator[](int k) const { return p[k]; }
};

}  // namespace porthos::integrators
