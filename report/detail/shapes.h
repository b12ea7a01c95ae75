#pragma once
#include <map>
#include <string>
#include <vector>

#include "contact/geometry/shape.h"
#include "mechanics/builder.h"
#include "report/detail/mesh_shelf.h"

namespace porthos::report {

/// The shape of a contact as {kind, size, p, q}: size is the sides of a box, {radius} of a sphere,
/// {radius, length} of a capsule or cylinder, of a plane {}.
Json drawn(const contact::Shape& shape);

/// The shapes that represent each body, in its own frame: those of a URDF's <visual> (or
/// <collision>) that can be shown, those of its contacts, and the box of equal mass and inertia,
/// made smaller where that is larger than the body can be.
/// @param bodies  as the mechanism was built;  urdf  text of the model, may be empty;  touching
///   the shapes that contacts state, by link;  meshes  gets those that it names
/// @return array of {name, parent, joint, mass, com, box: {size, p, q}, visuals: [{kind, size, p,
///   q, colour, mesh}], contacts: [{kind, size, p, q}], joints: [[x, y, z], …]}, a place and
///   quaternion (w, x, y, z) each; box is null where a contact's shape stands for the whole body;
///   contacts: no planes, and none that is a visual too; joints: where the body carries others
Json shapes_of(const std::vector<mechanics::BodySpec>& bodies, const std::string& urdf,
               const std::map<std::string, std::vector<contact::Shape>>& touching,
               MeshShelf& meshes);

}  // namespace porthos::report
