#pragma once
#include <span>
#include <vector>

#include "phs/scalars/quad.h"

namespace porthos::integrators {

/// Writes hb = h·b for weights b, both of size s, rounded so that the sum is h: of symmetric ones
/// the outermost pair takes the rest, else the largest. T = double or Quad.
template <class T>
void step_weights(std::span<const T> b, T h, std::span<T> hb);

/// A collocation-like method with s stages, in the form that conserves its invariants in floating
/// point:
///   L_i = (h b_i) f(Y_i),   Y_i = y + Σ_j μ_ij L_j,   y' = y + Σ_i L_i,   μ_ij = a_ij / b_j
/// (Antoñana, Makazaga, Murua 2017, arXiv:1702.03354). Computed in 113-bit arithmetic and rounded
/// once.
template <class T>
struct CollocationTable {
  int s;
  std::vector<T> c;     ///< nodes
  std::vector<T> b;     ///< weights
  std::vector<T> mu;    ///< s × s row-major
  std::vector<T> mu_p;  ///< for the momenta of a partitioned method; empty: the same
  /// Row j: the contributions of L_j to the Legendre coefficients of the polynomial's slope, degree
  /// 0 first.
  std::vector<T> legendre;

  /// step_weights() of b. Size s.
  void weights(T h, std::span<T> hb) const { step_weights<T>(b, h, hb); }
  /// The polynomial of the step at its fraction theta: y(theta) = y + Σ_j B_j L_j. Writes B, size
  /// s.
  void polynomial(T theta, std::span<T> B) const;
  /// Its derivative: dy/dtheta = Σ_j B_j L_j.
  void slope(T theta, std::span<T> B) const;
  /// Degree of the polynomial; s except for HBVM.
  int degree() const { return int(legendre.size()) / s; }
};

/// Gauss, order 2s: μ_ij + μ_ji = 1 exactly. Source: Hairer, Lubich, Wanner 2006, II.1.3.
/// @throws InvalidArgument unless 1 <= s <= 8 (12 for Quad). T = double or Quad.
template <class T>
CollocationTable<T> gauss_table(int s);

/// HBVM(k, r), order 2r: the polynomial has degree r, its slope the first r Legendre coefficients
/// of f at k Gauss nodes. Source: Brugnano, Iavernaro, Trigiante 2010, J. Numer. Anal. Ind. Appl.
/// Math. 5:17. 1 <= r <= k <= 16.
template <class T>
CollocationTable<T> hbvm_table(int k, int r);

/// Lobatto IIIA for positions (mu), IIIB for momenta (mu_p), order 2s - 2, with mu_ij + mu_p_ji = 1
/// exactly. Source: Hairer, Lubich, Wanner 2006, II.2.2 and VI.4.2. 2 <= s <= 8.
template <class T>
CollocationTable<T> lobatto_table(int s);

/// A Runge-Kutta method by its nodes c, its weights b, none of which is zero, and a, s × s row by
/// row.
/// @param degree  of the polynomial of a step: s of collocation, 1: a straight line
template <class T>
CollocationTable<T> runge_kutta_table(std::span<const phs::Quad> c, std::span<const phs::Quad> b,
                                      std::span<const phs::Quad> a, int degree);

}  // namespace porthos::integrators
