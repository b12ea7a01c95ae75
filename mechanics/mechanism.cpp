// Look-up by name in a Mechanism.
#include "mechanics/mechanism.h"

namespace porthos::mechanics {

const JointCoordinates& Mechanism::coordinate(std::string_view name) const {
  return find_named(coordinates_, name, "there is no joint coordinate");
}
const BodyFrame& Mechanism::body(std::string_view name) const {
  return find_named(bodies_, name, "there is no body");
}

std::vector<double> Mechanism::neutral() const {
  std::vector<double> q(size_t(nq_), 0.0);
  for (const auto& c : coordinates_)
    if (c.kind == phs::BlockKind::rotation) q[size_t(c.q)] = 1;
  return q;
}

}  // namespace porthos::mechanics
