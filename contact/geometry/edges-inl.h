#pragma once
#include <array>

#include "contact/geometry/pairs.h"

/// Edges that cross, and corners, of boxes with round edges.
namespace porthos::contact {

/// |v|, not 0 where v is: nothing is divided by 0 there, and elsewhere no bit changes.
template <class T>
T length(const Vec3<T>& v) {
  using phs::sqrt;
  return sqrt(dot(v, v) + T(1e-280));
}
template <class T>
T clamp(const T& x, double most) {
  using phs::max, phs::min;
  return min(max(x, T(-most)), T(most));
}

/// Two balls with centres a, b.
template <class T>
Touch<T> balls(const Vec3<T>& a, double r_a, const Vec3<T>& b, double r_b) {
  const Vec3<T> v = b - a;
  const T distance = length(v), gap = distance - T(r_a + r_b);
  const Vec3<T> n = (T(1.0) / distance) * v;
  return {gap, n, fma(T(r_a) + T(0.5) * gap, n, a)};
}

/// The first of two touches where `first` is, by lanes.
template <class Mask, class T>
Touch<T> pick(const Mask& first, const Touch<T>& a, const Touch<T>& b) {
  using phs::select;
  Touch<T> t{select(first, a.gap, b.gap), a.n, a.at};
  for (int i = 0; i < 3; ++i) {
    t.n[i] = select(first, a.n[i], b.n[i]);
    t.at[i] = select(first, a.at[i], b.at[i]);
  }
  return t;
}
/// The one with the larger, and with the smaller gap.
template <class T>
Touch<T> larger(const Touch<T>& a, const Touch<T>& b) {
  return pick(b.gap < a.gap, a, b);
}
template <class T>
Touch<T> smaller(const Touch<T>& a, const Touch<T>& b) {
  return pick(a.gap < b.gap, a, b);
}

/// A segment of the length 2 half along `axis`, thickened by a radius: a capsule, or an edge of a
/// box between its core's corners.
template <class T>
struct Rod {
  Vec3<T> axis;  ///< unit
  double half, radius;
};
/// Where two rods are nearest, from the middle of the first.
template <class T>
struct Nearest {
  Touch<T> touch;
  T past;  ///< how far beyond an end they would cross, seen along n; < 0: they do; parallel: 1 [m]
};
/// @param d  from the middle of `a` to that of `b` (Ericson 2005, section 5.1.9)
template <class T>
Nearest<T> nearest(const Rod<T>& a, const Rod<T>& b, const Vec3<T>& d) {
  using phs::abs, phs::fma, phs::max, phs::select;
  const Vec3<T>&x = a.axis, &y = b.axis;
  const Vec3<T> c = cross(x, y);
  const T s_of_lines = dot(cross(d, y), c) / (dot(c, c) + T(1e-280));
  T s = clamp(s_of_lines, a.half);
  const T t_of_line = fma(s, dot(x, y), -dot(y, d)), t = clamp(t_of_line, b.half);
  s = clamp(fma(t, dot(x, y), dot(x, d)), a.half);
  const T past = max(abs(s_of_lines) - T(a.half), abs(t_of_line) - T(b.half));
  return {balls(s * x, a.radius, fma(t, y, d), b.radius),
          select(dot(c, c) < T(1e-12), T(1.0), past)};
}

/// The core of a box, within its round edges, at `centre`; or the segment of a capsule.
template <class T>
struct Core {
  std::array<Vec3<T>, 3> axes;
  Vec3<T> centre;
  Vec3d half;
  double radius;

