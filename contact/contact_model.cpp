#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/detail/connected.h"
#include "contact/detail/gaps.h"
#include "contact/detail/near_pairs.h"

namespace porthos::contact {
namespace {

using mechanics::Mechanism;

[[noreturn]] void refuse(const char* what, const std::string& name, const std::string& why) {
  throw InvalidArgument(fmt::format("{} '{}': {}", what, name, why));
}
/// Calls f; an error begins with the name.
template <class F>
void in(const char* what, const std::string& name, F f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    refuse(what, name, e.what());
  }
}

using Seat = ContactModel::Seat;
using Sides = ContactModel::Sides;

Seat seat(const Mechanism& m, const Surface& s) {
  check(s.shape);
  Seat at{-1, s.shape};
  if (s.link == "world") return at;
  const mechanics::BodyFrame& body = m.body(s.link);
  at.node = body.node;
  at.shape.pose = body.pose * s.shape.pose;
  return at;
}

/// The seats of a model's surfaces, each once.
class Seats {
 public:
  Seats(const Mechanism& m, std::vector<Seat>& seats) : m_(m), seats_(seats) {
    of_node_.resize(m.nodes().size() + 1);
  }
  /// Those of one side of a contact.
  std::vector<size_t> of(const std::vector<Surface>& surfaces) {
    std::vector<size_t> all;
    for (const Surface& each : surfaces) all.push_back(of(each));
    return all;
  }

