#include "scene/read/part.h"

#include <fmt/format.h>

#include "mechanics/builder.h"
#include "mechanics/rotation.h"
#include "scene/read/scene.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

double positive(const Table& t, const char* key, const char* unit) {
  const double x = t.required(key, unit);
  if (!(x > 0)) t.fail(key, fmt::format("is {}, expected a number{} above 0", x, unit));
  return x;
}
Vec3d direction(const Table& t) {
  t.require("direction", "3 numbers, the direction in the link's axes");
  const Vec3d d = t.vector_or_zero("direction", "");
  const double length = mechanics::norm(d);
  if (!(length > 0)) t.fail("direction", "has length 0, expected a direction");
  return (1 / length) * d;
}
std::string name_of_link(const Table& t, const char* key) {
  t.require(key, "the name of a link");
  return t.text(key, "the name of a link");
}

space::Schedule schedule(const Table& t) {
  if (t.has("switches") && t.has("pulses"))
    t.fail("pulses", "is given with switches, expected one of both");
  if (t.has("switches"))
    return space::Schedule(t.list("switches", " of seconds (on, off, on, off ...)"));
  if (!t.has("pulses")) return {};
  const Table p = t.table("pulses", {"start", "period", "width", "count"});
  p.require("count", "a whole number");
  return space::Schedule::pulses(p.number_or("start", " of seconds", 0),
                                 positive(p, "period", " of seconds"),
                                 positive(p, "width", " of seconds"), long(p.whole("count")));
}

space::Thruster thruster(const Table& t) {
  space::Thruster x;
  x.link = name_of_link(t, "link");
  x.position = t.vector_or_zero("at", " of metres");
  x.direction = direction(t);
  x.thrust = positive(t, "thrust", " of N");
  x.schedule = schedule(t);
  if (t.has("specific_impulse"))
    x.specific_impulse = positive(t, "specific_impulse", " of seconds");
  return x;
}

space::Torquer torquer(const Table& t) {
  space::Torquer x;
  x.direction = direction(t);
  if (t.has("limit")) x.limit = positive(t, "limit", " of A m^2");
  const bool unloads = t.has("unload");
  for (const char* key : {"constant", "sine", "profile"})
    if (unloads && t.has(key)) t.fail(key, "is given with unload, expected one of both");
  if (unloads)
    x.unload = positive(t, "unload", " of 1/s");
  else
    x.dipole = read_signal(t, " of A m^2");
  return x;
}

/// One number for all axes, or three.
Vec3d three(const Table& t, const char* key, const char* unit) {
  if (!t.has(key)) return {0, 0, 0};
  Vec3d k{0, 0, 0};
  try {
    const double x = t.number(key, unit);
    k = {x, x, x};
  } catch (const InvalidArgument&) {
    const auto x = t.numbers<3>(key, unit);
    k = {x[0], x[1], x[2]};
  }
  for (int i = 0; i < 3; ++i)
    if (k[i] < 0) t.fail(key, fmt::format("is {}, expected 0 or more", k[i]));
  return k;
}
mechanics::Pose frame(const Table& t, const char* place, const char* rpy) {
  const Vec3d a = t.vector_or_zero(rpy, " of rad (roll, pitch, yaw)");
  return {mechanics::rotation_from_rpy(a.x, a.y, a.z), t.vector_or_zero(place, " of metres")};
}
space::SoftLatch soft_latch(const Table& t) {
  space::SoftLatch x;
  x.link = name_of_link(t, "link");
  x.body = name_of_link(t, "body");
  x.on_link = frame(t, "on_link", "on_link_rpy");
  x.on_body = frame(t, "on_body", "on_body_rpy");
  x.stiffness = three(t, "stiffness", " of N/m");
  x.turning_stiffness = three(t, "turning_stiffness", " of N m/rad");
  x.damping = three(t, "damping", " of N s/m");
  x.turning_damping = three(t, "turning_damping", " of N m s/rad");
  double any = 0;
  for (const Vec3d& k : {x.stiffness, x.turning_stiffness, x.damping, x.turning_damping})
    any += k.x + k.y + k.z;
  if (!(any > 0)) refuse(t.where(), t.label() + " does nothing, expected a stiffness or a damping");
  return x;
}

}  // namespace

bool is_part(std::string_view type) {
  return type == "thruster" || type == "torquer" || type == "soft_latch";
}

Names part_keys(std::string_view type) {
  if (type == "thruster")
    return {"link", "at", "direction", "thrust", "switches", "pulses", "specific_impulse"};
  if (type == "torquer") return {"direction", "constant", "sine", "profile", "unload", "limit"};
  return {"link",        "body",      "on_link",           "on_link_rpy", "on_body",
          "on_body_rpy", "stiffness", "turning_stiffness", "damping",     "turning_damping"};
}

void read_part(const Table& t, Element& e) {
  t.require("name", "the name of its row in the ledger");
  e.name = t.text("name", "text");
  if (e.type == "thruster") {
    e.thruster = thruster(t);
    e.thruster->name = e.name;
  }
  if (e.type == "torquer") {
    e.torquer = torquer(t);
    e.torquer->name = e.name;
  }
  if (e.type == "soft_latch") {
    e.latch = soft_latch(t);
    e.latch->name = e.name;
  }
}

std::vector<mechanics::Panel> read_panels(const Table& scene) {
  std::vector<mechanics::Panel> list;
  const auto known = [](const std::string&, const std::string&) -> Names {
    return {"name",     "link",         "at",
            "along",    "hinge_axis",   "length",
            "width",    "mass",         "bending_stiffness",
            "segments", "damping_ratio"};
  };
  scene.each_of("panel", "name", known, [&](const std::string& name, const Table& t) {
    mechanics::Panel p;
    p.name = name;
    p.where = t.where();
    p.link = name_of_link(t, "link");
    const auto axis = [&](const char* key, Vec3d otherwise) {
      const Vec3d a = t.has(key) ? t.vector_or_zero(key, "") : otherwise;
      const double length = mechanics::norm(a);
      if (!(length > 0)) t.fail(key, "has length 0, expected a direction");
      return (1 / length) * a;
    };
    const Vec3d x = axis("along", {1, 0, 0}), y = axis("hinge_axis", {0, 1, 0});
    if (std::fabs(dot(x, y)) > 1e-9)
      t.fail(t.has("hinge_axis") ? "hinge_axis" : "along",
             "is not at right angles to the other axis, expected along and hinge_axis to be");
    p.root = {{x, y, cross(x, y)}, t.vector_or_zero("at", " of metres")};
    p.length = positive(t, "length", " of metres");
    p.width = t.not_negative_or("width", " of metres", 0);
    p.mass = positive(t, "mass", " of kg");
    p.bending_stiffness = positive(t, "bending_stiffness", " of N m^2");
    if (t.has("segments")) {
      const std::uint64_t n = t.whole("segments");
      if (n < 1 || n > 1000) t.fail("segments", fmt::format("is {}, expected 1 to 1000", n));
      p.segments = int(n);
    }
    p.damping_ratio = t.not_negative_or("damping_ratio", "", 0);
    list.push_back(std::move(p));
  });
  return list;
}

}  // namespace porthos::scene
