#pragma once
#include "mechanics/inertia.h"

/// Screws about a coordinate axis: a rotation about it with a shift along it. Any placement of a
/// joint axis in the frame of the joint before is a screw about x followed by one about z (Denavit,
/// Hartenberg 1955). A transform by a screw is two planar ones, which costs half of a general
/// transform of an articulated inertia (McMillan, Orin 1995, IEEE Trans. Robotics Automation 11).
namespace porthos::mechanics {

/// The pose of a child frame that is turned about the axis and shifted by d along it.
template <class T>
struct Screw {
  T c, s;  ///< cosine and sine of the angle
  T d;     ///< shift [m]

  Screw() = default;
  Screw(T cosine, T sine, T shift) : c(cosine), s(sine), d(shift) {}
  template <class S>
  requires(!std::is_same_v<S, T>) explicit Screw(const Screw<S>& a) : c(a.c), s(a.s), d(a.d) {}

  /// One after the other, about the same axis.
  PORTHOS_INLINE friend Screw operator*(const Screw& a, const Screw& b) {
    return {product_difference(a.c, b.c, a.s, b.s), fma(a.s, b.c, a.c * b.s), a.d + b.d};
  }
};

/// The pose of a screw about z.
template <class T>
Transform<T> pose_about_z(const Screw<T>& x) {
  const T zero(0.0), one(1.0);
  return {{{x.c, x.s, zero}, {-x.s, x.c, zero}, {zero, zero, one}}, {zero, zero, x.d}};
}

/// The constant of a model in the scalar T. A sine and a cosine in double are on the circle to
/// their rounding only; for wider scalars, whose identities hold to more digits, they are put onto
/// it.
template <class T>
PORTHOS_INLINE Screw<T> constant(const Screw<double>& x) {
  if constexpr (phs::is_wide<T>) {
    const T c(x.c), s(x.s), scale = T(1.0) / sqrt(c * c + s * s);
    return {scale * c, scale * s, T(x.d)};
  } else {
    return Screw<T>(x);
  }
}

/// A screw that is a constant of a model.
struct FixedScrew {
  enum class Turn { any, none, right, left };  ///< right: by 90°, left: by -90°

  FixedScrew() = default;
  FixedScrew(const Screw<double>& x)
      : screw(x),
        turn(x.c == 1 && x.s == 0    ? Turn::none
             : x.c == 0 && x.s == 1  ? Turn::right
             : x.c == 0 && x.s == -1 ? Turn::left
                                     : Turn::any) {}
  bool is_identity() const { return turn == Turn::none && screw.d == 0; }

