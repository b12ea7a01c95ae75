#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "phs/linear_algebra/block_pattern.h"
#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// A sparse positive semidefinite matrix A, factored by Cholesky's method front by front, with
/// diagonal pivoting inside each front. The rows are scaled by bounds of their diagonal elements
/// first, so the units of rows do not matter. Rows whose pivot falls below a limit depend on the
/// rows in use and are left out: solve() sets them to zero. The factors are those of the rows in
/// use, without error: what is left out fills nothing.
///
/// Vectors are by place (BlockPattern). T: double, long double, Quad, Dual (pivots are chosen by
/// value). Nothing but the constructor allocates.
template <class T>
class BlockCholesky {
 public:
  /// A pivot below this, in the scaled matrix, counts as zero.
  static constexpr double limit = 1e-9;

  /// pattern: it must outlive this object
  explicit BlockCholesky(const BlockPattern& pattern)
      : pattern_(pattern),
        n_(std::size_t(pattern.rows())),
        a_(pattern.elements(), T(0.0)),
        scale_(n_, T(0.0)),
        unit_(scale_),
        inverse_(scale_),
        x_(scale_),
        rest_(scale_),
        along_(scale_),
        order_(n_),
        position_(n_),
        rank_of_(pattern.fronts().size()),
        used_(n_, 0),
        unique_(n_, 1) {}

  /// The elements of A, to be set before factor(): the lower triangle, as BlockPattern::locate()
  /// says. Elements of pairs that are no neighbours must be zero.
  std::span<T> elements() { return a_; }

  /// @param bound  by place: what the diagonal elements could be at most, as their units and sizes
  ///   go. A diagonal element far below its bound belongs to a row that is nearly zero
  /// @return the rank
  int factor(std::span<const double> bound) {
    scale(bound);
    smallest_ = 1;
    rank_ = 0;
    for (std::size_t f = 0; f < rank_of_.size(); ++f) {
      const Front& front = pattern_.fronts()[f];
      rank_of_[f] = factor(front);
      rank_ += int(rank_of_[f]);
      update_later(front, rank_of_[f]);
    }
    unique_is_known_ = false;
    return rank_;
  }

  int rank() const { return rank_; }
  /// The smallest pivot in use, of the scaled matrix.
  double smallest_pivot() const { return smallest_; }
  /// Whether the row at a place is in use.
  bool uses(int place) const { return used_[std::size_t(place)] != 0; }
  /// Whether A x = r determines x at a place.
  bool unique(int place) const {
    if (!unique_is_known_) find_unique();
    return unique_[std::size_t(place)] != 0;
  }

  /// r ← a solution of A x = r, for r in the range of A, size n. C: T or, if T is double, lanes: a
  /// right-hand side in each, with the bits that it has alone.
  template <class C>
  void solve(std::span<C> r) const {
    for (std::size_t i = 0; i < n_; ++i) r[i] = C(scale_[i]) * r[i];
    forward<Rows::used>(r);
    backward<Rows::used>(r);
    for (std::size_t i = 0; i < n_; ++i) r[i] = used_[i] ? C(scale_[i]) * r[i] : C(T(0.0));
  }

  /// x ← the shortest vector that differs from x by the kernel of A, size n: x - Z c, where Z spans
  /// the kernel and ZᵀZ c = Zᵀx. Each column of Z is 1 at a row left out and 0 at the others, so
  /// ZᵀZ = 1 + WᵀW, and conjugate gradients converge fast.
  void shorten(std::span<T> x) const {
    if (rank_ == int(n_)) return;
    constexpr double roundoff = std::is_same_v<T, Quad> ? 0x1p-110 : 0x1p-50;
    for (int twice = 0; twice < 2; ++twice) {
      onto_kernel(x, rest_);
      std::copy(rest_.begin(), rest_.end(), along_.begin());
      T square = dot(rest_, rest_);
      const double enough = roundoff * roundoff * to_double(square);
      for (int i = 0; i < 500 && to_double(square) > enough; ++i) {
        from_kernel();
        const T step = square / dot(x_, x_);
        for (std::size_t k = 0; k < n_; ++k) x[k] = x[k] - step * x_[k];
        onto_kernel(x_, x_);
        for (std::size_t k = 0; k < n_; ++k) rest_[k] = rest_[k] - step * x_[k];
        const T next = dot(rest_, rest_), ratio = next / square;
        for (std::size_t k = 0; k < n_; ++k) along_[k] = rest_[k] + ratio * along_[k];
        square = next;
      }
    }
  }

 private:
  using Front = BlockPattern::Front;
  /// Rows that a substitution gives values: those in use, or, of a vector of the kernel, all.
  enum class Rows { used, all };

  template <class A, class B>
  static T dot(const A& a, const B& b) {
    T s(0.0);
    for (std::size_t i = 0; i < a.size(); ++i) s = s + a[i] * b[i];
    return s;
  }
  static std::size_t height(const Front& f) { return std::size_t(f.size) + f.below.size(); }

