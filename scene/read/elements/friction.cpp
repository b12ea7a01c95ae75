#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_friction(const Table& t, Element& e) {
  const auto law = phs::friction({.coulomb = t.number("coulomb"),
                                  .breakaway = t.number_or("breakaway", 0),
                                  .stribeck = t.number_or("stribeck", 0),
                                  .viscous = t.number("viscous"),
                                  .smoothing = t.number("smoothing")});
  e.add = SmoothedFriction{law};
}

}  // namespace

void SmoothedFriction::operator()(const Element& e, const JointElement& at) const {
  at.require_freedom(e);
  at.network.resist(e.name, at.place.port, law);
}

ElementType friction_element() {
  using namespace keys;
  return {"friction",
          "Dry friction, smooth at rest.",
          ElementType::Place::joint,
          {number("coulomb", "N m (N)", required, "while it moves"),
           number("breakaway", "N m (N)", "coulomb", "what breaks it loose"),
           number("stribeck", "rad/s (m/s)", "required with breakaway",
                  "rate over which breakaway falls to coulomb"),
           number("viscous", "N m s/rad (N s/m)", "0", "0 or more"),
           number("smoothing", "rad/s (m/s)", required, "over this rate the force turns round")},
          read_friction};
}

}  // namespace porthos::scene
