#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_spring(const Table& t, Element& e) {
  const auto add = [&](phs::Potential potential) {
    e.add = [potential](const Element& own, const JointElement& at) {
      at.network.potential(own.name, at.place.coordinate, potential);
    };
  };
  if (!t.has("elongation") && !t.has("force"))
    return add(phs::spring(t.number("stiffness"), t.number("rest"), t.number("cubic")));
  for (const char* key : {"stiffness", "rest", "cubic"})
    if (t.has(key)) t.fail(key, "is given with a table of forces, expected one of both");
  add(phs::tabulated_spring(t.list("elongation"), t.list("force")));
}

}  // namespace

ElementType spring_element() {
  using namespace keys;
  return {"spring",
          "An elastic energy.",
          ElementType::Place::joint,
          {number("stiffness", "N m/rad (N/m)", "required, or a table", "0 or more"),
           number("rest", "rad (m)", "0", "where it is slack"),
           number("cubic", "N m/rad³ (N/m³)", "0", "0 or more"),
           list("elongation", "rad (m)", "none", "instead: a measured table"),
           list("force", "N m (N)", "none", "its other column")},
          read_spring};
}

}  // namespace porthos::scene
