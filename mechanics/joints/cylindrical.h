#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// Rotation about and translation along z; q = (angle, displacement).
struct Cylindrical : AxisJoint<2, 5>, PlainCoordinates<2> {
  static constexpr std::string_view name = "cylindrical";
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::angle, 1, ".angle", "rad", "kg m^2/s", "N m", "rad/s"},
      CoordinateBlock{phs::BlockKind::linear, 1, ".slide", "m", "kg m/s", "N", "m/s"}};

  template <class T>
  static Screw<T> screw(const Node&, const T* q, const Angle<T>& angle) {
    return {angle.cosine, angle.sine, q[1]};
  }
};

}  // namespace porthos::mechanics
