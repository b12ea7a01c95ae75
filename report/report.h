#pragma once
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "scene/read/scene.h"

/// report.html: one self-contained page per results folder. What it shows: docs/report.md.
namespace porthos::report {

/// The page without its data: PORTHOS_REPORT_TEMPLATE of the environment, else
/// share/porthos/report_template.html beside the program's bin/, else where the build or the
/// installation put it. Empty if there is none.
std::filesystem::path find_template();

/// Advice, in one sentence, if there is no template.
std::string no_template_text();

/// A part of a run [s].
struct Part {
  double from = -std::numeric_limits<double>::infinity(),
         to = std::numeric_limits<double>::infinity();
  bool whole() const { return std::isinf(from) && std::isinf(to); }
};

/// The data of a page.
struct PageData {
  std::string json;
  std::string missing_meshes;  ///< what the playback does not show, in one sentence; empty: it does
};
/// The data of a results folder: a finished, failed or unfinished run, a run of
/// several phases, a comparison, an ensemble; what cannot be read is named in it.
/// @param models  the folders of the model files, where the meshes are that they name; empty:
///   bodies are shown by other shapes
/// @param part  the playback is of this part alone
/// @throws InvalidArgument if the folder holds no results at all
PageData page_data(const std::filesystem::path& folder,
                   const std::vector<std::filesystem::path>& models = {}, const Part& part = {});
inline std::string report_json(const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& models = {}) {
  return page_data(folder, models).json;
}

/// The folders in which the meshes of a scene's model are looked for.
std::vector<std::filesystem::path> model_folders(const scene::Scene& scene);

/// Fills the template and writes `out` (under a temporary name, then renamed).
/// @param models, part  as in page_data()
/// @return PageData::missing_meshes
/// @throws InvalidArgument if a file cannot be read or written, or the template has no place for
///   the data
std::string write_report(const std::filesystem::path& folder, const std::filesystem::path& out,
                         const std::filesystem::path& page,
                         const std::vector<std::filesystem::path>& models = {},
                         const Part& part = {});

/// Writes a page for a film of a part of a run: that of write_report() with the shapes of the
/// folder's report.html, if there is one of this version, which knows the meshes.
/// @throws InvalidArgument as write_report()
void write_part(const std::filesystem::path& folder, const std::filesystem::path& out,
                const std::filesystem::path& page, const Part& part);

}  // namespace porthos::report
