#include "contact/geometry/pairs.h"

#include <array>
#include <cmath>

#include "contact/geometry/edges-inl.h"

namespace porthos::contact {
namespace {

using phs::abs, phs::fma, phs::max, phs::min, phs::select, phs::sqrt;

template <class T>
using Out = std::span<Touch<T>>;

/// The plane through the origin with the normal n, and a ball.
template <class T>
Touch<T> plane_ball(const Vec3<T>& n, const Vec3<T>& centre, double r) {
  const T height = dot(n, centre), gap = height - T(r);
  return {gap, n, fma(T(-r) - T(0.5) * gap, n, centre)};
}
/// A ball at the origin, and a solid at whose surface the distance of the ball's centre is
/// `distance`, along `outward` in the solid's axes.
template <class T>
Touch<T> ball_solid(double r, const T& distance, const Mat3<T>& axes, const Vec3<T>& outward) {
  const T gap = distance - T(r);
  const Vec3<T> n = -(axes * outward);
  return {gap, n, (T(r) + T(0.5) * gap) * n};
}

template <class T>
void plane_sphere(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  out[0] = plane_ball(f.A.z, f.d, b.radius);
}
template <class T>
void plane_capsule(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  out[0] = plane_ball(f.A.z, fma(T(b.half_length), f.B.z, f.d), b.radius);
  out[1] = plane_ball(f.A.z, fma(T(-b.half_length), f.B.z, f.d), b.radius);
}
template <class T>
void plane_box(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  const Vec3d core = b.half - Vec3d{b.radius, b.radius, b.radius};
  for (unsigned k = 0; k < 8; ++k) {
    const auto side = [k](unsigned bit, double x) { return T(k >> bit & 1U ? x : -x); };
    const Vec3<T> corner{side(0, core.x), side(1, core.y), side(2, core.z)};
    out[k] = plane_ball(f.A.z, fma(f.B, corner, f.d), b.radius);
  }
}
/// The lowest point of each rim; for rows also those at 120 degrees from it, on which a cylinder
/// stands flat.
template <class T>
void plane_cylinder(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out, Ends ends) {
  const Vec3<T>&n = f.A.z, &axis = f.B.z;
  Vec3<T> across = fma(-dot(n, axis), axis, n);  // of the rim's plane, upwards
  if (ends == Ends::off) across = fma(T(1e-30), f.B.x, across);
  const Vec3<T> lowest = (T(-b.radius) / length(across)) * across;
  for (const size_t end : {0, 1}) {
    const Vec3<T> middle = fma(T(end == 0 ? b.half_length : -b.half_length), axis, f.d);
    out[end] = plane_ball(n, Vec3<T>(middle + lowest), 0);
    if (ends == Ends::fade) continue;
    const Vec3<T> aside = T(std::sqrt(0.75)) * cross(axis, lowest), up = middle - T(0.5) * lowest;
    out[2 + end] = plane_ball(n, Vec3<T>(up + aside), 0);
    out[4 + end] = plane_ball(n, Vec3<T>(up - aside), 0);
  }
}
template <class T>
void sphere_sphere(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  out[0] = balls({T(0.0), T(0.0), T(0.0)}, a.radius, f.d, b.radius);
}
template <class T>
void sphere_capsule(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  const T along = clamp(-dot(f.d, f.B.z), b.half_length);
  out[0] = balls({T(0.0), T(0.0), T(0.0)}, a.radius, fma(along, f.B.z, f.d), b.radius);
}
template <class T>
void capsule_capsule(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  out[0] =
      nearest<T>({f.A.z, a.half_length, a.radius}, {f.B.z, b.half_length, b.radius}, f.d).touch;
}
template <class T>
void sphere_box(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  const Vec3<T> p = -f.B.tmul(f.d);  // the ball's centre
  Vec3<T> beyond, side, face{T(0.0), T(0.0), T(0.0)};
  T nearest(-1e300);  // of the faces, from inside: negative
  for (int i = 0; i < 3; ++i) {
    const double core = b.half[i] - b.radius;
    const T q = abs(p[i]) - T(core);
    side[i] = select(p[i] < T(0.0), T(-1.0), T(1.0));
    beyond[i] = side[i] * max(q, T(0.0));
    Vec3<T> own{T(0.0), T(0.0), T(0.0)};
    own[i] = side[i];
    for (int k = 0; k < 3; ++k) face[k] = select(q > nearest, own[k], face[k]);
    nearest = max(q, nearest);
  }
  const auto is_outside = nearest > T(0.0);
  const T distance = length(beyond);
  Vec3<T> outward;
  for (int i = 0; i < 3; ++i) outward[i] = select(is_outside, beyond[i] / distance, face[i]);
  const T from_core = select(is_outside, distance, nearest);
  out[0] = ball_solid(a.radius, from_core - T(b.radius), f.B, outward);
}
template <class T>
void sphere_cylinder(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends) {
  const Vec3<T> p = -f.B.tmul(f.d);
  const T rho = sqrt(p.x * p.x + p.y * p.y + T(1e-280));
  const T side = select(p.z < T(0.0), T(-1.0), T(1.0));
  const T q = rho - T(b.radius), h = abs(p.z) - T(b.half_length);
  const T u = max(q, T(0.0)), v = max(h, T(0.0)), distance = sqrt(u * u + v * v + T(1e-280));
  const auto is_outside = max(q, h) > T(0.0);
  const T across = select(is_outside, u / distance, select(q > h, T(1.0), T(0.0)));
  const T along = select(is_outside, v / distance, select(q > h, T(0.0), T(1.0)));
  const Vec3<T> outward{across * (p.x / rho), across * (p.y / rho), side * along};
  out[0] = ball_solid(a.radius, select(is_outside, distance, max(q, h)), f.B, outward);
}

/// A ball of radius r at p, from A's origin, and B, which a ball touches in one point.
template <class T>
Touch<T> ball_at(const Vec3<T>& p, double r, const Shape& b, const Frames<T>& f) {
  Touch<T> touch;
  const Shape ball{.radius = r};
  const Frames<T> from_p{f.A, f.B, f.d - p};
  if (b.kind == Kind::box)
    sphere_box(ball, b, from_p, Out<T>(&touch, 1), Ends::fade);
  else
    sphere_capsule(ball, b, from_p, Out<T>(&touch, 1), Ends::fade);
  touch.at += p;
  return touch;
}
/// A box or capsule and a box: the corners of each, then the edges.
template <class T>
void corners_edges(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out, Ends ends) {
  const Core<T> A(a, f.A, {T(0.0), T(0.0), T(0.0)}), B(b, f.B, f.d);
  const unsigned corners = a.kind == Kind::box ? 8 : 2;
  size_t i = 0;
  for (unsigned k = 0; k < corners; ++k) {
    const unsigned corner = a.kind == Kind::box ? k : 4 * k;
    out[i++] = ball_at(A.corner(corner), a.radius, b, f);
  }
  for (unsigned k = 0; k < 8; ++k) {
    const Vec3<T> p = B.corner(k);
    Touch<T> touch = ball_at(Vec3<T>(p - f.d), b.radius, a, {f.B, f.A, -f.d});
    touch.n = -touch.n;
    touch.at += f.d;
    out[i++] = touch;
  }
  for (size_t k = 0; k < (a.kind == Kind::box ? 12u : 1u); ++k)
    for (size_t l = 0; l < 12; ++l)
      out[i++] = crossing(A, Edge(a.kind, k), B, Edge(b.kind, l), ends);
}

template <class T>
struct Pair {
  Kind a, b;
  int points;
  void (*touch)(const Shape&, const Shape&, const Frames<T>&, Out<T>, Ends);
  int rows = points;  ///< with Ends::off
};
/// Every pair with a closed form.
template <class T>
constexpr std::array<Pair<T>, 11> pairs{{{Kind::plane, Kind::sphere, 1, plane_sphere<T>},
                                         {Kind::plane, Kind::capsule, 2, plane_capsule<T>},
                                         {Kind::plane, Kind::box, 8, plane_box<T>},
                                         {Kind::plane, Kind::cylinder, 2, plane_cylinder<T>, 6},
                                         {Kind::sphere, Kind::sphere, 1, sphere_sphere<T>},
                                         {Kind::sphere, Kind::capsule, 1, sphere_capsule<T>},
                                         {Kind::sphere, Kind::box, 1, sphere_box<T>},
                                         {Kind::sphere, Kind::cylinder, 1, sphere_cylinder<T>},
                                         {Kind::capsule, Kind::capsule, 1, capsule_capsule<T>},
                                         {Kind::capsule, Kind::box, 2 + 8 + 12, corners_edges<T>},
                                         {Kind::box, Kind::box, 8 + 8 + 144, corners_edges<T>}}};

}  // namespace

int points(Kind a, Kind b, Ends ends) {
  for (const auto& p : pairs<double>)
    if ((p.a == a && p.b == b) || (p.a == b && p.b == a))
      return ends == Ends::off ? p.rows : p.points;
  return 0;
}

bool have_edges(Kind a, Kind b) { return points(a, b, Ends::fade) > 8; }

std::string known_pairs() {
  std::string all;
  for (const auto& p : pairs<double>)
    add_to_list(all, std::string(to_string(p.a)) + " and " + to_string(p.b));
  return all;
}

template <class T>
void touches(const Shape& a, const Shape& b, const Frames<T>& f, std::span<Touch<T>> out,
             Ends ends) {
  for (const auto& p : pairs<T>) {
    if (p.a == a.kind && p.b == b.kind) return p.touch(a, b, f, out, ends);
    if (p.a != b.kind || p.b != a.kind) continue;
    p.touch(b, a, {f.B, f.A, -f.d}, out, ends);
    for (auto& touch : out) {
      touch.n = -touch.n;
      touch.at += f.d;
    }
    return;
  }
}

#define PORTHOS_INSTANTIATE(T) \
  template void touches<T>(const Shape&, const Shape&, const Frames<T>&, std::span<Touch<T>>, Ends);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
