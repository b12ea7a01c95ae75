#pragma once
#include "mechanics/mechanism.h"

/// Shapes of bodies, for contact.
namespace porthos::contact {

using mechanics::Mat3;
using mechanics::Pose;
using mechanics::Transform;
using mechanics::Vec3;
using mechanics::Vec3d;

/// plane: the half-space z <= 0 of its frame is solid. The axis of a capsule or a cylinder is z.
enum class Kind { plane, sphere, capsule, box, cylinder };
/// Its name in scenes and messages.
const char* to_string(Kind kind);

/// A shape fixed to a link. The frame's origin is its centre; for a plane, a point of it.
struct Shape {
  Kind kind = Kind::sphere;
  Pose pose{Mat3<double>::identity(), {0, 0, 0}};  ///< in the link's frame
  double radius = 0;       ///< [m] of a sphere, capsule or cylinder; of the edges of a box, >= 0
  double half_length = 0;  ///< [m] of the axis of a capsule (without its caps) or cylinder
  Vec3d half{0, 0, 0};     ///< [m] half the sides of a box, with its rounded edges

  /// Of the ball about its frame's origin that holds it [m]; infinite for a plane.
  double reach() const;
  bool operator==(const Shape&) const;
};

/// @throws InvalidArgument for a size that is not finite and positive, or edges of a box that are
///   rounder than its shortest side allows
void check(const Shape& shape);

}  // namespace porthos::contact
