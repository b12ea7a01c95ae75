#include <fmt/format.h>

#include "report/detail/identification_page.h"
#include "scene/files/files.h"

namespace porthos::report {

namespace fs = std::filesystem;

Json identification_page(const fs::path& folder) {
  Json j{{"format", 1},
         {"kind", "identification"},
         {"folder", folder.filename().string()},
         {"summary", nullptr},
         {"comparison", nullptr},
         {"phases", Json::array()},
         {"model_notes", Json::array()},
         {"texts", {{"scene", ""}, {"model", ""}}},
         {"missing", Json::array()},
         {"status", {{"state", "complete"}, {"text", ""}}}};
  try {
    j["identification"] = Json::parse(scene::read_file(folder / "identify.json"));
    for (const char* key : {"parameters", "columns", "combinations", "covariance", "notes"})
      (void)j["identification"].at(key).size();
    j["provenance"] = j["identification"].at("provenance");
    std::error_code e;
    if (fs::exists(folder / "found.toml", e))
      j["texts"]["scene"] = scene::read_file(folder / "found.toml");
  } catch (const std::exception& e) {
    j["identification"] = nullptr;
    j["missing"].push_back(fmt::format("identify.json is damaged: {}", e.what()));
    j["status"] = {{"state", "damaged"}, {"text", "Part of the results could not be read."}};
  }
  return j;
}

bool holds_identification(const fs::path& folder) {
  std::error_code e;
  return fs::exists(folder / "identify.json", e);
}

}  // namespace porthos::report
