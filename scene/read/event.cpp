#include "scene/read/event.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using Type = Event::Type;

double limit(const Table& t, const char* key) {
  return t.has(key) ? t.not_negative(key) : std::numeric_limits<double>::infinity();
}

/// Reads a time, or the condition the event waits for.
void read_moment(const Table& t, Event& e) {
  for (const auto& [key, to] : {std::pair{"above", &e.above}, {"below", &e.below}})
    if (t.has(key)) *to = t.number(key);
  if (t.has("when")) {
    t.choice("when");
    e.within_reach = true;
  }
  const int given = t.has("at") + t.has("when") + t.has("above") + t.has("below");
  const bool may_wait = e.type == Type::lock || e.type == Type::capture || e.type == Type::engage ||
                        e.type == Type::close;
  if (given != 1 && may_wait)
    refuse(t.where(), fmt::format("{} has {} of the keys {}, expected one", t.label(), given,
                                  e.type == Type::lock ? "at, above and below" : "at and when"));
  if (!e.waits()) {
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
           : type == "close"   ? Type::close
           : type == "open"    ? Type::open
                               : Type::disengage;
  read_moment(t, e);
  const bool body = e.type == Type::capture || e.type == Type::release;
  const char* named = body ? "body" : e.on_latch() ? "latch" : e.on_loop() ? "loop" : "joint";
  e.name = t.text(named, "a name");
  const bool closes = e.type == Type::engage || e.type == Type::close;
  if (e.type != Type::capture && !closes) return e;
  if (e.type == Type::capture) {
    e.latch.body = e.name;
    e.latch.link = t.text("link", "the name of a link");
    e.latch.on_body = t.vector("on_body");
    e.latch.on_link = t.vector("on_link");
  }
  if (e.type != Type::close)
    t.require("reach", "a number of metres, the largest distance at which the latch can close");
  e.latch.reach = limit(t, "reach");
  e.latch.speed = limit(t, "speed");
  e.latch.rate = limit(t, "rate");
  return e;
}

}  // namespace

mechanics::MassProperties read_mass_properties(const Table& t) {
  mechanics::MassProperties m;
  m.mass = t.not_negative("mass");
  m.com = t.vector("com");
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
  b.position = t.vector("position");
  b.linear_velocity = t.vector("linear_velocity");
  b.angular_velocity = t.vector("angular_velocity");
  if (!t.has("attitude_wxyz")) return b;
  auto xi = t.numbers<4>("attitude_wxyz");
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
  scene.each_of("body", "name", [&](const std::string& name, const Table& t) {
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
  scene.each_of("event", "type", [&](const std::string& type, const Table& t) {
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
    case Type::close:
      return "closing of " + e.name;
    case Type::open:
      return "opening of " + e.name;
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
      case Type::open:
        return mechanics::open_loop(moving, e.name);
      case Type::close:
      case Type::engage:
      case Type::disengage:
        break;  // need the scene: latching.h, loop_events.h
    }
    throw InvalidArgument("'" + e.name + "' is not changed by the event alone");
  } catch (const InvalidArgument& why) {
    throw InvalidArgument(fmt::format("{}: at {:g} s: {}", e.where, e.at, why.what()));
  }
}

}  // namespace porthos::scene
