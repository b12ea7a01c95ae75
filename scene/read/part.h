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

/// The elements of a scene that act on bodies instead of joints: thruster, torquer, soft_latch
/// (docs/space.md).
bool is_part(std::string_view type);
/// Their keys, besides type and name.
std::vector<std::string_view> part_keys(std::string_view type);
/// @throws InvalidArgument as read_scene()
void read_part(const Table& t, Element& e);

/// Reads the [[panel]] tables. @throws InvalidArgument as read_scene()
std::vector<mechanics::Panel> read_panels(const Table& scene);

}  // namespace porthos::scene
