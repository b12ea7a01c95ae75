#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>

#include <fmt/ranges.h>

#include "phs/csv_table.h"
#include "phs/error.h"
#include "phs/functions/smoothing.h"
#include "phs/functions/spline.h"
#include "phs/nearest.h"
#include "vsa/detail/table_remark.h"
#include "vsa/table.h"

namespace porthos::vsa {
namespace {

const std::array<std::string, 5> names{"deflection", "sigma", "torque", "stiffness",
                                       "sigma_effort"};
/// As in `names`; then 1 where the deflection rises along the file, -1 where it falls.
using Row = std::array<double, 6>;
/// The rows of a file by σ, then deflection, repeated measurements together.
using Rows = std::map<std::pair<double, double>, std::vector<Row>>;

/// The grid that the places are, or nothing.
std::optional<Measurements> grid_of(const Rows& rows, const std::array<bool, 5>& there) {
  Measurements m;
  for (const auto& [place, row] : rows) {
    if (m.sigma.empty() || m.sigma.back() != place.first) m.sigma.push_back(place.first);
    if (m.sigma.size() == 1) m.deflection.push_back(place.second);
  }
  size_t k = 0;
  for (const auto& [place, repeated] : rows) {
    const size_t i = k % m.deflection.size(), j = k / m.deflection.size();
    if (j >= m.sigma.size() || place != std::pair{m.sigma[j], m.deflection[i]} ||
        repeated.size() > 1)
      return std::nullopt;
    const auto& row = repeated[0];
    m.torque.push_back(row[2]);
    if (there[3]) m.stiffness.push_back(row[3]);
    if (there[4]) m.sigma_effort.push_back(row[4]);
    ++k;
  }
  if (k == 0 || k != m.deflection.size() * m.sigma.size()) return std::nullopt;
  return m;
}

/// Of a gridded table, at each σ.
constexpr size_t most_places = 200;

const char* const taken_as_one =
    " (settings of sigma nearer than 1/50 of their range count as one)";

/// The places of each setting of σ in order of their deflections. Settings that jitter are put
/// together: `one` is then the distance below which they are. @throws InvalidArgument for values
/// that chain over a fifth of their range: they are no settings
MeasuredCurves by_setting(const Rows& rows, double& one, const std::string& path) {
  using Place = std::array<double, 3>;  // deflection, torque, way
  std::map<double, std::vector<Place>> settings;
  for (const auto& [place, repeated] : rows)
    for (const Row& row : repeated) settings[place.first].push_back({row[0], row[2], row[5]});
  const auto few = [](const auto& s) { return s.second.size() < 4; };
  if (std::ranges::any_of(settings, few))
    one = (settings.rbegin()->first - settings.begin()->first) / 50;
  MeasuredCurves curves;
  for (auto at = settings.begin(); at != settings.end();) {
    const double begin = at->first;
    double last = begin, sum = 0;
    std::vector<Place> places;
    for (; at != settings.end() && at->first - last <= one; ++at) {
      last = at->first;
      sum += last * double(at->second.size());
      places.insert(places.end(), at->second.begin(), at->second.end());
    }
    if (one > 0 && last - begin > 10 * one)
      throw InvalidArgument(fmt::format(
          "{}: sigma scatters over {:.3g} to {:.3g} without a gap of {:.2g}, 1/50 of its range, "
          "expected settings: round each sigma to the setting it was meant to be",
          path, begin, last, one));
    std::ranges::stable_sort(places, {}, [](const Place& p) { return p[0]; });
    auto& c = curves[sum / double(places.size())];
    for (const Place& p : places) {
      c.x.push_back(p[0]);
      c.y.push_back(p[1]);
      c.way.push_back(p[2]);
    }
  }
  return curves;
}

/// The mean of the means of loading and of unloading, which has no loop, and of how many rows a
/// plain mean has the same error.
std::pair<double, double> mean_of_ways(const MeasuredCurve& c, const std::vector<double>& values,
                                       size_t first, size_t end) {
  double sum[3] = {}, rows[3] = {};
  for (size_t i = first; i < end; ++i) {
    const auto way = size_t(1 + c.way[i]);
    sum[way] += values[i];
    rows[way] += 1;
  }
  if (rows[1] > 0 || rows[0] == 0 || rows[2] == 0)  // one way, or some row without
    return {(sum[0] + sum[1] + sum[2]) / double(end - first), double(end - first)};
  return {(sum[0] / rows[0] + sum[2] / rows[2]) / 2, 4 / (1 / rows[0] + 1 / rows[2])};
}

/// A grid over the deflections that every σ has, from the smoothed curve of each σ through its own
/// places. Those nearer than half the finest spacing of a grid, as of an encoder that jitters,
/// count by their mean.
Measurements gridded(const Rows& rows, const TorqueErrors& errors, const std::string& path) {
  Measurements m;
  MeasuredCurves curves;
  for (const auto& [sigma, c] : by_setting(rows, m.one_setting, path)) {
    const double one = 0.5 * (c.x.back() - c.x.front()) / double(most_places);
    for (size_t first = 0, i = 1; i <= c.x.size(); ++i) {
      if (i < c.x.size() && c.x[i] - c.x[first] <= one) continue;
      auto& to = curves[sigma];
      for (std::vector<double> MeasuredCurve::*of : {&MeasuredCurve::x, &MeasuredCurve::y})
        (to.*of).push_back(mean_of_ways(c, c.*of, first, i).first);
      const auto [way, rows_of] = mean_of_ways(c, c.way, first, i);
      to.way.push_back(way);
      to.of_rows.push_back(rows_of);
      first = i;
    }
  }
  m.without_errors = true;
  double from = -HUGE_VAL, to = HUGE_VAL;
  size_t most = 0;
  for (const auto& [sigma, c] : curves) {
    m.sigma.push_back(sigma);
    if (c.x.size() < 4)
      throw InvalidArgument(fmt::format("{}: sigma {} has {} deflections, expected 4 or more{}",
                                        path, sigma, c.x.size(),
                                        m.one_setting > 0 ? taken_as_one : ""));
    from = std::max(from, c.x.front());
    to = std::min(to, c.x.back());
    most = std::max(most, c.x.size());
  }
  if (!(from < to))
    throw InvalidArgument(
        fmt::format("{}: no range of deflections is measured at every sigma, expected one", path));
  const size_t n = std::min(most, most_places);
  for (size_t i = 0; i < n; ++i)
    m.deflection.push_back(i + 1 == n ? to : from + (to - from) * double(i) / double(n - 1));
  for (const auto& [sigma, c] : curves) {
    const phs::Spline f(c.x, phs::smoothed(c.x, c.y, errors.of(c.y, c.of_rows)),
                        phs::Spline::Outside::linear, "tabulated");
    for (const double x : m.deflection) m.torque.push_back(f.value(x));
  }
  m.errors_to_state = errors_to_state(curves, errors);
  m.remark = remark_on(m, curves, errors, path);
  return m;
}

/// The columns that mean nothing here, as the time of a measurement; empty: none.
/// @throws InvalidArgument for one that may be a column's misspelt name
std::string ignored_columns(const CsvTable& table) {
  std::string list;
  for (const auto& name : table.names()) {
    if (std::ranges::find(names, name) != names.end()) continue;
    const auto meant = near_enough(name, Names(names.begin(), names.end()));
    if (!meant.empty() && !table.has(std::string(meant)))
      throw InvalidArgument(fmt::format("{}: unknown column '{}', expected {}, perhaps '{}'",
                                        table.header(), name, fmt::join(names, ", "), meant));
    list += fmt::format("{}'{}'", list.empty() ? "" : ", ", name);
  }
  return list;
}
std::string with_ignored(const std::string& remark, const std::string& ignored,
                         const std::string& path) {
  if (ignored.empty()) return remark;
  return fmt::format("{}{}{}: not used: the columns {}", remark, remark.empty() ? "" : "; ", path,
                     ignored);
}

}  // namespace

Measurements read_measurements(const std::string& path, const TorqueErrors& errors) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw_unreadable(fmt::format("{}: cannot be opened", path), errno);
  return parse_measurements({std::istreambuf_iterator<char>(file), {}}, path, errors);
}

