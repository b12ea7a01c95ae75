#include "report/report.h"

#include <fmt/format.h>

#include <cstdlib>

#include "phs/error.h"
#include "report/places.h"
#include "scene/files/files.h"

namespace porthos::report {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view data_mark = "@PORTHOS_DATA@";

/// Text inside <script>: it must not contain '<', which JSON can write as an escape.
std::string in_script(const std::string& json) {
  std::string text;
  text.reserve(json.size() + json.size() / 64);
  for (const char c : json) c == '<' ? void(text += "\\u003c") : text.push_back(c);
  return text;
}

}  // namespace

fs::path find_template() {
  if (const char* named = std::getenv("PORTHOS_REPORT_TEMPLATE"); named && *named) return named;
  std::error_code e;
  const fs::path program = fs::read_symlink("/proc/self/exe", e);
  const fs::path beside = program.parent_path().parent_path() / "share/porthos" / template_name;
  for (const fs::path& path :
       {e ? fs::path() : beside, fs::path(built_template), fs::path(installed_template)})
    if (!path.empty() && fs::exists(path, e)) return path;
  return {};
}

std::string no_template_text() {
  return fmt::format(
      "there is no template for the report: build with node and npm (Debian: nodejs, npm; cmake "
      "says at its end whether it "
      "found them), or name a {} by the environment variable PORTHOS_REPORT_TEMPLATE",
      template_name);
}

std::vector<fs::path> model_folders(const scene::Scene& s) {
  return {fs::path(s.urdf_path).parent_path(), fs::path(s.path).parent_path()};
}

std::string write_report(const fs::path& folder, const fs::path& out, const fs::path& page,
                         const std::vector<fs::path>& models) {
  const std::string text = scene::read_file(page);
  const auto mark = text.find(data_mark);
  if (mark == text.npos || text.find(data_mark, mark + 1) != text.npos)
    throw InvalidArgument(
        fmt::format("{} is no template of a report: expected {} once", page.string(), data_mark));
  auto data = page_data(folder, models);
  scene::write_file(
      out, text.substr(0, mark) + in_script(data.json) + text.substr(mark + data_mark.size()));
  return std::move(data.missing_meshes);
}

}  // namespace porthos::report
