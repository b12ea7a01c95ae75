#include "phs/functions/smoothing.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace porthos::phs {
namespace {

/// Qᵀ takes second differences: (Qᵀ y)_j = (y_{j+2} - y_{j+1})/h_{j+1} - (y_{j+1} - y_j)/h_j.
class Smoother {
 public:
  Smoother(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& s)
      : y_(y), n_(x.size()) {
    const double mean = (x.back() - x.front()) / double(n_ - 1);  // the spacings become about 1
    for (std::size_t i = 0; i + 1 < n_; ++i) h_.push_back((x[i + 1] - x[i]) / mean);
    double size = 0;
    for (const double each : s) size += each * each / double(n_);
    for (const double each : s) v_.push_back(std::max(each * each / size, 1e-6));
    most_ = double(n_) * size;
  }
  /// y - w V Q u with ((1 - w) R + w QᵀVQ) u = Qᵀ y, V = diag(s_i²). w = 0 interpolates, w = 1
  /// gives the straight line; w / (1 - w) is the weight of bending against distances.
  std::vector<double> values(double w) const {
    const std::size_t m = n_ - 2;
    std::vector<double> d(m), e(m), f(m), u(m);  // L D Lᵀ: D, and two diagonals of L
    for (std::size_t j = 0; j < m; ++j) {
      const double a = 1 / h_[j], c = 1 / h_[j + 1], b = -a - c;
      d[j] = (1 - w) * (h_[j] + h_[j + 1]) / 3 +
             w * (a * a * v_[j] + b * b * v_[j + 1] + c * c * v_[j + 2]);
      u[j] = (y_[j + 2] - y_[j + 1]) * c - (y_[j + 1] - y_[j]) * a;
      if (j + 1 < m) {
        const double next = 1 / h_[j + 2];
        e[j] = (1 - w) * h_[j + 1] / 6 + w * (b * c * v_[j + 1] + c * (-c - next) * v_[j + 2]);
        if (j + 2 < m) f[j] = w * c * next * v_[j + 2];
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
      g[j] -= w * v_[j] * u[j] / h_[j];
      g[j + 1] += w * v_[j + 1] * u[j] * (1 / h_[j] + 1 / h_[j + 1]);
      g[j + 2] -= w * v_[j + 2] * u[j] / h_[j + 1];
    }
    return g;
  }
  /// Whether Σ ((g_i - y_i)/s_i)² <= n; the sum grows with w.
  bool near(const std::vector<double>& g) const {
    double sum = 0;
    for (std::size_t i = 0; i < n_; ++i) sum += (g[i] - y_[i]) * (g[i] - y_[i]) / v_[i];
    return sum <= most_;
  }

 private:
  const std::vector<double>& y_;
  std::size_t n_;
  std::vector<double> h_, v_;  ///< v: s² over its mean
  double most_ = 0;
};

/// How n values are divided for their scatter.
struct ScatterPieces {
  explicit ScatterPieces(std::size_t n)
      : values(n),
        count(std::max<std::size_t>(1, (n + 5) / 10)),
        parameters(std::min<std::size_t>(4, (n + 1) / 2)),
        freedom(n < 3 ? 0 : n - count * parameters) {}
  std::size_t begin(std::size_t k) const { return k * values / count; }
  std::size_t values, count, parameters, freedom;
};

/// Σ ((y_i - p(x_i)) / s_i)² of the polynomial p of least squares through the values of a piece, by
/// powers of x made orthogonal one after the other.
double squares_off(const std::vector<double>& x, const std::vector<double>& y,
                   const std::vector<double>& s, double size, std::size_t begin, std::size_t end,
                   std::size_t parameters) {
  const double middle = (x[begin] + x[end - 1]) / 2, half = (x[end - 1] - x[begin]) / 2;
  std::vector<std::vector<double>> powers(parameters);
  std::vector<double> off;
  for (std::size_t i = begin; i < end; ++i) {
    double power = 1 / std::max(s[i], 1e-3 * size);
    off.push_back(y[i] * power);
    for (auto& each : powers) {
      each.push_back(power);
      power *= (x[i] - middle) / half;
    }
  }
  const auto dot = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  const auto take = [&](std::vector<double>& from, const std::vector<double>& a) {
    const double part = dot(from, a) / dot(a, a);
    for (std::size_t i = 0; i < a.size(); ++i) from[i] -= part * a[i];
  };
  for (std::size_t k = 0; k < parameters; ++k) {
    for (int twice = 0; twice < 2; ++twice)
      for (std::size_t j = 0; j < k; ++j) take(powers[k], powers[j]);
    take(off, powers[k]);
  }
  return dot(off, off);
}

}  // namespace

std::vector<double> smoothed(const std::vector<double>& x, const std::vector<double>& y,
                             const std::vector<double>& s) {
  const Smoother smoother(x, y, s);
  auto g = smoother.values(1);
  if (smoother.near(g)) return g;
  double low = -40, high = 60;  // of log(w / (1 - w))
  for (int i = 0; i < 100; ++i) {
    const double mid = (low + high) / 2;
    g = smoother.values(1 / (1 + std::exp(-mid)));
    (smoother.near(g) ? low : high) = mid;
  }
  return smoother.values(1 / (1 + std::exp(-low)));
}

double scatter(const std::vector<double>& x, const std::vector<double>& y) {
  return scatter(x, y, std::vector<double>(x.size(), 1.0));
}

double scatter(const std::vector<double>& x, const std::vector<double>& y,
               const std::vector<double>& s) {
  const ScatterPieces pieces(x.size());
  double size = 0;
  for (const double each : s) size += each * each / double(s.size());
  if (pieces.freedom == 0 || size == 0) return 0;
  double sum = 0;
  for (std::size_t k = 0; k < pieces.count; ++k)
    sum += squares_off(x, y, s, std::sqrt(size), pieces.begin(k), pieces.begin(k + 1),
                       pieces.parameters);
  return std::sqrt(sum / double(pieces.freedom));
}

std::pair<double, double> usual_scatter(std::size_t n, double sigmas) {
  const double part = 2 / (9 * double(ScatterPieces(n).freedom));
  const auto at = [&](double z) { return std::max(0.0, 1 - part + z * std::sqrt(part)); };
  return {std::pow(at(-sigmas), 1.5), std::pow(at(sigmas), 1.5)};
}

double slope_error(const std::vector<double>& x, const std::vector<double>& y) {
  std::size_t turns = 0;
  double before = 0;
  for (std::size_t i = 1; i + 1 < x.size(); ++i) {
    const double second =
        (y[i + 1] - y[i]) / (x[i + 1] - x[i]) - (y[i] - y[i - 1]) / (x[i] - x[i - 1]);
    turns += second * before < 0;
    before = second;
  }
  if (turns <= 3 || 5 * turns <= x.size()) return 0;
  return std::sqrt(2.0) * scatter(x, y) * double(x.size() - 1) / std::fabs(y.back() - y.front());
}

}  // namespace porthos::phs
