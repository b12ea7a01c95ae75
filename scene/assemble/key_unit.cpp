#include "scene/assemble/key_unit.h"

#include <algorithm>

#include "scene/assemble/assembly.h"
#include "scene/read/schema.h"
#include "scene/read/toml_table-inl.h"
#include "vsa/catalogue.h"

namespace porthos::scene {
namespace {

/// "element[0]" -> "element"
std::string name_alone(const std::string& key) { return key.substr(0, key.find('[')); }

/// The unit of a parameter of an actuator's family: of coefficients that of the first.
std::string unit_in_family(const toml::table& actuator, const std::string& name) {
  const auto own = actuator["family"].value_or(std::string());
  for (const vsa::Family& f : vsa::families())
    for (const vsa::Key& k : f.keys)
      if (f.name == own && k.name == name) return k.unit.substr(0, k.unit.find(','));
  return "";
}

}  // namespace

std::string unit_of_key(const Scene& scene, const std::string& key, const Assembly& a) {
  const toml::table root = parse_toml(scene.text, File{scene.path});
  const auto dot = key.rfind('.');
  std::string id = name_alone(key.substr(0, dot));
  const std::string name = name_alone(key.substr(dot + 1));
  if (const auto* actuator = root.at_path(key.substr(0, key.find('.'))).as_table();
      actuator && id == "actuator") {
    if (key.find("].parameters.") != key.npos) return unit_in_family(*actuator, name);
    if (key.find("].theta.") != key.npos) id = "actuator.drive";
  }
  const auto of_joint = [&](const std::string& joint) -> const mechanics::JointCoordinates* {
    if (!a.mechanism) return nullptr;
    const auto& all = a.mechanism->coordinates();
    const auto own = std::ranges::find(all, joint, &mechanics::JointCoordinates::name);
    return own == all.end() ? nullptr : &*own;
  };
  if (const std::string joints = "initial.joints"; id.starts_with(joints + "."))
    if (const auto* joint = of_joint(id.substr(joints.size() + 1)))
      return name == "position" ? joint->unit : name == "velocity" ? joint->rate_unit : "";
  bool slides = false;
  if (const auto* element = root.at_path(key.substr(0, dot)).as_table();
      element && id == "element") {
    id += "." + (*element)["type"].value_or(std::string());
    const auto* joint = of_joint((*element)["joint"].value_or(std::string()));
    slides = joint && joint->unit == "m";
  }
  const SchemaTable* table = schema_of(id);
  for (const SchemaKey& k : table ? table->keys : std::vector<SchemaKey>()) {
    if (k.name != name) continue;
    const auto open = k.unit.find(" (");
    if (open == std::string::npos) return k.unit;
    return slides ? k.unit.substr(open + 2, k.unit.size() - open - 3) : k.unit.substr(0, open);
  }
  return "";
}

}  // namespace porthos::scene
