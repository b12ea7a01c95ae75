#include "scene/judge/trajectory_map.h"

#include <fmt/format.h>

#include <filesystem>

#include "scene/assemble/detail/start.h"
#include "scene/files/files.h"
#include "scene/read/scene_texts.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

TrajectoryMap::Columns columns_of(const File& file, const toml::table& t, const std::string& key,
                                  TrajectoryMap& map) {
  TrajectoryMap::Columns all;
  const toml::node* given = t.get(key);
  if (!given) return all;
  const std::string expected = "expected the name of a column, or an array of names";
  if (!given->is_table())
    refuse(file.at(given->source()),
           fmt::format("columns.{} is {}, expected a table of coordinates and their columns", key,
                       found(*given)));
  for (const auto& [name, node] : *given->as_table()) {
    const std::string full = fmt::format("{}.{}", key, name.str());
    map.where[full] = file.at(name.source());
    auto& columns = all[std::string(name.str())];
    const auto put = [&](const toml::node& n) {
      if (!n.is_string())
        refuse(file.at(n.source()), fmt::format("columns.{} is {}, {}", full, found(n), expected));
      columns.push_back(**n.as_string());
    };
    if (!node.is_array()) {
      put(node);
      continue;
    }
    for (const toml::node& n : *node.as_array()) put(n);
  }
  return all;
}

/// The text with the tables of [columns] emptied line by line, so that places in messages stay
/// right.
std::string without_columns(const std::string& text) {
  std::string rest;
  bool inside = false;
  for (size_t from = 0; from < text.size();) {
    const size_t to = std::min(text.find('\n', from), text.size());
    const std::string line = text.substr(from, to - from);
    const size_t first = line.find_first_not_of(" \t");
    if (first != std::string::npos && line[first] == '[')
      inside = line.compare(first, 8, "[columns") == 0;
    rest += (inside ? "" : line) + "\n";
    from = to + 1;
  }
  return rest;
}

/// A trajectory has its own start; [initial] gives the positions of locked joints alone.
void refuse_starts(const Scene& s) {
  std::string where = s.base.where;
  if (s.start_from) where = s.start_from->where;
  for (const auto& [name, start] : s.joints)
    if (!is_locked(s, name)) where = start.where;
  if (!where.empty() || s.random)
    refuse(where.empty() ? s.path : where,
           "[initial] states a start, but the trajectory has its own, expected positions of locked "
           "joints alone");
}

}  // namespace

TrajectoryMap read_trajectory_map(const std::string& path) {
  TrajectoryMap m;
  m.path = path;
  m.text = read_file(path);
  const File file{path};
  const toml::table root = parse_toml(m.text, file);
  for (const char* clock : {"integrator", "run"})
    if (const toml::node* given = root.get(clock))
      refuse(file.at(given->source()),
             fmt::format("[{}] is given, but steps and times are those of the trajectory, expected "
                         "none (a scene is no map: [model], [columns], [environment], [verify])",
                         clock));
  const toml::node* columns = root.get("columns");
  if (!columns) return m;
  if (!columns->is_table())
    refuse(file.at(columns->source()), "columns is no table, expected [columns]");
  const Table t(file, *columns->as_table(), "[columns]", "columns.",
                Names{"time", "q", "v", "p", "torque", "linear_velocity_axes",
                      "angular_velocity_axes", "torque_between"});
  if (t.has("time")) m.time = t.text("time", "the name of a column");
  const toml::table& raw = *columns->as_table();
  m.q = columns_of(file, raw, "q", m);
  m.v = columns_of(file, raw, "v", m);
  m.p = columns_of(file, raw, "p", m);
  m.torque = columns_of(file, raw, "torque", m);
  if (t.has("linear_velocity_axes"))
    m.linear_in_body = t.choice("linear_velocity_axes", {"world", "body"}) == "body";
  if (t.has("angular_velocity_axes"))
    m.angular_in_world = t.choice("angular_velocity_axes", {"body", "world"}) == "world";
  if (t.has("torque_between")) {
    const auto between = t.choice("torque_between", {"held", "linear", "smooth"});
    using Between = TrajectoryMap::TorqueBetween;
    m.torque_between = between == "linear"   ? Between::linear
                       : between == "smooth" ? Between::smooth
                                             : Between::held;
  }
  return m;
}

Scene scene_of(const TrajectoryMap& map, const std::string& urdf, bool free_base, double step,
               double duration) {
  std::string text = without_columns(map.text);
  if (text.find("[model]") == std::string::npos)
    text += fmt::format("[model]\nbase = \"{}\"\n", free_base ? "free" : "fixed");
  text += fmt::format(
      "# The clock of the recorded rows: nothing is integrated.\n[integrator]\nmethod = "
      "\"recorded\"\nstep = {0}\n[run]\nduration = {1}\nrecord_every = {0}\n",
      step, duration);
  Scene s =
      read_scene_again(map.path.empty() ? "trajectory.toml" : map.path, {text, read_file(urdf)});
  s.urdf_path = urdf;
  refuse_starts(s);
  return s;
}

}  // namespace porthos::scene
