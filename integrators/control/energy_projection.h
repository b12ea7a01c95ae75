#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/methods/invariant_gradients.h"

namespace porthos::integrators {

/// Moves a state to a given energy without changing any linear or quadratic invariant of the
/// system: linear and angular momentum, norms, Casimirs.
///
/// Only momenta move, along d = v minus its part in the span of the invariants' gradients, v =
/// ∂H/∂p. The motion that carries the invariants stays; the rest becomes faster or slower. (Scaling
/// all velocities is simpler but changes linear and angular momentum by the same factor.) In a
/// system without momenta the whole state moves, along ∇H in the same way. Source: projection onto
/// an invariant manifold, Hairer, Lubich, Wanner 2006, IV.4.
///
/// With constraints, d loses Gᵀ(G M⁻¹ Gᵀ)⁻¹ G M⁻¹ d too. Then G M⁻¹ d = 0, so the rates stay on the
/// constraints; positions do not move. Forces of constraints change none of the invariants that the
/// system declares, so neither does this part of d.
class EnergyProjection {
 public:
  /// Both models must outlive it.
  /// @param keeps  declares the invariants; its state is the first numbers of the model's state
  EnergyProjection(const phs::Model& model, const phs::Model& keeps);
  explicit EnergyProjection(const phs::Model& model) : EnergyProjection(model, model) {}

  /// Moves the state to H(state) = target [J], up to the rounding of H. Returns false and leaves
  /// the state unchanged if no motion remains to supply that energy. Allocates nothing. system: of
  /// the same model, at the state's turns
  bool operator()(phs::System<double>& system, phs::State& state, double target);

 private:
  /// The rows of the constraints, and what takes d along them.
  struct Rows {
    std::unique_ptr<phs::System<double>> system;
    std::unique_ptr<phs::Constraints<double>> rows;
    std::vector<double> row, push, at_rest;
  };
  double energy(phs::System<double>& system, const phs::State& s);
  /// Computes d_ at x_; returns dH/dλ along it
  double direction(phs::System<double>& system);
  /// Takes from d_ what would change the rates across the constraints, at x_.
  void keep_to_constraints(phs::System<double>& system);

  InvariantGradients invariants_;
  std::optional<Rows> constraints_;
  size_t n_kept_;               ///< size of their system's state
  std::vector<size_t> moving_;  ///< indices of the state numbers that may move
  std::vector<double> x_, e_, v_, d_, slope_;
  std::vector<std::vector<double>> basis_;  ///< orthonormal, of the invariants' gradients
  phs::State trial_;
  std::vector<double> found_, found_lo_;  ///< the best x and lo so far
};

}  // namespace porthos::integrators
