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
