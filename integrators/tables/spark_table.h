#pragma once
#include <vector>

#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// The (s, s)-Gauss-Lobatto SPARK method, order 2s: Gauss stages i = 1 … s for the field,
/// constraint nodes j = 0 … s at the s + 1 Lobatto points c̃_j with weights b̃_j. With L_i = h b_i
/// f(Y_i) and the impulses I_j = h b̃_j λ_j:
///   Y_i = y + Σ_k μ_ik L_k - Σ_j (1 - ν_ji) B(Q_j) I_j        j = 0 … s - 1
///   Q_j = y + Σ_i ν_ji L_i  (positions),  g(Q_j) = 0           j = 1 … s
///   y'  = y + Σ_i L_i - Σ_j B(Q_j) I_j,  I_s from B(y')ᵀ e(y') = 0
/// ν_ji = ∫₀^c̃_j ℓ_i / b_i. It is symplectic because I_j enters Y_i with 1 - ν_ji, and keeps
/// linear and quadratic invariants. Source: Jay 2007, J. Comput. Appl. Math. 204:56. T = double or
/// Quad.
template <class T>
struct SparkTable {
  CollocationTable<T> gauss;
  std::vector<T> node, weight;  ///< c̃_j and b̃_j, size s + 1
  std::vector<T> nu, rest;  ///< ν_ji and 1 - ν_ji, (s + 1) × s row-major; they add up to 1 exactly
  /// Inverse of B_jk = Σ_i ν_ji b_i (1 - ν_ki), j = 1 … s, k = 0 … s - 1: row k, column j - 1. The
  /// positions at the nodes answer impulses by -h B ⊗ M⁻¹.
  std::vector<T> response;
  /// The multipliers' least-squares expansion, h λ(θ) = Σ_k a_k P_k(2θ - 1), k < s, with
  /// a_k = Σ_l mode_kl I_l: mode_kl = P_k(2 c̃_l - 1)/γ_k, γ_k = Σ_l b̃_l P_k(2 c̃_l - 1)², row k,
  /// s × (s + 1).
  std::vector<T> mode;

  int s() const { return gauss.s; }
};

/// @throws InvalidArgument unless 1 <= s <= 8 (11 for Quad)
template <class T>
SparkTable<T> spark_table(int s);

}  // namespace porthos::integrators
