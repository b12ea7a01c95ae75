#pragma once
#include <complex>
#include <optional>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Input-output descriptions of linear systems, without their port-Hamiltonian structure, for
/// independent checks of that structure.
namespace porthos::phs {

/// E x' = A x + B u,  y = C x + D u, with as many inputs as outputs. E may be singular, but the
/// pencil sE - A must be regular.
struct StateSpace {
  Matrix E, A, B, C, D;
};

/// T(s) = C (sE - A)⁻¹ B + D. @throws InvalidArgument if sE - A is singular: at a pole, or for
/// every s
ComplexMatrix transfer(const StateSpace& system, std::complex<double> s);

/// The finite roots of det(sE - A). Roots beyond 1e6 |A|/|E| count as infinite: rounding turns an
/// infinite root of a pencil of index 2, the highest index of a port-Hamiltonian one, into about
/// 1e8 |A|/|E|. @throws InvalidArgument if every s is a root
std::vector<std::complex<double>> poles(const StateSpace& system);

/// The smallest eigenvalue of T(s) + T(s)* on the whole line s = σ + iω, and its ω.
struct HermitianMinimum {
  double value = 0, omega = 0;
  double size = 0;      ///< |C||(sE - A)⁻¹B| + |D| there: rounding of `value` is relative to it
  int evaluations = 0;  ///< of T
};

/// Exact up to rounding and frequencies beyond 1e6 |A|/|E|; it does not search a grid. The
/// frequencies at which an eigenvalue of T + T* crosses a level γ are imaginary eigenvalues of a
/// pencil of twice the size (Boyd, Balakrishnan, Kabamba 1989). One point between each neighbouring
/// pair thus shows whether any value lies below γ. γ is then lowered to the lowest value found.
/// Cost: a few eigenvalue problems of size 2n + m.
HermitianMinimum lowest_hermitian_part(const StateSpace& system, double sigma = 0);

/// Whether T is positive real: no pole right of the imaginary axis, and T + T* >= 0 on the axis.
struct PositiveReality {
  double rightmost_pole = 0;  ///< largest real part; -inf without finite poles
  double pole_limit = 0;      ///< 1e-7 of the largest pole; nearer poles count as on the axis
  /// The line Re s = σ that was checked: the imaginary axis, or, if poles lie on the axis, a line
  /// to its right by a thousandth of the largest pole, so that residues of the wrong sign show.
  double sigma = 0;
  HermitianMinimum minimum;
  double limit = 0;  ///< rounding of minimum.value: values >= -limit count as >= 0
  bool holds() const { return rightmost_pole <= pole_limit && minimum.value >= -limit; }
};
PositiveReality positive_reality(const StateSpace& system);

/// The smallest X = Xᵀ >= 0 for which ½xᵀXx is a storage function, d/dt ½xᵀXx <= yᵀu (Willems
/// 1972). The most energy that can be extracted from x at the port is ½xᵀXx. Solves the Riccati
/// equation
///   AᵀX + XA + (XB - Cᵀ)(D + Dᵀ)⁻¹(BᵀX - C) = 0
/// by the sign function of its Hamiltonian matrix (Roberts 1980, Byers 1987). Returns nothing if E
/// or D + Dᵀ is singular, or T + T* is singular on the imaginary axis.
std::optional<Matrix> smallest_storage(const StateSpace& system);

}  // namespace porthos::phs
