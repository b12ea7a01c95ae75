#pragma once
#include <memory>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/system/system.h"

namespace porthos::mechanics {

/// A power port on a body: a frame fixed to a link, with the link's axes. Port "<name>.wrench", 6
/// numbers each way:
/// u = [moment; force] on the link about the frame's origin, in the frame's axes [N m; N];
/// y = twist [angular; linear] of the frame in the same axes [rad/s; m/s]; y = J(q) v, and the
/// joints feel J(q)ᵀ u.
struct BodyPort {
  std::string name;
  std::string link;         ///< any moving body of the mechanism, one on a fixed joint too
  Vec3d position{0, 0, 0};  ///< origin in the link's frame [m]
};

/// A mechanism as a port-Hamiltonian system: x = (q, p), canonical J,
///   H = ½ pᵀM(q)⁻¹p + V_gravity(q) + Σ ½ k (q_j - rest)²,   R = diag(0, joint damping).
///
/// Ports, one per joint, of the size of its rates, collocated with them:
///   "<joint>.torque" (one rotation), "<joint>.force" (one translation), "<joint>.wrench" (several
///   freedoms; of free and ball joints in the child's axes, [moment; force]),
/// then the body ports in the order given. On the base of a free-floating mechanism the free
/// joint's own port ("base.wrench") is already the wrench about the origin of the base's frame: a
/// body port there gives the same numbers. With body ports apply_input and output cost two more
/// passes over the tree each, however many ports there are; field only what gravity costs, and
/// nothing where u is empty. Invariants: linear and angular momentum of mechanisms free in the
/// world without gravity (for one ball-jointed root the angular momentum about its pivot), and of
/// every quaternion |ξ|² and ξ·π. Rotor inertias leave them invariants: the momenta are those of
/// the bodies, without the spin of rotors (momentum.h).
class MechanicalModel : public phs::ModelFor<MechanicalModel> {
 public:
  /// @throws InvalidArgument naming the port: no name or a name taken, a position that is not
  ///   finite, a link that does not exist (with those that do) or never moves
  explicit MechanicalModel(std::shared_ptr<const Mechanism> mechanism,
                           const std::vector<BodyPort>& ports = {});

  const phs::Description& description() const override { return description_; }
  const Mechanism& mechanism() const { return *mechanism_; }

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  /// The flat state of coordinates q (size nq) and joint rates v (size nv).
  std::vector<double> state(std::span<const double> q, std::span<const double> v) const;
  /// Joint rates of a flat state. turns: of its angle blocks, as phs::State::turns; none: they
  /// stand in the angles.
  std::vector<double> rates(std::span<const double> x,
                            std::span<const std::int64_t> turns = {}) const;

 private:
  std::shared_ptr<const Mechanism> mechanism_;
  std::vector<BodyFrame> ports_;  ///< the frames of the body ports
  phs::Description description_;
};

}  // namespace porthos::mechanics
