#include "scene/session/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/files/files.h"
#include "scene/plot/apart_by_size.h"
#include "scene/plot/ledger_plot.h"
#include "scene/plot/panel_plot.h"
#include "scene/plot/plot.h"
#include "scene/plot/space_plot.h"
#include "scene/run/checkpoint.h"
#include "scene/run/run_file.h"
#include "scene/session/replot.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

std::string plot(const Scene& scene, const Assembly& assembly, const RunReport& r,
                 const fs::path& log) {
  const RecordLayout layout(scene, assembly);
  const auto every = std::max(1.0, std::round(scene.record_every / scene.step));
  const bool fixed = scene.step_control == integrators::StepControl::fixed;
  Envelope envelope(fixed ? every * scene.step : scene.record_every, r.simulated_s);
  each_record(log, layout, [&](std::span<const double> row) {
    envelope.add(row[layout.time()], row[layout.energy()] / r.energy.scale_J);
  });
  return trace_plot({residual_panel(envelope, scene.verify.energy)}, scene.title, plot_subtitle(r));
}

/// Behind which records of a judged file rows are missing.
std::vector<double> holes(const Scene& scene, const Assembly& assembly, const RunReport& r,
                          const fs::path& log) {
  if (r.method != "recorded") return {};
  return holes_in(*open_log(log, assembly.model->description(), RecordLayout(scene, assembly)),
                  r.method);
}

std::string ledger(const Scene& scene, const Assembly& assembly, const RunReport& r,
                   const fs::path& log, const std::vector<double>& gaps) {
  const auto rows = open_log(log, assembly.model->description(), RecordLayout(scene, assembly),
                             thinned(r.records, most_of_ledger));
  LedgerSeries s = ledger_of(*rows, r);
  s.holes = gaps;
  return ledger_plot(s, scene.title, plot_subtitle(r));
}

/// Empty: nothing of the motion is in the records.
std::string motion(const Scene& scene, const Assembly& assembly, const RunReport& r,
                   const fs::path& log, const std::vector<double>& gaps) {
  if (!assembly.mechanism) return "";
  const auto rows = open_log(log, assembly.model->description(), RecordLayout(scene, assembly),
                             Shown::bands(r.records, most_shown).rows());
  auto panels = apart_by_size(panels_of(*rows, *assembly.mechanism, springs_of(scene),
                                        Shown::bands(rows->count(), most_shown)));
  for (TracePanel& p : panels) p.holes = gaps;
  return panels.empty() ? "" : trace_plot(panels, scene.title, plot_subtitle(r));
}

/// Writes pictures and summary, and puts them in place after the files written before. Pictures
/// that this run does not have are an earlier run's.
void write_with(const fs::path& folder, const Scene& scene, const Assembly& assembly,
                const RunReport& report, const fs::path& log, std::vector<fs::path> files) {
  const auto write = [&](const char* name, const std::string& text) {
    files.push_back(folder / name);
    write_aside(files.back(), text);
  };
  write("energy_error.svg", plot(scene, assembly, report, log));
  const auto gaps = holes(scene, assembly, report, log);
  write("ledger.svg", ledger(scene, assembly, report, log, gaps));
  if (const auto svg = motion(scene, assembly, report, log, gaps); !svg.empty())
    write("motion.svg", svg);
  if (!scene.panels.empty()) write("panels.svg", panel_plot(scene, assembly, report, log));
  if (report.space) write("ledgers.svg", space_plot(report));
  write("summary.json", summary_json(scene, assembly, report, report.final_state));
  for (const auto& path : files) put_in_place(path);
  std::error_code ignored;
  for (const char* name : {"motion.svg", "panels.svg", "ledgers.svg"})
    if (fs::exists(folder / name, ignored) &&
        std::ranges::find(files, folder / name) == files.end())
      fs::remove(folder / name, ignored);
}

}  // namespace

void remove_phases(const fs::path& folder) {
  std::error_code ignored;
  for (size_t k = 1; fs::exists(phase_folder(folder, k)); ++k)
    fs::remove_all(phase_folder(folder, k), ignored);
}

void remove_results(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : {"end", "checkpoint"})
    if (has_checkpoint(folder / name)) fs::remove_all(folder / name, ignored);
  for (const char* name : {"summary.json", "report.html", "run.h5", "energy_error.svg",
                           "ledger.svg", "motion.svg", "panels.svg", "ledgers.svg"})
    fs::remove(folder / name, ignored);
  remove_phases(folder);
}

void write_results(const fs::path& folder, const Scene& scene, const Assembly& assembly,
                   const RunReport& report, const fs::path& log) {
  const auto series = folder / "run.h5";
  write_run_file(series, scene, assembly, report, log);
  write_with(folder, scene, assembly, report, log, {series});
  remove_phases(folder);
}

void write_verdict(const fs::path& folder, const Scene& scene, const Assembly& assembly,
                   const RunReport& report, const fs::path& log) {
  write_with(folder, scene, assembly, report, log, {});
}

void require_finished(const fs::path& folder) {
  if (!fs::is_directory(folder))
    throw InvalidArgument(
        fmt::format("{} is no folder, expected one with the results of a run", folder.string()));
  if (fs::exists(folder / "summary.json")) return;
  throw InvalidArgument(
      fs::exists(folder / "checkpoint")
          ? fmt::format("{} holds an unfinished run: continue it with --resume", folder.string())
          : fmt::format("{} has no summary.json, expected the results of a run", folder.string()));
}

}  // namespace porthos::scene
