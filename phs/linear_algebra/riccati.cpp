#include "phs/linear_algebra/riccati.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace porthos::phs {
namespace {

using Dense = Eigen::MatrixXd;

Dense dense_of(const Matrix& M) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      M.a.data(), M.rows, M.cols);
}

/// sign(H) by Newton's iteration; NaN if it does not converge.
Dense sign_of(Dense S) {
  const double n = double(S.rows());
  for (int i = 0; i < 100; ++i) {
    const Eigen::PartialPivLU<Dense> lu(S);
    const double log_det = lu.matrixLU().diagonal().cwiseAbs().array().log().sum();
    const double scale = i < 12 ? std::exp(-log_det / n) : 1;
    const Dense next = 0.5 * (scale * S + lu.inverse() / scale);
    const double change = (next - S).norm(), size = next.norm();
    S = next;
    if (!std::isfinite(size)) break;
    if (change <= 1e-14 * n * size) return S;
  }
  return Dense::Constant(S.rows(), S.cols(), std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

Matrix riccati(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R) {
  require_size("columns of A", size_t(A.cols), size_t(A.rows));
  require_size("rows of B", size_t(B.rows), size_t(A.rows));
  require_size("rows of Q", size_t(Q.rows), size_t(A.rows));
  require_size("columns of Q", size_t(Q.cols), size_t(A.rows));
  require_size("rows of R", size_t(R.rows), size_t(B.cols));
  require_size("columns of R", size_t(R.cols), size_t(B.cols));
  const int n = A.rows;
  const Dense a = dense_of(A), b = dense_of(B), q = dense_of(Q), r = dense_of(R);
  Dense H(2 * n, 2 * n);
  H << a, -b * r.ldlt().solve(b.transpose()), -q, -a.transpose();
  const Dense S = sign_of(H);
  // (S + 1) [1; P] = 0: the stable subspace.
  const Dense I = Dense::Identity(n, n);
  Dense left(2 * n, n), right(2 * n, n);
  left << S.topRightCorner(n, n), S.bottomRightCorner(n, n) + I;
  right << -S.topLeftCorner(n, n) - I, -S.bottomLeftCorner(n, n);
  const Eigen::ColPivHouseholderQR<Dense> qr(left);
  Dense P = qr.solve(right);
  if (qr.rank() < n) P.setConstant(std::numeric_limits<double>::quiet_NaN());
  P = (0.5 * (P + P.transpose())).eval();
  Matrix result(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) result(i, j) = P(i, j);
  return result;
}

}  // namespace porthos::phs