  // --- factors ----------------------------------------------------------------------------------
  /// Scales the rows. Those that are zero from the start get the scale 0.
  void scale(std::span<const double> bound) {
    for (const Front& f : pattern_.fronts())
      for (std::size_t k = 0, b = std::size_t(f.size); k < b; ++k) {
        const std::size_t i = std::size_t(f.at) + k;
        const T own = T(bound[i] > 0 ? 1 / std::sqrt(bound[i]) : 0.0);
        const bool zero = !(to_double(a_[f.data + k * b + k] * own * own) > limit);
        scale_[i] = zero ? T(0.0) : own;
        unit_[i] = zero ? T(1.0) : own;
        order_[i] = int(i);
        used_[i] = 0;
      }
    for (const Front& f : pattern_.fronts())
      for (std::size_t i = 0, b = std::size_t(f.size); i < height(f); ++i) {
        T* const row = a_.data() + f.data + i * b;
        const T own = scale_[i < b ? std::size_t(f.at) + i : std::size_t(f.below[i - b])];
        for (std::size_t j = 0; j < std::min(i + 1, b); ++j)
          row[j] = row[j] * own * scale_[std::size_t(f.at) + j];
      }
  }
  /// @return the rank of the front's rows, given those eliminated before
  std::size_t factor(const Front& f) {
    std::size_t some = std::size_t(f.size), rank = 0;
    int* const order = order_.data() + f.at;
    for (std::size_t i = some; i-- > 0;)  // zero rows come last and take no part
      if (!(to_double(scale_[std::size_t(order[i])]) > 0)) exchange(f, i, --some);
    const auto diagonal = [&](std::size_t i) {
      return to_double(a_[f.data + i * std::size_t(f.size) + i]);
    };
    for (; rank < some; ++rank) {
      std::size_t best = rank;
      for (std::size_t i = rank; i < some; ++i)  // the first of equal ones: the choice is stable
        if (diagonal(i) > diagonal(best) * (1 + 1e-3)) best = i;
      const double pivot = diagonal(best);
      if (!(pivot > limit)) break;
      smallest_ = std::min(smallest_, pivot);
      exchange(f, rank, best);
      eliminate(f, rank, some);
      used_[std::size_t(order[rank])] = 1;
    }
    return rank;
  }
  /// Exchanges rows and columns k < m of the front.
  void exchange(const Front& f, std::size_t k, std::size_t m) {
    if (k == m) return;
    const auto at = [&](std::size_t i, std::size_t j) -> T& {
      return a_[f.data + i * std::size_t(f.size) + j];
    };
    std::swap(order_[std::size_t(f.at) + k], order_[std::size_t(f.at) + m]);
    for (std::size_t j = 0; j < k; ++j) std::swap(at(k, j), at(m, j));
    std::swap(at(k, k), at(m, m));
    for (std::size_t i = k + 1; i < m; ++i) std::swap(at(i, k), at(m, i));
    for (std::size_t i = m + 1; i < height(f); ++i) std::swap(at(i, k), at(i, m));
  }
  /// Column k, in the front's first `some` rows and in those below.
  void eliminate(const Front& f, std::size_t k, std::size_t some) {
    const std::size_t b = std::size_t(f.size);
    T* const A = a_.data() + f.data;
    const T root = phs::sqrt(A[k * b + k]), inverse = T(1.0) / root;
    inverse_[std::size_t(f.at) + k] = inverse;
    A[k * b + k] = root;
    const auto each_row = [&](const auto& apply) {
      for (std::size_t i = k + 1; i < some; ++i) apply(A + i * b, i + 1);
      for (std::size_t i = b; i < height(f); ++i) apply(A + i * b, some);
    };
    each_row([&](T* row, std::size_t) { row[k] = row[k] * inverse; });
    each_row([&](T* row, std::size_t end) {
      for (std::size_t j = k + 1; j < end; ++j) row[j] = row[j] - row[k] * A[j * b + k];
    });
  }
  /// A ← A - L Lᵀ in the rows below.
  void update_later(const Front& f, std::size_t rank) {
    const std::size_t b = std::size_t(f.size), n = f.below.size();
    const T* const L = a_.data() + f.data + b * b;
    const Front* to = nullptr;
    for (std::size_t q = 0; q < n; ++q) {
      if (!to || f.below[q] >= to->at + to->size) {
        to = &pattern_.fronts()[std::size_t(pattern_.front_of(f.below[q]))];
        for (std::size_t i = 0; i < to->below.size(); ++i)
          position_[std::size_t(to->below[i])] = to->size + int(i);
      }
      const std::size_t column = std::size_t(f.below[q] - to->at);
      for (std::size_t p = q; p < n; ++p) {
        const int place = f.below[p];
        const int row = place < to->at + to->size ? place - to->at : position_[std::size_t(place)];
        T& own = a_[to->data + std::size_t(row) * std::size_t(to->size) + column];
        for (std::size_t l = 0; l < rank; ++l) own = own - L[p * b + l] * L[q * b + l];
      }
    }
  }

