#include "apps/report.h"

#include <fmt/format.h>

#include <filesystem>

#include "phs/error.h"
#include "report/report.h"

namespace porthos::apps {

namespace fs = std::filesystem;

bool make_report(const std::string& out) {
  const auto page = report::find_template();
  if (page.empty()) return false;
  try {
    report::write_report(out, fs::path(out) / "report.html", page);
    return true;
  } catch (const std::exception& e) {
    fmt::print(stderr, "porthos: no report: {}\n", e.what());
    return false;
  }
}

int report_command(const Arguments& a) {
  const auto page = report::find_template();
  if (page.empty()) throw InvalidArgument(report::no_template_text());
  const fs::path file = a.out ? fs::path(*a.out) : fs::path(a.scene) / "report.html";
  report::write_report(a.scene, file, page);
  fmt::print("{}\n", file.string());
  return exit_ok;
}

}  // namespace porthos::apps
