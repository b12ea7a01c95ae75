#pragma once
#include <complex>
#include <span>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Small dense linear algebra for set-up and checks, not for kernels (phs/linear_algebra/dense.h).
/// It uses Eigen, compiled once in the source. Matrices are n × n, row-major.
namespace porthos::phs {

/// Eigenvalues of the symmetric part of A, ascending; NaN if A is not finite.
std::vector<double> symmetric_eigenvalues(std::size_t n, std::span<const double> A);
/// How far a symmetric matrix is from indefinite, the same in all units of its coordinates.
struct Definiteness {
  double least;  ///< least eigenvalue in units that make each |A_ii| 1; NaN if A is not finite
  std::size_t where = 0;  ///< the coordinate with the largest part in its eigenvector
};
/// That of the symmetric part of A. In these units a positive definite matrix has eigenvalues from
/// 0 to n, and nearly the best condition that a scaling can give (van der Sluis 1969). A row of
/// zeros gives 0.
Definiteness definiteness(std::size_t n, std::span<const double> A);
/// Eigenvalues of A by ascending real part; NaN if A is not finite, or the iteration does not end.
std::vector<std::complex<double>> eigenvalues(std::size_t n, std::span<const double> A);
/// Eigenvalues of A, with zeros counted separately. Null spaces are split off one after another.
/// Thus a Jordan block of zeros (a direction without stiffness and its momentum) does not perturb
/// slow modes, as it does in eigenvalues().
struct Spectrum {
  int zeros = 0;                           ///< the algebraic multiplicity of 0
  std::vector<std::complex<double>> rest;  ///< in the order of eigenvalues()
};
/// The spectrum of A, n × n row-major. tolerance: smaller singular values, relative to the largest,
/// count as zero.
Spectrum spectrum(std::size_t n, std::span<const double> A, double tolerance = 1e-13);
/// exp(A), by Padé approximants with scaling and squaring (Higham 2005), n × n row-major.
std::vector<double> exponential(std::size_t n, std::span<const double> A);
/// The solution x of A x = b; NaN if A is singular.
std::vector<double> linear_solve(std::size_t n, std::span<const double> A,
                                 std::span<const double> b);

/// A⁺ (Moore, Penrose) by singular values: A⁺ b is the shortest x that minimises |A x - b|.
struct PseudoInverse {
  Matrix inverse;
  int rank = 0;
};
PseudoInverse pseudo_inverse(const Matrix& A);

}  // namespace porthos::phs
