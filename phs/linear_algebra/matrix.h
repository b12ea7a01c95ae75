#pragma once
#include <complex>
#include <initializer_list>
#include <vector>

#include "phs/error.h"

namespace porthos::phs {

/// A dense row-major matrix, for describing linear systems and interconnections, not for kernels.
template <class T>
struct BasicMatrix {
  int rows = 0, cols = 0;
  std::vector<T> a;

  BasicMatrix() = default;
  /// Zeros.
  BasicMatrix(int m, int n) : rows(m), cols(n), a(size_t(m) * size_t(n)) {}
  /// One inner list per row: Matrix{{0, 1}, {-1, 0}}.
  BasicMatrix(std::initializer_list<std::initializer_list<T>> list)
      : rows(int(list.size())), cols(rows ? int(list.begin()->size()) : 0) {
    for (const auto& row : list) {
      require_size("matrix row", row.size(), size_t(cols));
      a.insert(a.end(), row.begin(), row.end());
    }
  }
  T& operator()(int i, int j) { return a[size_t(i) * size_t(cols) + size_t(j)]; }
  T operator()(int i, int j) const { return a[size_t(i) * size_t(cols) + size_t(j)]; }

  bool empty() const { return a.empty(); }
  static BasicMatrix identity(int n) {
    BasicMatrix m(n, n);
    for (int i = 0; i < n; ++i) m(i, i) = T(1.0);
    return m;
  }
  friend bool operator==(const BasicMatrix&, const BasicMatrix&) = default;
  friend BasicMatrix operator*(const BasicMatrix& A, const BasicMatrix& B) {
    require_size("rows of the second factor", size_t(B.rows), size_t(A.cols));
    BasicMatrix C(A.rows, B.cols);
    for (int i = 0; i < A.rows; ++i)
      for (int k = 0; k < A.cols; ++k)
        for (int j = 0; j < B.cols; ++j) C(i, j) += A(i, k) * B(k, j);
    return C;
  }
  friend BasicMatrix transpose(const BasicMatrix& A) {
    BasicMatrix t(A.cols, A.rows);
    for (int i = 0; i < A.rows; ++i)
      for (int j = 0; j < A.cols; ++j) t(j, i) = A(i, j);
    return t;
  }
};

using Matrix = BasicMatrix<double>;
using ComplexMatrix = BasicMatrix<std::complex<double>>;

}  // namespace porthos::phs
