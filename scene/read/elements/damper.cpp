#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_damper(const Table& t, Element& e) {
  e.add = [law = phs::viscous(t.number("damping"))](const Element& own, const JointElement& at) {
    at.network.resist(own.name, at.place.port, law);
  };
}

}  // namespace

ElementType damper_element() {
  using namespace keys;
  return {"damper",
          "Viscous.",
          ElementType::Place::joint,
          {number("damping", "N m s/rad (N s/m)", required, "0 or more")},
          read_damper};
}

}  // namespace porthos::scene