  // --- substitutions, in place ---------------------------------------------------------------
  /// y = L₁⁻¹ r of the rows in use; at the others, with Rows::all, r - L₂ y.
  template <Rows rows, class C>
  void forward(std::span<C> r) const {
    for (std::size_t f = 0; f < rank_of_.size(); ++f) {
      const Front& front = pattern_.fronts()[f];
      const std::size_t b = std::size_t(front.size), rank = rank_of_[f];
      const T* const L = a_.data() + front.data;
      const int* const order = order_.data() + front.at;
      const auto left = [&](const T* row, std::size_t end, C own) {
        for (std::size_t l = 0; l < end; ++l) own = own - C(row[l]) * r[std::size_t(order[l])];
        return own;
      };
      for (std::size_t k = 0; k < (rows == Rows::all ? b : rank); ++k) {
        C& own = r[std::size_t(order[k])];
        own = left(L + k * b, std::min(k, rank), own);
        if (k < rank) own = own * C(inverse_[std::size_t(front.at) + k]);
      }
      for (std::size_t p = b; p < height(front); ++p) {
        C& own = r[std::size_t(front.below[p - b])];
        own = left(L + p * b, rank, own);
      }
    }
  }
  /// x₁ of L₁ᵀ x₁ + L₂ᵀ x₂ = y, where x₂, at the rows not in use, is 0 or, with Rows::all, in r.
  template <Rows rows, class C>
  void backward(std::span<C> r) const {
    for (std::size_t f = rank_of_.size(); f-- > 0;) {
      const Front& front = pattern_.fronts()[f];
      const std::size_t b = std::size_t(front.size), rank = rank_of_[f];
      const T* const L = a_.data() + front.data;
      const int* const order = order_.data() + front.at;
      for (std::size_t k = rank; k-- > 0;) {
        C own = r[std::size_t(order[k])];
        for (std::size_t p = b; p < height(front); ++p) {
          const std::size_t place = std::size_t(front.below[p - b]);
          if (rows == Rows::all || used_[place]) own = own - C(L[p * b + k]) * r[place];
        }
        for (std::size_t l = k + 1; l < (rows == Rows::all ? b : rank); ++l)
          own = own - C(L[l * b + k]) * r[std::size_t(order[l])];
        r[std::size_t(order[k])] = own * C(inverse_[std::size_t(front.at) + k]);
      }
    }
  }

  // --- the kernel ----------------------------------------------------------------------------
  /// c = Zᵀ v at the rows left out, 0 at those in use.
  void onto_kernel(std::span<const T> v, std::span<T> c) const {
    for (std::size_t i = 0; i < n_; ++i) c[i] = unit_[i] * v[i];
    forward<Rows::all>(c);
    for (std::size_t i = 0; i < n_; ++i) c[i] = used_[i] ? T(0.0) : c[i] / unit_[i];
  }
  /// x_ = Z along_.
  void from_kernel() const {
    for (std::size_t i = 0; i < n_; ++i) x_[i] = used_[i] ? T(0.0) : along_[i] / unit_[i];
    backward<Rows::all>(std::span<T>(x_));
    for (std::size_t i = 0; i < n_; ++i) x_[i] = unit_[i] * x_[i];
  }
  /// A row is unique where all vectors of the kernel are 0: where two sums of them are, each with
  /// factors that cancel in no other way.
  void find_unique() const {
    unique_is_known_ = true;
    std::fill(unique_.begin(), unique_.end(), 1);
    if (rank_ == int(n_)) return;
    double factor = 0;
    for (int twice = 0; twice < 2; ++twice) {
      bool depends = false;
      for (std::size_t i = 0; i < n_; ++i) {
        factor = std::fmod(factor + 0.6180339887498949, 1.0);
        const bool dependent = !used_[i] && to_double(scale_[i]) > 0;
        depends = depends || dependent;
        x_[i] = T(dependent ? 1 + factor : 0.0);
      }
      if (depends) backward<Rows::all>(std::span<T>(x_));
      for (std::size_t i = 0; i < n_; ++i)
        if (!used_[i] || std::fabs(to_double(x_[i])) > 1e-6) unique_[i] = 0;
    }
  }

  const BlockPattern& pattern_;
  std::size_t n_;
  std::vector<T> a_;
  std::vector<T> scale_, unit_;  ///< unit_: scale_, but 1 of zero rows
  std::vector<T> inverse_;       ///< of the factor's diagonal, in the order of pivots
  mutable std::vector<T> x_, rest_, along_;
  std::vector<int> order_;  ///< of each front's pivots, from its first place on: their places
  std::vector<int> position_;
  std::vector<std::size_t> rank_of_;  ///< by front
  std::vector<char> used_;
  mutable std::vector<char> unique_;  ///< by place, when it is asked for: steps do not
  mutable bool unique_is_known_ = true;
  double smallest_ = 1;
  int rank_ = 0;
};

}  // namespace porthos::phs
