#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/command_tools.h"
#include "apps/output.h"
#include "phs/error.h"
#include "report/figure.h"
#include "scene/compare/compare.h"
#include "scene/ensemble/ensemble_plot.h"
#include "scene/files/hdf5_file.h"
#include "scene/session/replot.h"

namespace porthos::apps {
namespace {

namespace fs = std::filesystem;

/// "figure_rates_of_joints.svg" in the folder of the results.
fs::path usual_name(const Arguments& a) {
  std::string name = scene::link_name(a.what->substr(0, a.what->find(" [")));
  std::ranges::replace(name, ' ', '_');
  return fs::path(a.scene) / ("figure_" + name + ".svg");
}

}  // namespace

int plot_command(const Arguments& a) {
  const fs::path folder = a.scene;
  const bool run = fs::exists(folder / "summary.json"),
             ensemble = !run && fs::exists(folder / "ensemble.json"),
             comparison = !run && fs::exists(folder / "compare.json");
  if (a.out && !a.what)
    throw InvalidArgument("--out is the file of one panel, expected --what as well");
  if ((a.from || a.to) && !a.what)
    throw InvalidArgument("--from and --to are of one panel, expected --what as well");
  if (ensemble && a.what)
    throw InvalidArgument(fmt::format(
        "{} holds an ensemble, --what is a panel of a run: porthos run {} --case N makes one, and "
        "in Python porthos.plot(folder, what=NAME) has a histogram of each number",
        a.scene, a.scene));
  if (comparison && a.what)
    throw InvalidArgument(
        fmt::format("{} holds a comparison, which has one picture, expected no --what: that is a "
                    "panel of a run",
                    a.scene));
  if (ensemble || comparison) {
    print((ensemble ? scene::replot_ensemble(folder) : scene::replot_comparison(folder)) + "\n");
    return exit_ok;
  }
  if (!a.what) {
    for (const auto& file : scene::replot(folder)) print(file + "\n");
    return exit_ok;
  }
  if (a.out && fs::path(*a.out).has_parent_path() &&
      !fs::is_directory(fs::path(*a.out).parent_path()))
    throw IoError(fmt::format("cannot write {}: there is no folder {}", *a.out,
                              fs::path(*a.out).parent_path().string()));
  const fs::path out = a.out ? fs::path(*a.out) : usual_name(a);
  scene::TimeSpan span;
  span.from = seconds("from", a.from).value_or(span.from);
  span.to = seconds("to", a.to).value_or(span.to);
  if (!(span.from < span.to))
    throw InvalidArgument(
        fmt::format("--to is {:g} s, expected more than --from {:g} s", span.to, span.from));
  const auto documents = scene::figures(folder, *a.what, span);
  for (size_t k = 0; k < documents.size(); ++k) {
    if (documents[k].empty()) continue;  // a phase outside of the span
    fs::path file = out;                 // each phase has its own
    if (documents.size() > 1)
      file.replace_filename(
          fmt::format("{}_{}{}", out.stem().string(), k + 1, out.extension().string()));
    report::write_figure(documents[k], file);
    print(file.string() + "\n");
  }
  return exit_ok;
}

}  // namespace porthos::apps
