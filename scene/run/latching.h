#pragma once
#include <map>
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The soft latches of a scene with events: which are engaged, and how they hold their body.
class Latching {
 public:
  /// Latches that no event engages hold from the start, as the scene gives their frames.
  /// @throws InvalidArgument for events that name no soft latch
  explicit Latching(const Scene& scene);

  /// Takes the latches that are not engaged out of a phase's scene, and gives the others their
  /// frames. One whose two bodies an event has made one rests, with the energy it has, until they
  /// move again.
  void apply_to(Scene& phase, const mechanics::Mechanism& now) const;

  /// The latch takes hold of its body as it is: at rest there, without any energy. Or it lets go,
  /// and what its springs hold is lost: dissipated_J of the ledger. Nothing moves.
  /// @throws InvalidArgument with file and line: engaged already or not at all, out of reach,
  ///   beyond a limit
  mechanics::Impact change(const Scene& scene, const mechanics::MovingMechanism& moving,
                           const Event& e);

  /// What an event waits for, as a function of time and the mechanism's state that is continuous
  /// and rises through 0 where it happens.
  static double margin(const Scene& scene, const mechanics::MovingMechanism& moving,
                       const phs::State& state, double time, const Event& e);

 private:
  std::map<std::string, mechanics::Pose> engaged_;  ///< on_body, by latch
};

}  // namespace porthos::scene
