#pragma once
#include <string>
#include <vector>

#include "mechanics/reconfiguration.h"

namespace porthos::scene {

class Table;

/// Start of a body that is free in the world: velocity of its origin in the world frame, body rates.
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
  enum class Type { capture, release, lock, unlock } type;
  double at = 0;           ///< [s]
  std::string name;        ///< of the body that is released, or the joint
  mechanics::Latch latch;  ///< of a capture
  std::string where;
};
/// "capture of target by hand", for reports.
std::string text(const Event& e);

std::vector<FreeBody> read_bodies(const Table& scene);
/// In the order of their times. @throws InvalidArgument as read_scene()
std::vector<Event> read_events(const Table& scene);

/// Changes the mechanism. @throws InvalidArgument of mechanics::capture and its like, with file and line
mechanics::Impact apply(mechanics::Moving& moving, const Event& e);

}  // namespace porthos::scene
