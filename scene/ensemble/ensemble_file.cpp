#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "scene/ensemble/ensemble.h"
#include "scene/ensemble/ensemble_plot.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/run/stop_values.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;
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
  add("status", l.status, 1, integer, "1");
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
  const std::string outputs = lines(number_names(e.scene().outputs));
  add("outputs/end", l.output_end(), l.outputs, real, "", outputs);
  add("outputs/least", l.output_least(), l.outputs, real, "", outputs);
  add("outputs/largest", l.output_largest(), l.outputs, real, "", outputs);
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

Spread spread_of(const std::vector<std::pair<double, std::int64_t>>& unsorted) {
  auto v = unsorted;
  std::sort(v.begin(), v.end());
  Spread s;
  if (v.empty()) {
    std::fill(std::begin(s.quantiles), std::end(s.quantiles), NAN);
    return s;
  }
  for (size_t i = 0; i < std::size(quantile_levels); ++i) {
    const double rank = std::ceil(quantile_levels[i] * double(v.size()));
    s.quantiles[i] = v[size_t(std::max(rank, 1.0)) - 1].first;
  }
  s.worst = v.back().second;
  return s;
}

/// outputs: at the end, the least and the largest, of all numbers each.
std::vector<RequirementWorst> worst_of(
    const Scene& scene, const std::vector<std::vector<std::pair<double, std::int64_t>>>& outputs) {
  std::vector<RequirementWorst> all;
  const auto numbers = number_names(scene.outputs);
  for (const Stop& stop : scene.stops) {
    const auto at = size_t(std::ranges::find(numbers, stop.output) - numbers.begin());
    if (!stop.is_requirement() || stop.after > 0 || at == numbers.size()) continue;
    const auto& values = outputs[at + (stop.above ? 2 : 1) * numbers.size()];
    if (values.empty()) continue;
    const auto [least, largest] =
        std::ranges::minmax_element(values, {}, &std::pair<double, std::int64_t>::first);
    const auto& worst = stop.above ? *largest : *least;
    all.push_back({name_of_check(stop), stop.output, stop.above, worst.first, worst.second});
  }
  return all;
}

/// The report over the cases of a store.
EnsembleReport report_of(const Ensemble& e, const CaseStore& store) {
  EnsembleReport r;
  const CaseLayout& l = e.layout();
  r.cases = e.cases().cases;
  r.done = store.done();
  std::vector<std::pair<double, std::int64_t>> energy, linear, angular;
  std::vector<std::vector<std::pair<double, std::int64_t>>> times(l.events);
  std::vector<double> row(l.size());
  std::vector<std::vector<std::pair<double, std::int64_t>>> outputs(3 * l.outputs);
  r.stopped.assign(l.stops, 0);
  std::map<std::string, std::int64_t> failed, open;
  for (std::int64_t i = 0; i < r.cases; ++i) {
    if (!store.has(i)) continue;
    store.read(i, row);
    for (size_t k = 0; k < l.events; ++k)
      if (const double at = row[l.event_time() + k]; !std::isnan(at)) times[k].emplace_back(at, i);
    for (size_t k = 0; k < outputs.size(); ++k)
      if (const double v = row[l.output_end() + k]; !std::isnan(v)) outputs[k].emplace_back(v, i);
    if (l.stops > 0 && integer(row[l.stop()]) >= 0) ++r.stopped[size_t(integer(row[l.stop()]))];
    for (const auto& check : e.checks().names_of(integer(row[l.failed]))) ++failed[check];
    if (l.stops > 0)
      for (const auto& check : e.checks().names_of(integer(row[l.open()]))) ++open[check];
    const int status = int(integer(row[l.status]));
    if (status != 0) {
      ++r.failures[case_status(status)];
    } else {
      energy.emplace_back(row[l.energy], i);
      linear.emplace_back(row[l.linear], i);
      angular.emplace_back(row[l.angular], i);
    }
    const auto verdict = integer(row[l.passed]);
    if (verdict == 2) ++r.not_judged;
    if (verdict == 1)
      ++r.passed;
    else if (r.not_passed.size() < 10)
      r.not_passed.push_back(i);
  }
  for (const auto& name : e.checks().names()) {
    if (failed.count(name)) r.failed_checks.emplace_back(name, failed[name]);
    if (open.count(name)) r.not_judged_checks.emplace_back(name, open[name]);
  }
  r.energy = spread_of(energy);
  r.linear = spread_of(linear);
  r.angular = spread_of(angular);
  const auto names = event_names(e.scene());
  for (size_t k = 0; k < l.events; ++k)
    r.events.push_back({names[k], std::int64_t(times[k].size()), spread_of(times[k])});
  r.requirements = worst_of(e.scene(), outputs);
  const auto numbers = number_names(e.scene().outputs);
  for (size_t k = 0; k < l.outputs; ++k)
    r.outputs.push_back({numbers[k], spread_of(outputs[k]), spread_of(outputs[l.outputs + k]),
                         spread_of(outputs[2 * l.outputs + k])});
  return r;
}

