#pragma once
#include "integrators/derivatives/step_variation.h"

namespace porthos::integrators {

/// The derivative of a Störmer-Verlet step with quaternions (methods/stormer_verlet.h). With
/// a = h/2, F_0 and F_1 = G δx at the stages x_0 = (q, p½) and x_1 = (q', p½), where G is the
/// derivative of the field with the terms of κ, the tangent is
///
///   δp½ = δp + a (F_0p - δλ ξ - λ δξ),   δq' = δq + a (F_0q + F_1q),   ξ'·δξ' = 0,
///   δp' = δ[P(ξ') (p½ + a f_1p)],        P(ξ) = 1 - ξ ξᵀ/|ξ|²
///
/// and the adjoint its transpose: with c = P(ξ') λp' and K_i = a Gᵀ ℓ_i, ℓ_0 = (m_q, m_p),
/// ℓ_1 = (m_q, c),
///
///   m_q = λq' + e + ν ξ' + K_1q,   m_p = c + K_0p + K_1p,   ξ·m_p = 0,
///   λq = m_q + K_0q - a λ m_p,     λp = m_p
///
/// e: what λp' gives through ξ' in P. Each quaternion has its own multipliers λ and ν, solved for
/// with the rest by fixed-point iteration as in the step. Derivatives by parameters contain that of
/// κ.
std::unique_ptr<StepVariation> make_stormer_verlet_variation(const phs::Model& model,
                                                             StepVariation::Side side);

}  // namespace porthos::integrators
