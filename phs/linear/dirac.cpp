#include "phs/linear/dirac.h"

#include <Eigen/SVD>
#include <algorithm>
#include <sstream>

#include "phs/linear_algebra/matrix-inl.h"

namespace porthos::phs {
namespace {

using Real = Eigen::MatrixXd;
using Svd = Eigen::JacobiSVD<Real>;

Real beside(const Real& F, const Real& E) {
  Real both(F.rows(), F.cols() + E.cols());
  both << F, E;
  return both;
}

/// Columns `keep` of M.
Real columns(const Matrix& M, const std::vector<int>& keep) {
  return Real(view(M))(Eigen::all, keep);
}

std::vector<int> others(int ports, const std::vector<int>& taken) {
  std::vector<int> left;
  for (int i = 0; i < ports; ++i)
    if (std::find(taken.begin(), taken.end(), i) == taken.end()) left.push_back(i);
  return left;
}

void require_ports(const char* who, std::vector<int> used, int ports) {
  std::sort(used.begin(), used.end());
  for (size_t k = 0; k < used.size(); ++k) {
    if (used[k] < 0 || used[k] >= ports)
      throw InvalidArgument(std::string("compose: ") + who + " has no port " +
                            std::to_string(used[k]) + ", only 0 to " + std::to_string(ports - 1));
    if (k > 0 && used[k] == used[k - 1])
      throw InvalidArgument(std::string("compose: port ") + std::to_string(used[k]) + " of " + who +
                            " is shared twice");
  }
}

}  // namespace

DiracDefects dirac_defects(const Matrix& F, const Matrix& E) {
  if (F.rows != F.cols || E.rows != F.rows || E.cols != F.cols || F.empty())
    throw InvalidArgument("Dirac structure: F is " + std::to_string(F.rows) + " x " +
                          std::to_string(F.cols) + " and E is " + std::to_string(E.rows) + " x " +
                          std::to_string(E.cols) + ", expected both n x n");
  const Real f = view(F), e = view(E);
  const auto sizes = Svd(beside(f, e)).singularValues();
  const double largest = sizes(0) > 0 ? sizes(0) : 1;
  return {(f * e.transpose() + e * f.transpose()).norm() / (largest * largest),
          sizes(F.rows - 1) / largest};
}

Dirac::Dirac(Matrix F, Matrix E) : F_(std::move(F)), E_(std::move(E)) {
  const auto d = defects();
  std::ostringstream text;
  if (!(d.power <= 1e-12))
    text << "not a Dirac structure: |F Eᵀ + E Fᵀ| = " << d.power << " |[F|E]|², power is not kept";
  else if (!d.holds())
    text << "not a Dirac structure: the smallest singular value of [F|E] is " << d.independence
         << " of the largest, its " << F_.rows << " rows are not independent";
  if (!text.str().empty()) throw InvalidArgument(text.str());
}

double Dirac::residual(std::span<const double> f, std::span<const double> e) const {
  require_size("f", f.size(), size_t(ports()));
  require_size("e", e.size(), size_t(ports()));
  const Eigen::Map<const Eigen::VectorXd> flow(f.data(), ports()), effort(e.data(), ports());
  return (view(F_) * flow + view(E_) * effort).norm() / beside(view(F_), view(E_)).norm();
}

Dirac Dirac::feedback(const Matrix& K) {
  return {to_matrix(Real(-view(K))), Matrix::identity(K.rows)};
}

Dirac Dirac::zero_junction(int n) {
  Matrix F(n, n), E(n, n);
  for (int i = 0; i < n; ++i) F(0, i) = 1;
  for (int i = 1; i < n; ++i) {
    E(i, 0) = 1;
    E(i, i) = -1;
  }
  return {F, E};
}

Dirac Dirac::one_junction(int n) {
  const Dirac dual = zero_junction(n);
  return {dual.E(), dual.F()};
}

Dirac Dirac::transformer(double n) { return {{{0, 0}, {n, 1}}, {{1, -n}, {0, 0}}}; }

Dirac Dirac::gyrator(double r) { return feedback({{0, r}, {-r, 0}}); }

double distance(const Dirac& a, const Dirac& b) {
  if (a.ports() != b.ports()) return 1;
  const Real Fa = view(a.F()), Ea = view(a.E()), Fb = view(b.F()), Eb = view(b.E());
  return (Fa * Eb.transpose() + Ea * Fb.transpose()).norm() /
         (beside(Fa, Ea).norm() * beside(Fb, Eb).norm());
}

Dirac compose(const Dirac& a, const Dirac& b, const std::vector<std::pair<int, int>>& shared) {
  std::vector<int> in_a, in_b;
  for (const auto& [i, j] : shared) {
    in_a.push_back(i);
    in_b.push_back(j);
  }
  require_ports("the first structure", in_a, a.ports());
  require_ports("the second structure", in_b, b.ports());
  const auto left_a = others(a.ports(), in_a), left_b = others(b.ports(), in_b);
  const auto rows = a.ports() + b.ports(), left = int(left_a.size() + left_b.size());
  if (left == 0) throw InvalidArgument("compose: no port is left");

  // Rows of D_a and D_b in the flows and efforts (f, e) of a's shared ports ...
  Real M(rows, 2 * shared.size()), outer = Real::Zero(rows, 2 * left);
  M << columns(a.F(), in_a), columns(a.E(), in_a), -columns(b.F(), in_b), columns(b.E(), in_b);
  // ... and of the remaining ports: F's columns first, then E's.
  const auto na = Eigen::Index(left_a.size()), nb = Eigen::Index(left_b.size());
  outer.block(0, 0, a.ports(), na) = columns(a.F(), left_a);
  outer.block(0, left, a.ports(), na) = columns(a.E(), left_a);
  outer.block(a.ports(), na, b.ports(), nb) = columns(b.F(), left_b);
  outer.block(a.ports(), left + na, b.ports(), nb) = columns(b.E(), left_b);

  // Combinations of rows in which the shared (f, e) cancel. If junctions close a loop, there are
  // too many of them, but their span in the remaining ports has exactly the right dimension: take
  // an orthonormal basis of it.
  Real kept = outer;
  if (!shared.empty()) {
    Svd eliminate(M, Eigen::ComputeFullU);
    eliminate.setThreshold(1e-12);
    kept = eliminate.matrixU().rightCols(rows - eliminate.rank()).transpose() * outer;
  }
  const Svd basis(kept, Eigen::ComputeThinV);
  const Real kernel = basis.matrixV().leftCols(left).transpose();
  return {to_matrix(Real(kernel.leftCols(left))), to_matrix(Real(kernel.rightCols(left)))};
}

}  // namespace porthos::phs
