#include "energy_shaping/linear_algebra.h"

#include <Eigen/Dense>
#include <algorithm>

namespace porthos::energy_shaping {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::Map<const RowMatrix> as_matrix(std::size_t n, std::span<const double> A) {
  return {A.data(), Eigen::Index(n), Eigen::Index(n)};
}

/// Column j of the derivative of f(x) → out by duals.
template <class F>
std::vector<double> by_duals(std::span<const double> x, F f) {
  const std::size_t n = x.size();
  std::vector<phs::Dual> s(x.begin(), x.end()), out(n);
  std::vector<double> J(n * n);
  for (std::size_t j = 0; j < n; ++j) {
    s[j].d = 1;
    f(s, out);
    s[j].d = 0;
    for (std::size_t i = 0; i < n; ++i) J[i * n + j] = out[i].d;
  }
  return J;
}

}  // namespace

std::vector<double> symmetric_eigenvalues(std::size_t n, std::span<const double> A) {
  const RowMatrix M = as_matrix(n, A);
  if (!M.allFinite()) return std::vector<double>(n, std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXd e =
      Eigen::SelfAdjointEigenSolver<RowMatrix>((M + M.transpose()) / 2, Eigen::EigenvaluesOnly)
          .eigenvalues();
  return {e.data(), e.data() + e.size()};
}

std::vector<std::complex<double>> eigenvalues(std::size_t n, std::span<const double> A) {
  const RowMatrix M = as_matrix(n, A);
  if (!M.allFinite())
    return std::vector<std::complex<double>>(n, std::numeric_limits<double>::quiet_NaN());
  const Eigen::VectorXcd e = Eigen::EigenSolver<RowMatrix>(M, false).eigenvalues();
  std::vector<std::complex<double>> all(e.data(), e.data() + e.size());
  std::sort(all.begin(), all.end(), [](auto a, auto b) {
    return a.real() != b.real() ? a.real() < b.real() : a.imag() < b.imag();
  });
  return all;
}

std::vector<double> linear_solve(std::size_t n, std::span<const double> A,
                                 std::span<const double> b) {
  const Eigen::Map<const Eigen::VectorXd> rhs(b.data(), Eigen::Index(n));
  const Eigen::VectorXd x = as_matrix(n, A).fullPivLu().solve(rhs);
  return {x.data(), x.data() + x.size()};
}

std::vector<double> field_jacobian(const phs::Model& model, std::span<const double> x) {
  const auto s = model.instantiate<phs::Dual>();
  return by_duals(x, [&](const auto& at, auto& out) { s->field(0.0, at, {}, out); });
}

std::vector<double> hessian(const phs::Model& model, std::span<const double> x) {
  const auto s = model.instantiate<phs::Dual>();
  return by_duals(x, [&](const auto& at, auto& out) { s->gradient(at, out); });
}

}  // namespace porthos::energy_shaping
