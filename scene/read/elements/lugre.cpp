#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_lugre(const Table& t, Element& e) {
  const phs::LuGre law{.coulomb = t.number("coulomb"),
                       .breakaway = t.number_or("breakaway", 0),
                       .stribeck = t.number_or("stribeck", 0),
                       .viscous = t.number("viscous"),
                       .bristle_stiffness = t.number("bristle_stiffness"),
                       .bristle_damping = t.number("bristle_damping")};
  phs::check(law);
  e.add = [law](const Element& own, const JointElement& at) {
    at.require_freedom(own);
    at.network.lugre(own.name, at.place.port, law);
  };
}

}  // namespace

ElementType lugre_element() {
  using namespace keys;
  return {"lugre",
          "Dry friction by a bristle that bends before it slips (LuGre).",
          ElementType::Place::joint,
          {number("coulomb", "N m (N)", required, "while it slides fast, more than 0"),
           number("breakaway", "N m (N)", "coulomb", "while it slides slowly, coulomb or more"),
           number("stribeck", "rad/s (m/s)", "required with breakaway",
                  "rate over which breakaway falls to coulomb"),
           number("viscous", "N m s/rad (N s/m)", "0",
                  "bristle_damping · (breakaway - coulomb) / coulomb or more"),
           number("bristle_stiffness", "N m/rad (N/m)", required, "of the bend, more than 0"),
           number("bristle_damping", "N m s/rad (N s/m)", "0", "of the bend, 0 or more")},
          read_lugre};
}

}  // namespace porthos::scene
