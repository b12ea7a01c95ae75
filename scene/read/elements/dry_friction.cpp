#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_dry_friction(const Table& t, Element& e) {
  e.dry = {e.name,
           e.joint,
           t.positive("coulomb"),
           t.has("breakaway") ? t.positive("breakaway") : 0,
           t.not_negative("stribeck"),
           t.not_negative("viscous")};
  contact::check(*e.dry);
}

}  // namespace

ElementType dry_friction_element() {
  using namespace keys;
  return {"dry_friction",
          "Dry friction that sticks at rest.",
          ElementType::Place::joint,
          {number("coulomb", "N m (N)", required, "while it slides, more than 0"),
           number("breakaway", "N m (N)", "coulomb", "holds it at rest, coulomb or more"),
           number("stribeck", "rad/s (m/s)", "0",
                  "rate over which breakaway falls to coulomb; 0: at once"),
           number("viscous", "N m s/rad (N s/m)", "0", "0 or more")},
          read_dry_friction};
}

}  // namespace porthos::scene