  Core(const Shape& s, const Mat3<T>& R, const Vec3<T>& at)
      : axes{R.x, R.y, R.z}, centre(at), half{0, 0, s.half_length}, radius(s.radius) {
    if (s.kind == Kind::box) half = s.half - Vec3d{s.radius, s.radius, s.radius};
  }
  Vec3<T> corner(unsigned k) const {
    Vec3<T> at = centre;
    for (unsigned i = 0; i < 3; ++i)
      at = fma(T(k >> i & 1U ? half[int(i)] : -half[int(i)]), axes[i], at);
    return at;
  }
};
/// An edge of a core: along axis `along`, at a side of the two other axes.
struct Edge {
  size_t along;
  std::array<double, 3> side;  ///< -1 or 1; 0 along it
  /// Edge k of a box's 12, or the one of a capsule.
  Edge(Kind kind, size_t k) : along(kind == Kind::box ? k / 4 : 2), side{0, 0, 0} {
    if (kind != Kind::box) return;
    side[(along + 1) % 3] = k & 1U ? 1 : -1;
    side[(along + 2) % 3] = k & 2U ? 1 : -1;
  }
  template <class T>
  Vec3<T> middle(const Core<T>& core) const {
    Vec3<T> at = core.centre;
    for (size_t i = 0; i < 3; ++i) at = fma(T(side[i] * core.half[int(i)]), core.axes[i], at);
    return at;
  }
  template <class T>
  Rod<T> rod(const Core<T>& core) const {
    return {core.axes[along], core.half[int(along)], core.radius};
  }
};

/// How far an edge of `other` is from passing through one of the two planes that an edge of `box`
/// has along its faces; < 0: it passes through one, and goes so far on either side. The touch is
/// that of the end that is nearest to the plane.
/// @param sign  -1 if the box is B, so that normals point from A to B; else 1
template <class T>
Touch<T> passing(const Core<T>& box, const Edge& edge, const Core<T>& other, const Edge& through,
                 double sign) {
  const Rod<T> rod = through.rod(other);
  const Vec3<T> middle = through.middle(other);
  const std::array<Vec3<T>, 2> end{fma(T(-rod.half), rod.axis, middle),
                                   fma(T(rod.half), rod.axis, middle)};
  Touch<T> nearest_plane{T(1e300), rod.axis, middle};
  for (size_t i = 0; i < 3; ++i) {
    if (i == edge.along) continue;
    const Vec3<T> out = T(edge.side[i]) * box.axes[i], n = T(sign) * out;
    const T d0 = dot(out, end[0] - box.centre) - T(box.half[int(i)]),
            d1 = dot(out, end[1] - box.centre) - T(box.half[int(i)]);
    const Touch<T> inner = smaller<T>({d0, n, end[0]}, {d1, n, end[1]}),
                   outer = smaller<T>({-d0, -n, end[0]}, {-d1, -n, end[1]});
    nearest_plane = smaller(nearest_plane, larger(inner, outer));
  }
  return nearest_plane;
}

/// Edge a of A and edge b of B, a box.
///
/// The gap is the distance of the edges. Corners have gaps of their own, so it may be more where no
/// edges cross. Ends::off: there it is 1 m more. Ends::fade: a depth is at most how far either edge
/// passes through a plane beside the other, so it goes to 0 where edges become parallel, whose
/// nearest points jump from end to end, and stays continuous.
template <class T>
Touch<T> crossing(const Core<T>& A, const Edge& a, const Core<T>& B, const Edge& b, Ends ends) {
  const Vec3<T> at = a.middle(A);
  auto [touch, past] = nearest(a.rod(A), b.rod(B), b.middle(B) - at);
  touch.at += at;
  if (ends == Ends::off) {
    touch.gap = phs::select(past < T(0.0), touch.gap, touch.gap + T(1.0));
    return touch;
  }
  const auto overlap = touch.gap < T(0.0);
  if (!phs::any(overlap)) return touch;
  Touch<T> limit = passing(B, b, A, a, -1);
  if (a.side != Edge(Kind::capsule, 0).side)  // A has planes too
    limit = smaller(limit, passing(A, a, B, b, 1));
  return pick(overlap, larger(touch, limit), touch);
}

}  // namespace porthos::contact
