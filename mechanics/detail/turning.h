#pragma once
#include <string>
#include <vector>

#include "mechanics/detail/instant.h"

/// Trees that are hung on another link than their root. Private to reconfiguration*.cpp.
namespace porthos::mechanics {

/// The name of a body's joint.
inline std::string joint_of(const BodySpec& b) {
  return b.joint.name.empty() ? b.name : b.joint.name;
}
/// @throws InvalidArgument beginning with `what`
inline BodySpec& body_of(MechanismBuilder& parts, const std::string& name, const char* what) {
  return find_named(parts.bodies(), name, std::string(what) + ": there is no body");
}

/// The bodies from the root of a tree to a body of it.
std::vector<BodySpec> way_to(const MechanismBuilder& parts, const std::string& body);

/// Turns the way round: each of its bodies hangs on the next one. The last one is left on its old
/// parent, to be hung elsewhere.
/// @throws InvalidArgument for a joint that has no axis of its own: universal, planar, ball, free
void turn_round(MechanismBuilder& parts, const std::vector<BodySpec>& way);

/// Puts the bodies of the way back as they were. Joints that were locked since then stay locked in
/// their present position.
void turn_back(MechanismBuilder& parts, const std::vector<BodySpec>& way, const Instant& now,
               LockedJoints& locked);

}  // namespace porthos::mechanics