 private:
  size_t of(const Surface& s) {
    const Seat own = seat(m_, s);
    auto& known = of_node_[size_t(own.node + 1)];
    for (const size_t k : known)
      if (seats_[k].shape == own.shape) return k;
    known.push_back(seats_.size());
    seats_.push_back(own);
    return known.back();
  }
  const Mechanism& m_;
  std::vector<Seat>& seats_;
  std::vector<std::vector<size_t>> of_node_;  ///< of the world, then of each node
};

/// Calls f(a, b) for every two seats of a contact that may touch.
template <class F>
void each_pair(const ContactModel& model, const ContactModel::Placed& placed, const Sides& sides,
               const F& f) {
  std::vector<char> on(placed.seats.size(), 0);  // 1: on a, 2: on b
  for (const size_t k : sides.a) on[k] |= 1;
  for (const size_t k : sides.b) on[k] |= 2;
  for (const size_t a : sides.a)
    for (const size_t b : sides.b) {
      const int of_a = placed.seats[a].node, of_b = placed.seats[b].node;
      if (of_a == of_b) continue;  // one rigid body, for example since a joint was locked
      if (on[a] == 3 && on[b] == 3 && (b < a || model.connected(of_a, of_b))) continue;
      f(a, b);
    }
}

Sides sides_of(const ContactModel& model, Seats& seats, const ContactModel::Placed& placed,
               const Contact& c, size_t index) {
  if (c.a.empty() || c.b.empty()) throw InvalidArgument("one side has no shape, expected both");
  check(c.law);
  const std::vector<size_t> all_a = seats.of(c.a), all_b = seats.of(c.b);
  Sides sides{index, {}, {}};
  for (const auto& [all, once] : {std::pair{&all_a, &sides.a}, {&all_b, &sides.b}})
    for (const size_t k : *all)
      if (std::find(once->begin(), once->end(), k) == once->end()) once->push_back(k);
  const auto link = [](const std::vector<Surface>& surfaces, const std::vector<size_t>& all,
                       size_t seat) {
    return surfaces[size_t(std::find(all.begin(), all.end(), seat) - all.begin())].link;
  };
  each_pair(model, placed, sides, [&](size_t a, size_t b) {
    const Kind of_a = placed.seats[a].shape.kind, of_b = placed.seats[b].shape.kind;
    if (points(of_a, of_b, Ends::fade) == 0)
      throw InvalidArgument(
          fmt::format("there is no distance in closed form between a {} on '{}' and a {} on "
                      "'{}', expected one of the pairs {}",
                      to_string(of_a), link(c.a, all_a, a), to_string(of_b), link(c.b, all_b, b),
                      known_pairs()));
    if (!have_edges(of_a, of_b)) return;
    const double rounded = placed.seats[a].shape.radius + placed.seats[b].shape.radius;
    if (!(rounded > 0))
      throw InvalidArgument(fmt::format(
          "the boxes on '{}' and '{}' have sharp edges, whose normals are not unique: expected a "
          "shape with a radius for one of them",
          link(c.a, all_a, a), link(c.b, all_b, b)));
    if (!c.law.rigid() && !c.law.switches())
      throw InvalidArgument(fmt::format(
          "the smooth law pushes at a distance, where gaps of edges, of a {} on '{}' and a {} on "
          "'{}', have kinks: expected law = \"power\", \"hertz\" or \"rigid\"",
          to_string(of_a), link(c.a, all_a, a), to_string(of_b), link(c.b, all_b, b)));
  });
  return sides;
}

/// All pairs of two sides.
void add_pairs(const ContactModel& model, const Sides& sides, Ends ends,
               ContactModel::Placed& placed) {
  each_pair(model, placed, sides, [&](size_t a, size_t b) {
    const auto n = size_t(points(placed.seats[a].shape.kind, placed.seats[b].shape.kind, ends));
    placed.pairs.push_back({sides.contact, a, b, placed.points, n});
    placed.points += n;
  });
}

ContactModel::PlacedJoint place(const Mechanism& m, const std::string& joint) {
  const mechanics::JointCoordinates& c = m.coordinate(joint);
  if (c.nq != 1 || c.nv != 1)
    throw InvalidArgument(
        fmt::format("joint '{}' has several degrees of freedom, expected a joint of one", joint));
  const bool turns = c.kind == phs::BlockKind::angle;
  return {size_t(c.q), size_t(c.v), turns ? m.nodes()[size_t(c.node)].turn : -1};
}

ContactModel::PlacedStop place(const Mechanism& m, const Stop& s) {
  check(s.law);
  if (s.law.friction > 0) throw InvalidArgument("it has friction, expected none");
  if (std::isnan(s.lower) || std::isnan(s.upper) || !(s.lower < s.upper))
    throw InvalidArgument(fmt::format(
        "the lower limit is {:g}, expected less than the upper one, {:g}", s.lower, s.upper));
  if (!std::isfinite(s.lower) && !std::isfinite(s.upper))
    throw InvalidArgument("it has no limit, expected a lower or an upper one");
  return {place(m, s.joint), s.lower, s.upper};
}

phs::Description describe(const phs::Description& inner, const std::vector<Contact>& contacts,
                          const std::vector<Stop>& stops,
                          const std::vector<ContactModel::Rigid>& rigid,
                          const std::vector<DryFriction>& dry, bool on_the_world) {
  phs::Description d = inner;
  d.flows.clear();
  d.traits.separable = false;
  const auto lose = [&](const std::string& name, bool any) {
    if (!any) return;
    d.powers.push_back({name, phs::PowerKind::dissipated});
    d.traits.lossless = false;
  };
  for (const Contact& c : contacts) {
    d.storages.push_back(c.name);
    lose(c.name + ".loss", c.law.loss > 0);
    lose(c.name + ".friction", c.law.friction > 0);
  }
  for (const Stop& s : stops) {
    d.storages.push_back(s.name);
    lose(s.name + ".loss", s.law.loss > 0);
  }
  for (const auto& r : rigid) {
    lose(r.name + ".impact", true);
    d.powers.push_back({r.name + ".impacts", phs::PowerKind::observed});
    lose(r.name + ".friction", r.friction > 0);
  }
  for (const DryFriction& f : dry) {
    lose(f.name, true);
    d.powers.push_back({f.name + ".slips", phs::PowerKind::observed});
  }
  d.invariants.clear();
  int at = 0;
  for (auto i : inner.invariants) {
    if (on_the_world && i.name.find("_momentum") != std::string::npos) continue;
    i.at = at;
    at += i.size;
    d.invariants.push_back(std::move(i));
  }
  return d;
}

class Depths final : public integrators::Switches {
 public:
  Depths(const ContactModel& model, const ContactModel::Placed& placed)
      : gaps_(model.mechanism(), placed), nq_(size_t(model.mechanism().nq())) {
    for (const auto& p : placed.pairs)
      for (size_t i = p.first; i < p.first + p.points; ++i)
        if (model.contacts()[p.contact].law.switches()) points_.push_back(i);
    for (size_t s = 0; s < placed.stops.size(); ++s) {
      const Stop& stop = model.stops()[s];
      if (!stop.law.switches()) continue;
      if (std::isfinite(stop.lower)) limits_.push_back(2 * s);
      if (std::isfinite(stop.upper)) limits_.push_back(2 * s + 1);
    }
  }
  size_t count() const override { return points_.size() + limits_.size(); }
  void at(double, std::span<const double> x, std::span<const double> turns,
          std::span<double> depth) override {
    gaps_.set_turn_angles(turns);
    gaps_.place(x.first(nq_));
    size_t k = 0;
    for (const size_t i : points_) depth[k++] = -gaps_.touch[i].gap;
    for (const size_t i : limits_) depth[k++] = gaps_.depth[i];
  }

 private:
  Gaps<double> gaps_;
  size_t nq_;
  std::vector<size_t> points_, limits_;
};

}  // namespace

