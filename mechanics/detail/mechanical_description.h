#pragma once
#include <string_view>
#include <vector>

#include "mechanics/mechanical_model.h"

/// The description of a MechanicalModel. Private to mechanical_*.cpp.
namespace porthos::mechanics {

inline constexpr const char* base_storage = "base.kinetic";
/// Whether the node's joint is of this type.
bool is_type(const Node& n, std::string_view name);
/// The frames of body ports, relative to the nodes that contain their links.
std::vector<BodyFrame> port_frames(const Mechanism& m, const std::vector<BodyPort>& ports);

phs::Description describe(const Mechanism& m, const std::vector<BodyFrame>& body_ports,
                          const ConstraintSet* constraints = nullptr);

}  // namespace porthos::mechanics
