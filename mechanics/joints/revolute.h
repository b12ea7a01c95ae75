#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// One rotation about z. The coordinate is an angle, wrapped by the integrators.
struct Revolute : AxisJoint<2>, PlainCoordinates<1> {
  static constexpr std::string_view name = "revolute";
  static constexpr bool frees_rotation_about_z = true;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::angle, 1, "", "rad", "kg m^2/s", "N m", "rad/s"}};

  template <class T>
  static Screw<T> screw(const Node&, const T*, const Angle<T>& angle) {
    return {angle.cosine, angle.sine, T(0.0)};
  }
};

}  // namespace porthos::mechanics
