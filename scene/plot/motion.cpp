#include "scene/plot/motion.h"

#include <algorithm>
#include <cmath>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/kinematics.h"
#include "mechanics/rotation.h"
#include "scene/plot/spring_panels.h"
#include "scene/read/output.h"
#include "scene/read/scene.h"
#include "scene/run/columns.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates, mechanics::Quaternion, mechanics::Vec3d;
using phs::BlockKind;

/// More than four turns from zero [rad].
bool far(double q) { return std::fabs(q) > 4 * phs::two_pi_hi; }

/// With the start of the run as the first record.
MotionRecords from_start(const MotionRecords& r) {
  MotionRecords longer = r;
  longer.rows = [&r](const std::string& name) {
    auto own = r.rows(name);
    if (own.empty()) return own;
    auto first = r.whole.first(name);
    const size_t columns = own.size() / r.t.size();
    if (first.size() != columns) first.assign(own.begin(), own.begin() + long(columns));
    own.insert(own.begin(), first.begin(), first.end());
    return own;
  };
  longer.t.insert(longer.t.begin(), r.t.front());
  return longer;
}

/// Coordinates and rates at each record.
class MotionTable {
 public:
  MotionTable(const mechanics::Mechanism& m, const MotionRecords& r)
      : n_(r.t.size()), nq_(size_t(m.nq())), nv_(size_t(m.nv())) {
    std::vector<double> p(n_ * nq_);
    q_.resize(n_ * nq_);
    for (const auto& c : m.coordinates()) {
      known_ = known_ && fill(c, r.rows("state/" + link_name(c.name)), q_);
      moving_ = moving_ && fill(c, r.rows("momentum/" + link_name(c.name)), p);
    }
    if (!known_) return;
    const auto turns = turns_of_angles(m, r);
    if (moving_) find_rates(m, p, turns);
    for (const auto& c : m.coordinates())  // angles as they have turned
      if (const size_t a = angle_of(m, c); c.kind == BlockKind::angle)
        for (size_t i = 0; i < n_; ++i)
          q_[i * nq_ + size_t(c.q)] += turns[i * size_t(m.angle_count()) + a];
  }

  bool known() const { return known_; }
  bool moving() const { return moving_; }
  size_t size() const { return n_; }
  double q(size_t i, int at) const { return q_[i * nq_ + size_t(at)]; }
  double v(size_t i, int at) const { return v_[i * nv_ + size_t(at)]; }
  double q_dot(size_t i, int at) const { return q_dot_[i * nq_ + size_t(at)]; }

 private:
  bool fill(const JointCoordinates& c, const std::vector<double>& rows, std::vector<double>& to) {
    if (rows.size() != n_ * size_t(c.nq)) return false;
    for (size_t i = 0; i < n_; ++i)
      std::copy_n(rows.begin() + long(i) * c.nq, c.nq, to.begin() + long(i * nq_) + c.q);
    return true;
  }
  static size_t angle_of(const mechanics::Mechanism& m, const JointCoordinates& of) {
    size_t angle = 0;
    for (const auto& c : m.coordinates()) {
      if (&c == &of) break;
      angle += c.kind == BlockKind::angle;
    }
    return angle;
  }
  /// Whole turns of each angle block [rad], record by record.
  std::vector<double> turns_of_angles(const mechanics::Mechanism& m, const MotionRecords& r) const {
    const auto angles = size_t(m.angle_count());
    std::vector<double> turns(n_ * angles, 0.0);
    const auto rows = r.rows("turns");
    if (r.turns.empty() || rows.size() != n_ * r.turns.size()) return turns;
    for (const auto& c : m.coordinates()) {
      const auto at = size_t(std::find(r.turns.begin(), r.turns.end(), c.name) - r.turns.begin());
      if (c.kind != BlockKind::angle || at == r.turns.size()) continue;
      for (size_t i = 0; i < n_; ++i)
        turns[i * angles + angle_of(m, c)] = phs::two_pi_hi * rows[i * r.turns.size() + at];
    }
    return turns;
  }
  void find_rates(const mechanics::Mechanism& m, const std::vector<double>& p,
                  const std::vector<double>& turns) {
    mechanics::Workspace<double> w(m);
    v_.resize(n_ * nv_);
    q_dot_.resize(n_ * nq_);
    for (size_t i = 0; i < n_; ++i) {
      const auto q = std::span<const double>(q_).subspan(i * nq_, nq_);
      std::copy_n(turns.begin() + long(i * w.turn_angle.size()), w.turn_angle.size(),
                  w.turn_angle.begin());
      mechanics::rates_from_momenta<double>(m, w, q, std::span(p).subspan(i * nq_, nq_));
      std::copy_n(w.rate.begin(), nv_, v_.begin() + long(i * nv_));
      mechanics::coordinate_rates<double>(m, q, std::span<const double>(v_).subspan(i * nv_, nv_),
                                          std::span(q_dot_).subspan(i * nq_, nq_));
    }
  }

