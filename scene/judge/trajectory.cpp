#include "scene/judge/detail/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/rotation.h"
#include "phs/error.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates;
using mechanics::Vec3d;
using phs::BlockKind;

/// The columns of one coordinate: by the map, otherwise by the names of Porthos.
class Finder {
 public:
  Finder(const TrajectoryTable& table, const TrajectoryMap& map) : table_(table), map_(map) {}

  std::vector<Numbers> find(const TrajectoryMap::Columns& mapped, const char* kind,
                            const JointCoordinates& c, int numbers) const {
    const auto given = mapped.find(c.name);
    if (given == mapped.end()) {
      for (const auto& name : usual(kind, c.name))
        if (there(name, numbers)) return series(table_.spelled(name, size_t(numbers)));
      return {};
    }
    const std::string key = fmt::format("{}.{}", kind, c.name);
    auto names = given->second;
    if (names.size() == 1 && numbers > 1) names = table_.spelled(names[0], size_t(numbers));
    if (names.size() != size_t(numbers))
      throw InvalidArgument(fmt::format("{}: columns.{} has {} columns, expected {}",
                                        map_.where.at(key), key, names.size(), numbers));
    return series(names);
  }
  bool has_base() const {
    if (map_.q.count("base.position") > 0) return true;
    for (const auto& name : usual("q", "base.position"))
      if (there(name, 3)) return true;
    return false;
  }

 private:
  static std::vector<std::string> usual(const std::string& kind, const std::string& name) {
    if (kind == "q") return {name, "q." + name, "state/" + name};
    if (kind == "p") return {"p." + name, "momentum/" + name};
    return {kind + "." + name, kind + "/" + name};
  }
  bool there(const std::string& name, int numbers) const {
    return table_.has(table_.spelled(name, size_t(numbers))[0]);
  }
  std::vector<Numbers> series(const std::vector<std::string>& names) const {
    std::vector<Numbers> all;
    for (const auto& name : names) all.push_back(table_.column(name));
    return all;
  }

  const TrajectoryTable& table_;
  const TrajectoryMap& map_;
};

/// Refuses coordinates of the map that the model does not have.
void require_known_coordinates(const TrajectoryMap& map, const mechanics::Mechanism& m) {
  const std::string known = listed(m.coordinates(), [](const auto& c) { return c.name; });
  for (const auto& [key, where] : map.where) {
    const std::string name = key.substr(key.find('.') + 1);
    const auto& all = m.coordinates();
    if (std::none_of(all.begin(), all.end(), [&](const auto& c) { return c.name == name; }))
      throw InvalidArgument(fmt::format(
          "{}: columns.{}: the model has no coordinate of this name, expected one of: {}", where,
          key, known));
  }
}

}  // namespace

Numbers times_of_rows(const TrajectoryTable& table, const TrajectoryMap& map) {
  const std::string name = !map.time.empty() ? map.time : table.has("time") ? "time" : "t";
  Numbers t = table.column(name);
  for (size_t i = 1; i < t.size(); ++i)
    if (!(t[i] > t[i - 1]))
      throw InvalidArgument(fmt::format("{}: '{}' is {} after {}, expected time to go forward",
                                        table.at(i), name, t[i], t[i - 1]));
  return t;
}

bool has_base(const TrajectoryTable& table, const TrajectoryMap& map) {
  return Finder(table, map).has_base();
}