ContactModel::ContactModel(std::shared_ptr<const phs::Model> inner,
                           std::shared_ptr<const mechanics::MechanicalModel> mechanical,
                           std::vector<Contact> contacts, std::vector<Stop> stops,
                           std::vector<DryFriction> dry)
    : inner_(std::move(inner)),
      mechanical_(std::move(mechanical)),
      dry_(std::move(dry)),
      connected_(connected_nodes(*mechanical_)) {
  const Mechanism& m = mechanism();
  Seats soft_seats(m, placed_.seats), rigid_seats(m, placed_rigid_.seats);
  const auto is_rigid = [&](const std::string& name, const Law& law) {
    if (law.rigid()) rigid_.push_back({name, law.restitution, law.simultaneous, law.friction});
    return law.rigid();
  };
  for (Contact& c : contacts)
    in("contact", c.name, [&] {
      if (is_rigid(c.name, c.law)) {
        rigid_sides_.push_back(sides_of(*this, rigid_seats, placed_rigid_, c, rigid_.size() - 1));
        return;
      }
      add_pairs(*this, sides_of(*this, soft_seats, placed_, c, contacts_.size()), Ends::fade,
                placed_);
      contacts_.push_back(std::move(c));
    });
  for (Stop& s : stops)
    in("stop", s.name, [&] {
      const bool rigid = is_rigid(s.name, s.law);
      (rigid ? placed_rigid_ : placed_).stops.push_back(place(m, s));
      if (!rigid) stops_.push_back(std::move(s));
    });
  for (const DryFriction& f : dry_)
    in("dry friction", f.name, [&] {
      check(f);
      placed_dry_.push_back(place(m, f.joint));
      if (!rigid_.empty())
        throw InvalidArgument("'" + rigid_.front().name +
                              "' is rigid, expected soft contacts and stops beside dry friction");
      if (std::any_of(dry_.begin(), dry_.end(), [&](const DryFriction& other) {
            return &other < &f && other.joint == f.joint;
          }))
        throw InvalidArgument(
            fmt::format("joint '{}' has dry friction already, expected it once", f.joint));
    });
  const auto on_world = [](const Placed& placed) {
    return std::any_of(placed.seats.begin(), placed.seats.end(),
                       [](const Seat& s) { return s.node < 0; });
  };
  description_ = describe(inner_->description(), contacts_, stops_, rigid_, dry_,
                          on_world(placed_) || on_world(placed_rigid_));
}

std::unique_ptr<integrators::Switches> ContactModel::depths() const {
  return std::make_unique<Depths>(*this, placed_);
}

bool ContactModel::connected(int node, int other) const {
  return std::binary_search(connected_.begin(), connected_.end(),
                            std::pair(std::min(node, other), std::max(node, other)));
}

ContactModel::Placed ContactModel::all_rigid() const {
  Placed all = placed_rigid_;
  for (const Sides& sides : rigid_sides_) add_pairs(*this, sides, Ends::off, all);
  return all;
}

void ContactModel::check_friction_of_events() const {
  const Placed placed = all_rigid();
  std::vector<const Pair*> with_friction;
  const auto node = [&](size_t seat) { return placed.seats[seat].node; };
  for (const Pair& p : placed.pairs) {
    const Rigid& own = rigid_[p.contact];
    if (!(own.friction > 0)) continue;
    if (p.points > 1)
      refuse("contact", own.name,
             fmt::format("a {} and a {} touch in {} points and have friction, expected shapes that "
                         "touch in one, for example a sphere, or method = \"moreau\"",
                         to_string(placed.seats[p.a].shape.kind),
                         to_string(placed.seats[p.b].shape.kind), p.points));
    for (const Pair* other : with_friction)
      for (const int own_node : {node(p.a), node(p.b)})
        if (own_node >= 0 && (own_node == node(other->a) || own_node == node(other->b)))
          refuse("contact", own.name,
                 fmt::format("a link of it has rigid friction at another point, in '{}', expected "
                             "one such point on a link, or method = \"moreau\"",
                             rigid_[other->contact].name));
    with_friction.push_back(&p);
  }
}

std::pair<std::string, double> ContactModel::deepest_rigid(const phs::State& state) const {
  NearPairs near(*this);
  Gaps<double> gaps(mechanism(), near.placed(), Ends::off);
  gaps.place_bodies(state);
  near.find(gaps.seat, gaps.seat);
  gaps.place_pairs();
  std::pair<std::string, double> deepest{"", -std::numeric_limits<double>::infinity()};
  const auto look = [&](size_t rigid, double depth) {
    if (depth > deepest.second) deepest = {rigid_[rigid].name, depth};
  };
  for (const Pair& p : near.placed().pairs)
    for (size_t i = p.first; i < p.first + p.points; ++i) look(p.contact, -gaps.touch[i].gap);
  const size_t stops = placed_rigid_.stops.size();
  for (size_t k = 0; k < 2 * stops; ++k) look(rigid_.size() - stops + k / 2, gaps.depth[k]);
  return deepest;
}

}  // namespace porthos::contact
