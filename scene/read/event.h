#pragma once
#include <optional>
#include <string>
#include <vector>

#include "mechanics/reconfiguration.h"

namespace porthos::scene {

class Table;

/// Start of a body that is free in the world: the velocity of its origin is in the world frame, its
/// angular velocity in the body frame.
struct BaseStart {
  mechanics::Vec3d position{0, 0, 0}, linear_velocity{0, 0, 0}, angular_velocity{0, 0, 0};
  double attitude_wxyz[4] = {1, 0, 0,
                             0};  ///< unit after reading (a non-unit one is normalised once, here)
  std::string where;
};
/// Reads its keys. @throws InvalidArgument as read_scene()
BaseStart read_base_start(const Table& t);

/// Reads mass, com and the inertia about com. @throws InvalidArgument as read_scene()
mechanics::MassProperties read_mass_properties(const Table& t);

/// A body in addition to the model, free in the world: a [[body]] of the scene.
struct FreeBody {
  std::string name, where;
  mechanics::MassProperties mass;
  BaseStart start;
};

/// A change of the mechanism at a given time: an [[event]] of the scene.
struct Event {
  enum class Type { capture, release, lock, unlock, engage, disengage, close, open } type;
  double at = 0;           ///< [s]; infinite for an event that waits for a condition
  std::string name;        ///< of the released body, the joint, the soft latch, or the loop
  mechanics::Latch latch;  ///< of a capture; engagements and closings use only its limits
  /// Condition of an event without a time. A lock waits until its joint passes a value [rad | m], a
  /// capture, an engagement or a closing until its limits hold. It happens at that instant.
  std::optional<double> above, below;
  bool within_reach = false;
  double after = 0;      ///< [s]: the event does not happen before this time
  bool carried = false;  ///< from the run that this one goes on from: it holds at the start
  bool waits() const { return above || below || within_reach; }
  /// Whether it acts on a soft latch; then the mechanism stays as it is.
  bool on_latch() const { return type == Type::engage || type == Type::disengage; }
  /// Whether it acts on a loop or coupling.
  bool on_loop() const { return type == Type::close || type == Type::open; }
  std::string where;
};
/// "capture of target by hand", for reports.
std::string text(const Event& e);

/// The tables [[body]]. @throws InvalidArgument as read_scene()
std::vector<FreeBody> read_bodies(const Table& scene);
/// In the order of their times. @throws InvalidArgument as read_scene()
std::vector<Event> read_events(const Table& scene);

/// Changes the mechanism. @throws InvalidArgument as mechanics::capture and similar functions, with
/// file and line
mechanics::Impact apply(mechanics::MovingMechanism& moving, const Event& e);

}  // namespace porthos::scene
