#include "phs/functions/smoothing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace porthos::phs {
namespace {

/// Qᵀ takes second differences: (Qᵀ y)_j = (y_{j+2} - y_{j+1})/h_{j+1} - (y_{j+1} - y_j)/h_j.
class Smoother {
 public:
  Smoother(const std::vector<double>& x, const std::vector<double>& y) : y_(y), n_(x.size()) {
    const double mean = (x.back() - x.front()) / double(n_ - 1);  // the spacings become about 1
    for (std::size_t i = 0; i + 1 < n_; ++i) h_.push_back((x[i + 1] - x[i]) / mean);
  }
  /// y - w Q u with ((1 - w) R + w QᵀQ) u = Qᵀ y. w = 0 interpolates, w = 1 gives the straight
  /// line; w / (1 - w) is the weight of bending against distances.
  std::vector<double> values(double w) const {
    const std::size_t m = n_ - 2;
    std::vector<double> d(m), e(m), f(m), u(m);  // L D Lᵀ: D, and two diagonals of L
    for (std::size_t j = 0; j < m; ++j) {
      const double a = 1 / h_[j], c = 1 / h_[j + 1], b = -a - c;
      d[j] = (1 - w) * (h_[j] + h_[j + 1]) / 3 + w * (a * a + b * b + c * c);
      u[j] = (y_[j + 2] - y_[j + 1]) * c - (y_[j + 1] - y_[j]) * a;
      if (j + 1 < m) {
        const double next = 1 / h_[j + 2];
        e[j] = (1 - w) * h_[j + 1] / 6 + w * (b * c + c * (-c - next));
        if (j + 2 < m) f[j] = w * c * next;
      }
    }
    for (std::size_t j = 0; j < m; ++j) {
      const double e0 = e[j], f0 = f[j];
      e[j] /= d[j];
      f[j] /= d[j];
      if (j + 1 < m) {
        d[j + 1] -= e0 * e[j];
        e[j + 1] -= e0 * f[j];
        u[j + 1] -= e[j] * u[j];
      }
      if (j + 2 < m) {
        d[j + 2] -= f0 * f[j];
        u[j + 2] -= f[j] * u[j];
      }
    }
    for (std::size_t j = m; j-- > 0;) {
      u[j] /= d[j];
      if (j + 1 < m) u[j] -= e[j] * u[j + 1];
      if (j + 2 < m) u[j] -= f[j] * u[j + 2];
    }
    std::vector<double> g = y_;
    for (std::size_t j = 0; j < m; ++j) {
      g[j] -= w * u[j] / h_[j];
      g[j + 1] += w * u[j] * (1 / h_[j] + 1 / h_[j + 1]);
      g[j + 2] -= w * u[j] / h_[j + 1];
    }
    return g;
  }
  /// Σ (g_i - y_i)²; grows with w.
  double distance(const std::vector<double>& g) const {
    double sum = 0;
    for (std::size_t i = 0; i < n_; ++i) sum += (g[i] - y_[i]) * (g[i] - y_[i]);
    return sum;
  }

 private:
  const std::vector<double>& y_;
  std::size_t n_;
  std::vector<double> h_;
};

}  // namespace

std::vector<double> smoothed(const std::vector<double>& x, const std::vector<double>& y, double s) {
  const Smoother smoother(x, y);
  const double most = double(x.size()) * s * s;
  auto g = smoother.values(1);
  if (smoother.distance(g) <= most) return g;
  double low = -40, high = 60;  // of log(w / (1 - w))
  for (int i = 0; i < 100; ++i) {
    const double mid = (low + high) / 2;
    g = smoother.values(1 / (1 + std::exp(-mid)));
    (smoother.distance(g) <= most ? low : high) = mid;
  }
  return smoother.values(1 / (1 + std::exp(-low)));
}

double scatter(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 3) return 0;
  double sum = 0;
  for (std::size_t i = 1; i + 1 < x.size(); ++i) {
    const double a = (x[i + 1] - x[i]) / (x[i + 1] - x[i - 1]), b = 1 - a;
    const double off = a * y[i - 1] + b * y[i + 1] - y[i];
    sum += off * off / (1 + a * a + b * b);
  }
  return std::sqrt(sum / double(x.size() - 2));
}

}  // namespace porthos::phs