Trajectory::Trajectory(const TrajectoryTable& table, const TrajectoryMap& map, const Assembly& a)
    : table_(table),
      map_(map),
      m_(*a.mechanism),
      model_(*a.mechanical),
      lost_(size_t(m_.angle_count())),
      axes_{map.linear_in_body, map.angular_in_world} {
  require_known_coordinates(map, m_);
  const Finder finder(table, map);
  size_t angle = 0;
  for (const auto& c : m_.coordinates()) {
    Columns k{c, finder.find(map.q, "q", c, c.nq), {}, {}, {}, {}};
    if (k.q.empty()) missing(c, "q");
    if (c.kind == BlockKind::angle) find_turns(k, angle++);
    if (map.v.count(c.name) || !map.p.count(c.name)) k.v = finder.find(map.v, "v", c, c.nv);
    if (k.v.empty()) k.p = finder.find(map.p, "p", c, c.nq);
    if (k.v.empty() && k.p.empty()) missing(c, "v");
    by_rates_ |= !k.v.empty();
    by_momenta_ |= !k.p.empty();
    if (k.v.empty())
      k.v.assign(size_t(c.nv), Numbers(table.rows()));  // from the momenta, row by row
    const auto torque = finder.find(map.torque, "torque", c, c.nv);
    if (!torque.empty() && c.nv > 1)
      throw InvalidArgument(fmt::format(
          "{}: torques are given for '{}', which has {} degrees of freedom, expected joints "
          "of one",
          map.path.empty() ? table.at(0) : map.where.at("torque." + c.name), c.name, c.nv));
    if (!torque.empty()) {
      k.torque = torque[0];
      torques_.push_back(c.name);
    }
    columns_.push_back(std::move(k));
  }
  if (by_rates_ && by_momenta_)
    throw InvalidArgument(table.at(0) +
                          ": some joints have rates and others momenta, expected one of both");
}

Trajectory::Row Trajectory::row(const phs::Description& d, size_t i, double h, bool centre_out) {
  Numbers q(size_t(m_.nq())), v(size_t(m_.nv())), p(q.size());
  norm_error_ = 0;
  for (const Columns& k : columns_) {
    for (int n = 0; n < k.c.nq; ++n) q[size_t(k.c.q + n)] = k.q[size_t(n)][i];
    for (int n = 0; n < k.c.nv; ++n) v[size_t(k.c.v + n)] = k.v[size_t(n)][i];
    for (size_t n = 0; n < k.p.size(); ++n) p[size_t(k.c.q) + n] = k.p[n][i];
  }
  Row r;
  if (by_momenta_) {
    auto x = q;
    x.insert(x.end(), p.begin(), p.end());
    v = model_.rates(x, lost_);
    for (Columns& k : columns_)
      for (int n = 0; n < k.c.nv; ++n) k.v[size_t(n)][i] = v[size_t(k.c.v + n)];
  }
  for (const Columns& k : columns_)
    if (k.c.kind == BlockKind::rotation) normalise(&q[size_t(k.c.q)], i);
  if (by_rates_) turn_rates(q, v);
  follow(i, h);
  r.world = state(d, model_.state(q, v), i);
  if (centre_out) {
    r.centre = take_centre_out(m_, q, v);
    r.inner = state(d, model_.state(q, v), i);
    settle_momentum(m_, r.inner);
  } else {
    r.inner = r.world;
  }
  return r;
}

void Trajectory::missing(const JointCoordinates& c, const char* kind) const {
  throw InvalidArgument(fmt::format(
      "{}: no column for {} of '{}', expected '{}{}' or a [columns.{}] in the map",
      map_.path.empty() ? table_.at(0) : map_.path, *kind == 'q' ? "the position" : "the rate",
      c.name, *kind == 'q' ? "" : "v.", c.name, kind));
}

void Trajectory::normalise(double* xi, size_t i) {
  const double size = std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2] + xi[3] * xi[3]);
  if (!(size > 0.5 && size < 2))
    throw InvalidArgument(fmt::format(
        "{}: the attitude is a quaternion of length {:g}, expected one of 1 (w, x, y, z)",
        table_.at(i), size));
  norm_error_ = std::max(norm_error_, std::fabs(size - 1));
  for (int k = 0; k < 4; ++k) xi[k] /= size;
}

