#pragma once
#include <memory>

#include "mechanics/mechanism.h"
#include "phs/system.h"

namespace porthos::mechanics {

/// A mechanism as a port-Hamiltonian system: x = (q, p), canonical J,
///   H = ½ pᵀM(q)⁻¹p + V_gravity(q) + Σ ½ k (q_j - rest)²,   R = diag(0, joint damping).
///
/// Ports, one per joint, of the size of its rates, collocated with them:
///   "<joint>.torque" (one rotation), "<joint>.force" (one translation), "<joint>.wrench" (several freedoms;
///   of free and ball joints in the child's axes, [moment; force]).
/// Invariants: linear and angular momentum of mechanisms free in the world without gravity (angular momentum about the
/// pivot for one ball-jointed root at the origin), and of every quaternion |ξ|² and ξ·π.
class MechanicalModel : public phs::ModelFor<MechanicalModel> {
 public:
  explicit MechanicalModel(std::shared_ptr<const Mechanism> mechanism);

  const phs::Description& description() const override { return description_; }
  const Mechanism& mechanism() const { return *mechanism_; }

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  /// The flat state of coordinates q (size nq) and joint rates v (size nv).
  std::vector<double> state(std::span<const double> q, std::span<const double> v) const;
  /// Joint rates of a flat state.
  std::vector<double> rates(std::span<const double> x) const;

 private:
  std::shared_ptr<const Mechanism> mechanism_;
  phs::Description description_;
};

}  // namespace porthos::mechanics
