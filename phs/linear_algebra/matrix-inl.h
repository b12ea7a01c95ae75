#pragma once
#include <Eigen/Core>

#include "phs/linear_algebra/matrix.h"

/// Conversions between Matrix and Eigen, for sources only.
namespace porthos::phs {

template <class T>
auto view(const BasicMatrix<T>& m) {
  using RowMajor = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(m.a.data(), m.rows, m.cols);
}

template <class Expression>
auto to_matrix(const Expression& e) {
  BasicMatrix<typename Expression::Scalar> m(int(e.rows()), int(e.cols()));
  for (int i = 0; i < m.rows; ++i)
    for (int j = 0; j < m.cols; ++j) m(i, j) = e(i, j);
  return m;
}

}  // namespace porthos::phs
