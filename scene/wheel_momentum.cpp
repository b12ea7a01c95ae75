#include "scene/wheel_momentum.h"

#include <algorithm>
#include <cmath>

#include "mechanics/momentum.h"
#include "scene/record_log.h"
#include "scene/scene.h"

namespace porthos::scene {
namespace {

void see(MomentumRow& row, bool first, double value) {
  if (first) row.start = value;
  row.end = value;
  row.largest = std::max(row.largest, std::fabs(value));
}

}  // namespace

std::vector<MomentumRow> wheel_momentum(const Scene& scene, const Assembly& assembly,
                                        const std::filesystem::path& log) {
  std::vector<MomentumRow> rows;
  if (!assembly.mechanism) return rows;
  const auto& m = *assembly.mechanism;
  const size_t nq = size_t(m.nq());
  std::vector<size_t> at;  // of each wheel's momentum in the state
  for (const Element& e : scene.elements)
    if (e.wheel_gain) {
      rows.push_back({e.joint});
      at.push_back(nq + size_t(m.coordinate(e.joint).q));
    } else if (e.gimbal) {
      rows.push_back({e.gimbal->wheel});
      at.push_back(nq + size_t(m.coordinate(e.gimbal->wheel).q));
    }
  if (rows.empty()) return rows;
  rows.push_back({"total"});

  const RecordLayout layout(assembly.model->description(), scene.extrema);
  mechanics::Workspace<double> w(m);
  RecordReader reader(log, layout);
  std::vector<double> records;
  std::vector<std::int64_t> turns(layout.turns);
  bool first = true;
  while (const size_t n = reader.read(records, 4096))
    for (size_t i = 0; i < n; ++i, first = false) {
      const auto record = std::span<const double>(records).subspan(i * layout.size());
      const auto x = record.subspan(layout.x(), layout.nx);
      turns_of(layout, record, turns);
      w.set_turns(turns);
      for (size_t k = 0; k < at.size(); ++k) see(rows[k], first, x[at[k]]);
      const auto L = mechanics::momentum<double>(m, w, x.first(nq), x.subspan(nq, nq)).angular;
      see(rows.back(), first, std::hypot(L.x, L.y, L.z));
    }
  return rows;
}

Impulses impulses(const Scene& scene, const Assembly& assembly, const std::filesystem::path& log) {
  constexpr double g0 = 9.80665;  // [m/s²], of a specific impulse
  Impulses r;
  std::vector<const space::Thruster*> thrusters;
  for (const Element& e : scene.elements) {
    if (e.thruster) r.rows.push_back({.name = e.name, .type = "thruster"});
    if (e.thruster) thrusters.push_back(&*e.thruster);
  }
  for (const Element& e : scene.elements)
    if (e.torquer) r.rows.push_back({.name = e.name, .type = "torquer"});
  if (r.rows.empty()) return r;

  const auto& d = assembly.model->description();
  const auto find = [&](const std::string& name) {
    for (size_t a = 0; a < d.powers.size(); ++a)
      if (d.powers[a].name == name) return a;
    return d.powers.size();
  };
  struct At {
    size_t impulse, angular;
  };
  std::vector<At> at;
  for (const auto& row : r.rows)
    at.push_back({find(row.name + ".impulse.x"), find(row.name + ".angular_impulse.x")});

  const auto& m = *assembly.mechanism;
  const size_t nq = size_t(m.nq());
  const RecordLayout layout(d, scene.extrema);
  mechanics::Workspace<double> w(m);
  RecordReader reader(log, layout);
  std::vector<double> records;
  std::vector<std::int64_t> turns(layout.turns);
  mechanics::Momentum<double> start{}, sum{};
  double from = 0, to = 0, largest_P = 0, largest_L = 0;
  bool first = true;
  while (const size_t n = reader.read(records, 4096))
    for (size_t i = 0; i < n; ++i, first = false) {
      const auto record = std::span<const double>(records).subspan(i * layout.size());
      to = record[layout.time()];
      sum = {{0, 0, 0}, {0, 0, 0}};
      for (size_t k = 0; k < at.size(); ++k)
        for (int c = 0; c < 3; ++c) {
          const double* works = &record[layout.work()];
          auto& row = r.rows[k];
          row.angular[size_t(c)] = works[at[k].angular + size_t(c)];
          if (at[k].impulse < d.powers.size())
            row.impulse[size_t(c)] = works[at[k].impulse + size_t(c)];
          sum.linear[c] += row.impulse[size_t(c)], sum.angular[c] += row.angular[size_t(c)];
        }
      if (scene.orbit) continue;  // there the space ledgers keep this balance
      const auto x = record.subspan(layout.x(), layout.nx);
      turns_of(layout, record, turns);
      w.set_turns(turns);
      const auto now = mechanics::momentum<double>(m, w, x.first(nq), x.subspan(nq, nq));
      if (first) start = now, from = to;
      const auto left = [](const auto& a, const auto& b, const auto& given) {
        return mechanics::norm((a - b) - given);
      };
      r.linear_left = std::max(r.linear_left, left(now.linear, start.linear, sum.linear));
      r.angular_left = std::max(r.angular_left, left(now.angular, start.angular, sum.angular));
      largest_P = std::max(largest_P, mechanics::norm(now.linear));
      largest_L = std::max(largest_L, mechanics::norm(now.angular));
    }
  if (largest_P > 0) r.linear_left /= largest_P;
  if (largest_L > 0) r.angular_left /= largest_L;
  for (size_t k = 0; k < thrusters.size(); ++k) {
    const auto& t = *thrusters[k];
    r.rows[k].on_s = t.schedule.on_time(to) - t.schedule.on_time(from);
    if (t.specific_impulse > 0)
      r.rows[k].propellant_kg = r.rows[k].on_s * t.thrust / (t.specific_impulse * g0);
  }
  return r;
}

}  // namespace porthos::scene