void Trajectory::turn_rates(const Numbers& q, Numbers& v) const {
  for (const Columns& k : columns_) {
    if (k.c.kind != BlockKind::rotation) continue;
    const auto R =
        mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[size_t(k.c.q)]));
    const auto turn = [&](int at) {
      double* x = &v[size_t(at)];
      const Vec3d local = R.tmul(Vec3d{x[0], x[1], x[2]});
      for (int n = 0; n < 3; ++n) x[n] = local[n];
    };
    if (axes_.angular_in_world) turn(k.c.v);
    if (axes_.linear_in_body) continue;
    for (const Columns& o : columns_)
      if (o.c.joint == k.c.joint && o.c.nv == 3 && o.c.kind == BlockKind::linear) turn(o.c.v);
  }
}

phs::State Trajectory::state(const phs::Description& d, Numbers x, size_t i) const {
  phs::State s(d, std::move(x));
  s.step = std::int64_t(i);
  phs::wrap_angles(d, s);
  for (size_t a = 0; a < lost_.size(); ++a) s.turns[a] += lost_[a];
  return s;
}

std::vector<std::string> Trajectory::joints() const {
  std::vector<std::string> all;
  for (const Columns& k : columns_)
    if (k.q.size() == 1 && k.v.size() == 1) all.push_back(k.c.name);
  return all;
}

bool Trajectory::has(BlockKind kind) const {
  return std::ranges::any_of(columns_, [&](const Columns& k) { return k.c.kind == kind; });
}

Trajectory Trajectory::in_units(const Units& units) const {
  Trajectory other(*this);
  other.lost_.assign(lost_.size(), 0);
  size_t angle = 0;
  const auto multiply = [](std::vector<Numbers>& all, double by) {
    for (Numbers& column : all)
      for (double& x : column) x *= by;
  };
  for (Columns& k : other.columns_) {
    if (k.c.kind == BlockKind::angle) {
      multiply(k.q, units.angles);
      find_turns(k, angle++);
    }
    if (k.c.kind == BlockKind::linear) multiply(k.q, units.lengths);
    multiply(k.v, k.c.kind == BlockKind::angle      ? units.angle_rates
                  : k.c.kind == BlockKind::rotation ? units.attitude_rates
                                                    : units.velocities);
  }
  return other;
}

Trajectory Trajectory::exchanged(const std::string& a, const std::string& b, bool positions,
                                 bool rates) const {
  Trajectory other(*this);
  other.lost_.assign(lost_.size(), 0);
  const auto of = [&](const std::string& name) {
    return std::find_if(other.columns_.begin(), other.columns_.end(),
                        [&](const Columns& k) { return k.c.name == name; });
  };
  if (positions) {
    std::swap(of(a)->q, of(b)->q);
    std::swap(of(a)->turns, of(b)->turns);
    std::swap(of(a)->wrapped, of(b)->wrapped);
  }
  if (rates) std::swap(of(a)->v, of(b)->v);
  return other;
}

Trajectory Trajectory::with_axes_exchanged(size_t a, size_t b, bool positions, bool rates) const {
  Trajectory other(*this);
  other.lost_.assign(lost_.size(), 0);
  for (Columns& k : other.columns_) {
    if (k.c.kind != BlockKind::linear || k.q.size() != 3 || k.v.size() != 3) continue;
    if (positions) std::swap(k.q[a], k.q[b]);
    if (rates) std::swap(k.v[a], k.v[b]);
  }
  return other;
}

Trajectory Trajectory::with_scalar_last() const {
  Trajectory other(*this);
  other.lost_.assign(lost_.size(), 0);
  for (Columns& k : other.columns_)
    if (k.c.kind == BlockKind::rotation) std::rotate(k.q.begin(), k.q.end() - 1, k.q.end());
  return other;
}

Trajectory Trajectory::with_rates_along(RateAxes axes) const {
  Trajectory other(*this);
  other.lost_.assign(lost_.size(), 0);
  other.axes_ = axes;
  return other;
}

}  // namespace porthos::scene
