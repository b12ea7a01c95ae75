#pragma once
#include <string>
#include <vector>

#include "contact/geometry/shape.h"

namespace porthos::contact {

/// The <collision> shapes of a link in a URDF file: sphere, box, cylinder and capsule.
/// @param text  of the file; `file` names it in messages
/// @throws InvalidArgument "file:line: ..." for a link without <collision>, a mesh, and numbers
///   that are missing or out of range
std::vector<Shape> urdf_shapes(const std::string& text, const std::string& file,
                               const std::string& link);

}  // namespace porthos::contact
