#include "scene/read/element.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/mechanical_model.h"
#include "phs/csv_table.h"
#include "phs/functions/pieces.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

namespace {

/// Each value until the next, at even times from 0.
phs::FunctionPtr held_signal(const Table& file, const CsvTable& csv,
                             const std::vector<double>& times, std::vector<double> values,
                             double* period) {
  if (!period)
    file.fail("between",
              "is \"held\", which an element of type \"force\" can be, expected \"smooth\"");
  if (times.size() < 2 || times[0] != 0)
    refuse(csv.at(0), "a held signal begins at time 0 and has 2 rows or more");
  *period = times[1];
  for (size_t i = 1; i < times.size(); ++i)
    if (!(std::fabs(times[i] - double(i) * *period) <= 1e-9 * times[i]))
      refuse(csv.at(i),
             fmt::format("the time is {:.10g} s, expected even steps of {:.10g} s because "
                         "the values are held",
                         times[i], *period));
  return phs::pieces(*period, {0.5}, std::move(values));
}

phs::FunctionPtr file_signal(const Table& file, double* period) {
  const auto content = file.content("path");
  const CsvTable csv(content.path, content.text);
  const auto column = [&](const char* key, const char* otherwise) {
    return csv.column(file.has(key) || !*otherwise ? file.text(key, "the name of a column")
                                                   : otherwise);
  };
  const auto times = column("time", "t"), values = column("value", "");
  if (file.choice("between") == "held") return held_signal(file, csv, times, values, period);
  for (size_t i = 1; i < times.size(); ++i)
    if (!(times[i] > times[i - 1]))
      refuse(csv.at(i), fmt::format("the time is {:.10g} s after {:.10g} s, expected a later one",
                                    times[i], times[i - 1]));
  return at_line(file.at("path"), [&] { return phs::profile(times, values); });
}

}  // namespace

phs::FunctionPtr read_signal(const Table& t, const std::string& unit, double* period) {
  const int given = t.has("constant") + t.has("sine") + t.has("profile") + t.has("file");
  if (given != 1)
    refuse(t.where(),
           fmt::format("{} has {} of the keys constant, sine, profile and file, expected one",
                       t.label(), given));
  if (t.has("file")) return file_signal(t.table("file"), period);
  if (t.has("constant")) return phs::constant(t.number("constant", unit));
  if (t.has("sine")) {
    const Table s = t.table("sine");
    return phs::sine(s.number("amplitude", unit), s.number("frequency"), s.number("phase"),
                     s.number("offset"));
  }
  const Table p = t.table("profile");
  return phs::profile(p.list("times"), p.list("values", unit));
}

std::string overshoot(const Table& signal) {
  if (!signal.has("profile")) return {};
  const Table p = signal.table("profile");
  const auto times = p.list("times"), values = p.list("values");
  const auto curve = phs::profile(times, values);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  double most = 0.05 * (*high - *low), at = 0, reached = NAN;
  constexpr int samples = 64;  // of a cubic between two points: its extremum to 1e-3 of it
  for (size_t i = 1; i < times.size(); ++i)
    for (int k = 1; k < samples; ++k) {
      const double t = times[i - 1] + (times[i] - times[i - 1]) * k / samples, y = (*curve)(t);
      if (const double beyond = std::max(*low - y, y - *high); beyond > most) {
        most = beyond;
        at = t;
        reached = y;
      }
    }
  if (std::isnan(reached)) return {};
  return fmt::format(
      "the profile reaches {:.3g} at {:.3g} s, beyond its values {:g} to {:g}: it is a smooth "
      "curve through them (a spline), expected more points",
      reached, at, *low, *high);
}

void JointElement::require_freedom(const Element& e) const {
  if (place.size == 1) return;
  std::string names;
  for (const auto& f : freedoms_of(model.mechanism()))
    if ("mechanism." + f.of->name == place.coordinate) add_to_list(names, f.name);
  throw InvalidArgument(fmt::format(
      "element '{}': a {} acts at one degree of freedom and '{}' has {}, expected one of: {}",
      e.name, e.type, e.joint, place.size, names));
}

void JointElement::require_number(const Element& e) const {
  if (place.size == 1 && !place.coordinate.empty()) return;
  throw InvalidArgument(fmt::format(
      "element '{}': a {} depends on a coordinate of one number and '{}' is {}, expected "
      "a joint of one degree of freedom",
      e.name, e.type, e.joint, place.size > 1 ? "one of several" : "a rate without a coordinate"));
}

std::vector<Element> read_elements(const Table& scene) {
  std::vector<Element> list;
  scene.each_of("element", "type", [&](const std::string& word, const Table& t) {
    const auto& types = element_types();
    const auto type = std::find_if(types.begin(), types.end(),
                                   [&](const ElementType& each) { return each.name == word; });
    Element e;
    e.type = word;
    e.where = t.where();
    if (type->place == ElementType::Place::joint) {
      e.joint = t.text("joint", "the name of a joint");
      e.name = t.has("name") ? t.text("name", "text") : e.joint + "." + word;
    } else {
      e.name = t.text("name", "the name of its row in the ledger");
    }
    at_line(e.where, [&] { type->read(t, e); });
    if (e.remark.empty()) {
      e.remark = overshoot(word == "dc_motor" ? t.table("voltage") : t);
      if (!e.remark.empty()) e.remark += ", or the key pieces";
    }
    list.push_back(std::move(e));
  });
  return list;
}

void add_elements(phs::Network& n, const mechanics::MechanicalModel& model,
                  const std::vector<Element>& elements) {
  for (const Element& e : elements) {
    if (!e.add) continue;  // on links, a stop, or dry friction
    const JointPlace at = element_place(model, e.where, "element '" + e.name + "'", e.joint);
    at_line(e.where, [&] { e.add(e, {n, model, at}); });
  }
}

}  // namespace porthos::scene
