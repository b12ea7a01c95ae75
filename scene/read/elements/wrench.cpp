#include "phs/csv_table.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// Three columns of a file, those that are named.
space::Wrench::Signals components(const Table& t) {
  const auto content = t.content("path");
  const CsvTable csv(content.path, content.text);
  const auto times = csv.column(t.has("time") ? t.text("time", "the name of a column") : "t");
  space::Wrench::Signals all;
  const std::pair<const char*, Vec3d> axes[] = {
      {"x", {1, 0, 0}}, {"y", {0, 1, 0}}, {"z", {0, 0, 1}}};
  for (const auto& [axis, along] : axes)
    if (t.has(axis)) {
      const auto values = csv.column(t.text(axis, "the name of a column"));
      all.push_back({along, at_line(t.at(axis), [&] { return phs::profile(times, values); })});
    }
  if (all.empty()) refuse(t.where(), t.label() + " names no column, expected x, y or z");
  return all;
}

space::Wrench::Signals read_vector(const Table& wrench, const char* key, const char* unit) {
  if (!wrench.has(key)) return {};
  const Table t = wrench.table(key);
  if (!t.has("components")) return {{t.direction("direction"), read_signal(t, unit)}};
  for (const char* other : {"direction", "constant", "sine", "profile", "file"})
    if (t.has(other)) t.fail(other, "is given besides components, expected one of both");
  return components(t.table("components"));
}

void read_wrench(const Table& t, Element& e) {
  space::Wrench w;
  w.name = e.name;
  w.link = t.text("link", "the name of a link");
  w.position = t.vector("at");
  w.in_world = t.choice("axes") == "world";
  w.force = read_vector(t, "force", " of N");
  w.moment = read_vector(t, "moment", " of N m");
  if (w.force.empty() && w.moment.empty())
    refuse(t.where(), "wrench '" + e.name + "' has no force and no moment, expected one or both");
  e.wrench = std::move(w);
}

}  // namespace

ElementType wrench_element() {
  using namespace keys;
  return {
      "wrench",
      "A force and a moment of time on a link.",
      ElementType::Place::link,
      {text("link", required, ""),
       numbers("at", 3, "m", "[0, 0, 0]", "where the force acts, in the link's frame"),
       word("axes", {"link", "world"}, "\"link\"", "of both; world: in orbit the inertial ones"),
       table("force", "vector_signal", "none", "[N]"),
       table("moment", "vector_signal", "none", "[N m]")},
      read_wrench};
}

}  // namespace porthos::scene
