#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "apps/progress.h"
#include "apps/report.h"
#include "phs/error.h"
#include "report/film.h"

namespace porthos::apps {
namespace {

namespace fs = std::filesystem;

/// "1280x720"
void read_size(const std::string& text, report::FilmOptions& o) {
  const char *at = text.data(), *end = at + text.size();
  const auto [x, first] = std::from_chars(at, end, o.width);
  const auto [rest, second] = std::from_chars(x != end ? x + 1 : x, end, o.height);
  if (first != std::errc() || second != std::errc() || *x != 'x' || rest != end)
    throw InvalidArgument(
        fmt::format("--size: '{}' is no size, expected pixels as in 1280x720", text));
}

fs::path report_of(const Arguments& a) {
  fs::path file = a.scene;
  if (fs::is_regular_file(file)) {
    if (file.extension() != ".html")
      throw InvalidArgument(fmt::format(
          "{} is no report of Porthos, expected a results folder or its report.html", a.scene));
    return file;
  }
  file /= "report.html";
  if (fs::exists(file) && a.models.empty()) return file;
  write_page(a, file);
  return file;
}

}  // namespace

int film_command(const Arguments& a) {
  report::FilmOptions o;
  if (a.size) read_size(*a.size, o);
  o.from = number_of("from", a.from, "a number of seconds");
  o.to = number_of("to", a.to, "a number of seconds");
  o.rate = number_of("speed", a.speed, "a number of simulated seconds per second");
  if (a.camera) o.camera = *a.camera;
  o.ride = a.follow.value_or("");
  o.orbit = a.orbit;
  o.arrows = a.arrows;
  o.dark = a.dark;
  o.trail = a.trail;
  o.trail_of = a.of;
  o.text = !a.no_text;
  o.stop = &stop_on_signals();
  const fs::path report = report_of(a),
                 source = fs::is_directory(a.scene) ? fs::path(a.scene) : report;
  const fs::path out = a.out ? fs::path(*a.out) : report.parent_path() / "film.mp4";
  Progress progress;
  o.progress = [&](double done) { progress.update(done); };
  try {
    if (const auto remark = report::write_film(source, out, o); !remark.empty()) {
      progress.finish();
      log(remark);
    }
  } catch (const IoError&) {
    if (!o.stop->load()) throw;
    progress.finish();
    log("interrupted: no film was written");
    return exit_interrupted;
  }
  progress.finish();
  print(out.string() + "\n");
  return exit_ok;
}

}  // namespace porthos::apps
