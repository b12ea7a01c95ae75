#pragma once
#include <cmath>
#include <span>
#include <vector>

namespace porthos::contact {

/// Which of several dry joints at rest stick, by the linear complementarity problem with bounds
///   w = a + W λ,   |λ_i| <= L_i,   w_i = 0 inside the bounds, w_i <= 0 at L_i, w_i >= 0 at -L_i:
/// a the accelerations without friction, λ the frictions, w what they leave. W = M⁻¹ of those
/// joints is positive definite, so there is one solution.
/// Source: Murty 1974, Opsearch 11, the least-index rule; with bounds Judice, Pires 1992,
/// Computers & Operations Research 19. Exact and finite, cost m³ per pivot.
class StickSlip {
 public:
  explicit StickSlip(size_t most) {
    lambda_.reserve(most);
    at_.reserve(most);
    free_.reserve(most);
    factor_.reserve(most * most);
  }
  /// λ of all joints. @param W  m × m row-major; a, L: size m, L infinite where a joint must stick
  std::span<const double> solve(std::span<const double> W, std::span<const double> a,
                                std::span<const double> L) {
    const size_t m = a.size();
    at_.assign(m, 0);
    lambda_.resize(m);
    while (true) {
      solve_free(W, a, L);
      size_t i = 0;
      for (; i < m; ++i)
        if (const int next = next_of(i, W, a, L); next != at_[i]) {
          at_[i] = next;
          break;
        }
      if (i == m) return lambda_;
    }
  }
  /// Of the last solution: 0 if joint i sticks, 1 or -1 if its friction is at that bound.
  int bound(size_t i) const { return at_[i]; }

 private:
  /// Where joint i belongs by the present λ.
  int next_of(size_t i, std::span<const double> W, std::span<const double> a,
              std::span<const double> L) const {
    if (at_[i] == 0) return lambda_[i] > L[i] ? 1 : lambda_[i] < -L[i] ? -1 : 0;
    double w = a[i], scale = std::fabs(w);
    for (size_t j = 0; j < a.size(); ++j) {
      const double part = W[i * a.size() + j] * lambda_[j];
      w += part;
      scale += std::fabs(part);
    }
    return w * at_[i] > 1e-14 * scale ? 0 : at_[i];  // or rounding at a bound would pivot for ever
  }
  /// w = 0 for the joints between their bounds, by Cholesky.
  void solve_free(std::span<const double> W, std::span<const double> a, std::span<const double> L) {
    const size_t m = a.size();
    free_.clear();
    for (size_t i = 0; i < m; ++i) {
      if (at_[i] == 0)
        free_.push_back(i);
      else
        lambda_[i] = at_[i] * L[i];
    }
    const size_t n = free_.size();
    factor_.resize(n * n);
    for (size_t r = 0; r < n; ++r) {
      const size_t i = free_[r];
      double right = -a[i];
      for (size_t j = 0; j < m; ++j)
        if (at_[j] != 0) right -= W[i * m + j] * lambda_[j];
      for (size_t c = 0; c <= r; ++c) {
        double sum = W[i * m + free_[c]];
        for (size_t k = 0; k < c; ++k) sum -= factor_[r * n + k] * factor_[c * n + k];
        factor_[r * n + c] = c < r ? sum / factor_[c * n + c] : std::sqrt(sum);
      }
      for (size_t k = 0; k < r; ++k) right -= factor_[r * n + k] * lambda_[free_[k]];
      lambda_[i] = right / factor_[r * n + r];
    }
    for (size_t r = n; r-- > 0;) {
      double& l = lambda_[free_[r]];
      for (size_t k = r + 1; k < n; ++k) l -= factor_[k * n + r] * lambda_[free_[k]];
      l /= factor_[r * n + r];
    }
  }

  std::vector<double> lambda_, factor_;
  std::vector<int> at_;
  std::vector<size_t> free_;
};

}  // namespace porthos::contact
