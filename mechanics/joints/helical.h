#pragma once
#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// A screw about z: S = [z; pitch z]. The advance is pitch·(φ + 2π·turns), the rotation is
/// 2π-periodic.
struct Helical : PlainCoordinates<1> {
  static constexpr std::string_view name = "helical";
  static constexpr int nv = 1;
  static constexpr bool about_z = true;
  static constexpr bool frees_rotation_about_z = false;
  static constexpr std::array blocks{
      CoordinateBlock{phs::BlockKind::angle, 1, "", "rad", "kg m^2/s", "N m", "rad/s"}};

  template <class T>
  static Screw<T> screw(const Node& n, const T* q, const Angle<T>& angle) {
    return {angle.cosine, angle.sine, T(n.pitch) * (q[0] + angle.turns)};
  }
  template <int k, class T>
  static T project(const Node& n, const Force<T>& f) {
    return f.n.z + T(n.pitch) * f.f.z;
  }
  template <int k, class T>
  static void add(const Node& n, T rate, Motion<T>& v) {
    v.w.z = v.w.z + rate;
    v.v.z = v.v.z + T(n.pitch) * rate;
  }
  template <int k, template <class> class Inertia, class T>
  static Force<T> column(const Node& n, const Inertia<T>& A) {
    return A.template column<2>() + T(n.pitch) * A.template column<5>();
  }
  template <int k, class T>
  static void add_cross(const Node& n, const Motion<T>& V, T rate, Motion<T>& a) {
    add_cross_unit<2>(V, rate, a);
    add_cross_unit<5>(V, T(n.pitch) * rate, a);
  }
};

}  // namespace porthos::mechanics
