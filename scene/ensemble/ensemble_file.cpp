#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "scene/assemble/key_unit.h"
#include "scene/assemble/outputs.h"
#include "scene/ensemble/ensemble.h"
#include "scene/ensemble/ensemble_plot.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"

namespace porthos::scene {
namespace {

using Kind = Hdf5File::Kind;

constexpr std::int64_t rows_at_once = 4096;  // a chunk of the file

std::string lines(const std::vector<std::string>& names) {
  return fmt::format("{}", fmt::join(names, "\n"));
}

std::vector<std::string> event_names(const Scene& s) {
  std::vector<std::string> names;
  for (const Event& e : s.events) names.push_back(text(e));
  return names;
}

/// A dataset and the numbers of a row it is filled from.
struct CaseColumn {
  Hdf5File::Dataset data;
  size_t first, count;
  Kind kind;
};

/// The attributes and texts that say what the cases are, and the groups of their numbers.
void write_head(Hdf5File& file, const Ensemble& e) {
  const Scene& s = e.scene();
  const EnsembleScene& cases = e.cases();
  file.attribute("/", "title", s.title);
  file.attribute("/", "method", s.method);
  file.attribute("/", "step_s", s.step);
  file.attribute("/", "duration_s", s.duration);
  file.attribute("/", "cases", double(cases.cases));
  file.attribute("/", "sampling",
                 std::string(!cases.rows.empty() ? "table"
                             : cases.sobol       ? "sobol"
                                                 : "random"));
  file.attribute("/", "seed", std::to_string(cases.seed));
  file.group("provenance");
  for (const auto& [name, value] : provenance(s)) file.attribute("provenance", name, value);
  file.text("provenance/scene", s.text);
  file.text("provenance/model", s.urdf_text);
  if (!s.files.empty()) file.text("provenance/files", to_text(s.files));
  if (!cases.table_text.empty()) file.text("provenance/table", cases.table_text);
  file.group("final");
  if (e.layout().events > 0) file.group("events");
  if (e.layout().outputs > 0) file.group("outputs");
}

/// A dataset for every column of the cases.
std::vector<CaseColumn> add_columns(Hdf5File& file, const Ensemble& e) {
  const CaseLayout& l = e.layout();
  std::vector<CaseColumn> columns;
  const auto add = [&](const char* name, size_t first, size_t count, Kind kind, const char* unit,
                       const std::string& names = "") {
    if (count == 0) return;
    columns.push_back(
        {file.dataset(name, e.cases().cases, names.empty() ? 0 : std::int64_t(count), kind), first,
         count, kind});
    if (*unit) columns.back().data.attribute("unit", std::string(unit));
    if (!names.empty()) columns.back().data.attribute("columns", names);
  };
  constexpr Kind real = Kind::real, integer = Kind::integer;
  add("inputs", l.inputs, l.columns, real, "", lines(e.cases().column_names()));
  if (l.columns > 0) {
    std::vector<std::string> of_inputs;
    for (const auto& key : e.cases().column_names())
      of_inputs.push_back(unit_of_key(e.scene(), key, e.assembly()));
    columns.back().data.attribute("units", lines(of_inputs));
  }
  add("status", l.status, 1, integer, "1");
  std::vector<std::string> statuses;
  for (int k = 0; k <= case_event_refused; ++k) statuses.emplace_back(case_status(k));
  columns.back().data.attribute("names", lines(statuses));
  add("steps", l.steps, 1, integer, "1");
  add("passed", l.passed, 1, integer, "1");
  add("failed_checks", l.failed, 1, integer, "1");
  columns.back().data.attribute("names", lines(e.checks().names()));
  add("energy_error", l.energy, 1, real, "1");
  add("energy_error_rms", l.energy_rms, 1, real, "1");
  add("energy_error_J", l.energy_abs, 1, real, "J");
  add("energy_scale", l.energy_scale, 1, real, "J");
  add("energy_initial", l.energy_initial, 1, real, "J");
  add("linear_momentum_error", l.linear, 1, real, "1");
  add("angular_momentum_error", l.angular, 1, real, "1");
  add("quaternion_norm_error", l.quaternion, 1, real, "1");
  const std::string numbers = lines(e.state_columns().numbers());
  add("final/x", l.x(), l.nx, real, "", numbers);
  add("final/low_words", l.low(), l.nx, real, "", numbers);
  add("final/turns", l.turn(), l.turns, integer, "1", lines(e.state_columns().angles()));
  const std::string events = lines(event_names(e.scene()));
  add("events/time", l.event_time(), l.events, real, "s", events);
  add("events/dissipated", l.event_loss(), l.events, real, "J", events);
  const std::string outputs = lines(number_names(e.scene().outputs)),
                    units = lines(number_units(e.scene(), e.assembly()));
  for (const auto& [name, at] : {std::pair{"outputs/end", l.output_end()},
                                 {"outputs/least", l.output_least()},
                                 {"outputs/largest", l.output_largest()}}) {
    add(name, at, l.outputs, real, "", outputs);
    if (l.outputs > 0) columns.back().data.attribute("units", units);
  }
  if (l.stops > 0) {
    add("end_time", l.end_time(), 1, real, "s");
    add("stop", l.stop(), 1, integer, "1");
    add("not_judged_checks", l.open(), 1, integer, "1");
    columns.back().data.attribute("names", lines(e.checks().names()));
  }
  return columns;
}

void write_rows(std::vector<CaseColumn>& columns, const CaseStore& store, const CaseLayout& l,
                std::int64_t cases) {
  std::vector<double> rows(size_t(rows_at_once) * l.size()), reals;
  std::vector<std::int64_t> integers;
  for (std::int64_t at = 0; at < cases; at += rows_at_once) {
    const auto n = size_t(std::min(rows_at_once, cases - at));
    for (size_t i = 0; i < n; ++i)
      store.read(at + std::int64_t(i), std::span(rows).subspan(i * l.size(), l.size()));
    for (CaseColumn& c : columns) {
      reals.clear();
      integers.clear();
      for (size_t i = 0; i < n; ++i)
        for (size_t k = 0; k < c.count; ++k) {
          const double v = rows[i * l.size() + c.first + k];
          c.kind == Kind::real ? reals.push_back(v) : integers.push_back(scene::integer(v));
        }
      c.kind == Kind::real ? c.data.write(at, std::span<const double>(reals))
                           : c.data.write(at, std::span<const std::int64_t>(integers));
    }
  }
}

void write_file(const std::filesystem::path& path, const Ensemble& e, const CaseStore& store) {
  Hdf5File file(aside(path));
  write_head(file, e);
  {
    auto columns = add_columns(file, e);
    write_rows(columns, store, e.layout(), e.cases().cases);
  }  // datasets close before their file
  file.close();
}

}  // namespace

void write_ensemble(const std::filesystem::path& folder, const Ensemble& e, const CaseStore& store,
                    const EnsembleReport& r) {
  const auto h5 = folder / "ensemble.h5", svg = folder / "ensemble.svg",
             json = folder / "ensemble.json";
  write_file(h5, e, store);
  const std::string text = ensemble_json(e, store, r);
  write_aside(svg, ensemble_plot(aside(h5), text));
  write_aside(json, text);
  for (const auto& path : {h5, svg, json}) put_in_place(path);
}

EnsembleReport finish_ensemble(const Ensemble& e, CaseStore& store, const EnsembleOptions& o) {
  EnsembleReport r = report_on(e, store);
  r.damage = store.damage();
  if (r.done < r.cases) return r;
  // The last part does not write what --join writes: another process may be writing it too.
  if (!o.part.whole()) return r;
  write_ensemble(o.out, e, store, r);
  r.complete = true;
  r.left_over = store.remove();
  return r;
}

}  // namespace porthos::scene
