#pragma once
#include <vector>

#include "scene/read/scene.h"
#include "space/parts.h"

namespace porthos::scene {

/// The parts of a scene that act on the mechanism itself: in free space all of them, in orbit only
/// the soft latches, because thrusters and torquers are kicks of the splitting there.
space::Parts parts_of(const Scene& scene);
/// Thrusters and torquers of a scene in orbit.
space::Parts orbit_parts_of(const Scene& scene);

/// @throws InvalidArgument for a thruster that switches between steps of one size h
void check_switching(const Scene& scene, double h);
/// @throws InvalidArgument if a move of a driven joint begins or ends between steps of one size h
void check_moves(const Scene& scene, const phs::Description& system, double h);
/// The times inside the run at which thrusters switch and moves begin or end [s], in increasing
/// order.
std::vector<double> switches_of(const Scene& scene);
/// The same with the moves of a system that no scene describes.
std::vector<double> instants_of(const Scene& scene, const phs::Description& system);

}  // namespace porthos::scene
