#pragma once
#include "scene/run/phase_sequence.h"

/// From a mechanism between events to the phase that runs next.
namespace porthos::scene {

/// The event with latches that hold however far and fast they meet.
Event without_limits(Event e);

/// The scene of a phase up to `end`. What acts at locked joints is inactive, and so is a torquer
/// whose wheels are all locked, because there is no momentum to unload.
Scene phase_of(const Scene& scene, const mechanics::MovingMechanism& moving,
               const Latching& latching, double end);
/// Its assembly. @param whole  the assembly before all events
/// @throws InvalidArgument as with_joint_parts() and OrbitApart::put_back()
Assembly assembly_of_phase(const Scene& phase, const Assembly& whole,
                           const mechanics::MovingMechanism& moving, const MotorStates& motors,
                           const OrbitApart& orbit);

/// Changes the mechanism or the latches as an event says.
/// @throws InvalidArgument with file and line for an event that is impossible
mechanics::Impact apply_one(const Scene& scene, const Event& e, mechanics::MovingMechanism& moving,
                            Latching& latching, const OrbitApart& orbit);

}  // namespace porthos::scene
