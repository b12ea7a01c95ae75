#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::contact {

/// A closed contact with friction among rows of W: its normal, the first of two directions across
/// it, and what friction does. Where it slides the first direction is that of the slip.
struct Rubbing {
  size_t normal, across;
  double mu;
  bool sticks;
};

/// Turns two neighbouring rows r, r + 1 of W so that W(r, r+1) = 0, and the unknowns or right sides
/// v with them; a direction in which nothing can move, beside the normal's W, gets W = 0.
template <class T>
struct PrincipalAxes {
  T c, s;
  PrincipalAxes(std::span<T> W, size_t m, size_t r, const T& normal) : c(1.0), s(0.0) {
    using phs::sqrt;
    const auto abs = [](const T& x) { return x < T(0.0) ? T(-x) : x; };
    const T off = W[r * m + r + 1];
    if (off != T(0.0)) {  // Jacobi's rotation
      const T tau = (W[(r + 1) * m + r + 1] - W[r * m + r]) / (off + off);
      const T t = (tau < T(0.0) ? T(-1.0) : T(1.0)) / (abs(tau) + T(sqrt(tau * tau + T(1.0))));
      c = T(1.0) / T(sqrt(t * t + T(1.0)));
      s = t * c;
      for (size_t k = 0; k < m; ++k) turn(W[r * m + k], W[(r + 1) * m + k]);
      for (size_t k = 0; k < m; ++k) turn(W[k * m + r], W[k * m + r + 1]);
    }
    const T most = std::max({normal, W[r * m + r], W[(r + 1) * m + r + 1]});
    for (const size_t i : {r, r + 1})
      if (!(W[i * m + i] > T(1e-12) * most)) W[i * m + i] = T(0.0);
  }
  void turn(T& x, T& y) const {
    const T a = c * x - s * y, b = s * x + c * y;
    x = a;
    y = b;
  }
  void back(T& x, T& y) const {
    const T a = c * x + s * y, b = c * y - s * x;
    x = a;
    y = b;
  }
};

/// The forces of closed contacts with Coulomb's friction whose directions are known:
///   0 <= λ_n ⊥ w_n >= 0,  λ_t = -μ λ_n s where a contact slides along s,  w_t = 0 where it sticks,
/// with w = a + W λ. Sticking is eliminated first; then the normals are an active set (Lawson,
/// Hanson 1974) over the reduced matrix, which friction makes unsymmetric. Exact, cost m³.
///
/// Friction may press a contact harder than it yields: then a pivot of that matrix is not positive,
/// and there is no force, or two (Painlevé 1895; Génot, Brogliato 1999, eq. 12).
///
/// Where points that stick hold each other, as three feet on parallel legs, their friction is not
/// unique while the motion is. It is shared: the least Σ |λ_t|²/(μ λ_n), so all bear the same part
/// of what they can when one force pushes them.
class Coulomb {
 public:
  explicit Coulomb(size_t most)
      : W_(most * most),
        a_(most),
        X_(most * most),
        A_(most * most),
        b_(most),
        w_(most),
        candidate_(most),
        factor_(most * most),
        lambda_(most),
        scale_(most),
        weight_(most),
        excluded_(most),
        shared_(most) {
    free_.reserve(most);
    dependent_.reserve(most);
    held_.reserve(most);
    axes_.reserve(most);
  }
  /// @param W  m × m row-major, symmetric; a: size m; normals: the first rows; lambda: written
  /// @return whether the forces are unique
  bool solve(std::span<const double> W, std::span<const double> a, size_t normals,
             std::span<const Rubbing> rubs, std::span<double> lambda) {
    m_ = a.size();
    n_ = normals;
    std::copy(W.begin(), W.end(), W_.begin());
    std::copy(a.begin(), a.end(), a_.begin());
    for (size_t i = 0; i < n_; ++i) scale_[i] = W[i * (m_ + 1)];
    held_.clear();
    axes_.clear();
    for (const Rubbing& r : rubs) {
      if (!r.sticks) continue;
      axes_.emplace_back(std::span(W_).first(m_ * m_), m_, r.across, W[r.normal * (m_ + 1)]);
      axes_.back().turn(a_[r.across], a_[r.across + 1]);
      for (const size_t row : {r.across, r.across + 1})
        if (w(row, row) > 0) held_.push_back(row);
    }
    eliminate(rubs);
    if (!press(rubs)) return false;
    std::fill(lambda.begin(), lambda.end(), 0.0);
    std::copy_n(lambda_.begin(), n_, lambda.begin());
    for (size_t i = 0; i < held_.size(); ++i) {
      double& l = lambda[held_[i]];
      l = -X_[i * columns_ + n_];
      for (size_t k = 0; k < n_; ++k) l -= X_[i * columns_ + k] * lambda_[k];
    }
    if (!dependent_.empty()) share(rubs, lambda);
    auto axes = axes_.begin();
    for (const Rubbing& r : rubs)
      if (r.sticks)
        (axes++)->back(lambda[r.across], lambda[r.across + 1]);
      else
        lambda[r.across] = -r.mu * lambda_[r.normal];
    return true;
  }

