#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_damper(const Table& t, Element& e) {
  const double damping = t.number("damping");
  e.add = [damping, law = phs::viscous(damping)](const Element& own, const JointElement& at) {
    const JointPlace& place = at.place;
    if (place.size == 1) {
      at.network.resist(own.name, place.port, law);
      return;
    }
    phs::Matrix D(place.port_size, place.port_size);  // isotropic, on the rates of the coordinate
    for (int k = place.first; k < place.first + place.size; ++k) D(k, k) = damping;
    at.network.resist(own.name, {place.port}, D);
  };
}

}  // namespace

ElementType damper_element() {
  using namespace keys;
  return {"damper",
          "Viscous, at one degree of freedom or at all those of a ball joint, an attitude or a "
          "position.",
          ElementType::Place::joint,
          {number("damping", "N m s/rad (N s/m)", required, "0 or more")},
          read_damper};
}

}  // namespace porthos::scene
