#pragma once
#include <complex>
#include <optional>
#include <vector>

#include "phs/linear_algebra/matrix.h"

/// Linear systems seen from outside, without their port-Hamiltonian structure: an independent judge
/// of it.
namespace porthos::phs {

/// E x' = A x + B u,  y = C x + D u, with as many inputs as outputs. E may be singular, the pencil
/// sE - A not.
struct StateSpace {
  Matrix E, A, B, C, D;
};

/// T(s) = C (sE - A)⁻¹ B + D. Refuses where sE - A is singular: at a pole, or everywhere.
ComplexMatrix transfer(const StateSpace& system, std::complex<double> s);

/// The finite roots of det(sE - A); refuses where every s is one. Roots beyond 1e6 |A|/|E| count as
/// infinite: rounding makes an infinite root of a pencil of index 2, the highest a port-Hamiltonian
/// one has, about 1e8 |A|/|E|.
std::vector<std::complex<double>> poles(const StateSpace& system);

/// The smallest eigenvalue of T(s) + T(s)* on the whole line s = σ + iω, and where it is.
struct HermitianMinimum {
  double value = 0, omega = 0;
  double size = 0;      ///< |C||(sE - A)⁻¹B| + |D| there: rounding of `value` is relative to it
  int evaluations = 0;  ///< of T
};

/// Exact up to rounding and frequencies beyond 1e6 |A|/|E|, not a search on a grid: the frequencies
/// where an eigenvalue of T + T* crosses a level γ are imaginary eigenvalues of a pencil of twice
/// the size (Boyd, Balakrishnan, Kabamba 1989), so a point between each neighbouring pair tells
/// whether anything lies below γ; then γ sinks to the lowest point found. Cost: a few eigenvalue
/// problems of size 2n + m.
HermitianMinimum lowest_hermitian_part(const StateSpace& system, double sigma = 0);

/// Whether T is positive real: no pole right of the imaginary axis, T + T* >= 0 on it.
struct PositiveReality {
  double rightmost_pole = 0;  ///< largest real part; -inf without finite poles
  double pole_limit = 0;      ///< 1e-7 of the largest pole: nearer the axis counts as on it
  /// The line Re s = σ looked at: the axis, or where poles lie on the axis one a thousandth of the
  /// largest pole right of it, so that residues of the wrong sign show.
  double sigma = 0;
  HermitianMinimum minimum;
  double limit = 0;  ///< rounding of minimum.value, which counts as >= 0 from -limit on
  bool holds() const { return rightmost_pole <= pole_limit && minimum.value >= -limit; }
};
PositiveReality positive_reality(const StateSpace& system);

/// The smallest X = Xᵀ >= 0 for which ½xᵀXx is a storage function, d/dt ½xᵀXx <= yᵀu (Willems
/// 1972): what can be drawn from x at the port at most is ½xᵀXx. Solves the Riccati equation
///   AᵀX + XA + (XB - Cᵀ)(D + Dᵀ)⁻¹(BᵀX - C) = 0
/// by the sign function of its Hamiltonian matrix (Roberts 1980, Byers 1987). Nothing where E or D
/// + Dᵀ is singular or T + T* is so on the imaginary axis.
std::optional<Matrix> smallest_storage(const StateSpace& system);

}  // namespace porthos::phs
