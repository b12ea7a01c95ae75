#include "phs/linear/linear_system.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <sstream>

#include "phs/linear_algebra/matrix-inl.h"
#include "phs/system/user_model.h"

namespace porthos::phs {
namespace {

using Real = Eigen::MatrixXd;
using Index = Eigen::Index;

constexpr double rounding = 1e-12;

[[noreturn]] void refuse(const std::string& name, const std::string& reason) {
  throw InvalidArgument(name + ": " + reason);
}
std::string text(double x) {
  std::ostringstream s;
  s.precision(6);
  s << x;
  return s.str();
}
std::string entry(const std::string& matrix, Index i, Index j) {
  return matrix + "(" + std::to_string(i) + "," + std::to_string(j) + ")";
}

/// One check with its error text per axiom.
struct Judge {
  const std::string& name;

  void shape(const char* what, const Matrix& M, int rows, int cols) const {
    if (M.rows != rows || M.cols != cols || M.a.size() != size_t(rows) * size_t(cols))
      refuse(name, std::string(what) + " is " + std::to_string(M.rows) + " x " +
                       std::to_string(M.cols) + ", expected " + std::to_string(rows) + " x " +
                       std::to_string(cols));
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < cols; ++j)
        if (!std::isfinite(M(i, j))) refuse(name, entry(what, i, j) + " is " + text(M(i, j)));
  }
  void skew(const char* what, const Real& M) const {
    Index i, j;
    const Real defect = M + M.transpose();
    if (defect.size() == 0 || defect.cwiseAbs().maxCoeff(&i, &j) <= rounding * size(M)) return;
    refuse(name, std::string(what) + " is not skew: " + entry(what, i, j) + " + " +
                     entry(what, j, i) + " = " + text(defect(i, j)));
  }
  void symmetric(const std::string& what, const Real& M) const {
    Index i, j;
    const Real defect = M - M.transpose();
    if (defect.size() == 0 || defect.cwiseAbs().maxCoeff(&i, &j) <= rounding * size(M)) return;
    refuse(name, what + " is not symmetric: " + entry(what, i, j) + " - " + entry(what, j, i) +
                     " = " + text(defect(i, j)));
  }
  /// `place(i)` names the i-th diagonal entry.
  template <class Place>
  void semidefinite(const std::string& what, const Real& M, Place place) const {
    const Eigen::SelfAdjointEigenSolver<Real> solver((M + M.transpose()) / 2);
    if (solver.eigenvalues()(0) >= -rounding * size(M)) return;
    Index i;
    solver.eigenvectors().col(0).cwiseAbs().maxCoeff(&i);
    refuse(name, what + " is not >= 0: its eigenvalue " + text(solver.eigenvalues()(0)) +
                     " belongs to a vector largest at " + place(i));
  }

 private:
  static double size(const Real& M) { return M.cwiseAbs().maxCoeff(); }
};

Real dissipation_matrix(const LinearMatrices& m) {
  Real W(m.R.rows + m.S.rows, m.R.rows + m.S.rows);
  W << view(m.R), view(m.P), view(m.P).transpose(), view(m.S);
  return W;
}

/// x' = (J - R) Kx + Gu, H = ½xᵀKx.
struct LinearModel {
  std::string name;
  Matrix J, R, K, G;

  template <class T>
  static void multiply(const Matrix& M, std::span<const T> v, std::span<T> out) {
    for (int i = 0; i < M.rows; ++i) {
      T sum(0.0);
      for (int j = 0; j < M.cols; ++j)
        if (M(i, j) != 0) sum = sum + T(M(i, j)) * v[size_t(j)];
      out[size_t(i)] = sum;
    }
  }
  Description description() const {
    Description d;
    d.name = name;
    d.nx = J.rows;
    d.nu = G.cols;
    const auto named = [](std::string letter, int i) { return letter += std::to_string(i); };
    for (int i = 0; i < J.rows; ++i)
      d.blocks.push_back({named("x", i), BlockKind::linear, i, 1, -1, "1", ""});
    for (int i = 0; i < G.cols; ++i)
      d.ports.push_back({named("u", i), PortKind::effort_in, 1, i, "1", "1"});
    d.traits.lossless = view(R).isZero(0);
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    T H(0.0);
    for (int i = 0; i < K.rows; ++i) {
      T e(0.0);
      for (int j = 0; j < K.cols; ++j)
        if (K(i, j) != 0) e = e + T(K(i, j)) * x[size_t(j)];
      H = H + T(0.5) * x[size_t(i)] * e;
    }
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    multiply(K, x, e);
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T> e, std::span<T> Je) const {
    multiply(J, e, Je);
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    multiply(R, e, Re);
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    multiply(G, u, Gu);
  }
};

}  // namespace

