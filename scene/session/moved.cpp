#include "scene/session/moved.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "phs/error.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/files/hdf5_reader.h"
#include "scene/plot/apart_by_size.h"
#include "scene/read/scene_texts.h"
#include "scene/run/row_times.h"
#include "scene/session/detail/summary-inl.h"
#include "scene/session/event_times-inl.h"

namespace porthos::scene {
namespace fs = std::filesystem;

namespace {

/// The numbers of a block of the state or the momenta as lines of their panel, angles with their
/// turns.
/// @param group  "state" or "momentum"
/// @param angles, turns  the names behind the columns of "turns", and its shown rows
void add_state(std::vector<TracePanel>& panels, const Records& records, const std::string& group,
               const std::string& block, const Shown& shown, const std::vector<std::string>& angles,
               const std::vector<double>& turns) {
  const bool state = group == "state";
  const std::string name = group + "/" + block;
  const size_t count = shown.rows().size();
  auto rows = records.at(name, shown.rows());
  const size_t columns = rows.size() / std::max<size_t>(count, 1);
  if (const auto at = std::ranges::find(angles, block, link_name); state && at != angles.end())
    if (turns.size() == angles.size() * rows.size())
      for (size_t i = 0; i < rows.size(); ++i)
        rows[i] += phs::two_pi_hi * turns[i * angles.size() + size_t(at - angles.begin())];
  const std::string what = fmt::format("{} [{}]", state ? "states" : "momenta", records.unit(name));
  auto panel = std::ranges::find(panels, what, &TracePanel::what);
  if (panel == panels.end()) panel = panels.insert(panel, {what, {}});
  const auto names = records.columns(name);
  for (size_t k = 0; k < columns; ++k) {
    TraceLine line{columns == 1              ? block
                   : names.size() == columns ? block + "." + names[k]
                                             : fmt::format("{}.{}", block, k)};
    for (size_t i = 0; i < count; ++i) line.value.push_back(rows[i * columns + k]);
    line.value = shown.values(line.value);
    panel->lines.push_back(std::move(line));
  }
}

}  // namespace

std::vector<TracePanel> states_of(const Records& records, const Shown& shown) {
  const auto angles = records.columns("turns");
  const auto turns = records.at("turns", shown.rows());
  std::vector<TracePanel> panels;
  for (const char* group : {"state", "momentum"})
    for (const auto& block : records.names(group))
      add_state(panels, records, group, block, shown, angles, turns);
  return panels;
}

WholeRun whole_run(const std::vector<std::unique_ptr<Records>>& phases) {
  WholeRun run;
  for (const auto& phase : phases) {
    const Records& r = *phase;
    if (!run.first) run.first = [&r](const std::string& name) { return r.at(name, {0}); };
    const auto all = [&r](const std::string& name) {
      return r.at(name, evenly(r.count(), r.count()));
    };
    for (auto& joint : turning_joints({{}, r.columns("turns"), all}))
      run.turning.push_back(std::move(joint));
  }
  return run;
}

std::vector<double> holes_in(const Records& records, const std::string& method) {
  return method == "recorded" ? before_holes(records.column("time")) : std::vector<double>();
}

std::vector<TracePanel> panels_of(const Records& r, const mechanics::Mechanism& m,
                                  const std::vector<Spring>& springs, const Shown& shown,
                                  const WholeRun& whole) {
  const auto series = [&](const std::string& name) { return r.at(name, shown.rows()); };
  MotionRecords records{series("time"), r.columns("turns"), series};
  records.whole = whole;
  for (const auto& name : r.names("output"))
    records.outputs.emplace_back(name, r.unit("output/" + name));
  records.springs = springs;
  auto panels = motion_panels(m, records);
  shown.reduce(panels);
  return panels;
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
  const auto first = open_run_file(one ? folder / "run.h5" : folder / "phase_1" / "run.h5");
  const SceneTexts texts = first->scene();
  if (texts.scene.empty()) return {};  // of a system of the user's own
  const Scene scene = read_scene_again((folder / "scene.toml").string(), texts);
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
    const auto t = open_run_file(phase / "run.h5")->column("time");
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

/// The records of each phase.
std::vector<std::unique_ptr<Records>> records_of(const std::vector<fs::path>& parts) {
  std::vector<std::unique_ptr<Records>> all;
  for (const auto& part : parts) all.push_back(open_run_file(part / "run.h5"));
  return all;
}

/// "phase 2: lock of elbow"
std::string name_of_phase(size_t k, double from, const EventTimes& happened) {
  std::string events;
  for (const auto& [event, at] : happened)
    if (std::fabs(at - from) <= 1e-9 * std::fmax(1, from)) add_to_list(events, event);
  return fmt::format("phase {}{}{}", k + 1, events.empty() ? "" : ": ", events);
}

/// panels(k, shown): those of phase k.
template <class Panels>
Motion over_phases(const fs::path& folder, const std::vector<std::unique_ptr<Records>>& phases,
                   std::int64_t most, ShownOf shown_of, const Panels& panels) {
  Motion whole;
  const auto [method, happened] = of_summary(folder, [](const nlohmann::ordered_json& s) {
    return std::pair{s.value("method", ""), event_times(s).value_or(EventTimes())};
  });
  const auto each = std::max<std::int64_t>(most / std::int64_t(phases.size()), 2);
  for (size_t k = 0; k < phases.size(); ++k) {
    const size_t before = whole.t.size();
    const Shown shown = shown_of(phases[k]->count(), each);
    for (const double t : shown.times(phases[k]->at("time", shown.rows()))) whole.t.push_back(t);
    if (k > 0 && whole.t.size() > before)
      whole.marks.push_back({whole.t[before], name_of_phase(k, whole.t[before], happened)});
    const auto holes = holes_in(*phases[k], method);
    whole.holes.insert(whole.holes.end(), holes.begin(), holes.end());
    append_phase(whole, panels(k, shown), before, whole.t.size() - before);
  }
  for (TracePanel& p : whole.panels)
    for (TraceLine& l : p.lines) l.t = whole.t;
  return whole;
}

}  // namespace

Motion motion_in(const fs::path& folder, std::int64_t most,
                 std::shared_ptr<const mechanics::Mechanism> mechanism, ShownOf shown_of) {
  require_finished(folder);
  const auto parts = parts_of(folder);
  const Moved moved = mechanism ? Moved{{parts.size(), mechanism}} : moved_in(folder);
  if (moved.mechanisms.size() < parts.size())
    throw InvalidArgument(fmt::format(
        "{} has no mechanism whose motion could be shown, expected a scene or a MechanicalModel; "
        "what = \"states\" shows its states",
        folder.string()));
  const auto phases = records_of(parts);
  const WholeRun run = whole_run(phases);
  Motion motion = over_phases(folder, phases, most, shown_of, [&](size_t k, const Shown& shown) {
    return panels_of(*phases[k], *moved.mechanisms[k], moved.springs, shown, run);
  });
  motion.panels = apart_by_size(std::move(motion.panels));
  return motion;
}

bool has_scene(const fs::path& folder) {
  return !open_run_file(parts_of(folder)[0] / "run.h5")->scene().scene.empty();
}

Motion states_in(const fs::path& folder, std::int64_t most, ShownOf shown_of) {
  require_finished(folder);
  const auto phases = records_of(parts_of(folder));
  return over_phases(folder, phases, most, shown_of,
                     [&](size_t k, const Shown& shown) { return states_of(*phases[k], shown); });
}

}  // namespace porthos::scene
