#include "scene/read/controllers/foreign.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <sstream>

#include "energy_shaping/foreign_law.h"
#include "mechanics/mechanical_model.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;

constexpr const char* python_library = "porthos_python_law.so";

std::atomic<const porthos_law*> python_functions{nullptr};

/// The library with the interpreter, or an empty path.
fs::path find_python_library() {
  std::error_code none;
  const fs::path folder = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const fs::path& place : {folder, folder / "../lib/porthos"})
    if (fs::exists(place / python_library, none)) return place / python_library;
  return {};
}

/// Stands for a law that is not loaded.
class SilentLaw final : public phs::SampledLaw {
 public:
  std::vector<double> fresh() const override { return {}; }
  void operator()(double, std::span<const double>, std::span<const double>, std::span<double>,
                  std::span<double> u) const override {
    std::fill(u.begin(), u.end(), 0.0);
  }
};

/// A table as JSON.
std::string json_of(const toml::table& t, const Table& of, const char* key) {
  std::ostringstream text;
  text << toml::json_formatter{t};
  if (text.str().find("\"inf\"") != std::string::npos ||
      text.str().find("\"nan\"") != std::string::npos)
    of.fail(key, "has a number or a text that is inf or nan, expected finite numbers");
  return text.str();
}

}  // namespace

void use_python_laws(const porthos_law& functions) { python_functions = &functions; }

const porthos_law& python_law_functions() {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (!python_functions) {
    const fs::path library = find_python_library();
    if (library.empty())
      throw InvalidArgument(fmt::format(
          "laws in Python need the library {}, which is neither beside the program nor in "
          "../lib/porthos: it is built where pybind11 and Python's development files are",
          python_library));
    // Extension modules such as numpy's use the symbols of the interpreter in it.
    python_functions = &energy_shaping::open_law_library(library.string(), true);
  }
  return *python_functions;
}

std::vector<SchemaKey> foreign_keys() {
  using namespace keys;
  return {
      {"joints", KeyKind::texts, "", required, "of one degree of freedom, whose q and v it gets"},
      {"inputs", KeyKind::texts, "", "none", "names of [[output]]s that it sees too"},
      {"settings", KeyKind::any, "", "none", "keys of the law's own"},
      whole("memory", "by its start", "bytes for what it remembers")};
}

ForeignScene read_foreign(const Table& t) {
  ForeignScene w;
  t.require("joints", "an array of names of joints");
  w.joints = t.texts("joints", "names of joints");
  if (w.joints.empty()) t.fail("joints", "is empty, expected names of joints");
  if (t.has("inputs")) w.inputs = t.texts("inputs", "names of [[output]]s");
  if (t.has("settings"))
    w.settings = json_of(t.raw("settings", "a table of the law's own keys"), t, "settings");
  if (t.has("memory")) {
    w.memory = t.whole("memory");
    if (w.memory == 0 || w.memory > (1u << 24))
      t.fail("memory", "is out of range, expected 1 to 2^24 bytes");
  }
  return w;
}

ControllerDesign design_foreign(const Controller& c, const ControllerPlant& plant,
                                const ForeignScene& w, const porthos_law* functions,
                                const std::string& settings) {
  ControllerDesign made{{}, energy_shaping::Certificate(fmt::format("law of {}", c.file.name))};
  std::vector<energy_shaping::LawJoint> joints;
  for (const std::string& name : w.joints) {
    const ControlledJoint joint = controlled_joint(*plant.model, c, name);
    for (const auto& other : joints)
      if (other.name == name)
        throw InvalidArgument(
            fmt::format("controller '{}' names the joint '{}' twice", c.name, name));
    // What is measured stands behind the state, see sensed().
    const size_t measured = size_t(plant.model->description().nx) + joints.size();
    joints.push_back({name, c.sensing.measures() ? measured : joint.q});
    made.ports.push_back(joint.port);
    made.joints.push_back({name, joint.q, made.joints.size()});
  }
  if (!functions) {
    made.sampled = std::make_shared<const SilentLaw>();
    return made;
  }
  made.sampled = energy_shaping::foreign_law(
      *functions, fmt::format("controller '{}'", c.name), std::move(joints), settings,
      w.inputs.empty() ? energy_shaping::LawInputs{} : plant.inputs(w.inputs), w.memory);
  return made;
}

}  // namespace porthos::scene
