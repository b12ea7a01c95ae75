#pragma once
#include <span>
#include <vector>

#include "phs/quad.h"

namespace porthos::integrators {

/// Gauss collocation with s stages, order 2s, in the form that stays symplectic in floating point:
///   L_i = (h b_i) f(Y_i),   Y_i = y + Σ_j μ_ij L_j,   μ_ij = a_ij / b_j,   μ_ij + μ_ji = 1 exactly.
/// Sources: Hairer, Lubich, Wanner 2006, II.1.3; Antoñana, Makazaga, Murua 2017 (arXiv:1702.03354) for μ.
template <class T>
struct GaussTable {
  int s;
  std::vector<T> c;         ///< nodes
  std::vector<T> b;         ///< weights
  std::vector<T> mu;        ///< s × s row-major
  std::vector<T> legendre;  ///< P_k(2 c_j - 1), row j, k = 0 … s - 1

  /// h·b_i, rounded symmetrically with the outermost pair set so that the sum is h. Size s.
  void weights(T h, std::span<T> hb) const;
  /// The collocation polynomial at the fraction theta of the step: y(theta) = y + Σ_j B_j L_j. Writes B, size s.
  void polynomial(T theta, std::span<T> B) const;
};

/// Computed in 113-bit arithmetic and rounded once. T = double or Quad. @throws InvalidArgument unless 1 <= s <= 8
/// (12 for Quad).
template <class T>
GaussTable<T> gauss_table(int s);

/// The same with the *upper* triangle rounded and the lower set to 1 - upper: the wrong way round, kept as the negative
/// control of the drift tests.
GaussTable<double> gauss_table_wrong_triangle(int s);

}  // namespace porthos::integrators
