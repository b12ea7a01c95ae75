#pragma once
#include <vector>

namespace porthos::phs {

/// A dense matrix, row by row: for descriptions of systems, not for kernels.
struct Matrix {
  int rows = 0, cols = 0;
  std::vector<double> a;

  Matrix() = default;
  Matrix(int m, int n) : rows(m), cols(n), a(size_t(m) * size_t(n), 0.0) {}
  /// One inner list per row, all of one length.
  Matrix(std::initializer_list<std::initializer_list<double>> list)
      : rows(int(list.size())), cols(rows ? int(list.begin()->size()) : 0) {
    for (const auto& row : list) a.insert(a.end(), row.begin(), row.end());
  }
  double& operator()(int i, int j) { return a[size_t(i) * size_t(cols) + size_t(j)]; }
  double operator()(int i, int j) const { return a[size_t(i) * size_t(cols) + size_t(j)]; }

  static Matrix identity(int n) {
    Matrix m(n, n);
    for (int i = 0; i < n; ++i) m(i, i) = 1;
    return m;
  }
};

}  // namespace porthos::phs
