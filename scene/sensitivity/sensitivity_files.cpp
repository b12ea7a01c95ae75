// The results of porthos sensitivity: table, JSON, CSV.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene/files/files.h"
#include "scene/files/text_table.h"
#include "scene/run/provenance.h"
#include "scene/sensitivity/sensitivity.h"
#include "scene/sensitivity/sensitivity_plot.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;  // writes non-finite numbers as null

// Decades, docs/derivatives.md.
constexpr double large_growth = 8, notable_growth = 1;

std::string digits(double x, const std::string& unit) {
  return std::isfinite(x) ? fmt::format("{:.6g} {}", x, unit == "1" ? "" : unit) : "-";
}

void add_rows(TextRows& rows, const EndSensitivity& s, const EndSlopes& q, bool start,
              size_t most) {
  const auto order = s.sorted(q, start);
  if (order.empty()) return;
  std::vector<std::string> head{start ? "start value" : "parameter", "value", "slope",
                                "slope x value"};
  const bool deviates = s.uncertainty && !start;
  if (s.runs > 0) head.insert(head.begin() + 3, "+-");
  if (deviates) head.push_back("deviation");
  rows.push_back(head);
  for (size_t i = 0; i < std::min(most, order.size()); ++i) {
    const Input& in = s.inputs[order[i]];
    const double whole = s.by_whole(q, order[i]);
    rows.push_back({in.name, digits(in.value, in.unit), fmt::format("{:.4e}", q.slopes[order[i]]),
                    std::isfinite(whole) ? fmt::format("{:.4e}", whole) : "-"});
    if (s.runs > 0)
      rows.back().insert(rows.back().begin() + 3, fmt::format("{:.0e}", q.errors[order[i]]));
    if (deviates) rows.back().push_back(fmt::format("{:.2e}", *s.uncertainty * std::fabs(whole)));
  }
  if (order.size() > most) rows.push_back({fmt::format("and {} more", order.size() - most)});
}

std::string quantity_text(const EndSensitivity& s, const EndSlopes& q, size_t most) {
  std::string text = fmt::format("{} = {:.10g} {} at the end", q.name, q.value, q.unit);
  if (s.runs == 0) text += fmt::format(", growth of the gradient {:.1f}", q.growth);
  if (s.uncertainty)
    text += fmt::format(", standard deviation {:.2e} {} by the parameters", s.deviation(q), q.unit);
  text += "\n";
  if (q.growth > large_growth)
    text +=
        "  chaotic: the slopes are exact and tell nothing of a finite change, expected a shorter "
        "run\n";
  else if (s.uncertainty && q.growth > notable_growth && s.deviation(q) > std::fabs(q.value))
    text +=
        "  the deviation is larger than the value: the slopes may not hold that far, an [ensemble] "
        "tells\n";
  TextRows rows;
  add_rows(rows, s, q, false, most);
  add_rows(rows, s, q, true, most);
  return text + (rows.empty() ? "  depends on nothing\n" : aligned(rows, "  ")) + "\n";
}

/// A name in a line of CSV.
std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string number_cell(double x) { return std::isfinite(x) ? fmt::format("{}", x) : ""; }

}  // namespace

std::string sensitivity_text(const EndSensitivity& s, size_t most) {
  const std::string how =
      s.runs > 0 ? fmt::format("slopes by differences of {} runs", s.runs)
      : s.chosen > 0
          ? fmt::format("{} steps of the step control", s.chosen)
          : fmt::format("{:.0f} steps of {:g} s{}", (s.duration - s.last) / s.step, s.step,
                        s.last > 0 ? fmt::format(" and one of {:g} s", s.last) : "");
  std::string text =
      fmt::format("{}: {}, {}, {:g} s simulated\n\n", s.title, s.method, how, s.duration);
  for (const EndSlopes& q : s.of) text += quantity_text(s, q, most);
  const auto worst = std::ranges::max_element(s.of, {}, &EndSlopes::error);
  if (worst != s.of.end() && worst->error > 1e-9)
    text += fmt::format("note        the slopes of {} at the end are known to {:.0e}\n",
                        worst->name, worst->error);
  for (const auto& note : s.notes) text += "note        " + note + "\n";
  return text;
}

std::string sensitivity_json(const Scene& scene, const EndSensitivity& s) {
  Json j{{"title", s.title}, {"method", s.method}, {"step_s", s.step}, {"duration_s", s.duration}};
  j["by"] = s.runs > 0 ? "differences" : "adjoint";
  if (s.runs > 0) j["runs"] = s.runs;
  if (s.chosen > 0) j["steps_of_the_control"] = s.chosen;
  if (s.uncertainty) j["uncertainty"] = *s.uncertainty;
  j["inputs"] = Json::array();
  for (const Input& in : s.inputs)
    j["inputs"].push_back({{"name", in.name},
                           {"kind", in.start ? "start" : "parameter"},
                           {"unit", in.unit},
                           {"value", in.value}});
  j["of"] = Json::array();
  for (const EndSlopes& q : s.of) {
    Json slopes, errors;
    for (size_t i = 0; i < s.inputs.size(); ++i) slopes[s.inputs[i].name] = q.slopes[i];
    for (size_t i = 0; i < q.errors.size(); ++i) errors[s.inputs[i].name] = q.errors[i];
    j["of"].push_back({{"name", q.name},
                       {"unit", q.unit},
                       {"value", q.value},
                       {"growth", q.growth},
                       {"error", q.error},
                       {"slopes", slopes}});
    if (s.runs > 0) j["of"].back()["errors"] = errors;
    if (s.uncertainty) j["of"].back()["deviation"] = s.deviation(q);
  }
  j["notes"] = s.notes;
  for (const auto& [name, value] : provenance(scene)) j["provenance"][name] = value;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string sensitivity_csv(const EndSensitivity& s) {
  std::string text = "quantity,unit,input,kind,input_unit,value,slope,slope_x_value,error\n";
  for (const EndSlopes& q : s.of)
    for (size_t i = 0; i < s.inputs.size(); ++i) {
      const Input& in = s.inputs[i];
      text += fmt::format("{},{},{},{},{},{},{},{},{}\n", cell(q.name), q.unit, cell(in.name),
                          in.start ? "start" : "parameter", in.unit, number_cell(in.value),
                          number_cell(q.slopes[i]), number_cell(s.by_whole(q, i)),
                          q.errors.empty() ? "" : number_cell(q.errors[i]));
    }
  return text;
}

void write_sensitivity(const std::string& folder, const Scene& scene, const EndSensitivity& s) {
  write_together(folder, {{"sensitivity.svg", sensitivity_plot(s)},
                          {"sensitivity.txt", sensitivity_text(s)},
                          {"sensitivity.csv", sensitivity_csv(s)},
                          {"sensitivity.json", sensitivity_json(scene, s)}});
}

}  // namespace porthos::scene
