#include "contact/geometry/pairs.h"

#include <array>

namespace porthos::contact {
namespace {

using phs::abs, phs::fma, phs::max, phs::min, phs::select, phs::sqrt;

template <class T>
using Out = std::span<Touch<T>>;

/// |v|, not 0 where v is: nothing is divided by 0 there, and elsewhere no bit changes.
template <class T>
T length(const Vec3<T>& v) {
  return sqrt(dot(v, v) + T(1e-280));
}
template <class T>
T clamp(const T& x, double most) {
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
void plane_sphere(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out) {
  out[0] = plane_ball(f.A.z, f.d, b.radius);
}
template <class T>
void plane_capsule(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out) {
  out[0] = plane_ball(f.A.z, fma(T(b.half_length), f.B.z, f.d), b.radius);
  out[1] = plane_ball(f.A.z, fma(T(-b.half_length), f.B.z, f.d), b.radius);
}
template <class T>
void plane_box(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out) {
  const Vec3d core = b.half - Vec3d{b.radius, b.radius, b.radius};
  for (unsigned k = 0; k < 8; ++k) {
    const auto side = [k](unsigned bit, double x) { return T(k >> bit & 1U ? x : -x); };
    const Vec3<T> corner{side(0, core.x), side(1, core.y), side(2, core.z)};
    out[k] = plane_ball(f.A.z, fma(f.B, corner, f.d), b.radius);
  }
}
/// The lowest point of each rim.
template <class T>
void plane_cylinder(const Shape&, const Shape& b, const Frames<T>& f, Out<T> out) {
  const Vec3<T>&n = f.A.z, &axis = f.B.z;
  const Vec3<T> across = fma(-dot(n, axis), axis, n);  // of the rim's plane, upwards
  const Vec3<T> lowest = (T(-b.radius) / length(across)) * across;
  for (const int end : {0, 1}) {
    const double l = end == 0 ? b.half_length : -b.half_length;
    out[size_t(end)] = plane_ball(n, fma(T(l), axis, f.d) + lowest, 0);
  }
}
template <class T>
void sphere_sphere(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out) {
  out[0] = balls({T(0.0), T(0.0), T(0.0)}, a.radius, f.d, b.radius);
}
template <class T>
void sphere_capsule(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out) {
  const T along = clamp(-dot(f.d, f.B.z), b.half_length);
  out[0] = balls({T(0.0), T(0.0), T(0.0)}, a.radius, fma(along, f.B.z, f.d), b.radius);
}
/// The nearest points of two segments, s along A and t along B (Ericson 2005, section 5.1.9).
template <class T>
void capsule_capsule(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out) {
  const Vec3<T>&x = f.A.z, &y = f.B.z, &d = f.d;
  const Vec3<T> c = cross(x, y);
  T s = clamp(dot(cross(d, y), c) / (dot(c, c) + T(1e-280)), a.half_length);
  const T t = clamp(fma(s, dot(x, y), -dot(y, d)), b.half_length);
  s = clamp(fma(t, dot(x, y), dot(x, d)), a.half_length);
  out[0] = balls(s * x, a.radius, fma(t, y, d), b.radius);
}
template <class T>
void sphere_box(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out) {
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
void sphere_cylinder(const Shape& a, const Shape& b, const Frames<T>& f, Out<T> out) {
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

template <class T>
struct Pair {
  Kind a, b;
  int points;
  void (*touch)(const Shape&, const Shape&, const Frames<T>&, Out<T>);
};
/// Every pair with a closed form.
template <class T>
constexpr std::array<Pair<T>, 9> pairs{{{Kind::plane, Kind::sphere, 1, plane_sphere<T>},
                                        {Kind::plane, Kind::capsule, 2, plane_capsule<T>},
                                        {Kind::plane, Kind::box, 8, plane_box<T>},
                                        {Kind::plane, Kind::cylinder, 2, plane_cylinder<T>},
                                        {Kind::sphere, Kind::sphere, 1, sphere_sphere<T>},
                                        {Kind::sphere, Kind::capsule, 1, sphere_capsule<T>},
                                        {Kind::sphere, Kind::box, 1, sphere_box<T>},
                                        {Kind::sphere, Kind::cylinder, 1, sphere_cylinder<T>},
                                        {Kind::capsule, Kind::capsule, 1, capsule_capsule<T>}}};

}  // namespace

int points(Kind a, Kind b) {
  for (const auto& p : pairs<double>)
    if ((p.a == a && p.b == b) || (p.a == b && p.b == a)) return p.points;
  return 0;
}

std::string known_pairs() {
  std::string all;
  for (const auto& p : pairs<double>)
    add_to_list(all, std::string(to_string(p.a)) + " and " + to_string(p.b));
  return all;
}

template <class T>
void touches(const Shape& a, const Shape& b, const Frames<T>& f, std::span<Touch<T>> out) {
  for (const auto& p : pairs<T>) {
    if (p.a == a.kind && p.b == b.kind) return p.touch(a, b, f, out);
    if (p.a != b.kind || p.b != a.kind) continue;
    p.touch(b, a, {f.B, f.A, -f.d}, out);
    for (auto& touch : out) {
      touch.n = -touch.n;
      touch.at += f.d;
    }
    return;
  }
}

#define PORTHOS_INSTANTIATE(T) \
  template void touches<T>(const Shape&, const Shape&, const Frames<T>&, std::span<Touch<T>>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
