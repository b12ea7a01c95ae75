#pragma once
#include "integrators/derivatives/step_variation.h"
#include "integrators/methods/discrete_gradient.h"

namespace porthos::integrators {

/// The derivative of a step of a discrete gradient method, δ = h f̄(x0, δ), x1 = x0 + δ, by the
/// theorem on implicit functions:
///
///   tangent   (1 - h ∂f̄/∂δ) δδ = h ∂f̄/∂x0 δx0,   δx1 = δx0 + δδ
///   adjoint   (1 - h ∂f̄/∂δ)ᵀ m = λ' + (h/2) ∂r,
///             λ = λ' + h ∂r + h (∂f̄/∂x0)ᵀ m
///
/// with the running cost h r(x0 + δ/2). The two matrices are those of the step in duals, 2 nx
/// evaluations, and the equations are solved by LU: nothing is assumed of J, R and the sources. The
/// derivatives by parameters are m·h ∂f̄/∂θ. As ∇̄H is linear in ∇H at its points, they are
/// those of the field there; known for a canonical system without losses, sources and time, else
/// there are none.
///
/// One object per thread.
/// @throws InvalidArgument as phs::linearise()
std::unique_ptr<StepVariation> make_discrete_gradient_variation(const phs::Model& model,
                                                                DiscreteGradientRule rule,
                                                                StepVariation::Side side);

}  // namespace porthos::integrators
