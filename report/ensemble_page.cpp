#include "phs/error.h"
#include "report/detail/page_parts.h"
#include "report/detail/pages.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/read/scene_texts.h"

namespace porthos::report {
namespace {

namespace fs = std::filesystem;

Json or_null(const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); }

/// Fills what the scene says: its texts, limits, and whether its cases can be run again from the
/// results alone, which hold no law of a user's own.
void describe(Json& j, const scene::Hdf5Reader& file, const fs::path& folder) {
  const auto text = [&](const char* name) {
    return file.datasets().count(name) ? file.text(name) : std::string();
  };
  const scene::SceneTexts texts{text("provenance/scene"), text("provenance/model"),
                                scene::input_files(text("provenance/files"))};
  j["texts"] = {{"scene", texts.scene}, {"model", texts.urdf}};
  const auto s = scene::read_scene_again((folder / "scene.toml").string(), texts);
  const scene::Limits& l = s.verify;
  j["limits"] = {{"energy", or_null(l.energy)},
                 {"linear_momentum", or_null(l.linear_momentum)},
                 {"angular_momentum", or_null(l.angular_momentum)}};
  for (const scene::Controller& c : s.controllers)
    if (!c.file.name.empty()) j["rerun"] = nullptr;
}

}  // namespace

Json ensemble_page(const fs::path& folder) {
  PageParts page("ensemble", folder);
  Json& j = page.data;
  j["rerun"] = folder.string();
  page.attempt("ensemble.json is damaged", [&] {
    j["ensemble"] = Json::parse(scene::read_file(folder / "ensemble.json"));
    for (const char* key : {"cases", "passed", "not_judged", "verdict", "failures", "method"})
      (void)j["ensemble"].at(key);
  });
  page.attempt("ensemble.h5 is damaged", [&] {
    const scene::Hdf5Reader file(folder / "ensemble.h5");
    j["provenance"] = file.texts("provenance");
    j["cases"] = ensemble_data(folder / "ensemble.h5");
    page.attempt("the scene cannot be read again", [&] { describe(j, file, folder); });
  });
  return page.finished();
}

bool holds_ensemble(const fs::path& folder) {
  std::error_code e;
  return fs::exists(folder / "ensemble.json", e) || fs::exists(folder / "ensemble.h5", e);
}

}  // namespace porthos::report
