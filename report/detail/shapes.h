#pragma once
#include "mechanics/builder.h"
#include "report/detail/series.h"

namespace porthos::report {

/// The shapes that represent each body, in its own frame: the box of equal mass and inertia, and
/// the primitive shapes of a URDF's <visual> (or <collision>), if it has any.
/// @param bodies  as the mechanism was built;  urdf  text of the model, may be empty
/// @return array of {name, parent, joint, mass, com, box: {size, p, q}, visuals: [{kind, size, p,
///   q, colour}], joints: [[x, y, z], …]}, a place and quaternion (w, x, y, z) each; joints: where
///   the body carries others
Json shapes_of(const std::vector<mechanics::BodySpec>& bodies, const std::string& urdf);

}  // namespace porthos::report
