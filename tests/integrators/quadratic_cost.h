#pragma once
#include <span>

/// A cost at the end of a run, and its gradient.
namespace porthos::test {

/// Σ (1/2 + i/8) x_i² + x_i x_(i+1)
template <class T>
T quadratic(std::span<const T> x) {
  T sum(0.0);
  for (size_t i = 0; i < x.size(); ++i)
    sum = sum + T(0.5 + 0.125 * double(i)) * x[i] * x[i] + x[i] * x[(i + 1) % x.size()];
  return sum;
}
inline void add_quadratic_gradient(std::span<const double> x, double weight, std::span<double> g) {
  const size_t n = x.size();
  for (size_t i = 0; i < n; ++i)
    g[i] += weight * ((1 + 0.25 * double(i)) * x[i] + x[(i + 1) % n] + x[(i + n - 1) % n]);
}

}  // namespace porthos::test
