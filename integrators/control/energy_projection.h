#pragma once
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/methods/invariant_gradients.h"

namespace porthos::integrators {

/// Moves a state to a given energy and leaves every linear and quadratic invariant of the system
/// where it is: linear and angular momentum, norms, Casimirs.
///
/// Only momenta move, along d = v minus its part in the span of the invariants' slopes, v = ∂H/∂p:
/// the motion that carries the invariants stays, the rest is made slower or faster. (Scaling all
/// velocities, which is simpler, changes linear and angular momentum by the same factor.) In a
/// system without momenta the whole state moves, along ∇H likewise. Source: projection onto an
/// invariant manifold, Hairer, Lubich, Wanner 2006, IV.4.
class EnergyProjection {
 public:
  /// The models must outlive it.
  /// @param keeps  declares the invariants; its state is the first numbers of the model's
  EnergyProjection(const phs::Model& model, const phs::Model& keeps);
  explicit EnergyProjection(const phs::Model& model) : EnergyProjection(model, model) {}

  /// H(state) = target [J], to the rounding of H. False, and the state as it was, if the energy is
  /// out of reach: no motion is left to take it from. Allocates nothing. system: of the same model,
  /// at the state's turns
  bool operator()(phs::System<double>& system, phs::State& state, double target);

 private:
  double energy(phs::System<double>& system, const phs::State& s);
  /// d_ at x_; returns |d|²
  double direction(phs::System<double>& system);

  InvariantGradients invariants_;
  size_t n_kept_;               ///< size of their system's state
  std::vector<size_t> moving_;  ///< the numbers of the state that may move
  std::vector<double> x_, e_, d_, slope_;
  std::vector<std::vector<double>> basis_;  ///< orthonormal, of the invariants' slopes
  phs::State trial_;
  std::vector<double> found_, found_lo_;  ///< the best x and lo so far
};

}  // namespace porthos::integrators
