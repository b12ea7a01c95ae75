#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/assemble/outputs.h"
#include "scene/ensemble/ensemble.h"
#include "scene/run/stop_values.h"
#include "scene/run/verdict.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;

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
    const Scene& scene, const std::vector<std::string>& units,
    const std::vector<std::vector<std::pair<double, std::int64_t>>>& outputs) {
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
    all.push_back({name_of_check(stop), stop.output, units[at], stop.limit, stop.above, worst.first,
                   worst.second});
  }
  return all;
}

Json json_of(const Spread& s) {
  static const char* names[] = {"min", "q05", "q25", "median", "q75", "q95", "max"};
  Json j;
  for (size_t i = 0; i < std::size(names); ++i) j[names[i]] = s.quantiles[i];
  if (s.worst >= 0) j["case_of_max"] = s.worst;
  return j;
}

/// Cases by what happened to them.
class Kinds {
 public:
  void add(const std::string& name, std::int64_t of_case) {
    CaseKind& kind = all_[name];
    ++kind.count;
    if (kind.first.size() < CaseKind::most_named) kind.first.push_back(of_case);
  }
  /// Those of these names, in their order.
  std::vector<CaseKind> in_order(const std::vector<std::string>& names) const {
    std::vector<CaseKind> list;
    for (const auto& name : names)
      if (const auto kind = all_.find(name); kind != all_.end()) {
        list.push_back(kind->second);
        list.back().name = name;
      }
    return list;
  }
  std::vector<CaseKind> all() const {
    std::vector<std::string> names;
    for (const auto& [name, kind] : all_) names.push_back(name);
    return in_order(names);
  }

 private:
  std::map<std::string, CaseKind> all_;
};

/// The counts of kinds in ensemble.json, and the first cases of each beside them.
void put_kinds(Json& j, const char* what, const std::vector<CaseKind>& kinds) {
  j[what] = Json::object();
  j["first_cases"][what] = Json::object();
  for (const CaseKind& kind : kinds) {
    j[what][kind.name] = kind.count;
    j["first_cases"][what][kind.name] = kind.first;
  }
}

}  // namespace

const CaseKind* find_kind(const std::vector<CaseKind>& kinds, const std::string& name) {
  const auto at = std::ranges::find(kinds, name, &CaseKind::name);
  return at == kinds.end() ? nullptr : &*at;
}

std::string with_unit(const std::string& number, const std::string& unit) {
  return unit.empty() || unit == "1" ? number : number + " " + unit;
}

std::string limit_text(const Ensemble& e, const std::string& check) {
  if (const auto limit = limit_of_check(e.scene(), check)) return fmt::format("{:g}", *limit);
  const auto numbers = number_names(e.scene().outputs);
  const auto units = number_units(e.scene(), e.assembly());
  for (const Stop& stop : e.scene().stops) {
    if (!stop.is_requirement() || name_of_check(stop) != check) continue;
    const auto at = size_t(std::ranges::find(numbers, stop.output) - numbers.begin());
    return fmt::format("{} {}", stop.above ? "at most" : "at least",
                       with_unit(fmt::format("{:g}", stop.limit), units.at(at)));
  }
  return "";
}

EnsembleReport report_on(const Ensemble& e, const CaseStore& store) {
  EnsembleReport r;
  const CaseLayout& l = e.layout();
  r.cases = e.cases().cases;
  r.done = store.done();
  std::vector<std::pair<double, std::int64_t>> energy, linear, angular;
  std::vector<std::vector<std::pair<double, std::int64_t>>> times(l.events);
  std::vector<double> row(l.size());
  std::vector<std::vector<std::pair<double, std::int64_t>>> outputs(3 * l.outputs);
  r.stopped.assign(l.stops, 0);
  Kinds failures, failed, open;
  for (std::int64_t i = 0; i < r.cases; ++i) {
    if (!store.has(i)) continue;
    store.read(i, row);
    for (size_t k = 0; k < l.events; ++k)
      if (const double at = row[l.event_time() + k]; !std::isnan(at)) times[k].emplace_back(at, i);
    for (size_t k = 0; k < outputs.size(); ++k)
      if (const double v = row[l.output_end() + k]; !std::isnan(v)) outputs[k].emplace_back(v, i);
    if (l.stops > 0 && integer(row[l.stop()]) >= 0) ++r.stopped[size_t(integer(row[l.stop()]))];
    for (const auto& check : e.checks().names_of(integer(row[l.failed]))) failed.add(check, i);
    if (l.stops > 0)
      for (const auto& check : e.checks().names_of(integer(row[l.open()]))) open.add(check, i);
    const int status = int(integer(row[l.status]));
    if (status != 0) {
      failures.add(case_status(status), i);
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
  r.failures = failures.all();
  r.failed_checks = failed.in_order(e.checks().names());
  r.not_judged_checks = open.in_order(e.checks().names());
  r.energy = spread_of(energy);
  r.linear = spread_of(linear);
  r.angular = spread_of(angular);
  for (size_t k = 0; k < l.events; ++k)
    r.events.push_back(
        {text(e.scene().events[k]), std::int64_t(times[k].size()), spread_of(times[k])});
  const auto units = number_units(e.scene(), e.assembly());
  r.requirements = worst_of(e.scene(), units, outputs);
  const auto numbers = number_names(e.scene().outputs);
  for (size_t k = 0; k < l.outputs; ++k)
    r.outputs.push_back({numbers[k], units[k], spread_of(outputs[k]),
                         spread_of(outputs[l.outputs + k]), spread_of(outputs[2 * l.outputs + k])});
  return r;
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
  put_kinds(j, "failures", r.failures);
  put_kinds(j, "failed_checks", r.failed_checks);
  put_kinds(j, "not_judged_checks", r.not_judged_checks);
  j["check_limits"] = Json::object();
  for (const auto& kinds : {r.failed_checks, r.not_judged_checks})
    for (const CaseKind& kind : kinds)
      if (auto limit = limit_text(e, kind.name); !limit.empty())
        j["check_limits"][kind.name] = limit;
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
    j["outputs"][o.name] = {{"unit", o.unit},
                            {"end", json_of(o.end)},
                            {"least", json_of(o.least)},
                            {"largest", json_of(o.largest)}};
  for (const RequirementWorst& w : r.requirements)
    j["requirements"][w.check] = {{"output", w.output}, {"unit", w.unit},
                                  {"limit", w.limit},   {"is", w.above ? "largest" : "least"},
                                  {"value", w.value},   {"case", w.of_case}};
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

}  // namespace porthos::scene
