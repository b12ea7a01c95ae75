#include "mechanics/constraints/constraint_set.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "mechanics/constraints/plane_curve.h"
#include "mechanics/detail/body_checks.h"
#include "mechanics/joint_list.h"

namespace porthos::mechanics {
namespace {

struct TypeOfRows {
  std::string_view type;
  std::vector<Row> rows;
};
const std::vector<TypeOfRows>& types_of_rows() {
  using enum Row;
  static const std::vector<TypeOfRows> all{
      {Revolute::name, {dx, dy, dz, xz, yz}},
      {Continuous::name, {dx, dy, dz, xz, yz}},
      {Prismatic::name, {dx, dy, weld}},
      {Cylindrical::name, {dx, dy, xz, yz}},
      {Helical::name, {dx, dy, xz, yz, screw}},
      {Spherical::name, {dx, dy, dz}},
      {Universal::name, {dx, dy, dz, zx}},
      {Planar::name, {dz, xz, yz}},
      {Fixed::name, {dx, dy, dz, weld}},
      {"on_plane", {dz}},
      {"on_line", {dx, dy}},
      {"on_curve", {dz, curve}},
  };
  return all;
}
const std::vector<TypeOfRows>& types_of_rolling() {
  using enum Row;
  static const std::vector<TypeOfRows> all{
      {"disk", {disk}}, {"sphere", {sphere}}, {"blade", {blade}}, {"no_spin", {spin}}};
  return all;
}
constexpr std::array rod_rows{Row::distance};

[[noreturn]] void refuse_constraint(const std::string& name, const std::string& why) {
  throw InvalidArgument("constraint '" + name + "': " + why);
}

BodyFrame frame_of(const Mechanism& m, const std::string& name, const LinkFrame& f) {
  if (!finite(f.pose.r)) refuse_constraint(name, "a position is not finite");
  if (!is_rotation(f.pose.R)) refuse_constraint(name, "the axes of a frame are not a rotation");
  if (f.link.empty()) return {"world", -1, f.pose};
  for (const BodyFrame& link : m.bodies())
    if (link.name == f.link) return {link.name, link.node, link.pose * f.pose};
  refuse_constraint(name, "there is no link '" + f.link + "', expected one of " +
                              listed(m.bodies(), [](const auto& b) { return b.name; }));
}

/// The nodes from a node to the root, itself included.
std::vector<int> ancestors(const Mechanism& m, int node) {
  std::vector<int> all;
  for (; node >= 0; node = m.nodes()[size_t(node)].parent) all.push_back(node);
  return all;
}
bool contains(const std::vector<int>& all, int x) {
  return std::find(all.begin(), all.end(), x) != all.end();
}
/// Both lists without repetitions, descending: leaves first.
std::vector<int> united(std::vector<int> a, const std::vector<int>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end(), std::greater<>());
  a.erase(std::unique(a.begin(), a.end()), a.end());
  return a;
}

}  // namespace

std::span<const Row> rows_of(std::string_view joint_type) {
  return find_named(types_of_rows(), joint_type, "no loop joint has the type",
                    [](const TypeOfRows& t) { return t.type; })
      .rows;
}

std::span<const Row> rolling_rows(std::string_view type) {
  return find_named(types_of_rolling(), type, "nothing rolls as",
                    [](const TypeOfRows& t) { return t.type; })
      .rows;
}

int count_rows(std::span<const Row> rows) {
  int n = 0;
  for (const Row r : rows) n += r == Row::weld || r == Row::disk || r == Row::sphere ? 3 : 1;
  return n;
}

ConstraintSet::ConstraintSet(const Mechanism& m, const ConstraintSpec& spec) : spec_(spec) {
  for (const auto& l : spec.loops) {
    if (!std::isfinite(l.pitch) || (l.type == Helical::name && l.pitch == 0))
      refuse_constraint(l.name,
                        "pitch is " + number(l.pitch) + " m/rad, expected a number other than 0");
    const auto rows = rows_of(l.type);
    const bool on_curve = rows.back() == Row::curve;
    if (!on_curve && !l.points.empty())
      refuse_constraint(l.name, "points mean nothing to the type '" + l.type + "'");
    add_loop(m, l.name, l.type, l.a, l.b, rows, l.pitch, 0,
             on_curve ? std::make_shared<const PlaneCurve>(l.points, l.closed,
                                                           "constraint '" + l.name + "'")
                      : nullptr);
  }
  for (const auto& r : spec.rods) {
    if (!(r.length > 0) || !std::isfinite(r.length))
      refuse_constraint(r.name, "length is " + number(r.length) + " m, expected a number > 0");
    add_loop(m, r.name, "rod", r.a, r.b, rod_rows, 0, r.length);
  }
  for (const auto& r : spec.rollings) {
    const auto rows = rolling_rows(r.type);
    const bool round = rows.front() == Row::disk || rows.front() == Row::sphere;
    if (round && !(r.radius > 0 && std::isfinite(r.radius)))
      refuse_constraint(r.name, "radius is " + number(r.radius) + " m, expected a number > 0");
    add_loop(m, r.name, r.type, r.ground, r.wheel, rows, 0, r.radius);
    blocks_.back().rolling = true;
  }
  for (const auto& c : spec.couplings) add_coupling(m, c);
  for (const auto& d : spec.driven) add_driven(m, d);
  find_pattern(m);
}

