// What a Mechanism finds by name.
#include "mechanics/mechanism.h"

namespace porthos::mechanics {

namespace {
template <class Items, class Name>
auto& find_named(const Items& items, std::string_view name, const char* what, Name get) {
  std::string known;
  for (const auto& i : items) {
    if (get(i) == name) return i;
    known += (known.empty() ? "" : ", ") + get(i);
  }
  throw InvalidArgument("there is no " + std::string(what) + " '" + std::string(name) +
                        "'; known: " + known);
}
}  // namespace

const JointCoordinates& Mechanism::coordinate(std::string_view name) const {
  return find_named(coordinates_, name, "joint coordinate", [](const auto& c) { return c.name; });
}
const BodyFrame& Mechanism::body(std::string_view name) const {
  return find_named(bodies_, name, "body", [](const auto& b) { return b.name; });
}

std::vector<double> Mechanism::neutral() const {
  std::vector<double> q(size_t(nq_), 0.0);
  for (const auto& c : coordinates_)
    if (c.kind == phs::BlockKind::rotation) q[size_t(c.q)] = 1;
  return q;
}

}  // namespace porthos::mechanics
