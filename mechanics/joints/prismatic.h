#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// One translation along z.
struct Prismatic : AxisJoint<5>, PlainCoordinates<1> {
  static constexpr std::string_view name = "prismatic";
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::linear, 1, "", "m", "kg m/s", "N", "m/s"}};

  template <class T>
  static Screw<T> screw(const Node&, const T* q, const Angle<T>&) {
    return {T(1.0), T(0.0), q[0]};
  }
};

}  // namespace porthos::mechanics