bool ConstraintSet::on_the_world() const {
  return std::any_of(loops_.begin(), loops_.end(),
                     [](const Loop& l) { return l.node_a < 0 || l.node_b < 0; });
}

void ConstraintSet::add_block(const std::string& name, const std::string& kind, int size,
                              std::vector<phs::ConstraintBlock::Reaction> reactions) {
  if (name.empty()) throw InvalidArgument("a constraint (" + kind + ") has no name");
  for (const auto& other : blocks_)
    if (other.name == name) refuse_constraint(name, "there are two of that name");
  blocks_.push_back({name, kind, size, count_, -1, std::move(reactions)});
  count_ += size;
}

void ConstraintSet::add_loop(const Mechanism& m, const std::string& name, const std::string& kind,
                             const LinkFrame& a, const LinkFrame& b, std::span<const Row> rows,
                             double pitch, double length, std::shared_ptr<const PlaneCurve> curve) {
  const BodyFrame fa = frame_of(m, name, a), fb = frame_of(m, name, b);
  Loop l{rows, count_, count_rows(rows), fa.node,         fb.node, fa.pose, fb.pose, {}, {},
         {},   pitch,  length,           std::move(curve)};
  const auto up_a = ancestors(m, fa.node), up_b = ancestors(m, fb.node);
  for (const int i : up_a)
    if (!contains(up_b, i)) l.path_a.push_back(i);
  for (const int i : up_b)
    if (!contains(up_a, i)) l.path_b.push_back(i);
  l.above = united(up_a, up_b);
  if (l.path_a.empty() && l.path_b.empty())
    refuse_constraint(name, "no joint moves '" + fa.name + "' and '" + fb.name +
                                "' against each other, so there is no loop to close");
  add_block(name, kind, l.size, {{name, l.is_rod() ? 1 : 6, l.is_rod() ? "N" : "N m; N"}});
  loops_.push_back(std::move(l));
}

void ConstraintSet::add_term(const Mechanism& m, const std::string& name, const Coupling::Term& t,
                             Coupled& to, std::vector<phs::ConstraintBlock::Reaction>& reactions) {
  const JointCoordinates& q = find_named(
      m.coordinates(), t.coordinate, "constraint '" + name + "': the mechanism has no coordinate");
  if (q.nq != 1 || q.nv != 1)
    refuse_constraint(name, "'" + t.coordinate + "' has " + std::to_string(q.nv) +
                                " degrees of freedom, expected a coordinate with one");
  const int turn = q.kind == phs::BlockKind::angle ? m.nodes()[size_t(q.node)].turn : -1;
  to.above = united(std::move(to.above), ancestors(m, q.node));
  to.terms.push_back({q.node, q.q, q.v, turn, t.factor});
  reactions.push_back({name + "." + q.name, 1, q.effort_unit});
}

void ConstraintSet::add_coupling(const Mechanism& m, const Coupling& c) {
  if (!std::isfinite(c.offset)) refuse_constraint(c.name, "its offset is not finite");
  Coupled coupled{count_, c.offset, {}, {}};
  std::vector<phs::ConstraintBlock::Reaction> reactions;
  for (const auto& t : c.terms) {
    if (!std::isfinite(t.factor) || t.factor == 0)
      refuse_constraint(c.name, "the factor of '" + t.coordinate + "' is " + number(t.factor) +
                                    ", expected a number other than 0");
    add_term(m, c.name, t, coupled, reactions);
  }
  if (coupled.terms.empty()) refuse_constraint(c.name, "it couples no coordinate");
  add_block(c.name, "coupling", 1, std::move(reactions));
  couplings_.push_back(std::move(coupled));
}

void ConstraintSet::add_driven(const Mechanism& m, const Driven& d) {
  if (!d.motion.position || !d.motion.rate) refuse_constraint(d.name, "it has no motion");
  Coupled driven{count_, 0, {}, {}, d.motion.position, d.motion.rate};
  std::vector<phs::ConstraintBlock::Reaction> reactions;
  add_term(m, d.name, {d.coordinate, 1}, driven, reactions);
  for (const auto& other : couplings_)
    if (other.position && other.terms[0].q == driven.terms[0].q)
      refuse_constraint(d.name, "another motion drives '" + d.coordinate + "', expected one");
  add_block(d.name, "motion", 1, std::move(reactions));
  blocks_.back().moving = true;
  blocks_.back().instants = d.motion.instants;
  couplings_.push_back(std::move(driven));
}

std::span<const int> ConstraintSet::above(int block) const {
  const size_t b = size_t(block);
  return b < loops_.size() ? loops_[b].above : couplings_[b - loops_.size()].above;
}

void ConstraintSet::find_pattern(const Mechanism& m) {
  std::vector<std::vector<int>> below(m.nodes().size());  // blocks that a node moves
  std::vector<int> sizes, met(blocks_.size(), -1);
  for (int b = 0; b < int(blocks_.size()); ++b) {
    sizes.push_back(blocks_[size_t(b)].size);
    for (const int node : above(b)) {
      for (const int other : below[size_t(node)]) {
        if (met[size_t(other)] == b) continue;
        met[size_t(other)] = b;
        neighbours_.emplace_back(b, other);
      }
      below[size_t(node)].push_back(b);
    }
  }
  pattern_ = phs::BlockPattern(sizes, neighbours_);
}

}  // namespace porthos::mechanics
