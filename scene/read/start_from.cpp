#include "scene/read/start_from.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "phs/system/state.h"
#include "scene/files/files.h"
#include "scene/files/hdf5_file.h"
#include "scene/files/hdf5_reader.h"
#include "scene/files/text_table.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;

std::vector<double> times_of(const Hdf5Reader& file) {
  std::vector<double> t(size_t(file.dataset("time").size()));
  file.read("time", t.data());
  return t;
}

/// The series of a run. If it has several phases: of the last one that had begun at the time, or
/// without a time, of the last one.
fs::path series_in(const fs::path& folder, const double* at) {
  fs::path last;
  for (const fs::path& next : series_files(folder)) {
    if (at && !last.empty()) {
      const auto t = times_of(Hdf5Reader(next));
      if (t.empty() || t.front() > *at) break;
    }
    last = next;
  }
  return last;
}

/// The record at a time; the last one if there is none.
std::int64_t record_at(const Hdf5Reader& file, const double* at, double& time) {
  const auto t = times_of(file);
  if (t.empty()) throw InvalidArgument("the run has no records");
  size_t k = t.size() - 1;
  if (at)
    k = size_t(std::min_element(
                   t.begin(), t.end(),
                   [&](double a, double b) { return std::fabs(a - *at) < std::fabs(b - *at); }) -
               t.begin());
  if (at && std::fabs(t[k] - *at) > 1e-9 * std::max(1.0, std::fabs(*at)))
    throw InvalidArgument(
        fmt::format("the run has no record at {:g} s, the nearest one is at {:.17g} s", *at, t[k]));
  time = t[k];
  return std::int64_t(k);
}

std::vector<double> row_of(const Hdf5Reader& file, const std::string& name, std::int64_t k) {
  const auto& d = file.dataset(name);
  std::vector<double> row(d.shape.size() > 1 ? size_t(d.shape[1]) : 1);
  file.read_rows(name, k, 1, row.data());
  return row;
}

void read_group(const Hdf5Reader& file, const std::string& group, const std::string& low,
                std::int64_t k, std::map<std::string, StartFrom::Numbers>& to) {
  for (const auto& [name, d] : file.datasets()) {
    if (name.rfind(group, 0) != 0) continue;
    StartFrom::Numbers n{row_of(file, name, k), {}};
    const std::string own = low + name.substr(group.size());
    n.low =
        file.datasets().count(own) ? row_of(file, own, k) : std::vector<double>(n.x.size(), 0.0);
    to[name.substr(group.size())] = std::move(n);
  }
}

/// An attribute of lines of a name, a tab and numbers.
std::map<std::string, std::vector<double>> numbers_by_name(
    const std::map<std::string, std::string>& texts, const std::string& attribute) {
  std::map<std::string, std::vector<double>> all;
  const auto text = texts.find(attribute);
  if (text == texts.end()) return all;
  for (const std::string& line : lines_of(text->second)) {
    const auto tab = std::min(line.find('\t'), line.size());
    auto& list = all[line.substr(0, tab)];
    std::istringstream words(line.substr(std::min(tab + 1, line.size())));
    for (std::string word; words >> word;)
      if (const auto x = as_number(word)) list.push_back(*x);
  }
  return all;
}

/// Whether a summary in the folder says so; a folder without one is not asked.
bool has_failed(const fs::path& folder) {
  const fs::path summary = folder / "summary.json";
  if (!fs::exists(summary)) return false;
  const auto json = nlohmann::json::parse(scene::read_file(summary), nullptr, false);
  return json.is_object() && json.value("verdict", "") == "fail";
}

