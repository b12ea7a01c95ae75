#pragma once
#include <complex>
#include <span>
#include <vector>

#include "energy_shaping/closed_loop.h"

/// Eigenvalues and derivatives the certificates are made of. Not for kernels.
namespace porthos::energy_shaping {

/// Eigenvalues of the symmetric part of A (n × n, row by row), rising.
std::vector<double> symmetric_eigenvalues(std::size_t n, std::span<const double> A);
/// Eigenvalues of A (n × n, row by row) by rising real part.
std::vector<std::complex<double>> eigenvalues(std::size_t n, std::span<const double> A);
/// x of A x = b. NaN where A is singular.
std::vector<double> linear_solve(std::size_t n, std::span<const double> A,
                                 std::span<const double> b);
/// The Jacobian of the closed loop's field at x, row by row, exact (duals).
std::vector<double> field_jacobian(const phs::Model& model, std::span<const double> x);
/// The Hessian of H_d at x, row by row, exact.
std::vector<double> hessian(const phs::Model& model, std::span<const double> x);

}  // namespace porthos::energy_shaping
