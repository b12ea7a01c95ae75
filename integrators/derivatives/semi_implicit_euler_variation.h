#pragma once
#include "integrators/derivatives/step_variation.h"

namespace porthos::integrators {

/// The derivative of a step p' = p + h f_p(Y_0), q' = q + h f_q(Y_1), Y_0 = (q, p), Y_1 = (q, p'):
/// a partitioned Runge-Kutta step with weights that are zero, so its adjoint has no coefficients
/// a/b. With K_i = h Df(Y_i)ᵀ ℓ_i + (h/2) ∂r(Y_i) it is
///
///   ℓ_1 = (λq', 0),   ℓ_0 = (0, λp' + K_1p),   λ = λ' + K_0 + K_1
///
/// One object per thread. advance() allocates nothing.
/// @throws InvalidArgument as phs::linearise()
std::unique_ptr<StepVariation> make_semi_implicit_euler_variation(const phs::Model& model,
                                                                  StepVariation::Side side);

}  // namespace porthos::integrators
