#include "scene/read/event.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using Type = Event::Type;

Names event_keys(const std::string& type, const std::string& where) {
  if (type == "capture")
    return {"type",    "at",      "when",  "after", "body", "link",
            "on_body", "on_link", "reach", "speed", "rate"};
  if (type == "engage") return {"type", "at", "when", "after", "latch", "reach", "speed", "rate"};
  if (type == "disengage") return {"type", "at", "latch"};
  if (type == "release") return {"type", "at", "body"};
  if (type == "lock") return {"type", "at", "above", "below", "after", "joint"};
  if (type == "unlock") return {"type", "at", "joint"};
  refuse(where, fmt::format("type is \"{}\", expected \"capture\", \"release\", \"lock\", "
                            "\"unlock\", \"engage\" or \"disengage\"",
                            type));
}

double limit(const Table& t, const char* key, const char* unit) {
  if (!t.has(key)) return std::numeric_limits<double>::infinity();
  const double x = t.number(key, unit);
  if (x < 0) t.fail(key, fmt::format("is {}, expected a number{}, 0 or more", x, unit));
  return x;
}

/// A time, or what the event waits for.
void read_moment(const Table& t, Event& e) {
  for (const auto& [key, to] : {std::pair{"above", &e.above}, {"below", &e.below}})
    if (t.has(key)) *to = t.number(key, " of rad or m");
  if (t.has("when")) {
    t.choice("when", {"within_reach"});
    e.within_reach = true;
  }
  const int given = t.has("at") + t.has("when") + t.has("above") + t.has("below");
  const bool may_wait = e.type == Type::lock || e.type == Type::capture || e.type == Type::engage;
  if (given != 1 && may_wait)
    refuse(t.where(), fmt::format("{} has {} of the keys {}, expected one", t.label(), given,
                                  e.type == Type::lock ? "at, above and below" : "at and when"));
  if (!e.waits()) {
    t.require("at", "a number of seconds");
    e.at = t.seconds("at");
    if (t.has("after")) t.fail("after", "is given with a time, expected one of both");
    return;
  }
  e.at = std::numeric_limits<double>::infinity();
  if (t.has("after")) e.after = t.seconds("after");
}

Event read_event(const std::string& type, const Table& t) {
  Event e;
  e.where = t.where();
  e.type = type == "capture"   ? Type::capture
           : type == "release" ? Type::release
           : type == "lock"    ? Type::lock
           : type == "unlock"  ? Type::unlock
           : type == "engage"  ? Type::engage
                               : Type::disengage;
  read_moment(t, e);
  const bool body = e.type == Type::capture || e.type == Type::release,
             latch = e.type == Type::engage || e.type == Type::disengage;
  const char* named = body ? "body" : latch ? "latch" : "joint";
  t.require(named, "a name");
  e.name = t.text(named, "a name");
  if (e.type != Type::capture && e.type != Type::engage) return e;
  if (e.type == Type::capture) {
    t.require("link", "the name of a link");
    e.latch.body = e.name;
    e.latch.link = t.text("link", "the name of a link");
    e.latch.on_body = t.vector_or_zero("on_body", " of metres");
    e.latch.on_link = t.vector_or_zero("on_link", " of metres");
  }
  t.require("reach", "a number of metres, the largest distance at which the latch can close");
  e.latch.reach = limit(t, "reach", " of metres");
  e.latch.speed = limit(t, "speed", " of m/s");
  e.latch.rate = limit(t, "rate", " of rad/s");
  return e;
}

}  // namespace

mechanics::MassProperties read_mass_properties(const Table& t) {
  t.require("mass", "a number of kg");
  mechanics::MassProperties m;
  m.mass = t.not_negative_or("mass", " of kg", 0);
  m.com = t.vector_or_zero("com", " of metres");
  if (!t.has("inertia")) return m;
  const auto i = t.numbers<6>("inertia", " of kg m^2 (ixx, iyy, izz, ixy, ixz, iyz)");
  m.inertia.xx = i[0];
  m.inertia.yy = i[1];
  m.inertia.zz = i[2];
  m.inertia.xy = i[3];
  m.inertia.xz = i[4];
  m.inertia.yz = i[5];
  return m;
}

BaseStart read_base_start(const Table& t) {
  BaseStart b;
  b.position = t.vector_or_zero("position", " of metres");
  b.linear_velocity = t.vector_or_zero("linear_velocity", " of m/s");
  b.angular_velocity = t.vector_or_zero("angular_velocity", " of rad/s");
  if (!t.has("attitude_wxyz")) return b;
  auto xi = t.numbers<4>("attitude_wxyz", "");
  double largest = 0;
  for (const double x : xi) largest = std::max(largest, std::fabs(x));
  if (largest == 0) t.fail("attitude_wxyz", "has length 0, expected a quaternion of length 1");
  for (double& x : xi) x /= largest;  // so that no square overflows or vanishes
  const double length = std::sqrt(std::inner_product(xi.begin(), xi.end(), xi.begin(), 0.0));
  for (size_t i = 0; i < 4; ++i) b.attitude_wxyz[i] = xi[i] / length;
  return b;
}

std::vector<FreeBody> read_bodies(const Table& scene) {
  std::vector<FreeBody> list;
  const auto known = [](const std::string&, const std::string&) -> Names {
    return {"name",
            "mass",
            "com",
            "inertia",
            "position",
            "attitude_wxyz",
            "linear_velocity",
            "angular_velocity"};
  };
  scene.each_of("body", "name", known, [&](const std::string& name, const Table& t) {
    FreeBody b;
    b.name = name;
    b.where = t.where();
    t.require("inertia", "6 numbers of kg m^2");
    b.mass = read_mass_properties(t);
    b.start = read_base_start(t);
    b.start.where = b.where;
    list.push_back(std::move(b));
  });
  return list;
}

std::vector<Event> read_events(const Table& scene) {
  std::vector<Event> list;
  scene.each_of("event", "type", event_keys, [&](const std::string& type, const Table& t) {
    list.push_back(read_event(type, t));
  });
  std::stable_sort(list.begin(), list.end(),
                   [](const Event& a, const Event& b) { return a.at < b.at; });
  return list;
}

std::string text(const Event& e) {
  switch (e.type) {
    case Type::capture:
      return fmt::format("capture of {} by {}", e.name, e.latch.link);
    case Type::release:
      return "release of " + e.name;
    case Type::lock:
      return "lock of " + e.name;
    case Type::engage:
      return "engagement of " + e.name;
    case Type::disengage:
      return "disengagement of " + e.name;
    case Type::unlock:
      break;
  }
  return "unlock of " + e.name;
}

mechanics::Impact apply(mechanics::MovingMechanism& moving, const Event& e) {
  try {
    switch (e.type) {
      case Type::capture:
        return mechanics::capture(moving, e.latch);
      case Type::release:
        return mechanics::release(moving, e.name);
      case Type::lock:
        return mechanics::lock(moving, e.name);
      case Type::unlock:
        return mechanics::unlock(moving, e.name);
      case Type::engage:
      case Type::disengage:
        break;  // the mechanism stays: latching.h
    }
    throw InvalidArgument("soft latch '" + e.name + "' changes no mechanism");
  } catch (const InvalidArgument& why) {
    throw InvalidArgument(fmt::format("{}: at {:g} s: {}", e.where, e.at, why.what()));
  }
}

}  // namespace porthos::scene
