#include "report/report.h"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "report/places.h"
#include "scene/files/files.h"

namespace porthos::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view data_mark = "@PORTHOS_DATA@";

/// Text inside <script>: it must not contain '<', which JSON can write as an escape.
std::string in_script(const std::string& json) {
  std::string text;
  text.reserve(json.size() + json.size() / 64);
  for (const char c : json) c == '<' ? void(text += "\\u003c") : text.push_back(c);
  return text;
}

/// A page before and after its data.
struct Frame {
  std::string before, after;
};
/// @throws InvalidArgument if it has no place for the data
Frame frame_of(const fs::path& page) {
  const std::string text = scene::read_file(page);
  const auto mark = text.find(data_mark);
  if (mark == text.npos || text.find(data_mark, mark + 1) != text.npos)
    throw InvalidArgument(
        fmt::format("{} is no template of a report: expected {} once", page.string(), data_mark));
  return {text.substr(0, mark), text.substr(mark + data_mark.size())};
}

/// The data of an earlier page of the same results with the motion of `data`; `data` as it is where
/// the page is of another version or of other phases.
std::string with_shapes_of(const std::string& page, const Frame& frame, const std::string& data) {
  if (!page.starts_with(frame.before) || !page.ends_with(frame.after)) return data;
  const auto size = page.size() - frame.before.size() - frame.after.size();
  auto j = Json::parse(page.substr(frame.before.size(), size), nullptr, false);
  const auto moved = Json::parse(data);
  if (!j.is_object() || !j.contains("phases") || j["phases"].size() != moved["phases"].size())
    return data;
  for (size_t k = 0; k < moved["phases"].size(); ++k) {
    auto& shown = j["phases"][k];
    const auto& motion = moved["phases"][k];
    if (!shown.contains("playback") || !motion.contains("playback") ||
        shown["playback"]["nodes"] != motion["playback"]["nodes"])
      return data;
    shown["playback"]["clips"] = motion["playback"]["clips"];
  }
  return j.dump(-1, ' ', false, Json::error_handler_t::replace);
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
                         const std::vector<fs::path>& models, const Part& part) {
  const Frame frame = frame_of(page);
  auto data = page_data(folder, models, part);
  scene::write_file(out, frame.before + in_script(data.json) + frame.after);
  return std::move(data.missing_meshes);
}

void write_part(const fs::path& folder, const fs::path& out, const fs::path& page,
                const Part& part) {
  const Frame frame = frame_of(page);
  std::string data = page_data(folder, {}, part).json;
  std::error_code none;
  if (const fs::path known = folder / "report.html"; fs::exists(known, none))
    data = with_shapes_of(scene::read_file(known), frame, data);
  scene::write_file(out, frame.before + in_script(data) + frame.after);
}

}  // namespace porthos::report
