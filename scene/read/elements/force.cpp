#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_force(const Table& t, Element& e) {
  e.add = [source = read_signal(t, " of N m or N")](const Element& own, const JointElement& at) {
    at.network.source(own.name, at.place.port, source);
  };
}

}  // namespace

ElementType force_element() {
  using namespace keys;
  return {"force", "A torque or force of time.", ElementType::Place::joint, signal_keys("N m (N)"),
          read_force};
}

}  // namespace porthos::scene
