#pragma once
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "phs/scalars/quad.h"
#include "phs/system/state.h"

/// Events that change a mechanism in motion: capture, release, locking and unlocking of joints,
/// closing and opening of loops.
///
/// An event joins or frees bodies at one instant, without external impulse (but for loops that end
/// in the world). Positions stay. The new
/// rates v⁺ are nearest to the old motion in the kinetic-energy metric,
///
///   min Σ ½ (J_i v⁺ - V_i)ᵀ I_i (J_i v⁺ - V_i)   =>   M⁺ v⁺ = Σ J_iᵀ I_i V_i,
///
/// over all bodies i with twists V_i before, among those that keep the loops closed: a perfectly
/// plastic impact. Linear and angular momentum are conserved to rounding. The energy loss is that
/// minimum (Carnot's theorem). It is 0 if the new mechanism can continue the old motion (release,
/// unlock, opening). The computation uses 113 bits, so an event adds only the rounding of its final
/// state.
///
/// A floating mechanism can be captured by any link. If it is not the root, the tree is turned
/// round: it hangs on the captured link then, and the joints between that link and the old root
/// have parent and child exchanged. Their coordinates, rates and forces stay what they are. Each
/// such joint gets a frame without mass, "<joint>.turned", at the place of its old child. A release
/// puts the tree back as it was.
namespace porthos::mechanics {

/// A locked joint and its state before the lock.
struct LockedJoint {
  BodySpec free;          ///< its body before the lock
  std::vector<double> q;  ///< its coordinates, low words and turns at the lock
  std::vector<double> lo;
  std::vector<std::int64_t> turns;
  std::map<std::string, phs::Quad> values = {};  ///< by coordinate with one freedom, turns included
};

/// A capture, and the bodies from the root to the captured link as they were before it.
struct Captured {
  std::vector<BodySpec> way;
  const std::string& link() const { return way.back().name; }
  bool has(const std::string& body) const;  ///< whether the body is on the way
};

/// A mechanism in motion, with the parts it was built from and the loops that are closed.
struct MovingMechanism {
  MechanismBuilder parts;
  /// What is closed. Couplings have the coordinates of locked joints too: those are constants, so
  /// the model has the rest of such a coupling, and nothing where no coordinate is left.
  ConstraintSpec constraints;
  std::shared_ptr<const MechanicalModel> model;
  phs::State state;                           ///< of model
  double time = 0;                            ///< of joints that move as told [s]
  std::map<std::string, LockedJoint> locked;  ///< by joint
  std::vector<Captured> captured = {};        ///< those that last, in the order of time

  /// The mechanism at rest at q = 0 and time 0, without loops. @throws InvalidArgument as
  /// MechanismBuilder::build
  explicit MovingMechanism(MechanismBuilder parts);
  /// Sets the state from q and v (sizes nq, nv); the clock stays.
  void set(std::span<const double> q, std::span<const double> v);
};

/// Energy loss and momentum balance of an event.
struct Impact {
  double dissipated_J = 0;                   ///< plastic loss, >= 0
  double driven_J = 0;                       ///< what the motors of driven joints put in
  Momentum<double> momentum;                 ///< before the event, about the world's origin
  MomentumScale scale{0, 0};                 ///< of the motion before, for small momenta
  double linear_jump = 0, angular_jump = 0;  ///< |after - before| [kg m/s, kg m²/s]: rounding
  double rate_jump = 0;  ///< largest |v⁺ - v| of a body's twist [rad/s or m/s]
};

/// A latch that joins a point of a link to a point of a body.
struct Latch {
  std::string body;                          ///< of a mechanism that floats, with all of it
  std::string link;                          ///< of the rest of the mechanism
  Vec3d on_body{0, 0, 0}, on_link{0, 0, 0};  ///< in their frames [m]
  double reach = std::numeric_limits<double>::infinity();  ///< largest distance of the points [m]
  double speed =
      std::numeric_limits<double>::infinity();  ///< largest relative speed of the points [m/s]
  double rate = std::numeric_limits<double>::infinity();  ///< largest relative angular rate [rad/s]
};

/// Welds the body to the link in its current pose, by a fixed joint; if the body is not the root of
/// its mechanism, this is turned round.
/// @throws InvalidArgument with the numbers, for unknown names, a body whose mechanism does not
///   float or has the link or the free base, a joint on the way to its root that has not one axis,
///   points further apart than the reach, or relative motion beyond the limits. `moving` is then
///   unchanged.
Impact capture(MovingMechanism& moving, const Latch& latch);
/// The smallest margin of the latch's points and their motion to its limits [m, m/s or rad/s]. It
/// is continuous in the state and negative beyond a limit.
/// @throws InvalidArgument for unknown names
double margin(const MovingMechanism& moving, const phs::State& state, const Latch& latch);
/// The limits that are exceeded, with the numbers; empty: none.
std::string beyond_limits(const MovingMechanism& moving, const Latch& latch);
/// @throws InvalidArgument beginning with `event` and naming the limits that are exceeded, with
/// the numbers
void require_within_limits(const MovingMechanism& moving, const Latch& latch,
                           const std::string& event);
/// Closes a loop, rod or coupling as the mechanism stands: frame b of a loop is placed on a, a rod
/// gets the present distance as its length, a coupling the present sum as its offset.
/// @param closing  with one constraint
/// @throws InvalidArgument as ConstraintSet, and for a rod without length
Impact close_loop(MovingMechanism& moving, ConstraintSpec closing);
/// Opens one. @throws InvalidArgument for a name that is not closed
Impact open_loop(MovingMechanism& moving, const std::string& name);
/// Places a floating mechanism so that `body` has the pose in the frame of `link` and moves with
/// it, as if it had been captured so: sets the coordinates and rates of its free joint. All others
/// stay. Cost: O(n) in 113 bits.
/// @throws InvalidArgument for unknown names, and for a body whose mechanism does not float
void move_with(MovingMechanism& moving, const std::string& link, const std::string& body,
               const Pose& pose);
/// The current pose of the body's frame in the link's frame.
Pose relative_pose(const MovingMechanism& moving, const std::string& link, const std::string& body);

/// The body and all it carries become free in the world and keep their motion; a captured link is
/// let go with its whole mechanism, which floats on its root again. A lock of the joint that held
/// the body ends with that joint.
/// @throws InvalidArgument for an unknown body, one that is already free, or one that a later
///   capture holds by another link
Impact release(MovingMechanism& moving, const std::string& body);
/// Locks the joint in its current position. Closed couplings of it hold its other joints as they
/// then must: the second joint of a gear stops too. @throws InvalidArgument for an unknown joint,
/// one that is already fixed or locked, or one that moves as told
Impact lock(MovingMechanism& moving, const std::string& joint);
/// Frees a locked joint. It starts at rest, with the coordinates it had when it was locked.
/// @throws InvalidArgument for a joint that is not locked, or that was locked before a capture
///   turned it round
Impact unlock(MovingMechanism& moving, const std::string& joint);

}  // namespace porthos::mechanics
