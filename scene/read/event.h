#pragma once
#include <optional>
#include <string>
#include <vector>

#include "mechanics/reconfiguration.h"

namespace porthos::scene {

class Table;

/// Start of a body that is free in the world: velocity of its origin in the world frame, body
/// rates.
struct BaseStart {
  mechanics::Vec3d position{0, 0, 0}, linear_velocity{0, 0, 0}, angular_velocity{0, 0, 0};
  double attitude_wxyz[4] = {1, 0, 0,
                             0};  ///< unit after reading (a non-unit one is normalised once, here)
  std::string where;
};
/// Reads its keys. @throws InvalidArgument as read_scene()
BaseStart read_base_start(const Table& t);

/// Reads mass, com and inertia about it. @throws InvalidArgument as read_scene()
mechanics::MassProperties read_mass_properties(const Table& t);

/// A body besides the model, free in the world: a [[body]] of the scene.
struct FreeBody {
  std::string name, where;
  mechanics::MassProperties mass;
  BaseStart start;
};

/// A change of the mechanism at a time: an [[event]] of the scene.
struct Event {
  enum class Type { capture, release, lock, unlock, engage, disengage } type;
  double at = 0;           ///< [s]; infinite for one that waits for something
  std::string name;        ///< of the body that is released, the joint, or the soft latch
  mechanics::Latch latch;  ///< of a capture; its limits of an engagement
  /// What an event without a time waits for, at whole steps: a lock for its joint to pass an angle,
  /// a capture or engagement until it is possible.
  std::optional<double> above, below;
  bool within_reach = false;
  double after = 0;  ///< [s]: it does not happen before
  bool waits() const { return above || below || within_reach; }
  std::string where;
};
/// "capture of target by hand", for reports.
std::string text(const Event& e);

/// The tables [[body]]. @throws InvalidArgument as read_scene()
std::vector<FreeBody> read_bodies(const Table& scene);
/// In the order of their times. @throws InvalidArgument as read_scene()
std::vector<Event> read_events(const Table& scene);

/// Changes the mechanism. @throws InvalidArgument of mechanics::capture and its like, with file and
/// line
mechanics::Impact apply(mechanics::MovingMechanism& moving, const Event& e);

}  // namespace porthos::scene
