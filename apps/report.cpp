#include "apps/report.h"

#include <fmt/format.h>

#include <filesystem>

#include "phs/error.h"
#include "report/report.h"

namespace porthos::apps {

namespace fs = std::filesystem;

namespace {

void tell(const Arguments& a, const std::string& missing_meshes) {
  if (!a.no_meshes && !missing_meshes.empty())
    fmt::print(stderr, "porthos: playback: {}\n", missing_meshes);
}

}  // namespace

bool make_report(const Arguments& a, const std::string& out, const std::vector<fs::path>& models) {
  std::error_code ignored;
  if (const fs::path old = fs::path(out) / "report.html"; fs::exists(old, ignored))
    fs::remove(old, ignored);
  if (a.no_report) return false;
  const auto page = report::find_template();
  if (page.empty()) return false;
  try {
    const auto shown = a.no_meshes ? std::vector<fs::path>{} : models;
    tell(a, report::write_report(out, fs::path(out) / "report.html", page, shown));
    return true;
  } catch (const std::exception& e) {
    fmt::print(stderr, "porthos: no report: {}\n", e.what());
    return false;
  }
}

void write_page(const Arguments& a, const fs::path& file) {
  const auto page = report::find_template();
  if (page.empty()) throw InvalidArgument(report::no_template_text());
  for (const auto& folder : a.models)
    if (!fs::is_directory(folder))
      throw InvalidArgument(fmt::format("--models {}: expected a folder", folder));
  tell(a, report::write_report(a.scene, file, page, {a.models.begin(), a.models.end()}));
}

int report_command(const Arguments& a) {
  const fs::path file = a.out ? fs::path(*a.out) : fs::path(a.scene) / "report.html";
  write_page(a, file);
  fmt::print("{}\n", file.string());
  return exit_ok;
}

}  // namespace porthos::apps