  size_t n_, nq_, nv_;
  bool known_ = true, moving_ = true;
  std::vector<double> q_, v_, q_dot_;
};

/// Rotations from the first attitude as vectors along their axes, world axes [rad]. Of the vectors
/// that mean the same rotation, the one nearest to that before.
std::vector<Vec3d> rotations(const MotionTable& m, const JointCoordinates& c) {
  std::vector<Vec3d> all;
  const auto at = [&](size_t i) {
    return Quaternion<double>{m.q(i, c.q), {m.q(i, c.q + 1), m.q(i, c.q + 2), m.q(i, c.q + 3)}};
  };
  const Quaternion<double> first = at(0), back{first.w, -first.v};
  Vec3d before{0, 0, 0};
  for (size_t i = 0; i < m.size(); ++i) {
    const auto d = at(i) * back;
    const double sine = mechanics::norm(d.v), length = mechanics::norm(before);
    const double angle = 2 * std::atan2(sine, d.w);
    Vec3d axis{0, 0, 0};
    if (sine > 1e-12)
      axis = (1 / sine) * d.v;
    else if (length > 0)
      axis = (1 / length) * before;
    const double turns = std::round((dot(before, axis) - angle) / phs::two_pi_hi);
    before = (angle + phs::two_pi_hi * turns) * axis;
    all.push_back(before);
  }
  return all;
}

class MotionPanels {
 public:
  MotionPanels(const mechanics::Mechanism& m, const MotionRecords& r) : m_(m), r_(r), table_(m, r) {
    if (r.t.empty()) return;
    outputs();
    if (!table_.known()) return;
    for (const bool turning : {false, true})
      for (const auto* unit : {"rad", "m"}) joints(unit, turning);
    for (TracePanel& p : spring_panels(r_)) add(p.what, std::move(p.lines));
    size_t bodies = 0;
    for (const auto& c : m.coordinates())
      if (c.kind == BlockKind::rotation && bodies++ < most_lines) body(c);
  }
  std::vector<TracePanel> panels() { return std::move(panels_); }

 private:
  template <class F>
  TraceLine line(const std::string& name, F value) const {
    return line_of(name, r_.t, value);
  }
  void add(const std::string& what, std::vector<TraceLine> lines) {
    for (size_t from = 0; from < lines.size(); from += most_lines) {
      const size_t to = std::min(from + most_lines, lines.size());
      panels_.push_back({what, {lines.begin() + long(from), lines.begin() + long(to)}});
    }
  }

  void outputs() {
    std::vector<std::string> units;
    for (const auto& [name, unit] : r_.outputs)
      if (std::find(units.begin(), units.end(), unit) == units.end()) units.push_back(unit);
    for (const auto& unit : units) {
      std::vector<TraceLine> numbers;
      for (const auto& [name, own] : r_.outputs) {
        if (own != unit) continue;
        const auto rows = r_.rows("output/" + name);
        const size_t columns = rows.size() / r_.t.size();
        std::vector<TraceLine> lines;
        for (size_t k = 0; k < columns; ++k)
          lines.push_back(line(columns == 1 ? name : component_suffixes(columns).at(k),
                               [&](size_t i) { return rows[i * columns + k]; }));
        if (columns == 1)
          numbers.push_back(std::move(lines.front()));
        else
          add(name + " [" + unit + "]", std::move(lines));
      }
      const std::string what = numbers.size() == 1 ? numbers.front().name : "outputs";
      add(what + " [" + unit + "]", std::move(numbers));
    }
  }

