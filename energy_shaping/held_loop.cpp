#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/closed_loop.h"
#include "energy_shaping/lqr.h"
#include "phs/linear_algebra/linear_algebra.h"

/// The linear-quadratic regulator as a sampled law.
namespace porthos::energy_shaping {
namespace {

using phs::Matrix;

/// The largest |z| of x(k + 1) = Φ x(k) + Γ u(k), u(k) = -K x(k - delay), over periods of h.
double radius(const Matrix& A, const Matrix& B, const Matrix& K, double h, int delay) {
  const int n = A.rows, m = B.cols, all = n + m * delay;
  Matrix plant(n + m, n + m);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) plant(i, j) = h * A(i, j);
    for (int j = 0; j < m; ++j) plant(i, n + j) = h * B(i, j);
  }
  plant.a = phs::exponential(size_t(n + m), plant.a);
  // (x, what is under way): the oldest torque acts, -K x is the youngest.
  Matrix loop(all, all);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      loop(i, j) = plant(i, j);
      for (int k = 0; k < m && delay == 0; ++k) loop(i, j) -= plant(i, n + k) * K(k, j);
    }
  for (int k = 0; k < m && delay > 0; ++k) {
    for (int i = 0; i < n; ++i) loop(i, n + k) = plant(i, n + k);
    for (int j = 0; j < n; ++j) loop(all - m + k, j) = -K(k, j);
  }
  for (int i = n; i < all - m; ++i) loop(i, i + m) = 1;
  double most = 0;
  for (const auto& z : phs::eigenvalues(size_t(all), loop.a))
    most = std::isnan(std::abs(z)) ? HUGE_VAL : std::max(most, std::abs(z));
  return most;
}

}  // namespace

void Lqr::certify_sampled(double period, int delay) {
  const auto at = [&](double rate) { return radius(A_, B_, K_, 1 / rate, delay); };
  const double rate = 1 / period, now = radius(A_, B_, K_, period, delay);
  std::string text = fmt::format("largest |z| of the linearised loop at rate = {:.6g} Hz", rate);
  if (delay > 0) text += fmt::format(" with a delay of {} periods", delay);
  if (!(now <= 1)) {
    double low = rate, high = 2 * rate;
    for (int i = 0; i < 40 && !(at(high) <= 1); ++i) {
      low = high;
      high *= 2;
    }
    for (int i = 0; i < 20; ++i) {
      const double middle = std::sqrt(low * high);
      (at(middle) <= 1 ? high : low) = middle;
    }
    const double digit = std::pow(10, std::floor(std::log10(high)) - 2);
    text += fmt::format(", whose torques are held: a rate of {:.6g} Hz would do",
                        std::ceil(high / digit) * digit);
  }
  certificate_.at_most("sampled", now, 1, text);
  refuse_failure(certificate_);
}

}  // namespace porthos::energy_shaping
