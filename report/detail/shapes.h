#pragma once
#include <map>
#include <string>
#include <vector>

#include "contact/geometry/shape.h"
#include "mechanics/builder.h"
#include "report/detail/mesh_shelf.h"

namespace porthos::report {

/// The shapes that represent each body, in its own frame: the box of equal mass and inertia, and
/// the shapes of a URDF's <visual> (or <collision>), if it has any that can be shown, else that of
/// a contact.
/// @param bodies  as the mechanism was built;  urdf  text of the model, may be empty;  touching
///   the shapes that contacts state, by link;  meshes  gets those that it names
/// @return array of {name, parent, joint, mass, com, box: {size, p, q}, visuals: [{kind, size, p,
///   q, colour, mesh}], joints: [[x, y, z], …]}, a place and quaternion (w, x, y, z) each; joints:
///   where the body carries others
Json shapes_of(const std::vector<mechanics::BodySpec>& bodies, const std::string& urdf,
               const std::map<std::string, contact::Shape>& touching, MeshShelf& meshes);

}  // namespace porthos::report
