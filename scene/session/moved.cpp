#include "scene/session/moved.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/read/scene_texts.h"
#include "scene/session/detail/summary-inl.h"
#include "scene/session/event_times-inl.h"

namespace porthos::scene {
namespace fs = std::filesystem;

namespace {

/// The columns of a series at rows; empty: there is none.
std::vector<double> rows_of(const Hdf5Reader& file, const std::string& name,
                            const std::vector<std::int64_t>& shown) {
  std::vector<double> some;
  if (!file.datasets().count(name)) return some;
  const auto& d = file.dataset(name);
  const size_t columns = d.shape.size() > 1 ? size_t(d.shape[1]) : 1;
  std::vector<double> all(size_t(d.size()));
  file.read(name, all.data());
  for (const auto row : shown)
    if ((size_t(row) + 1) * columns <= all.size())
      some.insert(some.end(), all.begin() + long(size_t(row) * columns),
                  all.begin() + long((size_t(row) + 1) * columns));
  return some;
}

}  // namespace

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

namespace {

/// The names behind the columns of "turns" in a file.
std::vector<std::string> turning(const Hdf5Reader& file) {
  if (!file.datasets().count("turns")) return {};
  return lines_of(file.texts("turns")["columns"]);
}

/// The numbers of a series "state/..." or "momentum/..." as lines of their panel, angles with their
/// turns.
/// @param angles, turns  the names behind the columns of "turns", and its shown rows
void add_state(std::vector<TracePanel>& panels, const Hdf5Reader& file, const std::string& name,
               const std::vector<std::int64_t>& shown, const std::vector<std::string>& angles,
               const std::vector<double>& turns) {
  const bool state = name.starts_with("state/");
  const std::string block = name.substr(name.find('/') + 1);
  auto rows = rows_of(file, name, shown);
  const size_t columns = rows.size() / std::max<size_t>(shown.size(), 1);
  if (const auto at = std::ranges::find(angles, block); state && at != angles.end())
    if (turns.size() == angles.size() * rows.size())
      for (size_t i = 0; i < rows.size(); ++i)
        rows[i] += phs::two_pi_hi * turns[i * angles.size() + size_t(at - angles.begin())];
  auto texts = file.texts(name);
  const std::string what = fmt::format("{} [{}]", state ? "states" : "momenta", texts["unit"]);
  auto panel = std::ranges::find(panels, what, &TracePanel::what);
  if (panel == panels.end()) panel = panels.insert(panel, {what, {}});
  const auto names = lines_of(texts["columns"]);
  for (size_t k = 0; k < columns; ++k) {
    TraceLine line{columns == 1              ? block
                   : names.size() == columns ? block + "." + names[k]
                                             : fmt::format("{}.{}", block, k)};
    for (size_t i = 0; i < shown.size(); ++i) line.value.push_back(rows[i * columns + k]);
    panel->lines.push_back(std::move(line));
  }
}

std::vector<TracePanel> states_of(const Hdf5Reader& file, std::int64_t most) {
  const auto shown = evenly(file.dataset("time").size(), most);
  const auto angles = turning(file);
  const auto turns = rows_of(file, "turns", shown);
  std::vector<TracePanel> panels;
  for (const char* group : {"state/", "momentum/"})
    for (const auto& [name, d] : file.datasets())
      if (name.starts_with(group)) add_state(panels, file, name, shown, angles, turns);
  return panels;
}

}  // namespace

std::vector<TracePanel> panels_of(const Hdf5Reader& file, const mechanics::Mechanism& m,
                                  const std::vector<Spring>& springs, std::int64_t most,
                                  const WholeRun& whole) {
  const auto shown = evenly(file.dataset("time").size(), most);
  const auto series = [&](const std::string& name) { return rows_of(file, name, shown); };
  MotionRecords records{series("time"), turning(file), series};
  records.whole = whole;
  for (const auto& [name, d] : file.datasets())
    if (name.starts_with("output/"))
      records.outputs.emplace_back(name.substr(7), file.texts(name)["unit"]);
  records.springs = springs;
  return motion_panels(m, records);
}

Moved moved_in(const fs::path& part) {
  const fs::path folder = fs::weakly_canonical(part);
  if (const auto phase = folder.filename().string();
      phase.starts_with("phase_") && fs::exists(folder.parent_path() / "summary.json")) {
    Moved all = moved_in(folder.parent_path());
    const size_t k = std::strtoul(phase.c_str() + 6, nullptr, 10) - 1;
    all.mechanisms = k < all.mechanisms.size() ? decltype(all.mechanisms){all.mechanisms[k]}
                                               : decltype(all.mechanisms){};
    return all;
  }
  require_finished(folder);
  const bool one = fs::exists(folder / "run.h5");
  const Hdf5Reader first(one ? folder / "run.h5" : folder / "phase_1" / "run.h5");
  const auto text = [&](const char* name) {
    return first.datasets().count(name) ? first.text(name) : std::string();
  };
  if (text("provenance/scene").empty()) return {};  // of a system of the user's own
  const Scene scene = read_scene_again(
      (folder / "scene.toml").string(),
      {text("provenance/scene"), text("provenance/model"), input_files(text("provenance/files"))});
  const Assembly assembly = assemble(scene);
  if (!assembly.mechanism) return {};
  Moved all{{assembly.mechanism}, springs_of(scene)};
  if (one) return all;
  const auto happened =
      of_summary(folder, [](const nlohmann::ordered_json& s) { return event_times(s); });
  mechanics::MovingMechanism moving(assembly.parts);
  pass_events(moving, scene, assembly.initial, 0, happened);
  all.mechanisms = {{moving.model, &moving.model->mechanism()}};
  for (size_t k = 1; fs::is_directory(phase_folder(folder, k + 1)); ++k) {
    const fs::path phase = phase_folder(folder, k);
    const auto t = column(Hdf5Reader(phase / "run.h5"), "time");
    pass_events(moving, scene, phase, t.empty() ? 0 : t.back(), happened);
    all.mechanisms.emplace_back(moving.model, &moving.model->mechanism());
  }
  return all;
}

std::vector<fs::path> parts_of(const fs::path& folder) {
  std::vector<fs::path> parts;
  for (const auto& file : series_files(folder)) parts.push_back(file.parent_path());
  if (const auto lost = phase_folder(folder, parts.size() + 1);
      parts[0] != folder && fs::is_directory(lost))
    throw InvalidArgument(
        fmt::format("{} has no run.h5, expected the time series of a phase", lost.string()));
  return parts;
}

namespace {

/// The panels of a phase in `whole`, whose lines have `before` numbers of earlier phases and then
/// `count` of this one. The last numbers of a line count.
void append_phase(Motion& whole, const std::vector<TracePanel>& panels, size_t before,
                  size_t count) {
  for (const TracePanel& p : panels) {
    auto to = std::ranges::find(whole.panels, p.what, &TracePanel::what);
    if (to == whole.panels.end()) to = whole.panels.insert(to, {p.what, {}});
    for (const TraceLine& l : p.lines) {
      auto line = std::ranges::find(to->lines, l.name, &TraceLine::name);
      if (line == to->lines.end()) line = to->lines.insert(line, {l.name});
      line->value.resize(before, std::nan(""));
      line->value.insert(line->value.end(), l.value.end() - long(count), l.value.end());
    }
  }
  for (TracePanel& p : whole.panels)
    for (TraceLine& l : p.lines) l.value.resize(before + count, std::nan(""));
}

/// panels(k, file, most): those of phase k.
template <class Panels>
Motion over_phases(const std::vector<fs::path>& parts, std::int64_t most, const Panels& panels) {
  Motion whole;
  for (size_t k = 0; k < parts.size(); ++k) {
    const Hdf5Reader file(parts[k] / "run.h5");
    const auto t = column(file, "time");
    const auto each = std::max<std::int64_t>(most / std::int64_t(parts.size()), 2);
    const size_t before = whole.t.size();
    for (const auto i : evenly(std::int64_t(t.size()), each)) whole.t.push_back(t[size_t(i)]);
    append_phase(whole, panels(k, file, each), before, whole.t.size() - before);
  }
  for (TracePanel& p : whole.panels)
    for (TraceLine& l : p.lines) l.t = whole.t;
  return whole;
}

}  // namespace

Motion motion_in(const fs::path& folder, std::int64_t most,
                 std::shared_ptr<const mechanics::Mechanism> mechanism) {
  require_finished(folder);
  const auto parts = parts_of(folder);
  const Moved moved = mechanism ? Moved{{parts.size(), mechanism}} : moved_in(folder);
  if (moved.mechanisms.size() < parts.size())
    throw InvalidArgument(fmt::format(
        "{} has no mechanism whose motion could be shown, expected a scene or a MechanicalModel; "
        "what = \"states\" shows its states",
        folder.string()));
  const Hdf5Reader start(parts[0] / "run.h5");
  WholeRun run{[&](const std::string& name) { return rows_of(start, name, {0}); }};
  for (const auto& part : parts) {
    const Hdf5Reader file(part / "run.h5");
    const auto n = file.dataset("time").size();
    const auto all = [&](const std::string& name) { return rows_of(file, name, evenly(n, n)); };
    for (auto& joint : turning_joints({{}, turning(file), all}))
      run.turning.push_back(std::move(joint));
  }
  return over_phases(parts, most, [&](size_t k, const Hdf5Reader& file, std::int64_t each) {
    return panels_of(file, *moved.mechanisms[k], moved.springs, each, run);
  });
}

bool has_scene(const fs::path& folder) {
  const Hdf5Reader first(parts_of(folder)[0] / "run.h5");
  return first.datasets().count("provenance/scene") > 0 && !first.text("provenance/scene").empty();
}

Motion states_in(const fs::path& folder, std::int64_t most) {
  require_finished(folder);
  return over_phases(parts_of(folder), most, [](size_t, const Hdf5Reader& file, std::int64_t each) {
    return states_of(file, each);
  });
}

}  // namespace porthos::scene
