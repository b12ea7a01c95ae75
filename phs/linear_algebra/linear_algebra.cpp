#include "phs/linear_algebra/linear_algebra.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>
#include <unsupported/Eigen/MatrixFunctions>

#include "phs/linear_algebra/matrix-inl.h"

namespace porthos::phs {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

Eigen::MatrixXd square(std::size_t n, std::span<const double> A) {
  const auto m = Eigen::Index(n);
  return Eigen::Map<const Eigen::MatrixXd>(A.data(), m, m).transpose();
}

}  // namespace

std::vector<double> symmetric_eigenvalues(std::size_t n, std::span<const double> A) {
  const Eigen::MatrixXd M = square(n, A), S = (M + M.transpose()) / 2;
  if (!S.allFinite()) return std::vector<double>(n, not_a_number);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(S, Eigen::EigenvaluesOnly);
  return {solver.eigenvalues().begin(), solver.eigenvalues().end()};
}

Definiteness definiteness(std::size_t n, std::span<const double> A) {
  const Eigen::MatrixXd M = square(n, A), S = (M + M.transpose()) / 2;
  if (!S.allFinite()) return {not_a_number};
  Eigen::VectorXd unit = S.diagonal().cwiseAbs().cwiseSqrt();
  for (double& u : unit) u = u > 0 ? 1 / u : 1;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(unit.asDiagonal() * S *
                                                              unit.asDiagonal());
  Eigen::Index where = 0;
  solver.eigenvectors().col(0).cwiseAbs().maxCoeff(&where);
  return {solver.eigenvalues()[0], std::size_t(where)};
}

namespace {

std::vector<std::complex<double>> eigenvalues(const Eigen::MatrixXd& M) {
  if (M.size() == 0) return {};
  if (!M.allFinite()) return std::vector<std::complex<double>>(size_t(M.rows()), not_a_number);
  Eigen::EigenSolver<Eigen::MatrixXd> solver(M, false);
  // The QR sweeps stagnate on about a hundredth of the matrices with two Jordan blocks. The
  // transpose has the same eigenvalues and another way there.
  if (solver.info() != Eigen::Success) solver.compute(M.transpose(), false);
  if (solver.info() != Eigen::Success)
    return std::vector<std::complex<double>>(size_t(M.rows()), not_a_number);
  std::vector<std::complex<double>> all(solver.eigenvalues().begin(), solver.eigenvalues().end());
  std::sort(all.begin(), all.end(), [](auto a, auto b) {
    return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
  });
  return all;
}

}  // namespace

std::vector<std::complex<double>> eigenvalues(std::size_t n, std::span<const double> A) {
  return eigenvalues(square(n, A));
}

Spectrum spectrum(std::size_t n, std::span<const double> A, double tolerance) {
  Eigen::MatrixXd M = square(n, A);
  Spectrum s;
  double zero = 0;
  while (M.size() > 0 && M.allFinite()) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(M, Eigen::ComputeFullV);
    const auto& sigma = svd.singularValues();
    if (s.zeros == 0) zero = tolerance * sigma[0];
    const Eigen::Index rank = (sigma.array() > zero).count();
    if (rank == M.rows()) break;
    s.zeros += int(M.rows() - rank);
    const Eigen::MatrixXd V = svd.matrixV().leftCols(rank);  // orthogonal to the null space
    M = (V.transpose() * M * V).eval();
  }
  s.rest = eigenvalues(M);
  return s;
}

std::vector<double> exponential(std::size_t n, std::span<const double> A) {
  const Eigen::MatrixXd transposed = square(n, A).transpose().exp();  // column by column
  return {transposed.data(), transposed.data() + transposed.size()};
}

std::vector<double> linear_solve(std::size_t n, std::span<const double> A,
                                 std::span<const double> b) {
  const Eigen::VectorXd rhs = Eigen::Map<const Eigen::VectorXd>(b.data(), Eigen::Index(n));
  const Eigen::VectorXd x = Eigen::FullPivLU<Eigen::MatrixXd>(square(n, A)).solve(rhs);
  return {x.begin(), x.end()};
}

PseudoInverse pseudo_inverse(const Matrix& A) {
  if (A.empty()) return {Matrix(A.cols, A.rows), 0};
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(view(A)),
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  PseudoInverse p{Matrix(A.cols, A.rows), int(svd.rank())};
  for (int k = 0; k < p.rank; ++k)
    for (int i = 0; i < A.cols; ++i)
      for (int j = 0; j < A.rows; ++j)
        p.inverse(i, j) += svd.matrixV()(i, k) * svd.matrixU()(j, k) / svd.singularValues()(k);
  return p;
}

}  // namespace porthos::phs