  Screw<double> screw{1, 0, 0};
  Turn turn = Turn::none;
};

/// A turn by k right angles; its sine and cosine are exact, and turning by it costs nothing.
template <int k>
struct RightAngle {};

namespace screw {

/// The components of vectors and matrices for an axis w: u, v, w are x, y, z in cyclic order.
template <int axis>
struct Axes {
  static constexpr int u = (axis + 1) % 3, v = (axis + 2) % 3, w = axis;
};
template <int i, class T>
PORTHOS_INLINE auto& at(T& a) {
  if constexpr (i == 0) return a.x;
  if constexpr (i == 1) return a.y;
  if constexpr (i == 2) return a.z;
}
/// Row i, column j of a symmetric matrix.
template <int i, int j, class T>
PORTHOS_INLINE auto& at(Sym3<T>& a) {
  if constexpr (i > j) return at<j, i>(a);
  if constexpr (i == 0 && j == 0) return a.xx;
  if constexpr (i == 0 && j == 1) return a.xy;
  if constexpr (i == 0 && j == 2) return a.xz;
  if constexpr (i == 1 && j == 1) return a.yy;
  if constexpr (i == 1 && j == 2) return a.yz;
  if constexpr (i == 2 && j == 2) return a.zz;
}
/// Row i, column j of a matrix by its columns.
template <int i, int j, class T>
PORTHOS_INLINE auto& at(Mat3<T>& a) {
  return at<i>(at<j>(a));
}

/// (a, b) turned by the angle: (c a - s b, s a + c b).
template <class T>
PORTHOS_INLINE void plane(const Screw<T>& x, T& a, T& b) {
  const T turned = product_difference(x.c, a, x.s, b);
  b = fma(x.s, a, x.c * b);
  a = turned;
}
template <int k, class T>
PORTHOS_INLINE void plane(RightAngle<k>, T& a, T& b) {
  const T old = a;
  if constexpr (k == 1) {
    a = -b;
    b = old;
  }
  if constexpr (k == -1) {
    a = b;
    b = -old;
  }
}
/// (a, b) turned back.
template <class T>
PORTHOS_INLINE void plane_back(const Screw<T>& x, T& a, T& b) {
  const T turned = fma(x.c, a, x.s * b);
  b = product_difference(x.c, b, x.s, a);
  a = turned;
}
template <int k, class T>
PORTHOS_INLINE void plane_back(RightAngle<k>, T& a, T& b) {
  plane(RightAngle<-k>{}, a, b);
}
/// The 2x2 matrix [a b; e f] in the turned axes. With w = s (a - f) + c (b + e) it is
/// [a - s w, c w - e; c w - b, f + s w], because c² + s² = 1.
template <class T>
PORTHOS_INLINE void plane(const Screw<T>& x, T& a, T& b, T& e, T& f) {
  const T w = fma(x.s, a - f, x.c * (b + e)), old_b = b;
  a = fma(-x.s, w, a);
  b = fma(x.c, w, -e);
  e = fma(x.c, w, -old_b);
  f = fma(x.s, w, f);
}
template <int k, class T>
PORTHOS_INLINE void plane(RightAngle<k>, T& a, T& b, T& e, T& f) {
  if constexpr (k == 0) return;
  const T old_a = a, old_b = b;
  a = f;
  b = -e;
  e = -old_b;
  f = old_a;
}

// turn and shift take what is known in the child's axes to the parent's, turn_back and shift_back
// from the parent's to the child's. X: a Screw or a RightAngle.

template <int axis, class X, class T>
PORTHOS_INLINE void turn(const X& x, Vec3<T>& a) {
  plane(x, at<Axes<axis>::u>(a), at<Axes<axis>::v>(a));
}
template <int axis, class X, class T>
PORTHOS_INLINE void turn_back(const X& x, Vec3<T>& a) {
  plane_back(x, at<Axes<axis>::u>(a), at<Axes<axis>::v>(a));
}
/// Rows and columns u and v of a symmetric matrix.
template <int axis, class X, class T>
PORTHOS_INLINE void turn_block(const X& x, Sym3<T>& a) {
  using A = Axes<axis>;
  T vu = at<A::v, A::u>(a);
  plane(x, at<A::u, A::u>(a), at<A::u, A::v>(a), vu, at<A::v, A::v>(a));
}
template <int axis, class X, class T>
PORTHOS_INLINE void turn(const X& x, Sym3<T>& a) {
  using A = Axes<axis>;
  turn_block<axis>(x, a);
  plane(x, at<A::u, A::w>(a), at<A::v, A::w>(a));
}
/// to += r × a with r = d along the axis.
template <int axis, class T>
PORTHOS_INLINE void shear(const T& d, const Vec3<T>& a, Vec3<T>& to) {
  using A = Axes<axis>;
  at<A::u>(to) = fma(-d, at<A::v>(a), at<A::u>(to));
  at<A::v>(to) = fma(d, at<A::u>(a), at<A::v>(to));
}

template <int axis, class X, class T>
PORTHOS_INLINE void turn_back(const X& x, Motion<T>& m) {
  turn_back<axis>(x, m.w);
  turn_back<axis>(x, m.v);
}
template <int axis, class T>
PORTHOS_INLINE void shift_back(const T& d, Motion<T>& m) {
  shear<axis>(-d, m.w, m.v);
}

template <int axis, class X, class T>
PORTHOS_INLINE void turn(const X& x, Force<T>& g) {
  turn<axis>(x, g.n);
  turn<axis>(x, g.f);
}
template <int axis, class T>
PORTHOS_INLINE void shift(const T& d, Force<T>& g) {
  shear<axis>(d, g.f, g.n);
}

/// The first moment m·c and the mass of a body.
template <class T>
struct Moment {
  Vec3<T> mc;
  T m;
};
template <int axis, class X, class T>
PORTHOS_INLINE void turn(const X& x, Moment<T>& a) {
  turn<axis>(x, a.mc);
}
template <int axis, class T>
PORTHOS_INLINE void shift(const T& d, Moment<T>& a) {
  at<axis>(a.mc) = fma(a.m, d, at<axis>(a.mc));
}

template <int axis, class X, class T>
PORTHOS_INLINE void turn(const X& x, RigidInertia<T>& a) {
  turn<axis>(x, a.I);
  turn<axis>(x, a.mc);
}
template <int axis, class T>
PORTHOS_INLINE void shift(const T& d, RigidInertia<T>& a) {
  using A = Axes<axis>;
  const T before = at<A::w>(a.mc);
  at<A::w>(a.mc) = fma(a.m, d, before);
  const T both = before + at<A::w>(a.mc);
  at<A::u, A::u>(a.I) = fma(d, both, at<A::u, A::u>(a.I));
  at<A::v, A::v>(a.I) = fma(d, both, at<A::v, A::v>(a.I));
  at<A::u, A::w>(a.I) = fma(-d, at<A::u>(a.mc), at<A::u, A::w>(a.I));
  at<A::v, A::w>(a.I) = fma(-d, at<A::v>(a.mc), at<A::v, A::w>(a.I));
}

/// `free`: the row and column of rotation about the axis are not read and not written.
template <int axis, bool free = false, class X, class T>
PORTHOS_INLINE void turn(const X& x, ArticulatedInertia<T>& a) {
  using A = Axes<axis>;
  constexpr int u = A::u, v = A::v, w = A::w;
  turn<axis>(x, a.M);
  Mat3<T>& H = a.H;
  plane(x, at<u, u>(H), at<u, v>(H), at<v, u>(H), at<v, v>(H));
  plane(x, at<u, w>(H), at<v, w>(H));
  if constexpr (!free) {
    turn<axis>(x, a.I);
    plane(x, at<w, u>(H), at<w, v>(H));
  } else {
    turn_block<axis>(x, a.I);
  }
}
/// H' = H + r×M and I' = I - H r× + r× H'ᵀ with r = d along the axis.
template <int axis, bool free = false, class T>
PORTHOS_INLINE void shift(const T& d, ArticulatedInertia<T>& a) {
  using A = Axes<axis>;
  constexpr int u = A::u, v = A::v, w = A::w;
  Sym3<T>& I = a.I;
  Mat3<T>& H = a.H;
  const T uu = at<u, u>(H), uv = at<u, v>(H), vu = at<v, u>(H);
  const Mat3<T> m = a.M.full();
  shear<axis>(d, m.x, H.x);
  shear<axis>(d, m.y, H.y);
  shear<axis>(d, m.z, H.z);
  at<u, u>(I) = fma(-d, uv + at<u, v>(H), at<u, u>(I));
  at<u, v>(I) = fma(d, uu - at<v, v>(H), at<u, v>(I));
  at<v, v>(I) = fma(d, vu + at<v, u>(H), at<v, v>(I));
  if constexpr (!free) {
    at<u, w>(I) = fma(-d, at<w, v>(H), at<u, w>(I));
    at<v, w>(I) = fma(d, at<w, u>(H), at<v, w>(I));
  }
}
/// Sets the row and column of rotation about z to zero.
template <class T>
PORTHOS_INLINE void clear_about_z(ArticulatedInertia<T>& a) {
  const T zero(0.0);
  a.I.xz = a.I.yz = a.I.zz = a.H.x.z = a.H.y.z = a.H.z.z = zero;
}

}  // namespace screw
}  // namespace porthos::mechanics
