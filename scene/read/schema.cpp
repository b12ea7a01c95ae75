#include "scene/read/schema.h"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>
#include <utility>

#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/sensing.h"
#include "scene/read/controllers/tank.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/output.h"
#include "scene/read/schema_keys-inl.h"

namespace porthos::scene {

const std::vector<SchemaTable>& schema() {
  static const std::vector<SchemaTable> all = [] {
    auto a = run_tables();
    for (const ElementType& t : element_types()) a.push_back(t.table());
    for (const ControllerType& t : controller_types()) {
      a.push_back(t.table());
      a.insert(a.end(), t.tables.begin(), t.tables.end());
    }
    for (const auto& more : {sensing_tables(), tank_tables(), part_tables(), output_tables()})
      a.insert(a.end(), more.begin(), more.end());
    return a;
  }();
  return all;
}

const SchemaTable* schema_of(const std::string& id) {
  for (const SchemaTable& t : schema())
    if (t.id == id) return &t;
  return nullptr;
}

const SchemaKey& SchemaTable::key(const std::string& name) const {
  for (const SchemaKey& k : keys)
    if (k.name == name) return k;
  throw std::logic_error(fmt::format("the schema of {} has no key '{}'", heading, name));
}

std::string of_unit(const SchemaKey& key) {
  if (key.unit.empty() || key.unit == "1") return "";
  if (key.unit == "s") return " of seconds";
  if (key.unit == "m") return " of metres";
  if (key.unit == "T") return " of tesla";
  std::string text = " of " + key.unit;
  for (const auto& [sign, word] :
       {std::pair{" (", " or "}, {")", ""}, {"²", "^2"}, {"³", "^3"}, {"Ω", "Ohm"}})
    for (size_t at; (at = text.find(sign)) != text.npos;)
      text.replace(at, std::string_view(sign).size(), word);
  return text;
}

}  // namespace porthos::scene