  void joints(const std::string& unit, bool turning) {
    std::vector<TraceLine> positions, rates;
    for (const auto& c : m_.coordinates()) {
      if (c.nq != 1 || c.nv != 1 || c.unit != unit) continue;
      auto l = line(c.name, [&](size_t i) { return table_.q(i, c.q); });
      const auto& known = r_.whole.turning;
      const bool turns = std::find(known.begin(), known.end(), c.name) != known.end() ||
                         std::any_of(l.value.begin(), l.value.end(), far);
      if ((unit == "rad" && turns) != turning) continue;
      positions.push_back(std::move(l));
      if (table_.moving())
        rates.push_back(line(c.name, [&](size_t i) { return table_.v(i, c.v); }));
    }
    const std::string which = unit == "m" ? "sliding joints"
                              : turning   ? "turning joints"
                                          : "joints";
    add(which + " [" + unit + "]", std::move(positions));
    add("rates of " + which + " [" + unit + "/s]", std::move(rates));
  }

  template <class F>
  std::vector<TraceLine> three(F value) const {
    std::vector<TraceLine> lines;
    const char* names[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k)
      lines.push_back(line(names[k], [&](size_t i) { return value(i, k); }));
    return lines;
  }
  void body(const JointCoordinates& c) {
    const auto turned = rotations(table_, c);
    const auto part = [](const Vec3d& a, int k) { return k == 0 ? a.x : k == 1 ? a.y : a.z; };
    auto lines = three([&](size_t i, int k) { return part(turned[i], k); });
    lines.insert(lines.begin(),
                 line("angle", [&](size_t i) { return mechanics::norm(turned[i]); }));
    add("rotation of " + c.joint + " [rad]", std::move(lines));
    if (table_.moving())
      add("rates of " + c.joint + ", own axes [rad/s]",
          three([&](size_t i, int k) { return table_.v(i, c.v + k); }));
    for (const auto& p : m_.coordinates()) {
      if (p.joint != c.joint || p.kind != BlockKind::linear || p.nq != 3) continue;
      add("path of " + c.joint + " [m]",
          three([&](size_t i, int k) { return table_.q(i, p.q + k) - table_.q(0, p.q + k); }));
      if (table_.moving())
        add("velocity of " + c.joint + " [m/s]",
            three([&](size_t i, int k) { return table_.q_dot(i, p.q + k); }));
    }
  }

  const mechanics::Mechanism& m_;
  const MotionRecords& r_;
  MotionTable table_;
  std::vector<TracePanel> panels_;
};

}  // namespace

std::vector<TracePanel> motion_panels(const mechanics::Mechanism& mechanism,
                                      const MotionRecords& records) {
  if (!records.whole.first || records.t.empty()) return MotionPanels(mechanism, records).panels();
  auto panels = MotionPanels(mechanism, from_start(records)).panels();
  for (TracePanel& p : panels)
    for (TraceLine& l : p.lines) {
      l.t.erase(l.t.begin());
      l.value.erase(l.value.begin());
    }
  return panels;
}

std::vector<std::string> turning_joints(const MotionRecords& r) {
  std::vector<std::string> all;
  const auto turns = r.rows("turns");
  const size_t n = r.turns.size();
  for (size_t k = 0; k < n; ++k) {
    const auto q = r.rows("state/" + link_name(r.turns[k]));
    for (size_t i = 0; i < q.size() && q.size() * n == turns.size(); ++i) {
      if (!far(q[i] + phs::two_pi_hi * turns[i * n + k])) continue;
      all.push_back(r.turns[k]);
      break;
    }
  }
  return all;
}

}  // namespace porthos::scene
