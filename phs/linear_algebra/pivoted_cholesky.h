#pragma once
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// A positive semidefinite matrix A, factored by Cholesky's method with diagonal pivoting. The rows
/// are scaled by bounds of their diagonal elements first, so the units of rows do not matter. Rows
/// whose pivot falls below a limit depend on the rows in use and are left out: solve() sets them to
/// zero.
///
/// T: double, long double, Quad, Dual (pivots are chosen by value). Everything but the constructor
/// allocates nothing.
template <class T>
class PivotedCholesky {
 public:
  /// A pivot below this, in the scaled matrix, counts as zero.
  static constexpr double limit = 1e-9;

  explicit PivotedCholesky(std::size_t n = 0)
      : n_(n),
        a_(n * n, T(0.0)),
        scale_(n, T(0.0)),
        inverse_(scale_),
        y_(n, T(0.0)),
        order_(n),
        unique_(n, true) {}

  std::size_t size() const { return n_; }
  /// The element of A to be set before factor(), i >= j.
  T& at(std::size_t i, std::size_t j) { return a_[i * n_ + j]; }

  /// @param bound  size n: what the diagonal elements could be at most, as their units and sizes
  ///   go. A diagonal element far below its bound belongs to a row that is nearly zero
  /// @return the rank
  int factor(std::span<const double> bound) {
    for (std::size_t i = 0; i < n_; ++i) {
      order_[i] = i;
      scale_[i] = T(bound[i] > 0 ? 1 / std::sqrt(bound[i]) : 0.0);
    }
    for (std::size_t i = 0; i < n_; ++i)
      for (std::size_t j = 0; j <= i; ++j) at(i, j) = at(i, j) * scale_[i] * scale_[j];
    set_zero_rows_aside();
    smallest_ = 1;
    for (rank_ = 0; rank_ < some_; ++rank_) {
      std::size_t best = rank_;
      for (std::size_t i = rank_; i < some_; ++i)  // the first of equal ones: the choice is stable
        if (to_double(at(i, i)) > to_double(at(best, best)) * (1 + 1e-3)) best = i;
      const double pivot = to_double(at(best, best));
      if (!(pivot > limit)) break;
      smallest_ = std::min(smallest_, pivot);
      exchange(rank_, best);
      eliminate(rank_);
    }
    find_unique();
    return int(rank_);
  }

  int rank() const { return int(rank_); }
  /// The smallest pivot in use, of the scaled matrix.
  double smallest_pivot() const { return smallest_; }
  /// Whether row i is in use.
  bool uses(std::size_t i) const {
    for (std::size_t k = 0; k < rank_; ++k)
      if (order_[k] == i) return true;
    return false;
  }
  /// Whether A x = r determines x_i.
  bool unique(std::size_t i) const { return unique_[i]; }

  /// r ← a solution of A x = r, for r in the range of A. Size n.
  void solve(std::span<T> r) const {
    for (std::size_t k = 0; k < rank_; ++k) {
      T s = scale_[order_[k]] * r[order_[k]];
      for (std::size_t l = 0; l < k; ++l) s = s - get(k, l) * y_[l];
      y_[k] = s * inverse_[k];
    }
    back_substitute(rank_);
    for (std::size_t k = 0; k < n_; ++k)
      r[order_[k]] = k < rank_ ? scale_[order_[k]] * y_[k] : T(0.0);
  }

  /// x ← the shortest vector that differs from x by the kernel of A. Allocates. Size n.
  void shorten(std::span<T> x) const {
    std::vector<std::vector<T>> kernel;
    for (std::size_t i = rank_; i < n_; ++i) {
      std::vector<T> z = kernel_vector(i);
      for (int twice = 0; twice < 2; ++twice)
        for (const auto& w : kernel) add(-dot(w, z), w, z);
      const T length = phs::sqrt(dot(z, z));
      for (T& c : z) c = c / length;
      kernel.push_back(std::move(z));
    }
    for (const auto& w : kernel) add(-dot(w, x), w, x);
  }