  /// If they are not: the normal of a contact whose friction is to blame.
  size_t jammed() const { return jammed_; }
  /// Whether the friction of the contact with this normal is one of several that would do.
  bool shared(size_t normal) const { return !dependent_.empty() && shared_[normal]; }

 private:
  /// By a row of it; else the first one.
  bool jams(size_t row, std::span<const Rubbing> rubs) {
    jammed_ = rubs.front().normal;
    for (const Rubbing& r : rubs)
      if (row == r.normal || row == r.across || row == r.across + 1) jammed_ = r.normal;
    return false;
  }
  double& w(size_t i, size_t j) { return W_[i * m_ + j]; }

  /// L Lᵀ of the rows that stick; those that depend on others go to dependent_.
  void factor_held() {
    const size_t stride = held_.size();
    size_t kept = 0;
    dependent_.clear();
    for (size_t i = 0; i < stride; ++i) {
      const size_t row = held_[i];
      double* const L = factor_.data() + kept * stride;
      for (size_t j = 0; j < kept; ++j) {
        L[j] = w(row, held_[j]);
        for (size_t k = 0; k < j; ++k) L[j] -= L[k] * factor_[j * stride + k];
        L[j] /= factor_[j * stride + j];
      }
      double sum = w(row, row);
      for (size_t k = 0; k < kept; ++k) sum -= L[k] * L[k];
      if (!(sum > 1e-12 * w(row, row))) {
        dependent_.push_back(row);
        continue;
      }
      L[kept] = std::sqrt(sum);
      held_[kept++] = row;
    }
    stride_ = stride;
    held_.resize(kept);
  }
  /// X = W_TT⁻¹ (W_TN, a_T, W_TD) of the independent rows T that stick, where the columns N of
  /// contacts that slide have their friction, and D are dependent; then the reduced A and b.
  void eliminate(std::span<const Rubbing> rubs) {
    for (const Rubbing& r : rubs)
      if (!r.sticks)
        for (size_t i = 0; i < m_; ++i) w(i, r.normal) -= r.mu * w(i, r.across);
    factor_held();
    const size_t t = held_.size(), columns = columns_ = n_ + 1 + dependent_.size();
    for (size_t i = 0; i < t; ++i) {
      for (size_t k = 0; k < n_; ++k) X_[i * columns + k] = w(held_[i], k);
      X_[i * columns + n_] = a_[held_[i]];
      for (size_t d = 0; d < dependent_.size(); ++d)
        X_[i * columns + n_ + 1 + d] = w(held_[i], dependent_[d]);
    }
    for (size_t c = 0; c < columns; ++c) {
      for (size_t i = 0; i < t; ++i) {
        double& x = X_[i * columns + c];
        for (size_t k = 0; k < i; ++k) x -= factor_[i * stride_ + k] * X_[k * columns + c];
        x /= factor_[i * stride_ + i];
      }
      for (size_t i = t; i-- > 0;) {
        double& x = X_[i * columns + c];
        for (size_t k = i + 1; k < t; ++k) x -= factor_[k * stride_ + i] * X_[k * columns + c];
        x /= factor_[i * stride_ + i];
      }
    }
    for (size_t i = 0; i < n_; ++i) {
      for (size_t k = 0; k < n_; ++k) A_[i * n_ + k] = w(i, k);
      b_[i] = a_[i];
      for (size_t j = 0; j < t; ++j) {
        for (size_t k = 0; k < n_; ++k) A_[i * n_ + k] -= w(i, held_[j]) * X_[j * columns + k];
        b_[i] -= w(i, held_[j]) * X_[j * columns + n_];
      }
    }
  }
  /// Of a friction that moves nothing: its entry d of dependent_ is 1.
  double idle(size_t i, size_t d) const { return -X_[i * columns_ + n_ + 1 + d]; }
  /// Adds to λ what moves nothing, so that Σ |λ_t|²/(μ λ_n) is least.
  void share(std::span<const Rubbing> rubs, std::span<double> lambda) {
    const size_t d = dependent_.size();
    double most = 0;
    for (const Rubbing& r : rubs)
      if (r.sticks) most = std::max(most, r.mu * lambda[r.normal]);
    for (const Rubbing& r : rubs) {
      const double can = most > 0 ? std::max(r.mu * lambda[r.normal] / most, 1e-12) : 1;
      weight_[r.across] = weight_[r.across + 1] = 1 / can;
    }
    auto& y = candidate_;
    for (size_t e = 0; e < d; ++e) {
      for (size_t f = 0; f < d; ++f) {
        double& sum = factor_[e * d + f] = e == f ? weight_[dependent_[e]] : 0;
        for (size_t i = 0; i < held_.size(); ++i)
          sum += idle(i, e) * weight_[held_[i]] * idle(i, f);
      }
      y[e] = 0;
      for (size_t i = 0; i < held_.size(); ++i)
        y[e] -= idle(i, e) * weight_[held_[i]] * lambda[held_[i]];
    }
    solve(d, [](size_t, double) { return true; });  // positive definite
    for (size_t e = d; e-- > 0;) {
      lambda[dependent_[e]] = y[e];
      for (size_t i = 0; i < held_.size(); ++i) lambda[held_[i]] += idle(i, e) * y[e];
    }
    mark_shared(rubs);
  }
  void mark_shared(std::span<const Rubbing> rubs) {
    std::fill(shared_.begin(), shared_.end(), 0);
    const auto mark = [&](size_t row) {
      for (const Rubbing& r : rubs)
        if (r.sticks && (row == r.across || row == r.across + 1)) shared_[r.normal] = 1;
    };
    for (size_t d = 0; d < dependent_.size(); ++d) {
      mark(dependent_[d]);
      for (size_t i = 0; i < held_.size(); ++i)
        if (std::fabs(idle(i, d)) > 1e-9) mark(held_[i]);
    }
  }
  /// The normals' λ.
  bool press(std::span<const Rubbing> rubs) {
    free_.clear();
    std::fill_n(lambda_.begin(), n_, 0.0);
    std::fill_n(excluded_.begin(), n_, 0);
    for (const Rubbing& r : rubs)
      if (!r.sticks && !(A_[r.normal * (n_ + 1)] > least(r.normal))) return jams(r.normal, rubs);
    double largest = 0;
    for (size_t i = 0; i < n_; ++i) largest = std::max(largest, std::fabs(b_[i]));
    for (size_t round = 0; round < 20 * n_ + 20; ++round) {
      size_t worst = n_;
      for (size_t i = 0; i < n_; ++i) {
        w_[i] = b_[i];
        for (size_t k = 0; k < n_; ++k) w_[i] += A_[i * n_ + k] * lambda_[k];
        if (!excluded_[i] && w_[i] < -1e-13 * largest && !is_free(i) &&
            (worst == n_ || w_[i] < w_[worst]))
          worst = i;
      }
      if (worst == n_) return true;
      free_.push_back(worst);
      if (!settle(worst, rubs)) return false;
    }
    return jams(n_, rubs);
  }
  bool is_free(size_t i) const { return std::find(free_.begin(), free_.end(), i) != free_.end(); }
  /// A pivot that is rounding.
  double least(size_t i) const { return 1e-12 * scale_[i]; }

