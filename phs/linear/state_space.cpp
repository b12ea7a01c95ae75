#include "phs/linear/state_space.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "phs/linear_algebra/linear_algebra.h"
#include "phs/linear_algebra/matrix-inl.h"

namespace porthos::phs {
namespace {

using ComplexNumber = std::complex<double>;
using Real = Eigen::MatrixXd;

constexpr double factored = 1e-12;  // relative rounding after a factorisation or eigensolver
constexpr double infinity = 1e6;    // higher frequencies count as infinite, in units of |A|/|E|

constexpr const char* singular_pencil =
    "transfer function: the pencil sE - A is singular for every s, so that u does not determine x";

/// Solves M X = B with rows and columns of M scaled to size 1. Returns nothing if M is singular to
/// rounding.
std::optional<Real> solve(Real M, Real B) {
  const auto inverse = [](double size) { return size > 0 ? 1 / size : 1.0; };
  const Eigen::VectorXd r = M.cwiseAbs().rowwise().maxCoeff().unaryExpr(inverse);
  M = r.asDiagonal() * M;
  B = r.asDiagonal() * B;
  const Eigen::VectorXd c = M.cwiseAbs().colwise().maxCoeff().transpose().unaryExpr(inverse);
  const Eigen::FullPivLU<Real> lu(M * c.asDiagonal());
  if (!lu.isInvertible()) return {};
  return Real(c.asDiagonal() * lu.solve(B));
}

/// X + iY as a real matrix that acts on stacked real and imaginary parts.
Real embedded(const Real& X, const Real& Y) {
  Real both(2 * X.rows(), 2 * X.cols());
  both << X, -Y, Y, X;
  return both;
}

struct Response {
  Real re, im;
  double size;  // of the terms that the response sums
};

std::optional<Response> response(const StateSpace& g, ComplexNumber s) {
  const Real E = view(g.E), A = view(g.A), B = view(g.B), C = view(g.C), D = view(g.D);
  Real forced = Real::Zero(2 * B.rows(), B.cols());
  forced.topRows(B.rows()) = B;
  const auto x = solve(embedded(s.real() * E - A, s.imag() * E), forced);
  if (!x) return {};
  return Response{C * x->topRows(B.rows()) + D, C * x->bottomRows(B.rows()),
                  C.norm() * x->norm() + D.norm()};
}

/// The size of the pole if E and A were scalars.
double natural_frequency(const StateSpace& g) {
  const double frequency = view(g.A).norm() / std::max(view(g.E).norm(), 1e-300);
  return frequency > 0 ? frequency : 1;
}

/// Finite roots of det(sE - A), E and A real, from the eigenvalues 1/(s - shift) of (A - shift
/// E)⁻¹E. Returns nothing if the pencil is singular to rounding at three shifts: then every s is a
/// root.
std::optional<std::vector<ComplexNumber>> roots(const Real& E, const Real& A, double frequency) {
  for (const double part : {0.7310585786300049, 1.6180339887498949, -0.4142135623730951}) {
    const double shift = part * frequency;
    const auto M = solve(Real(A - shift * E), E);
    if (!M) continue;
    const Eigen::EigenSolver<Real> solver(*M, false);
    if (solver.info() != Eigen::Success) continue;
    std::vector<ComplexNumber> found;
    for (const ComplexNumber mu : solver.eigenvalues())
      if (std::abs(mu) * infinity * frequency >= 1) found.push_back(shift + 1.0 / mu);
    return found;
  }
  return {};
}

/// Frequencies ω >= 0 that include all those where an eigenvalue of T + T* equals γ on the line s =
/// σ + iω. s runs through the eigenvalues of the pencil whose kernel is (x, w, u): (sE - A) x = B
/// u, (-sEᵀ - Aᵀ) w = Cᵀu, Cx + Bᵀw + (D + Dᵀ - γ)u = 0.
std::vector<double> crossings(const StateSpace& g, double sigma, double gamma) {
  const auto n = g.A.rows, m = g.D.rows;
  const Real E = view(g.E), A = view(g.A) - sigma * E, B = view(g.B), C = view(g.C), D = view(g.D);
  Real K = Real::Zero(2 * n + m, 2 * n + m), L = K;
  K.block(0, 0, n, n) = E;
  K.block(n, n, n, n) = -E.transpose();
  L.block(0, 0, n, n) = A;
  L.block(0, 2 * n, n, m) = B;
  L.block(n, n, n, n) = A.transpose();
  L.block(n, 2 * n, n, m) = C.transpose();
  L.block(2 * n, 0, m, n) = C;
  L.block(2 * n, n, m, n) = B.transpose();
  L.block(2 * n, 2 * n, m, m) = D + D.transpose() - gamma * Real::Identity(m, m);
  std::vector<double> omega;
  if (const auto found =
          roots(K, L, natural_frequency(g)))  // otherwise γ is an eigenvalue for every ω
    for (const ComplexNumber s : *found) omega.push_back(std::fabs(s.imag()));
  return omega;
}

/// One point inside each gap between the frequencies, one beyond them, and 0. Frequencies that
/// differ by rounding only are merged.
std::vector<double> between(std::vector<double> omega) {
  std::erase_if(omega, [](double w) { return !std::isfinite(w); });
  std::sort(omega.begin(), omega.end());
  std::vector<double> points{0.0};
  double last = 0;
  for (const double w : omega) {
    if (w - last <= 1e-9 * w) continue;
    points.push_back((last + w) / 2);
    last = w;
  }
  points.push_back(last > 0 ? 2 * last : 1.0);
  return points;
}

}  // namespace

ComplexMatrix transfer(const StateSpace& g, ComplexNumber s) {
  if (const auto r = response(g, s)) {
    ComplexMatrix T(int(r->re.rows()), int(r->re.cols()));
    for (int i = 0; i < T.rows; ++i)
      for (int j = 0; j < T.cols; ++j) T(i, j) = {r->re(i, j), r->im(i, j)};
    return T;
  }
  // A pole is a special s. If a second, arbitrary s fails too, every s fails.
  if (!response(g, natural_frequency(g) * ComplexNumber(0.7310585786300049, 0.4142135623730951)))
    throw InvalidArgument(singular_pencil);
  std::ostringstream text;
  text << "transfer function: s = " << s.real() << (s.imag() < 0 ? " - " : " + ")
       << std::fabs(s.imag()) << "i is a pole, sE - A is singular there";
  throw InvalidArgument(text.str());
}

std::vector<ComplexNumber> poles(const StateSpace& g) {
  if (const auto found = roots(view(g.E), view(g.A), natural_frequency(g))) return *found;
  throw InvalidArgument(singular_pencil);
}

HermitianMinimum lowest_hermitian_part(const StateSpace& g, double sigma) {
  HermitianMinimum low;
  low.value = INFINITY;
  const auto look = [&](double omega) {
    const auto r = response(g, {sigma, omega});
    if (!r) return;
    ++low.evaluations;
    // The embedded T + T* has the same eigenvalues, each twice.
    const Real hermitian = embedded(r->re + r->re.transpose(), r->im - r->im.transpose());
    const Eigen::SelfAdjointEigenSolver<Real> solver(hermitian, Eigen::EigenvaluesOnly);
    if (solver.eigenvalues()(0) < low.value) {
      low.value = solver.eigenvalues()(0);
      low.omega = omega;
      low.size = r->size;
    }
  };
  look(infinity * natural_frequency(g));
  std::vector<double> start;
  for (const ComplexNumber s : poles(g)) start.push_back(std::abs(s));
  for (const double omega : start) look(omega);
  for (const double omega : between(start)) look(omega);
  for (int i = 0; i < 50; ++i) {  // converges quadratically, in a few iterations
    const double level = low.value - factored * low.size;
    for (const double omega : between(crossings(g, sigma, level))) look(omega);
    if (low.value >= level) break;
  }
  return low;
}

PositiveReality positive_reality(const StateSpace& g) {
  PositiveReality p;
  p.rightmost_pole = -INFINITY;
  double largest = 1e-6 * natural_frequency(g), nearest = INFINITY;
  for (const ComplexNumber s : poles(g)) {
    largest = std::max(largest, std::abs(s));
    nearest = std::min(nearest, std::fabs(s.real()));
    p.rightmost_pole = std::max(p.rightmost_pole, s.real());
  }
  p.pole_limit =
      1e-7 * largest;  // rounding moves a double root (a free body at 0) by its square root
  if (nearest <= p.pole_limit) p.sigma = largest > 0 ? 1e-3 * largest : 1.0;
  p.minimum = lowest_hermitian_part(g, p.sigma);
  p.limit = 10 * factored * p.minimum.size;
  return p;
}

std::optional<Matrix> smallest_storage(const StateSpace& g) {
  const auto n = g.A.rows;
  const Real D = view(g.D), W = D + D.transpose();
  const Eigen::FullPivLU<Real> E{Real(view(g.E))};
  const Eigen::SelfAdjointEigenSolver<Real> definite(W, Eigen::EigenvaluesOnly);
  if (!E.isInvertible() || definite.eigenvalues()(0) <= factored * std::max(1e-300, W.norm()))
    return {};
  const Real A = E.solve(Real(view(g.A))), B = E.solve(Real(view(g.B))), C = view(g.C);
  const Real V = Eigen::PartialPivLU<Real>(W).inverse(), F = A - B * V * C;
  const Real P = B * V * B.transpose(), Q = C.transpose() * V * C;
  Real Z(2 * n, 2 * n);
  Z << F, P, -Q, -F.transpose();

  // Newton's iteration for the sign of Z: each eigenvalue converges to ±1, the sign of its real
  // part. The first iterations are scaled by |det Z|.
  const Real identity = Real::Identity(2 * n, 2 * n);
  double change = INFINITY;
  for (int i = 0; i < 60 && change > factored; ++i) {
    const Eigen::PartialPivLU<Real> lu(Z);
    const double log_det = lu.matrixLU().diagonal().cwiseAbs().array().log().sum();
    const double c = change < 1e-2 ? 1.0 : std::exp(-log_det / double(2 * n));
    if (!std::isfinite(c)) return {};
    const Real next = (c * Z + lu.solve(identity) / c) / 2;
    change = (next - Z).norm() / next.norm();
    Z = next;
  }
  if (!(change <= factored)) return {};  // eigenvalues on the imaginary axis
  // (Z + 1) (1, X)ᵀ = 0: the stable invariant subspace.
  Real left(2 * n, n), right(2 * n, n);
  left << Z.topRightCorner(n, n), Z.bottomRightCorner(n, n) + Real::Identity(n, n);
  right << -Z.topLeftCorner(n, n) - Real::Identity(n, n), -Z.bottomLeftCorner(n, n);
  Real X = view(pseudo_inverse(to_matrix(left)).inverse) * right;
  X = (X + X.transpose()).eval() / 2;
  const double residual = (F.transpose() * X + X * F + X * P * X + Q).norm();
  const double terms = 2 * F.norm() * X.norm() + P.norm() * X.squaredNorm() + Q.norm();
  if (!(residual <= 1e-9 * terms)) return {};
  return to_matrix(X);
}

}  // namespace porthos::phs
