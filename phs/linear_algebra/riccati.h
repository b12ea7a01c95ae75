#pragma once
#include "phs/linear_algebra/matrix.h"

namespace porthos::phs {

/// The stabilising solution P of the Riccati equation AᵀP + PA - P B R⁻¹Bᵀ P + Q = 0, by the sign
/// function of the Hamiltonian matrix (Roberts 1980; scaling by the determinant, Byers 1987). NaN
/// if there is none: (A, B) cannot be stabilised, or Q does not see a mode on the imaginary axis.
/// For set-up: O(n³).
/// @param A  n × n
/// @param B  n × m
/// @param Q  n × n, symmetric, >= 0
/// @param R  m × m, symmetric, > 0
/// @throws InvalidArgument for sizes that do not match
Matrix riccati(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R);

}  // namespace porthos::phs
