// Look-up by name in a Mechanism.
#include "mechanics/mechanism.h"

#include <algorithm>

namespace porthos::mechanics {

const JointCoordinates& Mechanism::coordinate(std::string_view name) const {
  return find_named(coordinates_, name, "there is no joint coordinate");
}
const BodyFrame& Mechanism::body(std::string_view name) const {
  const bool known = std::any_of(bodies_.begin(), bodies_.end(),
                                 [&](const BodyFrame& b) { return b.name == name; });
  if (name == "base" && !known && !bodies_.empty())
    throw InvalidArgument("there is no body 'base', the root link is '" + bodies_[0].name + "'");
  return find_named(bodies_, name, "there is no body");
}

std::vector<double> Mechanism::neutral() const {
  std::vector<double> q(size_t(nq_), 0.0);
  for (const auto& c : coordinates_)
    if (c.kind == phs::BlockKind::rotation) q[size_t(c.q)] = 1;
  return q;
}

}  // namespace porthos::mechanics
