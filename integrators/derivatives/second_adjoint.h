#pragma once
#include <memory>

#include "integrators/derivatives/step_variation.h"

namespace porthos::integrators {

/// The change δλ of the adjoint of a step along a tangent δY of its stages, tangent over adjoint:
///
///   δK_i = h b_i (Df(Y_i)ᵀ δℓ_i + (D²f(Y_i) δY_i)ᵀ ℓ_i + ∂²r(Y_i) δY_i),
///   δℓ_i = δλ' + Σ μ_ji δK_j,   δλ = δλ' + Σ δK_i:
///
/// the equations of the adjoint with another running cost. The product with D²f is the second part
/// of that with Dfᵀ in duals, at all stages in lanes. So δλ is a product with the Hessian of the
/// cost, exact to rounding.
class SecondAdjoint {
 public:
  virtual ~SecondAdjoint() = default;
  /// δλ' → δλ, over a step back that `first` has just taken.
  /// @param tangent  δY, size s · nx;  running: ∂²r δY, likewise, or empty
  [[nodiscard]] virtual Outcome advance(const StepPiece& step,
                                        const std::vector<std::int64_t>& turns,
                                        std::span<const double> tangent, const StepVariation& first,
                                        std::span<const double> running, TwoWords& v) = 0;
  /// After that: gradient += the change of what `first` adds to its gradient along the tangent.
  virtual void add_gradient(TwoWords& gradient) = 0;
};

/// The model must outlive the result.
/// @param parameters  δθ of the direction; empty: none. Then δℓ and D²f along it contain them too
/// @throws InvalidArgument as phs::linearise_in_duals() and Linearised::along_parameters(); for
///   Störmer-Verlet with quaternions and discrete gradients; for another number of parameters than
///   the system has
std::unique_ptr<SecondAdjoint> make_second_adjoint(const phs::Model& model,
                                                   const StepPieces& pieces,
                                                   std::span<const double> parameters = {});

/// What a change of the parameters adds to the field, ∂f/∂θ δθ, at the stages of a step.
class FieldChange {
 public:
  /// The model must outlive it. @throws InvalidArgument as make_second_adjoint()
  FieldChange(const phs::Model& model, const StepPieces& pieces,
              std::span<const double> parameters);
  ~FieldChange();
  /// Size s · nx, until the next call.
  std::span<const double> at(const StepPiece& step, const std::vector<std::int64_t>& turns);

 private:
  std::unique_ptr<class FieldsInDuals> fields_;
  std::vector<double> changes_;
};

}  // namespace porthos::integrators
