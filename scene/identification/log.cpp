#include "scene/identification/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/judge/trajectory_table.h"
#include "scene/read/toml_file-inl.h"

namespace porthos::scene {
namespace {

/// How files call a number: as porthos identify, run.h5 and its export, and porthos judge do.
std::vector<std::string> names_in_files(const TrajectoryTable& file, const std::string& name,
                                        const std::vector<Observed>& known) {
  std::vector<std::string> all{name, "output/" + name};
  const auto dot = name.rfind('.');
  if (dot == std::string::npos) return all;
  const std::string first = name.substr(0, dot), last = name.substr(dot + 1);
  if (last == "position")
    for (const char* of : {"state/", "", "q."}) all.push_back(of + first);
  if (last == "velocity") all.push_back("v." + first);
  const auto n = size_t(std::ranges::count_if(
      known, [&](const Observed& o) { return o.name.substr(0, o.name.rfind('.')) == first; }));
  const auto ends = component_suffixes(n);
  const auto at = size_t(std::ranges::find(ends, last) - ends.begin());
  if (at == ends.size()) return all;
  const auto add = [&](const std::string& vector) { all.push_back(file.spelled(vector, n)[at]); };
  for (const char* of : {"", "output/", "state/", "q."}) add(of + first);
  for (const auto& [rate, of] :
       {std::pair{".linear_velocity", ".position"}, std::pair{".angular_velocity", ".attitude"}})
    if (first.ends_with(rate))
      add("v." + first.substr(0, first.size() - std::string(rate).size()) + of);
  return all;
}

void check_times(const Log& log, const std::function<std::string(size_t)>& at) {
  if (log.times.size() < 2)
    throw InvalidArgument(log.path + ": there are fewer than two times, expected more");
  for (size_t i = 0; i < log.times.size(); ++i) {
    const double before = i == 0 ? 0 : log.times[i - 1], t = log.times[i];
    if (i == 0 ? !(t >= 0) : !(t > before))
      throw InvalidArgument(
          fmt::format("{}: time is {:g} s{}, expected {}", at(i), t,
                      i == 0 ? "" : fmt::format(" after {:g} s", before),
                      i == 0 ? "0 or more, from the start of the scene" : "times that increase"));
  }
}

void set_noise(Log& log, const LogNoise& noise) {
  const auto check = [&](double sigma, const std::string& of) {
    if (!(sigma > 0) || !std::isfinite(sigma))
      throw InvalidArgument(
          fmt::format("sigma{} is {}, expected a positive number, the standard "
                      "deviation of the noise in the unit of the column",
                      of, sigma));
  };
  if (noise.of_all) check(*noise.of_all, "");
  for (auto& c : log.columns) c.sigma = noise.of_all.value_or(0);
  for (const auto& [name, sigma] : noise.by_name) {
    check(sigma, " of '" + name + "'");
    const auto at =
        std::ranges::find_if(log.columns, [&, &n = name](const auto& c) { return c.of.name == n; });
    if (at == log.columns.end())
      throw InvalidArgument(
          fmt::format("sigma is given of '{}', which is no column that is used, expected one of {}",
                      name, listed(log.columns, [](const auto& c) { return c.of.name; })));
    at->sigma = sigma;
  }
  const auto& first = log.columns.front();
  for (const auto& c : log.columns) {
    if ((c.sigma == 0) != (first.sigma == 0))
      throw InvalidArgument(fmt::format(
          "sigma of '{}' is not given and that of others is, expected it of all columns",
          c.sigma == 0 ? c.of.name : first.of.name));
    if (c.sigma == 0 && c.of.unit != first.of.unit)
      throw InvalidArgument(
          fmt::format("{}: '{}' is in {} and '{}' in {}, expected the noise of each by sigma, "
                      "which weighs them",
                      log.path, first.of.name, first.of.unit, c.of.name, c.of.unit));
  }
}

std::string known_names(const std::vector<Observed>& all) {
  constexpr size_t most = 8;
  std::vector<Observed> some(all.begin(), all.begin() + std::ptrdiff_t(std::min(most, all.size())));
  return listed(some, [](const auto& o) { return o.name; }) + (all.size() > most ? ", ..." : "");
}

}  // namespace

Log read_log(const std::string& path, const LogNoise& noise, const Scene& scene,
             const Assembly& assembly) {
  const TrajectoryTable file(path);
  Log log{.path = path, .times = {}, .columns = {}, .unused = file.names()};
  const auto take = [&](const std::string& name) {
    std::erase(log.unused, name);
    return file.column(name);
  };
  const bool is_time = file.has("time");
  if (!is_time && !file.has("t"))
    throw InvalidArgument(path + ": there is no column 'time' or 't', expected the times in s");
  log.times = take(is_time ? "time" : "t");
  check_times(log, [&](size_t i) { return file.at(i); });
  const auto all = observable(scene, assembly);
  for (const Observed& o : all)
    for (const auto& name : names_in_files(file, o.name, all)) {
      const bool is_other =
          name != o.name && std::ranges::find(all, name, &Observed::name) != all.end();
      if (is_other || !file.has(name)) continue;
      log.columns.push_back({o, 0, take(name)});
      break;
    }
  if (log.columns.empty())
    throw InvalidArgument(
        fmt::format("{}: no column is called like a number of the run, expected some of {}", path,
                    known_names(all)));
  set_noise(log, noise);
  return log;
}

Log log_of(const NamedColumns& columns, const LogNoise& noise, const Scene& scene,
           const Assembly& assembly) {
  Log log{.path = "the log", .times = {}, .columns = {}, .unused = {}};
  const auto all = observable(scene, assembly);
  for (const auto& [name, values] : columns) {
    if (name == "time" || name == "t") {
      log.times = values;
      continue;
    }
    const auto at = std::ranges::find(all, name, &Observed::name);
    if (at == all.end())
      throw InvalidArgument(fmt::format(
          "the log has '{}', which a run has not, expected some of {}", name, known_names(all)));
    log.columns.push_back({*at, 0, values});
  }
  check_times(log, [](size_t i) { return fmt::format("the log, row {}", i); });
  if (log.columns.empty())
    throw InvalidArgument("the log has no columns, expected some of " + known_names(all));
  for (const auto& c : log.columns) {
    require_size(("log '" + c.of.name + "'").c_str(), c.values.size(), log.times.size());
    for (size_t i = 0; i < c.values.size(); ++i)
      if (!std::isfinite(c.values[i]))
        throw InvalidArgument(fmt::format("the log, row {}: '{}' is {}, expected a finite number",
                                          i, c.of.name, c.values[i]));
  }
  set_noise(log, noise);
  return log;
}

}  // namespace porthos::scene
