#include <nlohmann/json.hpp>

#include "scene/read/controllers/foreign.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

void read_python(const Table& t, Controller& c) {
  const size_t colon = c.file.name.rfind(".py:");
  if (colon == c.file.name.npos || colon + 4 == c.file.name.size())
    t.fail("python", "is \"" + c.file.name + "\", expected a file and a class, as \"law.py:Law\"");
  nlohmann::json settings{
      {"file", c.file.path}, {"text", c.file.text}, {"class", c.file.name.substr(colon + 4)}};
  const ForeignScene w = read_foreign(t);
  if (!w.settings.empty()) settings["settings"] = nlohmann::json::parse(w.settings);
  std::string text;
  try {
    text = settings.dump();
  } catch (const nlohmann::json::exception&) {
    t.fail("python", "names a file that is not UTF-8, expected one that is");
  }
  c.design = [w, text](const Controller& own, const ControllerPlant& plant) {
    return design_foreign(own, plant, w, own.file.loaded ? &python_law_functions() : nullptr, text);
  };
}

}  // namespace

ControllerType python_controller() {
  using namespace keys;
  return {"python",
          "A law of your own: a class in a Python file, whose object is called at each instant.",
          joined({text("python", required, "file and class, \"law.py:Law\", beside the scene")},
                 foreign_keys()),
          {},
          read_python,
          true,
          "python"};
}

}  // namespace porthos::scene