LinearSystem::LinearSystem(LinearMatrices matrices, std::string name)
    : m_(std::move(matrices)), name_(std::move(name)) {
  const int n = m_.J.rows, m = m_.G.cols;
  if (n == 0 || m == 0) refuse(name_, "J and G must be given, with one state and one port or more");
  for (Matrix* M : {&m_.E, &m_.Q})
    if (M->empty()) *M = Matrix::identity(n);
  if (m_.R.empty()) m_.R = Matrix(n, n);
  if (m_.P.empty()) m_.P = Matrix(n, m);
  for (Matrix* M : {&m_.S, &m_.N})
    if (M->empty()) *M = Matrix(m, m);

  const Judge judge{name_};
  judge.shape("E", m_.E, n, n);
  judge.shape("J", m_.J, n, n);
  judge.shape("R", m_.R, n, n);
  judge.shape("Q", m_.Q, n, n);
  judge.shape("G", m_.G, n, m);
  judge.shape("P", m_.P, n, m);
  judge.shape("S", m_.S, m, m);
  judge.shape("N", m_.N, m, m);
  judge.skew("J", view(m_.J));
  judge.skew("N", view(m_.N));
  judge.symmetric("R", view(m_.R));
  judge.symmetric("S", view(m_.S));
  const Real K = view(m_.E).transpose() * view(m_.Q);
  judge.symmetric("EᵀQ", K);
  judge.semidefinite("EᵀQ", K, [](Index i) { return entry("EᵀQ", i, i); });
  judge.semidefinite("W = [R P; Pᵀ S]", dissipation_matrix(m_),
                     [&](Index i) { return i < n ? entry("R", i, i) : entry("S", i - n, i - n); });
}

double LinearSystem::hamiltonian(std::span<const double> x) const {
  require_size("x", x.size(), size_t(states()));
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), states());
  return (view(m_.E) * v).dot(view(m_.Q) * v) / 2;
}

StateSpace LinearSystem::state_space() const {
  const Real Q = view(m_.Q), G = view(m_.G), P = view(m_.P);
  return {m_.E, to_matrix(Real((view(m_.J) - view(m_.R)) * Q)), to_matrix(Real(G - P)),
          to_matrix(Real((G + P).transpose() * Q)), to_matrix(Real(view(m_.S) - view(m_.N)))};
}

ComplexMatrix LinearSystem::transfer(std::complex<double> s) const {
  return phs::transfer(state_space(), s);
}

Matrix LinearSystem::dc_gain() const { return to_matrix(Real(view(transfer(0.0)).real())); }

double LinearSystem::dissipation() const {
  return Eigen::SelfAdjointEigenSolver<Real>(dissipation_matrix(m_), Eigen::EigenvaluesOnly)
      .eigenvalues()(0);
}

AvailableStorage LinearSystem::available_storage(std::span<const double> x) const {
  const double H = hamiltonian(x);
  const auto X = smallest_storage(state_space());
  if (!X)
    return {H, false,
            "the Riccati equation needs an invertible E and T + T* > 0 on the imaginary axis, "
            "infinity included; H bounds what can be drawn"};
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), states());
  return {v.dot(view(*X) * v) / 2, true, "smallest solution of the Riccati equation"};
}

std::unique_ptr<Model> LinearSystem::to_model() const {
  for (const auto& [what, M] : {std::pair{"P", &m_.P}, {"S", &m_.S}, {"N", &m_.N}})
    for (int i = 0; i < M->rows; ++i)
      for (int j = 0; j < M->cols; ++j)
        if ((*M)(i, j) != 0)
          refuse(name_, "has no model with y = Gᵀe, because " + entry(what, i, j) + " = " +
                            text((*M)(i, j)) + " feeds u through to y");
  const Eigen::FullPivLU<Real> lu{Real(view(m_.E))};
  if (!lu.isInvertible())
    refuse(name_, "has no model x' = ..., because E has rank " + std::to_string(lu.rank()) +
                      " of " + std::to_string(states()) + ": some equations are algebraic");
  const Real inverse = lu.inverse();
  const Real J = inverse * view(m_.J) * inverse.transpose();
  const Real R = inverse * view(m_.R) * inverse.transpose();
  const Real K = view(m_.E).transpose() * view(m_.Q);
  return std::make_unique<UserModel<LinearModel>>(LinearModel{
      name_, to_matrix(Real((J - J.transpose()) / 2)), to_matrix(Real((R + R.transpose()) / 2)),
      to_matrix(Real((K + K.transpose()) / 2)), to_matrix(Real(inverse * view(m_.G)))});
}

}  // namespace porthos::phs