Measurements parse_measurements(const std::string& text, const std::string& path,
                                const TorqueErrors& errors) {
  const CsvTable table(path, text);
  const std::string ignored = ignored_columns(table);
  std::array<std::vector<double>, 5> columns;
  std::array<bool, 5> there{};
  for (size_t k = 0; k < names.size(); ++k) {
    there[k] = table.has(names[k]);
    if (there[k])
      columns[k] = table.column(names[k]);
    else if (names[k] == "sigma")
      columns[k].assign(table.rows(), 0.0);
    else if (k < 3)
      throw InvalidArgument(fmt::format("{}: no column '{}', expected {}{}", table.header(),
                                        names[k], fmt::join(names, ", "),
                                        ignored.empty() ? "" : "; it has " + ignored));
  }
  Rows rows;
  std::vector<MeasuredTorque> as_measured;
  for (size_t i = 0; i < table.rows(); ++i) {
    as_measured.push_back({columns[0][i], columns[1][i], columns[2][i]});
    Row row{};
    for (size_t k = 0; k < names.size(); ++k)
      if (!columns[k].empty()) row[k] = columns[k][i];
    const double on = columns[0][std::min(i + 1, table.rows() - 1)] - columns[0][i - (i > 0)];
    row[5] = double(on > 0) - double(on < 0);
    auto& same = rows[{row[1], row[0]}];
    if (!same.empty() && !errors.any())
      throw InvalidArgument(
          fmt::format("{}: deflection {} and sigma {} are given twice (smoothing [N m] takes "
                      "repeated measurements)",
                      table.at(i), row[0], row[1]));
    same.push_back(row);
  }
  if (auto m = grid_of(rows, there)) {
    MeasuredCurves curves;
    for (size_t j = 0; j < m->sigma.size(); ++j) {
      const auto from = m->torque.begin() + long(j * m->deflection.size());
      auto& c = curves[m->sigma[j]] = {m->deflection, {from, from + long(m->deflection.size())}};
      for (const double x : c.x) c.way.push_back(rows[{m->sigma[j], x}][0][5]);
    }
    m->errors_to_state = errors_to_state(curves, errors);
    m->rows = std::move(as_measured);
    m->remark = with_ignored(remark_on(*m, curves, errors, path), ignored, path);
    return *m;
  }
  if (!errors.any() || rows.empty())
    throw InvalidArgument(
        fmt::format("{}: {} places are no grid, expected the same deflections at every sigma, or "
                    "smoothing [N m], which takes any places",
                    path, rows.size()));
  if (there[3] || there[4])
    throw InvalidArgument(
        fmt::format("{}: places that are no grid come with a column '{}', expected deflection, "
                    "sigma and torque alone",
                    path, there[3] ? names[3] : names[4]));
  auto m = gridded(rows, errors, path);
  m.rows = std::move(as_measured);
  m.remark = with_ignored(m.remark, ignored, path);
  return m;
}

}  // namespace porthos::vsa
