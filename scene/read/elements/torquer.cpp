#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_torquer(const Table& t, Element& e) {
  space::Torquer x;
  x.name = e.name;
  x.direction = t.direction("direction");
  if (t.has("limit")) x.limit = t.positive("limit");
  const bool unloads = t.has("unload");
  for (const char* key : {"constant", "sine", "profile", "file"})
    if (unloads && t.has(key)) t.fail(key, "is given with unload, expected one of both");
  if (unloads)
    x.unload = t.positive("unload");
  else if (t.has("wheels"))
    t.fail("wheels", "are given without unload, expected both or neither");
  else
    x.dipole = read_signal(t, " of A m^2");
  if (t.has("wheels")) x.wheels = t.texts("wheels", "names of joints");
  e.torquer = x;
}

}  // namespace

ElementType torquer_element() {
  using namespace keys;
  return {
      "torquer", "A magnetic rod on the base.", ElementType::Place::link,
      joined({numbers("direction", 3, "1", required, "in the base's axes")},
             joined(signal_keys("A m²"),
                    {number("unload", "1/s", "none", "instead of a signal: it unloads the wheels"),
                     {"wheels", KeyKind::texts, "", "those of the elements",
                      "joints of the wheels it unloads"},
                     number("limit", "A m²", "none", "smooth")})),
      read_torquer};
}

}  // namespace porthos::scene
