#include <fmt/format.h>

#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"

// clang-format off
#define PORTHOS_ELEMENTS(X) \
  X(spring) \
  X(damper) \
  X(friction) \
  X(dry_friction) \
  X(lugre) \
  X(limits) \
  X(force) \
  X(dc_motor) \
  X(controller) \
  X(wheel) \
  X(cmg) \
  X(thruster) \
  X(wrench) \
  X(torquer) \
  X(soft_latch) \
  X(line_spring) \
  X(joint_stop)
// clang-format on

namespace porthos::scene {

#define PORTHOS_DECLARE(type) ElementType type##_element();
PORTHOS_ELEMENTS(PORTHOS_DECLARE)
#undef PORTHOS_DECLARE

const std::vector<ElementType>& element_types() {
#define PORTHOS_LIST(type) type##_element(),
  static const std::vector<ElementType> all{PORTHOS_ELEMENTS(PORTHOS_LIST)};
#undef PORTHOS_LIST
  return all;
}

SchemaTable ElementType::table() const {
  keys::Keys all{keys::word("type", {name}, keys::required, "what it is")};
  if (place == Place::joint) {
    all.push_back(keys::text("name", "<joint>.<type>", "name in the ledger"));
    all.push_back(keys::text("joint", keys::required,
                             "coordinate, as porthos info names it, or wrist.about_x"));
  } else {
    all.push_back(keys::text("name", keys::required, "name in the ledger"));
  }
  return {"element." + name, fmt::format("[[element]] type = \"{}\"", name), what,
          keys::joined(all, keys)};
}

}  // namespace porthos::scene