 private:
  const T& get(std::size_t i, std::size_t j) const { return a_[i * n_ + j]; }
  template <class A, class B>
  static T dot(const A& a, const B& b) {
    T s(0.0);
    for (std::size_t i = 0; i < a.size(); ++i) s = s + a[i] * b[i];
    return s;
  }
  template <class To>
  static void add(T factor, const std::vector<T>& v, To& to) {
    for (std::size_t i = 0; i < v.size(); ++i) to[i] = to[i] + factor * v[i];
  }

  /// Exchanges rows and columns k < m of the lower triangle.
  void exchange(std::size_t k, std::size_t m) {
    if (k == m) return;
    std::swap(order_[k], order_[m]);
    for (std::size_t j = 0; j < k; ++j) std::swap(at(k, j), at(m, j));
    std::swap(at(k, k), at(m, m));
    for (std::size_t i = k + 1; i < m; ++i) std::swap(at(i, k), at(m, i));
    for (std::size_t i = m + 1; i < n_; ++i) std::swap(at(i, k), at(i, m));
  }
  /// Rows that are zero from the start come last and take no part in the elimination.
  void set_zero_rows_aside() {
    some_ = n_;
    for (std::size_t i = n_; i-- > 0;) {
      if (to_double(at(i, i)) > limit) continue;
      exchange(i, --some_);
      scale_[order_[some_]] = T(0.0);
    }
  }
  void eliminate(std::size_t k) {
    const T root = phs::sqrt(at(k, k));
    inverse_[k] = T(1.0) / root;
    at(k, k) = root;
    for (std::size_t i = k + 1; i < some_; ++i) at(i, k) = at(i, k) * inverse_[k];
    for (std::size_t i = k + 1; i < some_; ++i)
      for (std::size_t j = k + 1; j <= i; ++j) at(i, j) = at(i, j) - at(i, k) * at(j, k);
  }
  /// y ← L₁⁻ᵀ y, L₁ the rows in use; entries from `begin` on are zero.
  void back_substitute(std::size_t begin) const {
    for (std::size_t k = begin; k-- > 0;) {
      T s = y_[k];
      for (std::size_t l = k + 1; l < begin; ++l) s = s - get(l, k) * y_[l];
      y_[k] = s * inverse_[k];
    }
  }
  /// Of [L₁; L₂]ᵀ z = 0 in the scaled rows: z₁ = -L₁⁻ᵀ L₂ᵀ z₂ for the unit vector z₂ of place i.
  void dependence(std::size_t i) const {
    for (std::size_t k = 0; k < rank_; ++k) y_[k] = -get(i, k);
    back_substitute(rank_);
  }
  std::vector<T> kernel_vector(std::size_t i) const {
    std::vector<T> z(n_, T(0.0));
    const T own = scale_[order_[i]];
    if (!(to_double(own) > 0)) {  // a zero row: it depends on nothing
      z[order_[i]] = T(1.0);
      return z;
    }
    dependence(i);
    for (std::size_t k = 0; k < rank_; ++k) z[order_[k]] = scale_[order_[k]] * y_[k];
    z[order_[i]] = own;
    return z;
  }
  void find_unique() {
    std::fill(unique_.begin(), unique_.end(), true);
    for (std::size_t i = rank_; i < n_; ++i) {
      unique_[order_[i]] = false;
      if (!(to_double(scale_[order_[i]]) > 0)) continue;
      dependence(i);
      for (std::size_t k = 0; k < rank_; ++k)
        if (std::fabs(to_double(y_[k])) > 1e-6) unique_[order_[k]] = false;
    }
  }

  std::size_t n_, some_ = 0, rank_ = 0;  ///< rows: all, not zero, in use
  std::vector<T> a_, scale_, inverse_;   ///< inverse_: of the factor's diagonal
  mutable std::vector<T> y_;
  std::vector<std::size_t> order_;
  std::vector<bool> unique_;
  double smallest_ = 1;
};

}  // namespace porthos::phs
