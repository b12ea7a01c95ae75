#include "scene/session/replot.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/plot/ledger_plot.h"
#include "scene/plot/motion.h"
#include "scene/plot/plot.h"
#include "scene/read/scene_texts.h"
#include "scene/run/columns.h"
#include "scene/session/event_times-inl.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json summary_of(const fs::path& folder) {
  require_finished(folder);
  const fs::path path = folder / "summary.json";
  try {
    return Json::parse(read_file(path));
  } catch (const Json::exception& e) {
    throw InvalidArgument(fmt::format("{} is damaged: {}", path.string(), e.what()));
  }
}

/// The report as far as the pictures need it. Null figures (not finite) become 0.
RunReport report_of(const Json& s) {
  const auto number = [](const Json& j) { return j.is_number() ? j.get<double>() : 0.0; };
  RunReport r;
  r.title = s.at("title");
  r.method = s.at("method");
  if (s.contains("step_control"))
    r.step_control = integrators::step_control_of(s.at("step_control").get<std::string>());
  r.step_s = number(s.at("step_s"));
  r.simulated_s = number(s.at("simulated_s"));
  r.steps = std::int64_t(std::clamp(number(s.at("steps")), 0.0, 0x1p53));
  r.cpu_s = number(s.at("cpu_s"));
  r.energy.scale_J = number(s.at("energy").at("scale_J"));
  for (const auto& c : s.at("checks"))
    r.checks.push_back({c.at("name"), number(c.at("value")), number(c.at("limit")), c.at("pass"),
                        c.value("telling", true)});
  return r;
}

/// A series with one number per record.
std::vector<double> column(const Hdf5Reader& file, const std::string& name) {
  std::vector<double> v(size_t(file.dataset(name).size()));
  const auto records = size_t(file.dataset("time").size());
  if (v.size() != records)
    throw InvalidArgument(
        fmt::format("run.h5 is damaged: {} has {} numbers, expected {}, one a record", name,
                    v.size(), records));
  file.read(name, v.data());
  return v;
}

/// The series of a group, first those named in the summary, in its order.
std::vector<LedgerLine> lines(const Hdf5Reader& file, const std::string& group, const Json& order,
                              std::int64_t every) {
  std::vector<std::string> names;
  for (const auto& [name, joule] : order.items()) {
    const std::string link = link_name(name);
    if (file.datasets().count(group + link)) names.push_back(link);
  }
  for (const auto& [name, d] : file.datasets())
    if (name.starts_with(group) &&
        std::find(names.begin(), names.end(), name.substr(group.size())) == names.end())
      names.push_back(name.substr(group.size()));
  std::vector<LedgerLine> all;
  for (const auto& name : names) {
    const auto v = column(file, group + name);
    LedgerLine line{name, {}};
    for (std::int64_t i = 0; i < std::int64_t(v.size()); ++i)
      if (i % every == 0 || i + 1 == std::int64_t(v.size())) line.value.push_back(v[size_t(i)]);
    all.push_back(std::move(line));
  }
  return all;
}

std::string energy_picture(const RunReport& r, const std::vector<double>& t,
                           const std::vector<double>& error) {
  // The distance of the records: a phase does not begin at 0.
  Envelope envelope(t.size() > 1 ? t[1] - t[0] : 1, r.simulated_s);
  for (size_t i = 0; i < t.size(); ++i) envelope.add(t[i], error[i] / r.energy.scale_J);
  std::optional<double> limit;
  for (const auto& c : r.checks)
    if (c.name == "energy") limit = c.limit;
  return energy_plot(envelope, {r.title, plot_subtitle(r), limit});
}

/// The motion in run.h5; empty where a series is missing.
std::string motion_picture(const Hdf5Reader& file, const mechanics::Mechanism& m,
                           const std::vector<Spring>& springs, const RunReport& r) {
  const auto shown = evenly(file.dataset("time").size(), most_of_motion);
  const auto series = [&](const std::string& name) {
    std::vector<double> some;
    if (!file.datasets().count(name)) return some;
    const auto& d = file.dataset(name);
    const size_t columns = d.shape.size() > 1 ? size_t(d.shape[1]) : 1;
    std::vector<double> all(size_t(d.size()));
    file.read(name, all.data());
    for (const auto row : shown)
      some.insert(some.end(), all.begin() + long(size_t(row) * columns),
                  all.begin() + long((size_t(row) + 1) * columns));
    return some;
  };
  std::vector<std::string> turns;
  if (file.datasets().count("turns")) turns = lines_of(file.texts("turns")["columns"]);
  MotionRecords records{series("time"), turns, series};
  for (const auto& [name, d] : file.datasets())
    if (name.starts_with("output/"))
      records.outputs.emplace_back(name.substr(7), file.texts(name)["unit"]);
  records.springs = springs;
  return motion_plot(m, records, r.title, plot_subtitle(r));
}

