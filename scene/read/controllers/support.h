#pragma once
#include <span>
#include <string>

#include "planning/whole_body_law.h"

namespace porthos::scene {

struct Scene;

/// The points on which a [[contact]] of a scene may stand: of spheres the lowest, of boxes
/// the corners of the side that looks down then.
/// @param q      size nq, coordinates at the start
/// @param where  of who asks, for messages
/// @throws InvalidArgument with file and line: no such contact, a soft one, one that is not with
///   flat ground of the world, other shapes
planning::Support support_of(const Scene& scene, const mechanics::Mechanism& m,
                             std::span<const double> q, const std::string& where,
                             const std::string& contact);

}  // namespace porthos::scene
