#include "scene/results.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/files.h"
#include "scene/plot.h"
#include "scene/record_log.h"
#include "scene/run_file.h"

namespace porthos::scene {
namespace {

std::string seconds(double s) {
  return s < 60 ? fmt::format("{:.3g} s", s) : fmt::format("{:.0f} s", s);
}

/// 50000 -> "50 000", with narrow spaces.
std::string grouped(std::int64_t n) {
  const std::string digits = std::to_string(n);
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += " ";
    text += digits[i];
  }
  return text;
}

std::string subtitle(const RunReport& r) {
  const bool fixed = r.step_control == integrators::StepControl::fixed;
  return fmt::format("{}  ·  {}step {:g} s  ·  {} steps  ·  {} CPU  ·  verdict: {}", r.method,
                     fixed ? "" : fmt::format("{} ", to_string(r.step_control)), r.step_s,
                     grouped(r.steps), seconds(r.cpu_s), r.passed() ? "pass" : "fail");
}

std::string plot(const Scene& scene, const Assembly& assembly, const RunReport& r,
                 const std::filesystem::path& log) {
  const RecordLayout layout(assembly.model->description());
  const auto every = std::max(1.0, std::round(scene.record_every / scene.step));
  const bool fixed = scene.step_control == integrators::StepControl::fixed;
  Envelope envelope(fixed ? every * scene.step : scene.record_every, r.simulated_s);
  RecordReader reader(log, layout);
  std::vector<double> rows;
  while (const size_t n = reader.read(rows, 4096))
    for (size_t i = 0; i < n; ++i) {
      const double* row = rows.data() + i * layout.size();
      envelope.add(row[layout.time()], row[layout.energy()] / r.energy.scale_J);
    }
  return energy_plot(envelope, {scene.title, subtitle(r), scene.verify.energy});
}

}  // namespace

void write_results(const std::filesystem::path& folder, const Scene& scene,
                   const Assembly& assembly, const RunReport& report,
                   const std::filesystem::path& log) {
  const auto h5 = folder / "run.h5", svg = folder / "energy_error.svg",
             summary = folder / "summary.json";
  write_run_file(h5, scene, assembly, report, log);
  write_aside(svg, plot(scene, assembly, report, log));
  write_aside(summary, summary_json(scene, assembly, report, report.final_state));
  for (const auto& path : {h5, svg, summary}) put_in_place(path);
}

}  // namespace porthos::scene