Json json_of(const Spread& s) {
  static const char* names[] = {"min", "q05", "q25", "median", "q75", "q95", "max"};
  Json j;
  for (size_t i = 0; i < std::size(names); ++i) j[names[i]] = s.quantiles[i];
  if (s.worst >= 0) j["case_of_max"] = s.worst;
  return j;
}

}  // namespace

std::string worst_text(const EnsembleReport& r, const std::string& check) {
  const auto at = std::ranges::find(r.requirements, check, &RequirementWorst::check);
  if (at == r.requirements.end()) return "";
  return fmt::format("; the {} {} at the records is {:.4g}, in case {}",
                     at->above ? "largest" : "least", at->output, at->value, at->of_case);
}

std::string ensemble_json(const Ensemble& e, const CaseStore& store, const EnsembleReport& r) {
  const CaseLayout& l = e.layout();
  Json j;
  j["title"] = e.scene().title;
  j["method"] = e.scene().method;
  j["step_s"] = e.scene().step;
  j["duration_s"] = e.scene().duration;
  j["cases"] = r.cases;
  j["passed"] = r.passed;
  j["not_judged"] = r.not_judged;
  j["verdict"] = to_string(r.verdict());
  Json failures = Json::object();
  for (const auto& [why, count] : r.failures) failures[why] = count;
  j["failures"] = failures;
  j["failed_checks"] = Json::object();
  for (const auto& [check, count] : r.failed_checks) j["failed_checks"][check] = count;
  j["not_judged_checks"] = Json::object();
  for (const auto& [check, count] : r.not_judged_checks) j["not_judged_checks"][check] = count;
  j["energy_error"] = json_of(r.energy);
  const phs::Description& d = e.assembly().model->description();
  for (const auto& i : d.invariants) {
    if (i.name == "linear_momentum") j["linear_momentum_error"] = json_of(r.linear);
    if (i.name == "angular_momentum") j["angular_momentum_error"] = json_of(r.angular);
  }
  const Limits& limits = e.scene().verify;
  j["limits"] = Json::object();
  for (const auto& [name, limit] : {std::pair{"energy_error", limits.energy},
                                    {"linear_momentum_error", limits.linear_momentum},
                                    {"angular_momentum_error", limits.angular_momentum}})
    if (limit) j["limits"][name] = *limit;
  for (const EventSpread& event : r.events)
    j["events"].push_back(
        {{"event", event.name}, {"happened", event.happened}, {"time_s", json_of(event.time)}});
  for (const OutputSpread& o : r.outputs)
    j["outputs"][o.name] = {
        {"end", json_of(o.end)}, {"least", json_of(o.least)}, {"largest", json_of(o.largest)}};
  for (const RequirementWorst& w : r.requirements)
    j["requirements"][w.check] = {{"output", w.output},
                                  {"is", w.above ? "largest" : "least"},
                                  {"value", w.value},
                                  {"case", w.of_case}};
  for (size_t k = 0; k < l.stops; ++k)
    if (const Stop& stop = e.scene().stops[k]; stop.ends) j["stopped"][stop.name] = r.stopped[k];
  Json not_passed = Json::array();
  std::vector<double> row(l.size());
  const auto names = e.cases().column_names();
  for (const std::int64_t i : r.not_passed) {
    store.read(i, row);
    Json inputs = Json::object();
    for (size_t k = 0; k < names.size(); ++k) inputs[names[k]] = row[l.inputs + k];
    Json one = {{"case", i},
                {"status", case_status(int(integer(row[l.status])))},
                {"failed_checks", e.checks().names_of(integer(row[l.failed]))},
                {"steps", integer(row[l.steps])},
                {"energy_error", row[l.energy]},
                {"inputs", inputs}};
    for (size_t k = 0; k < l.events; ++k)
      if (std::isnan(row[l.event_time() + k])) one["never_happened"].push_back(r.events[k].name);
    not_passed.push_back(one);
  }
  j["first_not_passed"] = not_passed;
  return j.dump(2) + "\n";
}

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
  EnsembleReport r = report_of(e, store);
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
