#include "report/detail/stage_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <thread>

#include "phs/error.h"
#include "phs/nearest.h"

namespace porthos::report {
namespace {

void check(const FilmOptions& o) {
  const auto require = [](bool holds, const std::string& sentence) {
    if (!holds) throw InvalidArgument(sentence);
  };
  for (const int n : {o.width, o.height})
    require(n >= 64 && n <= 4096 && n % 2 == 0,
            fmt::format("a film of {}x{} pixels, expected even numbers from 64 to 4096", o.width,
                        o.height));
  const auto one_of = [&](const char* what, const std::string& word,
                          std::initializer_list<const char*> words) {
    std::string list;
    for (const char* w : words) add_to_list(list, w);
    require(std::ranges::find(words, word) != words.end(),
            fmt::format("{} is '{}', expected one of {}", what, word, list));
  };
  one_of("camera", o.camera, {"iso", "x", "y", "z"});
  if (!o.ride.empty()) one_of("follow", o.ride, {"place", "base", "world"});
  require(!o.rate || *o.rate > 0,
          fmt::format("speed is {}, expected simulated seconds per second above 0",
                      o.rate.value_or(0)));
  require(!o.from || !o.to || *o.to > *o.from,
          fmt::format("the film ends at {} s and begins at {} s, expected the end after the begin",
                      o.to.value_or(0), o.from.value_or(0)));
}

/// Waits until the playback stands on the page. @throws InvalidArgument if the page has none
void wait_for_stage(BrowserPage& page, const std::filesystem::path& report) {
  for (int i = 0; i < 300; ++i) {
    const std::string state = page.value(
        "!window.porthos?.ready ? 'no' : porthos.stage && porthos.film ? 'stage' : "
        "document.querySelector('#playback canvas') || !porthos.data.acts.length ? "
        "'none' : 'no'");
    if (state == "\"stage\"") return;
    if (state == "\"none\"" && i > 20) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const std::string why = nlohmann::json::parse(
      page.value("window.porthos?.data?.acts.length === 0 ? porthos.data.missing.join('; ') : "
                 "document.querySelector('#playback .stage > .soft')?.textContent || ''"));
  if (!why.empty())
    throw InvalidArgument(fmt::format("{} has no playback: {}", report.string(), why));
  const std::string kind = page.value("window.porthos?.data?.kind || ''");
  const bool ensemble = kind == R"("ensemble")",
             other = kind == R"("comparison")" || kind == R"("identification")";
  throw InvalidArgument(fmt::format(
      "{} has no playback, expected the report of a run{}", report.string(),
      ensemble ? ": porthos run SCENE --case N"
      : other  ? ""
               : ": porthos report makes it anew, of this version, if it was built with node"));
}

/// @throws InvalidArgument for a link that the playback does not move
void check_links(BrowserPage& page, const FilmOptions& o) {
  if (o.trail_of.empty()) return;
  const auto known = nlohmann::json::parse(page.value("porthos.stage.movers?.() || []"));
  const auto links = known.get<std::vector<std::string>>();
  if (links.empty())
    throw InvalidArgument(
        "trail_of is given, and the page names no links that move, expected a report of this "
        "version: porthos report makes it anew");
  for (const auto& link : o.trail_of)
    if (std::ranges::find(links, link) == links.end())
      throw InvalidArgument(
          fmt::format("trail_of is '{}', the nearest is '{}', expected one of the {} links that "
                      "move",
                      link, nearest(link, {links.begin(), links.end()}), links.size()));
}

}  // namespace

std::unique_ptr<BrowserPage> open_stage(const std::filesystem::path& report, const FilmOptions& o) {
  check(o);
  const auto browser = find_browser("", "the buttons of the report make the same films");
  auto page = std::make_unique<BrowserPage>(browser, report, "still", o.width, o.height, o.stop);
  wait_for_stage(*page, report);
  check_links(*page, o);
  const std::string ride = !o.ride.empty() ? nlohmann::json(o.ride).dump()
                           : o.trail       ? "'world'"
                                           : "porthos.stage.usual || 'place'";
  page->value(
      fmt::format("document.documentElement.dataset.theme = {}; porthos.stage.theme(); "
                  "porthos.stage.choose(0); "
                  "porthos.stage.rate = (porthos.stage.last - porthos.stage.first) / 20; "
                  "porthos.stage.set('view', {}); porthos.stage.set('ride', {}); "
                  "porthos.stage.set('arrows', {}); porthos.stage.options.whole = {}; "
                  "porthos.stage.set('trailOf', {}); "
                  "porthos.stage.silent = {}; porthos.stage.look({}); 0",
                  nlohmann::json(o.dark ? "dark" : "light").dump(),
                  nlohmann::json(o.orbit ? "orbit" : "mechanism").dump(), ride, o.arrows, o.trail,
                  nlohmann::json(o.trail_of).dump(), !o.text, nlohmann::json(o.camera).dump()));
  return page;
}

std::string bytes_of_base64(const std::string& json) {
  const std::string text = nlohmann::json::parse(json).get<std::string>();
  std::string bytes;
  unsigned bits = 0, have = 0;
  for (const char c : text) {
    const unsigned six = c >= 'A' && c <= 'Z'   ? unsigned(c - 'A')
                         : c >= 'a' && c <= 'z' ? unsigned(c - 'a') + 26
                         : c >= '0' && c <= '9' ? unsigned(c - '0') + 52
                         : c == '+'             ? 62
                         : c == '/'             ? 63
                                                : 64;
    if (six == 64) break;  // '=' at the end
    bits = bits << 6 | six;
    have += 6;
    if (have >= 8) bytes += char(bits >> (have -= 8) & 0xff);
  }
  return bytes;
}

}  // namespace porthos::report
