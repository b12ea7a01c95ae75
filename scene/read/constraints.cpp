#include "scene/read/constraints.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "mechanics/rotation.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using mechanics::LinkFrame;
using mechanics::Mat3;

/// The rotation by the smallest angle that takes e to the unit vector u; about another coordinate
/// axis for the opposite of e.
Mat3<double> turning(const Vec3d& e, const Vec3d& u) {
  const Vec3d v = cross(e, u);
  const double c = dot(e, u), v2 = dot(v, v);
  const double k = c > 0 ? 1 / (1 + c) : (1 - c) / v2;  // the same; 1 + c cancels near -1
  if (v2 == 0 && c < 0) {
    const Vec3d n{e.y, e.z, e.x};
    return {2 * n.x * n - Vec3d{1, 0, 0}, 2 * n.y * n - Vec3d{0, 1, 0},
            2 * n.z * n - Vec3d{0, 0, 1}};
  }
  return {{c + k * v.x * v.x, v.z + k * v.x * v.y, -v.y + k * v.x * v.z},
          {-v.z + k * v.x * v.y, c + k * v.y * v.y, v.x + k * v.y * v.z},
          {v.y + k * v.x * v.z, -v.x + k * v.y * v.z, c + k * v.z * v.z}};
}

/// axis: which of the frame's axes the key `axis` means: z, or x of the second frame of a universal
/// joint.
LinkFrame frame(const Table& loop, const char* key, const Vec3d& axis) {
  loop.require(key, "a table with the link and the place of its frame");
  const Table t = loop.table(key);
  LinkFrame f;
  f.link = t.text("link", "the name of a link, or \"world\"");
  if (f.link == "world") f.link.clear();
  f.pose.r = t.vector("position");
  if (t.has("attitude_wxyz")) {
    if (t.has("axis")) t.fail("axis", "is given with attitude_wxyz, expected one of both");
    const auto q = t.numbers<4>("attitude_wxyz");
    const double norm = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (!(norm > 0)) t.fail("attitude_wxyz", "is zero, expected a quaternion");
    f.pose.R = mechanics::rotation_matrix(
        mechanics::Quaternion<double>{q[0] / norm, {q[1] / norm, q[2] / norm, q[3] / norm}});
  } else if (t.has("axis")) {
    f.pose.R = turning(axis, t.direction("axis"));
  }
  return f;
}

void read_loop(const Table& t, const std::string& name, mechanics::ConstraintSpec& spec) {
  const std::string type = t.choice("type");
  const Vec3d z{0, 0, 1}, x{1, 0, 0};
  const LinkFrame a = frame(t, "a", z), b = frame(t, "b", type == "universal" ? x : z);
  for (const auto& [key, of, some] : {std::array{"pitch", "helical", "one, because the loop is a"},
                                      {"length", "rod", "one, because the loop is a"},
                                      {"points", "on_curve", "some, because the loop is"}}) {
    if (type == of) t.require(key, fmt::format("{} {}", some, of));
    if (type != of && t.has(key))
      t.fail(key, fmt::format("means nothing to a loop of type {}", type));
  }
  if (type != "on_curve" && t.has("closed"))
    t.fail("closed", fmt::format("means nothing to a loop of type {}", type));
  if (type == "rod") {
    spec.rods.push_back({name, a, b, t.positive("length")});
    return;
  }
  mechanics::LoopJoint loop{name, type, a, b, type == "helical" ? t.number("pitch") : 0};
  if (type == "on_curve") {
    loop.points = t.rows<2>("points");
    loop.closed = t.boolean("closed");
  }
  spec.loops.push_back(std::move(loop));
}

void read_coupling(const Table& t, const std::string& name, mechanics::ConstraintSpec& spec) {
  Names joints;
  t.require("factors", "a table of coordinates and their factors");
  for (const auto& [joint, factor] : t.raw("factors", "a table of coordinates and their factors"))
    joints.push_back(joint.str());
  const Table factors = t.table("factors", joints);
  mechanics::Coupling c{name, {}, t.number("offset")};
  for (const auto joint : joints) {
    const std::string coordinate(joint);
    c.terms.push_back({coordinate, factors.number(coordinate.c_str(), std::string())});
  }
  spec.couplings.push_back(std::move(c));
}

void read_rolling(const Table& t, const std::string& name, mechanics::ConstraintSpec& spec) {
  const Vec3d z{0, 0, 1};
  mechanics::Rolling r{name, t.choice("type"), {}, frame(t, "wheel", z), 0};
  if (t.has("ground")) r.ground = frame(t, "ground", z);
  const bool round = r.type == "disk" || r.type == "sphere";
  if (round) t.require("radius", fmt::format("one, because it rolls as a {}", r.type));
  if (!round && t.has("radius")) t.fail("radius", fmt::format("means nothing to a {}", r.type));
  if (round) r.radius = t.positive("radius");
  spec.rollings.push_back(std::move(r));
}