std::vector<std::string> replot_one(const fs::path& folder, const Json& summary,
                                    const mechanics::Mechanism* mechanism,
                                    const std::vector<Spring>& springs) {
  const RunReport r = report_of(summary);
  const Hdf5Reader file(folder / "run.h5");
  const auto t = column(file, "time"), error = column(file, "energy_error");
  const std::int64_t n = std::int64_t(t.size()), every = std::max<std::int64_t>(1, n / 750);
  LedgerSeries s;
  for (std::int64_t i = 0; i < n; ++i)
    if (i % every == 0 || i + 1 == n) {
      s.t.push_back(t[size_t(i)]);
      s.defect.push_back(error[size_t(i)]);
    }
  const Json& balance = summary.at("balance");
  s.stored = lines(file, "stored/", balance.at("storages"), every);
  s.supplied = lines(file, "supplied/", balance.at("ports"), every);
  s.dissipated = lines(file, "dissipated/", balance.at("losses"), every);
  const fs::path svg = folder / "energy_error.svg", ledger = folder / "ledger.svg";
  write_aside(svg, energy_picture(r, t, error));
  write_aside(ledger, ledger_plot(s, r.title, plot_subtitle(r)));
  put_in_place(svg);
  put_in_place(ledger);
  std::vector<std::string> files{svg.string(), ledger.string()};
  if (const auto text = mechanism ? motion_picture(file, *mechanism, springs, r) : "";
      !text.empty()) {
    const fs::path motion = folder / "motion.svg";
    write_aside(motion, text);
    put_in_place(motion);
    files.push_back(motion.string());
  }
  return files;
}

}  // namespace

Moved moved_in(const fs::path& folder) {
  const Json summary = summary_of(folder);
  const bool one = fs::exists(folder / "run.h5");
  const Hdf5Reader first(one ? folder / "run.h5" : folder / "phase_1" / "run.h5");
  if (!first.datasets().count("provenance/scene")) return {};  // of a system of the user's own
  const auto text = [&](const char* name) {
    return first.datasets().count(name) ? first.text(name) : std::string();
  };
  const Scene scene = read_scene_again(
      (folder / "scene.toml").string(),
      {text("provenance/scene"), text("provenance/model"), input_files(text("provenance/files"))});
  const Assembly assembly = assemble(scene);
  if (!assembly.mechanism) return {};
  Moved all{{assembly.mechanism}, springs_of(scene)};
  if (one) return all;
  const auto happened = event_times(summary);
  mechanics::MovingMechanism moving(assembly.parts);
  pass_events(moving, scene, assembly.initial, 0, happened);
  all.mechanisms = {{moving.model, &moving.model->mechanism()}};
  for (int k = 1; fs::is_directory(folder / fmt::format("phase_{}", k + 1)); ++k) {
    const fs::path phase = folder / fmt::format("phase_{}", k);
    const auto t = column(Hdf5Reader(phase / "run.h5"), "time");
    pass_events(moving, scene, phase, t.empty() ? 0 : t.back(), happened);
    all.mechanisms.emplace_back(moving.model, &moving.model->mechanism());
  }
  return all;
}

namespace {

/// None where the scene was made in code, or names tables that the results do not hold: then the
/// plot of the motion stays as the run has drawn it.
Moved moved_if_known(const fs::path& folder) {
  try {
    return moved_in(folder);
  } catch (const InvalidArgument&) {
    return {};
  }
}

}  // namespace

std::vector<std::string> replot(const fs::path& folder) {
  const Json summary = summary_of(folder);
  try {
    const Moved moved = moved_if_known(folder);
    const auto one = [&](const fs::path& part, const Json& of, size_t k) {
      return replot_one(part, of, k < moved.mechanisms.size() ? moved.mechanisms[k].get() : nullptr,
                        moved.springs);
    };
    if (fs::exists(folder / "run.h5")) return one(folder, summary, 0);
    std::vector<std::string> files;
    for (int k = 1; fs::is_directory(folder / fmt::format("phase_{}", k)); ++k) {
      const fs::path phase = folder / fmt::format("phase_{}", k);
      for (auto& f : one(phase, summary_of(phase), size_t(k) - 1)) files.push_back(std::move(f));
    }
    if (!files.empty()) return files;
  } catch (const Json::exception& e) {
    throw InvalidArgument(fmt::format("{}/summary.json is damaged: {}", folder.string(), e.what()));
  }
  throw InvalidArgument(
      fmt::format("{} has no run.h5, expected the time series of a run", folder.string()));
}

}  // namespace porthos::scene