  /// λ of those that press, the last one among them new; lets go those that would pull.
  bool settle(size_t added, std::span<const Rubbing> rubs) {
    for (;;) {
      if (!solve_free()) {
        if (std::any_of(rubs.begin(), rubs.end(), [](const Rubbing& r) { return !r.sticks; }))
          return jams(added, rubs);
        free_.pop_back();  // it depends on the others
        excluded_[added] = 1;
        return true;
      }
      double part = 1;
      size_t first = n_;
      for (size_t k = 0; k < free_.size(); ++k) {
        const double now = lambda_[free_[k]];
        if (candidate_[k] > 0) continue;
        if (const double ends = now / (now - candidate_[k]); first == n_ || ends < part) {
          part = ends;
          first = free_[k];
        }
      }
      for (size_t k = 0; k < free_.size(); ++k) {
        double& now = lambda_[free_[k]];
        now = first == n_ ? candidate_[k] : now + part * (candidate_[k] - now);
      }
      if (first == n_) return true;
      lambda_[first] = 0;
      std::erase(free_, first);
    }
  }
  /// Elimination in the order of free_, whose pivots are positive unless friction jams.
  bool solve_free() {
    const size_t n = free_.size();
    for (size_t i = 0; i < n; ++i) {
      for (size_t k = 0; k < n; ++k) factor_[i * n + k] = A_[free_[i] * n_ + free_[k]];
      candidate_[i] = -b_[free_[i]];
    }
    return solve(n, [&](size_t i, double pivot) { return pivot > least(free_[i]); });
  }
  /// Elimination of factor_ y = candidate_, n numbers, which become y; false at a pivot that is not
  /// accepted.
  template <class Accepts>
  bool solve(size_t n, const Accepts& accepts) {
    for (size_t i = 0; i < n; ++i) {
      if (!accepts(i, factor_[i * n + i])) return false;
      for (size_t r = i + 1; r < n; ++r) {
        const double f = factor_[r * n + i] / factor_[i * n + i];
        for (size_t k = i; k < n; ++k) factor_[r * n + k] -= f * factor_[i * n + k];
        candidate_[r] -= f * candidate_[i];
      }
    }
    for (size_t i = n; i-- > 0;) {
      for (size_t k = i + 1; k < n; ++k) candidate_[i] -= factor_[i * n + k] * candidate_[k];
      candidate_[i] /= factor_[i * n + i];
    }
    return true;
  }

  size_t m_ = 0, n_ = 0, jammed_ = 0, columns_ = 0, stride_ = 0;
  std::vector<double> W_, a_, X_, A_, b_, w_, candidate_, factor_, lambda_, scale_, weight_;
  std::vector<char> excluded_, shared_;
  std::vector<size_t> free_, held_;  ///< normals that press; directions that stick and can move
  std::vector<size_t> dependent_;    ///< of the latter, those that others hold as well
  std::vector<PrincipalAxes<double>> axes_;
};

}  // namespace porthos::contact