/// at: null, the last record.
void read_record(const fs::path& path, const double* at, StartFrom& from) {
  const Hdf5Reader file(path);
  const std::int64_t k = record_at(file, at, from.time);
  const auto numbers = file.numbers("/");
  if (const auto before = numbers.find("elapsed_s"); before != numbers.end())
    from.elapsed = before->second;
  from.elapsed += from.time;
  const auto texts = file.texts("/");
  if (const auto epoch = texts.find("epoch"); epoch != texts.end()) from.epoch = epoch->second;
  if (const auto forces = texts.find("forces"); forces != texts.end())
    from.forces = lines_of(forces->second);
  for (const auto& [key, rad] : numbers_by_name(texts, "longitudes"))
    if (!rad.empty()) from.longitudes[key] = rad[0];
  from.locked_at = numbers_by_name(texts, "locked_at");
  from.low_words =
      file.datasets().lower_bound("low_words/") != file.datasets().lower_bound("low_words0");
  read_group(file, "state/", "low_words/", k, from.state);
  read_group(file, "momentum/", "low_words_momentum/", k, from.momentum);
  if (file.datasets().count("turns")) {
    const auto names = lines_of(file.texts("turns")["columns"]);
    const auto turns = row_of(file, "turns", k);
    for (size_t i = 0; i < std::min(names.size(), turns.size()); ++i)
      from.turns[names[i]] = std::llround(turns[i]);
  }
  for (const char* part : {"stored/kinetic", "stored/base.kinetic", "stored/links.kinetic"})
    if (file.datasets().count(part))
      from.kinetic = from.kinetic.value_or(0) + row_of(file, part, k)[0];
  for (const auto& [name, to] : {std::pair{"scene", &from.scene_text},
                                 {"model", &from.model_text},
                                 {"files", &from.files_text}})
    if (file.datasets().count(std::string("provenance/") + name))
      *to = file.text(std::string("provenance/") + name);
  if (!file.datasets().count("joined")) return;
  from.joined = joined_of(file.text("joined"));
  for (const auto& [block, v] : from.joined.locked) {
    from.state[block] = {v.x, v.low};
    const std::vector<double> at_rest(v.x.size(), 0.0);
    from.momentum[block] = {at_rest, at_rest};
    if (v.turns != 0) from.turns[block] = v.turns;
  }
}

}  // namespace

std::optional<double> StartFrom::position(const std::string& coordinate) const {
  const auto own = state.find(link_name(coordinate));
  if (own == state.end() || own->second.x.size() != 1) return {};
  const auto turn = turns.find(coordinate);
  return own->second.x[0] + (turn == turns.end() ? 0.0 : phs::two_pi_hi * double(turn->second));
}

StartFrom read_start_from(const Table& t, const std::string& beside) {
  StartFrom from;
  from.folder = t.text("from", "the results folder of a run");
  from.where = t.at("from");
  double at = 0;
  if (t.has("at")) at = t.seconds("at");
  try {
    if (t.of_results())  // the other run may be gone, its record is the first of this one
      for (const char* own : {"run.h5", "phase_1/run.h5"})
        if (fs::exists(fs::path(beside) / own)) {
          const double start = 0;
          read_record(fs::path(beside) / own, &start, from);
          return from;
        }
    const double* moment = t.has("at") ? &at : nullptr;
    const fs::path folder = fs::path(beside) / from.folder;
    read_record(series_in(folder, moment), moment, from);
    from.failed = has_failed(folder);
  } catch (const InvalidArgument& e) {
    refuse(from.where, e.what());
  }
  return from;
}

std::vector<Event> carried_events(const StartFrom& from) {
  std::vector<Event> list;
  for (const Joined::Hold& h : from.joined.holds) {
    Event e;
    e.type = h.joint.empty() ? Event::Type::capture : Event::Type::lock;
    e.name = h.joint.empty() ? h.body : h.joint;
    e.latch.body = h.body;
    e.latch.link = h.link;
    e.carried = true;
    e.where = from.where;
    list.push_back(std::move(e));
  }
  return list;
}

void leave_out(std::vector<Event>& events, const std::vector<Event>& carried) {
  std::erase_if(events, [&](const Event& e) {
    return std::ranges::any_of(carried, [&](const Event& c) {
      return c.type == e.type && c.name == e.name && c.latch.link == e.latch.link;
    });
  });
}

std::string text(const StartFrom& from) {
  std::string all = fmt::format("{} {:a}\n", from.folder, from.time);
  for (const auto* group : {&from.state, &from.momentum})
    for (const auto& [name, n] : *group) {
      all += name;
      for (size_t i = 0; i < n.x.size(); ++i) all += fmt::format(" {:a} {:a}", n.x[i], n.low[i]);
      all += '\n';
    }
  for (const auto& [name, n] : from.turns) all += fmt::format("{} {}\n", name, n);
  if (!from.joined.empty()) all += to_text(from.joined);
  return all;
}

}  // namespace porthos::scene
