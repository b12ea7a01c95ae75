#include "scene/identification/detail/log_units.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace porthos::scene {
namespace {

constexpr double degrees_in_rad = 180 / std::numbers::pi;

/// Whether a ratio is `expected` but for noise and wide rows.
bool is_about(double ratio, double expected) {
  constexpr double most = 1.3;
  return ratio > expected / most && ratio < expected * most;
}

const LogColumn* column_named(const Log& log, const std::string& name) {
  const auto at =
      std::ranges::find_if(log.columns, [&](const LogColumn& c) { return c.of.name == name; });
  return at == log.columns.end() ? nullptr : &*at;
}

/// The rate of a place: "hinge.velocity" of "hinge.position"; null if the log has none.
const LogColumn* rate_of(const Log& log, const std::string& place) {
  const auto at = place.rfind(".position");
  if (at == std::string::npos) return nullptr;
  const std::string end = place.substr(at + std::string(".position").size());
  return column_named(log,
                      place.substr(0, at) + (end.empty() ? ".velocity" : ".linear_velocity") + end);
}

/// How many times the slopes of a place a rate is, over the log; 0: they have nothing in common.
/// @param wraps  steps of the place are taken without whole turns
double times_the_slope(const Log& log, const LogColumn& place, const LogColumn& rate, bool wraps) {
  constexpr double alike = 0.9;  // correlation
  const auto& q = place.values;
  const auto step = [&](size_t i) {
    return wraps ? std::remainder(q[i + 1] - q[i], 2 * std::numbers::pi) : q[i + 1] - q[i];
  };
  double vv = 0, dd = 0, vd = 0;
  for (size_t i = 1; i + 1 < q.size(); ++i) {
    const double d = (step(i - 1) + step(i)) / (log.times[i + 1] - log.times[i - 1]);
    const double v = rate.values[i];
    vv += v * v;
    dd += d * d;
    vd += v * d;
  }
  return vd > alike * std::sqrt(vv * dd) ? std::sqrt(vv / dd) : 0;
}

/// The rate at which a place begins, by the parabola through its first rows.
double first_slope(const Log& log, const LogColumn& place) {
  const auto rows = Eigen::Index(std::clamp<size_t>(log.times.size() / 40, 5, 50));
  if (rows > Eigen::Index(log.times.size())) return 0;
  Eigen::MatrixX3d powers(rows, 3);
  Eigen::VectorXd q(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = log.times[size_t(i)], step = place.values[size_t(i)] - (i > 0 ? q[i - 1] : 0);
    powers.row(i) << 1, t, t * t;
    q[i] = i == 0           ? step
           : place.of.wraps ? q[i - 1] + std::remainder(step, 2 * std::numbers::pi)
                            : q[i - 1] + step;
  }
  return powers.colPivHouseholderQr().solve(q)[1];
}

void require_rates_of_places(const Log& log, const LogColumn& place, const LogColumn& rate) {
  constexpr size_t fewest = 6;
  if (log.times.size() < fewest) return;
  double ratio = times_the_slope(log, place, rate, false);
  if (ratio == 0 && place.of.wraps) ratio = times_the_slope(log, place, rate, true);
  const auto refuse = [&](const std::string& column, const char* unit, const std::string& right) {
    throw InvalidArgument(fmt::format(
        "{}: '{}' is {:.3g} times the slope of '{}' over time: is '{}' in {}? expected {}; in a "
        "file the head '{} [{}]' says so",
        log.path, rate.of.name, ratio, place.of.name, column, unit, right, column, unit));
  };
  const bool turns = place.of.unit == "rad";
  if (turns && is_about(ratio, degrees_in_rad)) refuse(rate.of.name, "deg/s", rate.of.unit);
  if (turns && is_about(ratio, 1 / degrees_in_rad)) refuse(place.of.name, "deg", place.of.unit);
  if (is_about(ratio, 1e3)) refuse("time", "ms", "s");
  if (is_about(ratio, 1e6)) refuse("time", "us", "s");
}

}  // namespace

