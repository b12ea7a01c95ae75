#include "report/figure.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "phs/error.h"
#include "report/browser.h"
#include "report/detail/stage_page.h"
#include "scene/files/files.h"

namespace porthos::report {
namespace {

constexpr double pixels_per_inch = 96;  // of a page

/// Width and height of the document in pixels of the page, when it stands there.
std::pair<double, double> size_of(BrowserPage& page) {
  for (int i = 0; i < 300; ++i) {
    const auto size = nlohmann::json::parse(page.value(
        "document.readyState === 'complete' && document.documentElement.localName === 'svg' ? "
        "[document.documentElement.width.baseVal.value, "
        "document.documentElement.height.baseVal.value] : null"));
    if (!size.is_null()) return {size.at(0).get<double>(), size.at(1).get<double>()};
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  throw IoError("the browser did not show the figure within 30 s");
}

}  // namespace

void write_figure(const std::string& svg, const std::filesystem::path& out) {
  const auto ending = out.extension();
  if (ending == ".svg") return scene::write_file(out, svg);
  if (ending != ".pdf" && ending != ".png")
    throw InvalidArgument(
        fmt::format("{}: expected a name that ends with .svg, .pdf or .png", out.string()));
  const auto browser = find_browser(out.string() + ": ", "a name that ends with .svg needs none");
  std::filesystem::path beside = out;
  beside += ".svg";
  scene::write_file(beside, svg);
  std::string bytes;
  try {
    BrowserPage page(browser, beside, "", 1200, 900);
    const auto [width, height] = size_of(page);
    if (ending == ".pdf")
      bytes = page.data("Page.printToPDF", nlohmann::json{{"paperWidth", width / pixels_per_inch},
                                                          {"paperHeight", height / pixels_per_inch},
                                                          {"marginTop", 0},
                                                          {"marginBottom", 0},
                                                          {"marginLeft", 0},
                                                          {"marginRight", 0},
                                                          {"printBackground", true},
                                                          {"pageRanges", "1"}}
                                               .dump());
    else
      bytes =
          page.data("Page.captureScreenshot", nlohmann::json{{"captureBeyondViewport", true},
                                                             {"clip",
                                                              {{"x", 0},
                                                               {"y", 0},
                                                               {"width", width},
                                                               {"height", height},
                                                               {"scale", 300 / pixels_per_inch}}}}
                                                  .dump());
  } catch (...) {
    std::filesystem::remove(beside);
    throw;
  }
  std::filesystem::remove(beside);
  scene::write_file(out, bytes_of_base64(bytes));
}

}  // namespace porthos::report
