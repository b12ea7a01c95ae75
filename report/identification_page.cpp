#include "report/detail/pages.h"

#include "report/detail/page_parts.h"
#include "scene/files/files.h"

namespace porthos::report {

namespace fs = std::filesystem;

Json identification_page(const fs::path& folder) {
  PageParts page("identification", folder);
  Json& j = page.data;
  j["identification"] = nullptr;
  page.attempt("identify.json is damaged", [&] {
    const Json found = Json::parse(scene::read_file(folder / "identify.json"));
    for (const char* key : {"parameters", "columns", "combinations", "covariance", "notes"})
      (void)found.at(key).size();
    j["provenance"] = found.at("provenance");
    std::error_code e;
    if (fs::exists(folder / "found.toml", e))
      j["texts"]["scene"] = scene::read_file(folder / "found.toml");
    j["identification"] = found;
  });
  return page.finished();
}

bool holds_identification(const fs::path& folder) {
  std::error_code e;
  return fs::exists(folder / "identify.json", e);
}

}  // namespace porthos::report
