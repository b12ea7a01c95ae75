#include "report/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <thread>

#include "phs/error.h"
#include "report/browser.h"
#include "scene/files/files.h"

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
  one_of("follow", o.ride, {"place", "base", "world"});
  require(!o.rate || *o.rate > 0,
          fmt::format("speed is {}, expected simulated seconds per second above 0",
                      o.rate.value_or(0)));
  require(!o.from || !o.to || *o.to > *o.from,
          fmt::format("the film ends at {} s and begins at {} s, expected the end after the begin",
                      o.to.value_or(0), o.from.value_or(0)));
}

std::string bytes_of_base64(std::string_view text) {
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
  const std::string kind = page.value("window.porthos?.data?.kind || ''");
  throw InvalidArgument(fmt::format("{} has no playback, expected the report of a run{}",
                                    report.string(),
                                    kind == R"("ensemble")"     ? ": porthos run SCENE --case N"
                                    : kind == R"("comparison")" ? ""
                                                                : ", bundled with node"));
}

/// @throws InvalidArgument if the film begins or ends outside the run
void check_times(BrowserPage& page, const FilmOptions& o) {
  const auto span = nlohmann::json::parse(page.value("[porthos.stage.first, porthos.stage.last]"));
  const double first = span.at(0).get<double>(), last = span.at(1).get<double>();
  const double slack = 1e-9 * (last - first);
  for (const auto& [what, t] : {std::pair{"begins", o.from}, {"ends", o.to}})
    if (t && !(*t >= first - slack && *t <= last + slack))
      throw InvalidArgument(
          fmt::format("the film {} at {:g} s, expected a time of the run, {:g} to "
                      "{:g} s",
                      what, *t, first, last));
  if (o.orbit && page.value("Boolean(porthos.data.planet && porthos.stage.far)") != "true")
    throw InvalidArgument("the run is not in orbit, expected a film of the mechanism");
}

std::string film_of(BrowserPage& page, const FilmOptions& o) {
  nlohmann::json options{{"fps", o.fps}};
  if (o.from) options["from"] = *o.from;
  if (o.to) options["to"] = *o.to;
  if (o.rate) options["rate"] = *o.rate;
  page.value(fmt::format(
      "window.filmed = {{ done: 0 }}; porthos.film(porthos.stage, Object.assign({}, {{ onFrame: "
      "(done) => {{ filmed.done = done; return true; }} }})).then(porthos.base64).then((data) => "
      "filmed.data = data, (e) => filmed.fault = String(e.message || e)); 0",
      options.dump()));
  for (;;) {
    const nlohmann::json state = nlohmann::json::parse(
        page.value("({ done: filmed.done, ready: Boolean(filmed.data), fault: filmed.fault })"));
    if (state.contains("fault")) throw IoError("no film: " + state["fault"].get<std::string>());
    if (state.at("ready").get<bool>()) break;
    if (o.progress) o.progress(state.at("done").get<double>());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return page.value("filmed.data");
}

}  // namespace

void write_film(const std::filesystem::path& report, const std::filesystem::path& out,
                const FilmOptions& o) {
  check(o);
  const bool still = out.extension() == ".png";
  if (!still && out.extension() != ".mp4")
    throw InvalidArgument(
        fmt::format("{}: expected a name that ends with .mp4 (a film) or .png "
                    "(a picture)",
                    out.string()));
  const std::filesystem::path browser = find_browser();
  if (browser.empty())
    throw InvalidArgument(
        "no Chromium or Chrome was found in PATH, expected one, or its path in PORTHOS_CHROMIUM; "
        "the "
        "buttons of the report make the same films");
  BrowserPage page(browser, report, "still", o.width, o.height, o.stop);
  wait_for_stage(page, report);
  check_times(page, o);
  page.value(fmt::format(
      "document.documentElement.dataset.theme = {}; porthos.stage.theme(); porthos.stage.rate = "
      "(porthos.stage.last - porthos.stage.first) / 20; porthos.stage.set('view', {}); "
      "porthos.stage.set('ride', {}); porthos.stage.set('arrows', {}); porthos.stage.look({}); 0",
      nlohmann::json(o.dark ? "dark" : "light").dump(),
      nlohmann::json(o.orbit ? "orbit" : "mechanism").dump(), nlohmann::json(o.ride).dump(),
      o.arrows, nlohmann::json(o.camera).dump()));
  const std::string data =
      still ? page.value(fmt::format("porthos.stage.seek({}), "
                                     "porthos.picture(porthos.stage).then(porthos.base64)",
                                     o.from ? fmt::format("{}", *o.from) : "porthos.stage.first"))
            : film_of(page, o);
  const std::string bytes = bytes_of_base64(nlohmann::json::parse(data).get<std::string>());
  scene::write_file(out, bytes);
}

}  // namespace porthos::report
