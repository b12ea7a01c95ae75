#pragma once
#include <array>
#include <string>

#include "energy_shaping/matching/designs.h"

namespace porthos::energy_shaping {

/// Matching of two coordinates with one actuator without a closed form. The masses depend on the
/// unactuated coordinate r alone; the actuated coordinate s enters V as a0(r) + a1(r) cos s + a2(r)
/// sin s (a pendubot, a cart-pole, ...).
///
/// With λ = M⁻¹M_d e_r the matching equations are  λ_r (M_d)_rr' = λᵀM'λ  (J2 being solved for) and
/// λ·∂V_d = ∂V/∂r (after Auckly, Kapitanski, White 2000). For a constant ratio ρ = λ_s/λ_r both are
/// quadratures,
///   λ_r'/λ_r = (ρ² M_ss' + ρ M_rs')/(ρ M_rs + M_rr),   s - ρ r constant along the characteristics,
/// done in Chebyshev polynomials of r. (M_d)_ss is chosen so that det M_d = `determinant` · M_d_rr.
/// V_d gets ½ ku (s - ρ r)². Derivatives are those of the polynomials, so that the residual of
/// MatchedLoop has the interpolation in it.
struct NumericalMatching {
  std::string name = "numerical matching";
  std::string actuator;  ///< port of s
  int unactuated = 1;    ///< r: 0 or 1
  double ratio = 0;      ///< ρ
  /// r in [-half_width, half_width]: beyond it the law is not defined, certify() refuses boxes and
  /// starts, and a run that leaves it and fails tells so
  double half_width = 1;
  double scale = 1;        ///< |λ_r| at rest
  double determinant = 1;  ///< > 0
  double ku = 100, kv = 1;
  double other = 3;                  ///< the region: |s| up to this
  double rate = 2;                   ///< and |q'_i| up to this
  int degree = 60;                   ///< of the polynomials
  double matching = 1e-6;            ///< bound of the residuals
  std::array<double, 2> rest{0, 0};  ///< q*, an equilibrium of the plant; r and s count from it
};

/// Rest at q*. Its certificate tells if the plant hangs there. @throws InvalidArgument for an
/// actuator that acts on r, a rest that is no equilibrium along r or near which nothing pulls r,
/// where ρ M_rs + M_rr vanishes in the interval (with the place), V is not
/// of the form above, the polynomials do not resolve the functions, or MatchedLoop refuses
LoopPtr numerical_matching(PlantPtr plant, const NumericalMatching& options);

/// The options with ku, kv and determinant, and with the ratio if it is 0, whose loop, linearised
/// at the rest point, has a bandwidth ω [rad/s] and a damping ratio twice. The ratio alone decides
/// on ω: with K = ∂²V/∂q²,
///   ω² = (K_rr + ρ K_rs)/(M_rr + ρ M_rs),
/// so of another one the nearest are found. By a search over six decades and least squares.
/// For set-up: some 100 ms
/// @throws InvalidArgument for a plant that is not of two coordinates, numbers that are not above
///   0, a rest as numerical_matching() refuses it, and a ratio with which no gains make the rest
///   point attract
NumericalMatching numerical_matching_gains(const phs::Model& plant, NumericalMatching options,
                                           double bandwidth, double damping_ratio);

}  // namespace porthos::energy_shaping
