#pragma once
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "phs/system/state.h"

/// Events that change a mechanism while it moves: capture, release, joints that lock and unlock.
///
/// An event joins or frees bodies at one instant, without external impulse. Positions stay, and the
/// new rates v⁺ are those nearest to the old motion in the metric of the masses,
///
///   min Σ ½ (J_i v⁺ - V_i)ᵀ I_i (J_i v⁺ - V_i)   =>   M⁺ v⁺ = Σ J_iᵀ I_i V_i,
///
/// over all bodies i with twists V_i before: the perfectly plastic impact. Linear and angular
/// momentum are equal before and after to rounding, and what is lost is that minimum (Carnot's
/// theorem), 0 where the new mechanism can go on as the old one moved (release, unlock). Computed
/// in 113 bits: an event adds no rounding beyond that of the state it ends in.
namespace porthos::mechanics {

/// A joint that is locked: what it was.
struct LockedJoint {
  BodySpec free;          ///< its body before
  std::vector<double> q;  ///< its coordinates, low words and turns when it was locked
  std::vector<double> lo;
  std::vector<std::int64_t> turns;
};

/// A mechanism in motion with the parts it is made of.
struct MovingMechanism {
  MechanismBuilder parts;
  std::shared_ptr<const MechanicalModel> model;
  phs::State state;                           ///< of model
  std::map<std::string, LockedJoint> locked;  ///< by joint

  /// The mechanism at rest at q = 0 and time 0. @throws InvalidArgument as MechanismBuilder::build
  explicit MovingMechanism(MechanismBuilder parts);
  /// Sets the state from q and v (sizes nq, nv) and keeps the clock.
  void set(std::span<const double> q, std::span<const double> v);
};

/// The ledger of an event.
struct Impact {
  double dissipated_J = 0;                   ///< plastic loss, >= 0
  Momentum<double> momentum;                 ///< before, about the world's origin
  MomentumScale scale{0, 0};                 ///< of the motion before, where the momenta are small
  double linear_jump = 0, angular_jump = 0;  ///< |after - before| [kg m/s, kg m²/s]: rounding
  double rate_jump = 0;  ///< largest |v⁺ - v| of a body's twist [rad/s or m/s]
};

/// A latch: a point of the link meets a point of the body.
struct Latch {
  std::string body;                          ///< free in the world, with whatever it carries
  std::string link;                          ///< of the rest of the mechanism
  Vec3d on_body{0, 0, 0}, on_link{0, 0, 0};  ///< in their frames [m]
  double reach = std::numeric_limits<double>::infinity();  ///< largest distance of the points [m]
  double speed =
      std::numeric_limits<double>::infinity();  ///< largest relative speed of the points [m/s]
  double rate = std::numeric_limits<double>::infinity();  ///< largest relative angular rate [rad/s]
};

/// The body is welded to the link as it is, by a fixed joint.
/// @throws InvalidArgument for unknown names, a body that is not free in the world or carries the
///   link, points further apart than the reach, or relative motion beyond the limits; with the
///   numbers. Nothing has changed then.
Impact capture(MovingMechanism& moving, const Latch& latch);
/// How far the latch's points and their motion are within its limits, by the one that is closest
/// [m, m/s or rad/s]: continuous in the state, below 0 beyond a limit. @throws InvalidArgument for
/// unknown names
double margin(const MovingMechanism& moving, const phs::State& state, const Latch& latch);
/// @throws InvalidArgument saying which limit is passed, with the numbers
void require_within_limits(const MovingMechanism& moving, const Latch& latch);
/// The body's frame in the link's, as they are now.
Pose relative_pose(const MovingMechanism& moving, const std::string& link, const std::string& body);

/// The body and all it carries become free in the world, with the motion they have. A lock of the
/// joint that held the body ends with that joint.
/// @throws InvalidArgument for an unknown body or one that is free already
Impact release(MovingMechanism& moving, const std::string& body);
/// The joint stops where it is. @throws InvalidArgument for an unknown joint or one that is fixed
/// or locked already
Impact lock(MovingMechanism& moving, const std::string& joint);
/// The joint can move again, from rest where it was locked, its coordinates as they were.
/// @throws InvalidArgument for a joint that is not locked
Impact unlock(MovingMechanism& moving, const std::string& joint);

}  // namespace porthos::mechanics
