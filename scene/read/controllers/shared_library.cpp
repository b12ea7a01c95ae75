#include "energy_shaping/foreign_law.h"
#include "scene/read/controllers/foreign.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_shared_library(const Table& t, Controller& c) {
  const ForeignScene w = read_foreign(t);
  c.design = [w](const Controller& own, const ControllerPlant& plant) {
    const porthos_law* functions =
        own.file.loaded ? &energy_shaping::open_law_library(own.file.path) : nullptr;
    return design_foreign(own, plant, w, functions, w.settings.empty() ? "{}" : w.settings);
  };
}

}  // namespace

ControllerType shared_library_controller() {
  using namespace keys;
  return {
      "shared_library",
      "A law of your own: a shared object with the functions of porthos_law.h.",
      joined({text("library", required, "the shared object, beside the scene")}, foreign_keys()),
      {},
      read_shared_library,
      true,
      "library"};
}

}  // namespace porthos::scene