void require_units(const Log& log, const Scene& scene) {
  for (const LogColumn& place : log.columns)
    if (const LogColumn* rate = rate_of(log, place.of.name))
      require_rates_of_places(log, place, *rate);
  constexpr double runs = 100, steps = 50;
  const double last = log.times.back(), length = last - log.times.front();
  const double apart = length / double(log.times.size() - 1);
  if (length > runs * scene.duration && apart > steps * scene.step)
    throw InvalidArgument(fmt::format(
        "{}: 'time' ends at {:g} s, and the scene at {:g} s: is it in ms? expected s; in a file "
        "the head 'time [ms]' says so, else give the scene a longer duration",
        log.path, last, scene.duration));
}

std::vector<std::string> questions_before(const Log& log, const Eigen::VectorXd& before,
                                          const Unknowns& unknowns) {
  constexpr double part = 0.1, sure = 5, early = 0.02;
  std::vector<std::string> all;
  std::string apart, names;
  const size_t columns = log.columns.size();
  for (size_t i = 0; i < columns; ++i) {
    const LogColumn& c = log.columns[i];
    const double sigma = c.sigma > 0 ? c.sigma : 1;
    double own = 0, of_run = 0;
    for (size_t row = 0; row < log.times.size(); ++row) {
      const double run = c.values[row] + sigma * before[Eigen::Index(row * columns + i)];
      own += c.values[row] * c.values[row];
      of_run += run * run;
    }
    const bool in_angles = c.of.unit == "rad" || c.of.unit == "rad/s";
    if (in_angles && is_about(std::sqrt(own / of_run), degrees_in_rad))
      all.push_back(fmt::format(
          "'{}' is {:.3g} times as large in the log as in the run of the scene: is it in degrees? "
          "expected {}; in a file the head '{} [{}]' says so",
          c.of.name, std::sqrt(own / of_run), c.of.unit, c.of.name,
          c.of.unit == "rad" ? "deg" : "deg/s"));
    if (!c.of.name.ends_with(".position") && !c.of.name.ends_with(".velocity")) continue;
    const auto [least, most] = std::ranges::minmax(c.values);
    double off = sigma * before[Eigen::Index(i)];
    if (c.of.wraps) off = std::remainder(off, 2 * std::numbers::pi);
    if (!(std::fabs(off) > std::max(part * (most - least), c.sigma > 0 ? sure * sigma : 0.0)) ||
        std::ranges::any_of(unknowns.list(),
                            [&](const Unknown& u) { return u.name.ends_with(c.of.name); }))
      continue;
    if (apart.empty())
      apart = fmt::format("'{}' is {:.3g} {} in the first row and {:.3g} in the run", c.of.name,
                          c.values[0], c.of.unit, c.values[0] + off);
    add_to_list(names, c.of.name);
  }
  if (!apart.empty() && log.times.front() <= early * log.times.back())
    all.push_back(apart +
                  ": where the log was cut from a longer one, ask for its start too: " + names);
  return all;
}

std::vector<double> with_start_of(const Log& log, const Unknowns& unknowns) {
  auto z = unknowns.start();
  if (log.times.front() > 0) return z;
  for (size_t i = 0; i < z.size(); ++i) {
    const auto& [name, unit, start, scale, of_start] = unknowns.list()[i];
    const LogColumn* place = nullptr;
    if (const auto at = name.rfind(".velocity"); at != name.npos)
      place = column_named(log, name.substr(0, at) + ".position");
    if (const LogColumn* c = column_named(log, name)) {
      const double off = c->values[0] - start;  // a turn that the log does not tell stays
      z[i] = (start + (c->of.wraps ? std::remainder(off, 2 * std::numbers::pi) : off)) / scale;
    } else if (place) {
      z[i] = first_slope(log, *place) / scale;
    }
  }
  return z;
}

}  // namespace porthos::scene
