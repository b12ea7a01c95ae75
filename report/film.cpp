#include "report/film.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "phs/error.h"
#include "report/browser.h"
#include "report/detail/stage_page.h"
#include "report/report.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/session/records.h"

namespace porthos::report {
namespace {

constexpr double far_between_frames = 1.6;  ///< [rad], as on the page

/// @throws InvalidArgument if the film begins or ends outside the run, [first, last]
void check_times(double first, double last, const FilmOptions& o) {
  const double slack = 1e-9 * (last - first);
  for (const auto& [what, t] : {std::pair{"begins", o.from}, {"ends", o.to}})
    if (t && !(*t >= first - slack && *t <= last + slack))
      throw InvalidArgument(
          fmt::format("the film {} at {:g} s, expected a time of the run, {:g} to "
                      "{:g} s",
                      what, *t, first, last));
}

void check_page(BrowserPage& page, const FilmOptions& o) {
  const auto span = nlohmann::json::parse(page.value("[porthos.stage.first, porthos.stage.last]"));
  check_times(span.at(0).get<double>(), span.at(1).get<double>(), o);
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

/// The page that is filmed: of a part of a run in a folder one with its records, which is removed.
class FilmedPage {
 public:
  FilmedPage(const std::filesystem::path& report, const FilmOptions& o, bool still)
      : file_(report) {
    if (!std::filesystem::is_directory(report)) return;
    file_ = report / "report.html";
    const auto page = find_template();
    const bool finished = std::filesystem::exists(report / "summary.json");
    if (page.empty() || !finished || !(o.from || o.to)) return;
    const auto files = scene::series_files(report);
    check_times(scene::open_run_file(files.front())->column("time").front(),
                scene::open_run_file(files.back())->column("time").back(), o);
    Part part;
    part.from = o.from.value_or(part.from);
    part.to = still ? part.from : o.to.value_or(part.to);
    if (still && o.trail) part.from = Part().from;  // the path up to then
    file_ = std::filesystem::temp_directory_path() / fmt::format("porthos_film_{}.html", getpid());
    made_ = true;
    write_part(report, file_, page, part);
  }
  ~FilmedPage() {
    std::error_code ignored;
    if (made_) std::filesystem::remove(file_, ignored);
  }
  FilmedPage(const FilmedPage&) = delete;
  FilmedPage& operator=(const FilmedPage&) = delete;
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  bool made_ = false;
};

}  // namespace

std::string write_film(const std::filesystem::path& report, const std::filesystem::path& out,
                       const FilmOptions& o) {
  const bool still = out.extension() == ".png";
  if (!still && out.extension() != ".mp4")
    throw InvalidArgument(
        fmt::format("{}: expected a name that ends with .mp4 (a film) or .png "
                    "(a picture)",
                    out.string()));
  const FilmedPage filmed(report, o, still);
  const auto opened = open_stage(filmed.file(), o);
  BrowserPage& page = *opened;
  check_page(page, o);
  const std::string data =
      still ? page.value(fmt::format("porthos.stage.seek({}), "
                                     "porthos.picture(porthos.stage).then(porthos.base64)",
                                     o.from ? fmt::format("{}", *o.from) : "porthos.stage.first"))
            : film_of(page, o);
  const std::string bytes = bytes_of_base64(data);
  scene::write_file(out, bytes);
  const double turn =
      nlohmann::json::parse(page.value("porthos.stage.clips[0].turn")).get<double>();
  if (turn < far_between_frames) return "";
  return fmt::format(
      "{}: a body turns by up to {:.2g} rad between two records of the playback, so that a fast "
      "swing may look slow or still: a film of a shorter part, --from T --to T, has more of its "
      "records",
      out.string(), turn);
}

}  // namespace porthos::report
