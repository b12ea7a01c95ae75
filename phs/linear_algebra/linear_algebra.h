#pragma once
#include <complex>
#include <span>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Small dense linear algebra for set-up and checks, not for kernels (phs/linear_algebra/dense.h).
/// By Eigen, compiled here once. Matrices are n × n, row by row.
namespace porthos::phs {

/// Eigenvalues of the symmetric part of A, rising; NaN where A is not finite.
std::vector<double> symmetric_eigenvalues(std::size_t n, std::span<const double> A);
/// Eigenvalues of A by rising real part; NaN where A is not finite.
std::vector<std::complex<double>> eigenvalues(std::size_t n, std::span<const double> A);
/// Eigenvalues of A, those that are zero counted apart. Null spaces are split off one after the
/// other, so that a Jordan block of zeros (a direction without stiffness and its momentum) does not
/// smear over slow modes, as it does in eigenvalues().
struct Spectrum {
  int zeros = 0;                           ///< the algebraic multiplicity of 0
  std::vector<std::complex<double>> rest;  ///< as of eigenvalues()
};
/// Of A, n × n row-major. tolerance: singular values below it times the largest are zero.
Spectrum spectrum(std::size_t n, std::span<const double> A, double tolerance = 1e-13);
/// x of A x = b. NaN where A is singular.
std::vector<double> linear_solve(std::size_t n, std::span<const double> A,
                                 std::span<const double> b);

/// A⁺ (Moore, Penrose) by singular values: A⁺ b is the shortest x with the least |A x - b|.
struct PseudoInverse {
  Matrix inverse;
  int rank = 0;
};
PseudoInverse pseudo_inverse(const Matrix& A);

}  // namespace porthos::phs
