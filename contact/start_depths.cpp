#include <algorithm>

#include "contact/detail/gaps.h"

namespace porthos::contact {
namespace {

/// Half of the least extent of a shape, without end of a plane [m].
double half_size(const Shape& s) {
  switch (s.kind) {
    case Kind::plane:
      return std::numeric_limits<double>::infinity();
    case Kind::box:
      return std::min({s.half.x, s.half.y, s.half.z});
    case Kind::cylinder:
      return std::min(s.radius, s.half_length);
    case Kind::sphere:
    case Kind::capsule:
      break;
  }
  return s.radius;
}

}  // namespace

std::vector<ContactModel::Depth> ContactModel::soft_depths(const phs::State& state) const {
  Gaps<double> gaps(mechanism(), placed_);
  gaps.place_bodies(state);
  gaps.place_pairs();
  std::vector<Depth> depths(contacts_.size());
  for (const Pair& p : placed_.pairs)
    for (size_t i = p.first; i < p.first + p.points; ++i) {
      Depth& own = depths[p.contact];
      const double depth = -gaps.touch[i].gap;
      own.energy += elastic_energy(contacts_[p.contact].law, depth);
      if (!(depth > own.depth)) continue;
      own.depth = depth;
      own.half_size =
          std::min(half_size(placed_.seats[p.a].shape), half_size(placed_.seats[p.b].shape));
    }
  return depths;
}

}  // namespace porthos::contact
