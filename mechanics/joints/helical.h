#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// A screw about z: S = [z; pitch z]. The advance is pitch·(φ + 2π·turns), the rotation is 2π-periodic.
struct Helical : PlainCoordinates<1> {
  static constexpr std::string_view name = "helical";
  static constexpr int nv = 1;
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::angle, 1, "", "rad", "kg m^2/s", "N m", "rad/s"}};

  template <class T>
  static Transform<T> place(const Node& n, const T* q, T turn_angle) {
    const T advance = T(n.pitch) * (q[0] + turn_angle);
    return {turned(n.placement.R, q[0]),
            Vec3<T>(n.placement.r) + advance * Vec3<T>(n.placement.R.z)};
  }
  template <int k, class T>
  static T project(const Node& n, const Force<T>& f) {
    return f.n.z + T(n.pitch) * f.f.z;
  }
  template <int k, class T>
  static void add(const Node& n, T rate, Motion<T>& v) {
    v.w.z = v.w.z + rate, v.v.z = v.v.z + T(n.pitch) * rate;
  }
  template <int k, class T>
  static Force<T> column(const Node& n, const ArticulatedInertia<T>& A) {
    return A.template column<2>() + T(n.pitch) * A.template column<5>();
  }
};

}  // namespace porthos::mechanics
