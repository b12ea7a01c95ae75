#pragma once
#include <map>
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The soft latches of a scene with events: which are engaged, and the frames in which they hold
/// their body.
class Latching {
 public:
  /// Latches that no event engages are engaged from the start, in the frames of the scene.
  /// @throws InvalidArgument for events that name no soft latch
  explicit Latching(const Scene& scene);

  /// Removes the latches that are not engaged from a phase's scene, and sets the frames of the
  /// others. A latch whose two bodies an event has joined into one is inactive and keeps its energy
  /// until they move again.
  void apply_to(Scene& phase, const mechanics::Mechanism& now) const;

  /// Engages a latch with its body in the current pose, unloaded and without energy; or disengages
  /// it, and the energy of its springs is lost: dissipated_J of the ledger. Nothing moves.
  /// @throws InvalidArgument with file and line: already engaged or not engaged, out of reach,
  /// beyond a limit
  mechanics::Impact change(const Scene& scene, const mechanics::MovingMechanism& moving,
                           const Event& e);

  /// The condition of an event, as a continuous function of time and the mechanism's state that
  /// rises through 0 when the event happens.
  static double margin(const Scene& scene, const mechanics::MovingMechanism& moving,
                       const phs::State& state, double time, const Event& e);

  /// What keeps an event from happening at the mechanism's state: the first limit that it is
  /// beyond, with the numbers. Empty: nothing does.
  static std::string hindrance(const Scene& scene, const mechanics::MovingMechanism& moving,
                               const Event& e);

 private:
  std::map<std::string, mechanics::Pose> engaged_;  ///< on_body, by latch
};

}  // namespace porthos::scene
