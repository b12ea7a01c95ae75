#pragma once
#include "scene/read/scene.h"

/// Events that close a loop or coupling of the scene.
namespace porthos::scene {

/// @throws InvalidArgument with file and line for limits of a coupling and a joint without reach
void check_closing(const Scene& scene, const Event& event);

/// The points and limits of a closing: the origins of both frames of a joint or rod.
mechanics::Latch limits_of_closing(const Scene& scene, const Event& event);

/// Closes the loop as the mechanism stands.
/// @throws InvalidArgument with file and line: closed already, out of reach, beyond a limit
mechanics::Impact close(const Scene& scene, mechanics::MovingMechanism& moving, const Event& event);

}  // namespace porthos::scene
