#pragma once
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "phs/scalars/complex.h"

namespace porthos::phs {

/// LU of complex n × n matrices, one per lane, with one row order for all lanes. Allocates only in
/// the constructor.
class LaneLu {
 public:
  explicit LaneLu(size_t n) : n_(n), lu_(n * n), row_(n), r_(n) {}

  size_t size() const { return n_; }
  /// Entry of the matrix, to be written before factor().
  Complex4& entry(size_t i, size_t j) { return lu_[i * n_ + j]; }

  void factor() {
    for (size_t k = 0; k < n_; ++k) row_[k] = k;
    for (size_t k = 0; k < n_; ++k) {
      // The pivot is the entry with the largest sum of squares over the lanes.
      size_t pivot = k;
      double largest = -1;
      for (size_t i = k; i < n_; ++i) {
        const Pack4 a = at(i, k).norm2();
        const double size = (a[0] + a[1]) + (a[2] + a[3]);
        if (size > largest) {
          largest = size;
          pivot = i;
        }
      }
      std::swap(row_[k], row_[pivot]);
      const Complex4 inverse = at(k, k) = at(k, k).inverse();
      for (size_t i = k + 1; i < n_; ++i) {
        const Complex4 factor = at(i, k) = at(i, k) * inverse;
        Complex4* const target = &at(i, 0);
        const Complex4* const source = &at(k, 0);
        for (size_t j = k + 1; j < n_; ++j) target[j] -= factor * source[j];
      }
    }
  }
  /// r ← A⁻¹ r
  void solve(std::span<Complex4> r) {
    for (size_t i = 0; i < n_; ++i) {
      Complex4 sum = r[row_[i]];
      for (size_t j = 0; j < i; ++j) sum -= at(i, j) * r_[j];
      r_[i] = sum;
    }
    for (size_t i = n_; i-- > 0;) {
      Complex4 sum = r_[i];
      for (size_t j = i + 1; j < n_; ++j) sum -= at(i, j) * r_[j];
      r_[i] = sum * at(i, i);
    }
    std::copy(r_.begin(), r_.end(), r.begin());
  }

 private:
  Complex4& at(size_t i, size_t j) { return lu_[row_[i] * n_ + j]; }

  size_t n_;
  std::vector<Complex4> lu_;
  std::vector<size_t> row_;
  std::vector<Complex4> r_;
};

}  // namespace porthos::phs
