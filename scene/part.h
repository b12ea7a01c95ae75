#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mechanics/panel.h"
#include "space/parts.h"

namespace porthos::scene {

class Table;
struct Element;
struct Scene;

/// The elements of a scene that act on bodies instead of joints: thruster, torquer, soft_latch (docs/space.md).
bool is_part(std::string_view type);
/// Their keys, besides type and name.
std::vector<std::string_view> part_keys(std::string_view type);
/// @throws InvalidArgument as read_scene()
void read_part(const Table& t, Element& e);

/// Reads the [[panel]] tables. @throws InvalidArgument as read_scene()
std::vector<mechanics::Panel> read_panels(const Table& scene);

/// The parts of a scene that act on the mechanism itself: all of them in free space, the soft latches alone in orbit, where
/// thrusters and torquers are kicks of the splitting.
space::Parts parts_of(const Scene& scene);
/// Thrusters and torquers of a scene in orbit.
space::Parts orbit_parts_of(const Scene& scene);

/// @throws InvalidArgument for a thruster that switches between steps of one size h
void check_switching(const Scene& scene, double h);
/// When thrusters switch after the start [s], in rising order.
std::vector<double> switches_of(const Scene& scene);

}  // namespace porthos::scene
