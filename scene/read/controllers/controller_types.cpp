#include <fmt/format.h>

#include "scene/read/controllers/controller_type.h"
#include "scene/read/schema_keys-inl.h"

// clang-format off
#define PORTHOS_CONTROLLERS(X) \
  X(potential) \
  X(null_space) \
  X(wheel_attitude) \
  X(tracking) \
  X(lqr) \
  X(swing_up) \
  X(ida_pbc) \
  X(motor_side) \
  X(esp) \
  X(whole_body) \
  X(python) \
  X(shared_library)
// clang-format on

namespace porthos::scene {

#define PORTHOS_DECLARE(type) ControllerType type##_controller();
PORTHOS_CONTROLLERS(PORTHOS_DECLARE)
#undef PORTHOS_DECLARE

const std::vector<ControllerType>& controller_types() {
#define PORTHOS_LIST(type) type##_controller(),
  static const std::vector<ControllerType> all{PORTHOS_CONTROLLERS(PORTHOS_LIST)};
#undef PORTHOS_LIST
  return all;
}

SchemaTable ControllerType::table() const {
  const keys::Keys first{keys::word("type", {name}, keys::required, "which law"),
                         keys::text("name", keys::required, "name in the ledger"),
                         keys::number("rate", "Hz", always_sampled ? keys::required : "continuous",
                                      "sampled and held, whole steps apart")};
  return {"controller." + name, fmt::format("[[controller]] type = \"{}\"", name), what,
          keys::joined(keys::joined(keys::joined(first, sensing_keys()), tank_keys()), keys)};
}

}  // namespace porthos::scene