phs::Motion moves(const Table& t, const char* what) {
  const auto at = t.list("at"), duration = t.list("duration"), to = t.list("to");
  if (duration.size() != at.size() || to.size() != at.size())
    t.fail("at", fmt::format("has {} numbers, duration {} and to {}, expected as many of each",
                             at.size(), duration.size(), to.size()));
  std::vector<phs::Move> all;
  for (size_t i = 0; i < at.size(); ++i) all.push_back({at[i], duration[i], to[i]});
  return phs::moves_from(t.number("from"), all, what);
}

phs::Motion motion_of(const Table& t, const char* what) {
  if (t.has("moves")) return moves(t.table("moves"), what);
  if (t.has("steady")) {
    const Table s = t.table("steady");
    return phs::steady_motion(s.number("from"), s.number("rate"), what);
  }
  const Table s = t.table("swing");
  return phs::swinging_motion(s.number("middle"), s.number("amplitude"), s.positive("frequency"),
                              s.number("phase"), what);
}

void read_motion(const Table& t, const std::string& name, mechanics::ConstraintSpec& spec) {
  t.require("joint", "the coordinate that moves as told");
  if (t.has("moves") + t.has("steady") + t.has("swing") != 1)
    refuse(t.where(), fmt::format("{} has {} of the keys moves, steady and swing, expected one",
                                  t.label(), t.has("moves") + t.has("steady") + t.has("swing")));
  try {
    const std::string what = "motion '" + name + "'";
    spec.driven.push_back(
        {name, t.text("joint", "the name of a coordinate"), motion_of(t, what.c_str())});
  } catch (const InvalidArgument& e) {
    const std::string text = e.what();
    if (text.starts_with("motion '")) refuse(t.where(), text);
    throw;
  }
}

/// Moves the constraint of this name from one spec to the other.
void move_named(mechanics::ConstraintSpec& from, mechanics::ConstraintSpec& to,
                const std::string& name) {
  const auto move = [&](auto& a, auto& b) {
    for (size_t i = 0; i < a.size(); ++i) {
      if (a[i].name != name) continue;
      b.push_back(std::move(a[i]));
      a.erase(a.begin() + long(i));
      return;
    }
  };
  move(from.loops, to.loops);
  move(from.rods, to.rods);
  move(from.couplings, to.couplings);
}

/// Opens those that an event closes; checks the names.
void await(SceneConstraints& c, const std::vector<Event>& events) {
  for (const Event& e : events) {
    if (!e.on_loop()) continue;
    if (!c.where.count(e.name)) {
      std::string known;
      for (const auto& [name, where] : c.where) add_to_list(known, name);
      refuse(e.where, fmt::format("there is no [[loop]] or [[coupling]] '{}', expected one of: {}",
                                  e.name, known.empty() ? "(none)" : known));
    }
    const auto has = [&](const auto& list) {
      return std::any_of(list.begin(), list.end(), [&](const auto& x) { return x.name == e.name; });
    };
    if (has(c.spec.rollings) || has(c.spec.driven))
      refuse(e.where, fmt::format("'{}' is a [[rolling]] or [[motion]], which no event changes: "
                                  "expected a [[loop]] or [[coupling]]",
                                  e.name));
    if (e.type == Event::Type::close) move_named(c.spec, c.later, e.name);
  }
}

}  // namespace

std::string SceneConstraints::held_to_the_world() const {
  for (const auto* one : {&spec, &later}) {
    for (const auto& l : one->loops)
      if (l.a.link.empty() || l.b.link.empty()) return l.name;
    for (const auto& r : one->rods)
      if (r.a.link.empty() || r.b.link.empty()) return r.name;
    for (const auto& r : one->rollings)
      if (r.ground.link.empty() || r.wheel.link.empty()) return r.name;
  }
  return "";
}

mechanics::ConstraintSpec SceneConstraints::awaited(const std::string& name) const {
  mechanics::ConstraintSpec all = later, one;
  move_named(all, one, name);
  return one;
}

InvalidArgument SceneConstraints::placed(const InvalidArgument& error) const {
  const std::string text = error.what();
  for (const auto& [name, place] : where)
    if (text.find("constraint '" + name + "'") != std::string::npos)
      return InvalidArgument(in_file(place) + text);
  return error;
}

SceneConstraints read_constraints(const Table& scene, const std::vector<Event>& events) {
  SceneConstraints c;
  const auto each = [&](const char* key, auto read) {
    scene.each_of(key, "name", [&](const std::string& name, const Table& t) {
      if (name.empty()) t.fail("name", "is empty, expected one");
      if (!c.where.emplace(name, t.where()).second)
        t.fail("name", fmt::format("is '{}', as another constraint is called", name));
      read(t, name, c.spec);
    });
  };
  each("loop", read_loop);
  each("coupling", read_coupling);
  each("rolling", read_rolling);
  each("motion", read_motion);
  await(c, events);
  return c;
}

}  // namespace porthos::scene
