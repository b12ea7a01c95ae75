#pragma once
#include "integrators/derivatives/step_variation.h"

namespace porthos::integrators {

/// The derivative of a step x' = Φ(x) of a method that is taken in duals (StepsByDuals), nx steps
/// for its matrix: δx' = DΦ δx, λ = DΦᵀ (λ' + (h/2) ∂r(x')) + (h/2) ∂r(x), with the running cost by
/// the trapezoidal rule. There are no derivatives by parameters. Any system will do, and any flows
/// of its parts.
///
/// One object per thread.
/// @throws InvalidArgument as phs::linearise() and make_basic_integrator()
std::unique_ptr<StepVariation> make_dual_step_variation(const phs::Model& model,
                                                        const std::string& method,
                                                        StepVariation::Side side);

}  // namespace porthos::integrators
