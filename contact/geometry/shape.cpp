#include "contact/geometry/shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace porthos::contact {

const char* to_string(Kind kind) {
  switch (kind) {
    case Kind::plane:
      return "plane";
    case Kind::sphere:
      return "sphere";
    case Kind::capsule:
      return "capsule";
    case Kind::box:
      return "box";
    case Kind::cylinder:
      return "cylinder";
  }
  return "unknown";
}

double Shape::reach() const {
  switch (kind) {
    case Kind::plane:
      break;
    case Kind::sphere:
      return radius;
    case Kind::capsule:
      return half_length + radius;
    case Kind::cylinder:
      return std::hypot(half_length, radius);
    case Kind::box:
      return norm(half);
  }
  return HUGE_VAL;
}

bool Shape::operator==(const Shape& s) const {
  const auto same = [](const Vec3d& a, const Vec3d& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  };
  return kind == s.kind && radius == s.radius && half_length == s.half_length &&
         same(half, s.half) && same(pose.r, s.pose.r) && same(pose.R.x, s.pose.R.x) &&
         same(pose.R.y, s.pose.R.y) && same(pose.R.z, s.pose.R.z);
}

void check(const Shape& s) {
  const auto positive = [&](const char* what, double x) {
    if (!(x > 0) || !std::isfinite(x))
      throw InvalidArgument(fmt::format("the {} of a {} is {} m, expected a number above 0", what,
                                        to_string(s.kind), x));
  };
  switch (s.kind) {
    case Kind::plane:
      return;
    case Kind::sphere:
      return positive("radius", s.radius);
    case Kind::capsule:
    case Kind::cylinder:
      positive("radius", s.radius);
      return positive("length", s.half_length);
    case Kind::box: {
      for (int i = 0; i < 3; ++i) positive("side", s.half[i]);
      const double most = std::min({s.half.x, s.half.y, s.half.z});
      if (!(s.radius >= 0) || s.radius > most)
        throw InvalidArgument(fmt::format(
            "the edges of a box have the radius {} m, expected 0 to half its shortest side, {} m",
            s.radius, most));
    }
  }
}

}  // namespace porthos::contact
