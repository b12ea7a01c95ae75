#pragma once
#include <memory>
#include <string>
#include <vector>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/mechanism.h"
#include "phs/system/system.h"

namespace porthos::mechanics {

/// A power port on a body: a frame fixed to a link, with the link's axes. The port "<name>.wrench"
/// has 6 numbers each way:
/// u = [moment; force] on the link about the frame's origin, in the frame's axes [N m; N];
/// y = twist [angular; linear] of the frame in the same axes [rad/s; m/s]; y = J(q) v, and the
/// joints receive J(q)ᵀ u.
struct BodyPort {
  std::string name;
  std::string link;         ///< any moving body of the mechanism, also one on a fixed joint
  Vec3d position{0, 0, 0};  ///< origin in the link's frame [m]
};

/// A mechanism as a port-Hamiltonian system: x = (q, p), canonical J,
///   H = ½ pᵀM(q)⁻¹p + V_gravity(q) + Σ ½ k (q_j - rest)²,   R = diag(0, joint damping).
///
/// Ports: one per joint, with the size of its rates and collocated with them:
///   "<joint>.torque" (one rotation), "<joint>.force" (one translation), "<joint>.wrench" (several
///   freedoms; of free and ball joints in the child's axes, [moment; force]),
/// then the body ports in the order given. On the base of a free-floating mechanism, the free
/// joint's own port ("base.wrench") already is the wrench about the origin of the base's frame; a
/// body port there gives the same numbers. With body ports, apply_input and output each cost two
/// more passes over the tree, however many ports there are. field costs only what gravity costs,
/// and nothing more if u is empty.
///
/// Constraints close loops, couple joints, let bodies roll and drive joints (System::constraints).
/// Each has an account in the ledger, "<name>.reaction", which a method that keeps it books as zero
/// to rounding; that of a driven joint is "<name>.power", what its motor puts in.
///
/// Invariants: linear and angular momentum of mechanisms that are free in the world without gravity
/// (for a single ball-jointed root, the angular momentum about its pivot), and |ξ|² and ξ·π of
/// every quaternion. They stay invariant with rotor inertias: the momenta are those of the bodies,
/// without rotor spin (momentum.h).
class MechanicalModel : public phs::ModelFor<MechanicalModel> {
 public:
  /// @throws InvalidArgument naming the port: an empty or duplicate name, a position that is not
  ///   finite, a link that never moves or does not exist (with the list of those that do); for
  ///   constraints: see ConstraintSet
  explicit MechanicalModel(std::shared_ptr<const Mechanism> mechanism,
                           const std::vector<BodyPort>& ports = {},
                           const ConstraintSpec& constraints = {});

  const phs::Description& description() const override { return description_; }
  const Mechanism& mechanism() const { return *mechanism_; }
  /// The constraints, or null without any.
  const ConstraintSet* constraint_set() const { return constraints_.get(); }

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  /// The flat state of coordinates q (size nq) and joint rates v (size nv).
  std::vector<double> state(std::span<const double> q, std::span<const double> v) const;
  /// Joint rates of a flat state x. turns: of its angle blocks, as phs::State::turns; empty: the
  /// angles contain their turns.
  std::vector<double> rates(std::span<const double> x,
                            std::span<const std::int64_t> turns = {}) const;

 private:
  std::shared_ptr<const Mechanism> mechanism_;
  std::vector<BodyFrame> ports_;                      ///< the frames of the body ports
  std::shared_ptr<const ConstraintSet> constraints_;  ///< null: none
  phs::Description description_;
};

}  // namespace porthos::mechanics
