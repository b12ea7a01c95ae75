#include "scene/read/element.h"

#include <fmt/format.h>

#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "scene/read/part.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// Keys of a type, besides type, name and joint.
Names element_keys(const std::string& type, const std::string& where) {
  Names own;
  if (type == "spring")
    own = {"stiffness", "rest", "cubic", "elongation", "force"};
  else if (type == "damper")
    own = {"damping"};
  else if (type == "friction")
    own = {"coulomb", "breakaway", "stribeck", "viscous", "smoothing"};
  else if (type == "limits")
    own = {"lower", "upper", "stiffness"};
  else if (type == "force")
    own = {"constant", "sine", "profile"};
  else if (type == "dc_motor")
    own = {"inductance", "resistance", "constant", "gear", "rotor_inertia", "friction", "voltage"};
  else if (type == "wheel")
    own = {"gain", "rate"};
  else if (type == "cmg")
    own = {"wheel", "gain", "constant", "sine", "profile"};
  else if (is_part(type))
    own = part_keys(type);
  else if (type == "controller")
    own = {"target", "speed", "stiffness", "damping", "rate", "output"};
  else
    refuse(where,
           fmt::format("type is \"{}\", expected \"spring\", \"damper\", \"friction\", \"limits\", "
                       "\"force\", \"dc_motor\", \"controller\", \"wheel\", \"cmg\", "
                       "\"thruster\", \"torquer\" or \"soft_latch\"",
                       type));
  own.insert(own.begin(), {"type", "name"});
  if (!is_part(type)) own.insert(own.begin() + 2, "joint");
  return own;
}

void read_spring(const Table& t, Element& e) {
  const bool table = t.has("elongation") || t.has("force");
  if (table) {
    for (const char* key : {"stiffness", "rest", "cubic"})
      if (t.has(key)) t.fail(key, "is given with a table of forces, expected one of both");
    t.require("elongation", "an array of rad or m");
    t.require("force", "an array of N m or N");
    e.potential = phs::tabulated_spring(t.list("elongation", " of rad or m"),
                                        t.list("force", " of N m or N"));
  } else {
    e.potential = phs::spring(t.required("stiffness", " of N m/rad or N/m"),
                              t.number_or("rest", " of rad or m", 0),
                              t.number_or("cubic", " of N m/rad^3 or N/m^3", 0));
  }
}

void read_motor(const Table& t, Element& e) {
  phs::DcMotor m;
  m.inductance = t.required("inductance", " of H");
  m.resistance = t.required("resistance", " of Ohm");
  m.constant = t.required("constant", " of N m/A");
  m.gear = t.number_or("gear", "", 1);
  m.rotor_inertia = t.not_negative_or("rotor_inertia", " of kg m^2", 0);
  m.friction = t.not_negative_or("friction", " of N m s/rad", 0);
  e.motor = m;
  t.require("voltage", "a table with one of the keys constant, sine, profile");
  e.source = read_signal(t.table("voltage", {"constant", "sine", "profile"}), " of V");
}

/// tau = stiffness (target - z) + damping (speed - z'), with the z and z' of the instants if it has
/// a rate.
void read_controller(const Table& t, Element& e) {
  const double stiffness = t.not_negative_or("stiffness", " of N m/rad or N/m", 0),
               damping = t.not_negative_or("damping", " of N m s/rad or N s/m", 0),
               target = t.number_or("target", " of rad or m", 0),
               speed = t.number_or("speed", " of rad/s or m/s", 0);
  if (stiffness == 0 && damping == 0)
    refuse(t.where(), t.label() + " does nothing, expected a stiffness or a damping");
  e.gains = {stiffness, damping, target, speed};
  if (t.has("rate")) {
    e.rate = t.number("rate", " of Hz");
    if (!(e.rate > 0)) t.fail("rate", fmt::format("is {}, expected a positive number", e.rate));
  }
  if (!t.has("output")) return;
  e.mean = t.choice("output", {"instant", "mean"}) == "mean";
  if (e.mean && e.rate == 0)
    t.fail("output", "is \"mean\" without a rate, expected both or neither");
}

void read_one(const Table& t, Element& e) {
  if (e.type == "spring") read_spring(t, e);
  if (e.type == "damper") e.law = phs::viscous(t.required("damping", " of N m s/rad or N s/m"));
  if (e.type == "friction")
    e.law = phs::friction({.coulomb = t.required("coulomb", " of N m or N"),
                           .breakaway = t.number_or("breakaway", " of N m or N", 0),
                           .stribeck = t.number_or("stribeck", " of rad/s or m/s", 0),
                           .viscous = t.number_or("viscous", " of N m s/rad or N s/m", 0),
                           .smoothing = t.required("smoothing", " of rad/s or m/s")});
  if (e.type == "force") e.source = read_signal(t, " of N m or N");
  if (e.type == "dc_motor") read_motor(t, e);
  if (e.type == "controller") read_controller(t, e);
  if (e.type == "wheel") {
    e.wheel_gain = t.required("gain", " of N m s/rad");
    if (!(*e.wheel_gain > 0))
      t.fail("gain", fmt::format("is {}, expected a positive number", *e.wheel_gain));
    if (t.has("rate") && !((e.rate = t.number("rate", " of Hz")) > 0))
      t.fail("rate", fmt::format("is {}, expected a positive number", e.rate));
  }
  if (e.type == "cmg") {
    t.require("wheel", "the name of the joint its wheel turns on");
    e.gimbal = {t.text("wheel", "the name of a joint"), t.required("gain", " of N m s/rad")};
    if (!(e.gimbal->gain > 0))
      t.fail("gain", fmt::format("is {}, expected a positive number", e.gimbal->gain));
    e.source = read_signal(t, " of rad/s");
  }
  if (e.type == "limits") {
    e.stiffness = t.required("stiffness", " of N m/rad^2 or N/m^2");
    if (t.has("lower")) e.lower = t.number("lower", " of rad or m");
    if (t.has("upper")) e.upper = t.number("upper", " of rad or m");
  }
}

phs::Potential limits(const mechanics::MechanicalModel& model, const Element& e) {
  auto lower = e.lower, upper = e.upper;
  for (const auto& j : model.mechanism().joint_properties()) {
    if (j.joint != e.joint) continue;
    if (!lower) lower = j.lower;
    if (!upper) upper = j.upper;
  }
  if (!lower || !upper)
    throw InvalidArgument(
        fmt::format("{}: element '{}': neither the scene nor the model file gives the {} limit of "
                    "joint '{}', expected it here",
                    e.where, e.name, lower ? "upper" : "lower", e.joint));
  return phs::soft_limits(*lower, *upper, e.stiffness);
}

phs::LawPtr joint_controller(const mechanics::MechanicalModel& model, const Element& e) {
  size_t at = 0;
  for (const auto& b : model.description().blocks)
    if (b.name == e.joint) at = size_t(b.at);
  return phs::law([at, g = *e.gains](auto, auto x, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(g.stiffness) * (T(g.target) - x[at]) + T(g.damping) * (T(g.speed) - y[0]);
  });
}

bool turns_on_the_ground(const mechanics::MechanicalModel& model, const Element& e) {
  const auto& c = model.mechanism().coordinate(e.joint);
  return c.kind == phs::BlockKind::angle && model.mechanism().nodes()[size_t(c.node)].parent < 0;
}

/// The wheel takes up the rate of the base about its axis: tau = gain a·omega, and the base feels
/// the opposite. The ground has no rate: a wheel on a bench is left alone.
phs::LawPtr wheel(const mechanics::MechanicalModel& model, const Element& e) {
  const auto& m = model.mechanism();
  const auto& c = m.coordinate(e.joint);
  const auto& node = m.nodes()[size_t(c.node)];
  if (turns_on_the_ground(model, e))
    return phs::law([](auto, auto, auto, auto u) {
      using T = typename decltype(u)::value_type;
      u[0] = T(0.0);
    });
  const bool on_base =
      node.parent >= 0 &&
      m.coordinate(std::string(mechanics::base_joint_name) + ".attitude").node == node.parent;
  if (!on_base || c.kind != phs::BlockKind::angle)
    throw InvalidArgument(fmt::format(
        "{}: element '{}': joint '{}' does not turn on a free base, expected a wheel that does",
        e.where, e.name, e.joint));
  const mechanics::Vec3d a = node.placement.R.z;  // the joint's axis in the base
  return phs::law([a, gain = *e.wheel_gain](auto, auto, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(gain) * (T(a.x) * y[1] + T(a.y) * y[2] + T(a.z) * y[3]);
  });
}

/// The drive of a gimbal follows a rate. Its wheel keeps its momentum by itself: a balanced one is
/// a cyclic coordinate.
phs::LawPtr gimbal(const mechanics::MechanicalModel& model, const Element& e) {
  const auto& m = model.mechanism();
  const auto refuse_wheel = [&](const std::string& why) {
    throw InvalidArgument(
        fmt::format("{}: element '{}': wheel '{}' {}", e.where, e.name, e.gimbal->wheel, why));
  };
  const mechanics::JointCoordinates *wheel = nullptr, *own = nullptr;
  for (const auto& c : m.coordinates()) {
    if (c.name == e.gimbal->wheel && c.kind == phs::BlockKind::angle) wheel = &c;
    if (c.name == e.joint) own = &c;
  }
  if (!wheel) refuse_wheel("is no joint that turns, expected the joint of a wheel");
  const auto& node = m.nodes()[size_t(wheel->node)];
  if (node.parent != own->node)
    refuse_wheel("is not carried by joint '" + e.joint + "', expected a wheel on the gimbal");
  const auto& I = node.inertia;
  const double size = std::max({I.I.xx, I.I.yy, I.I.zz}) * 1e-9;
  if (std::fabs(I.I.xx - I.I.yy) > size || std::fabs(I.I.xy) > size || std::fabs(I.I.xz) > size ||
      std::fabs(I.I.yz) > size || std::hypot(I.mc.x, I.mc.y) > 1e-9 * I.m)
    refuse_wheel("is not balanced about its axis, expected a wheel whose angle nothing feels");
  for (const auto& n : m.nodes())
    if (n.parent == wheel->node) refuse_wheel("carries another link, expected a wheel alone");
  return phs::law([command = e.source, gain = e.gimbal->gain](auto t, auto, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(gain) * ((*command)(T(t)) - y[0]);
  });
}

}  // namespace

phs::FunctionPtr read_signal(const Table& t, const char* unit) {
  const int given = t.has("constant") + t.has("sine") + t.has("profile");
  if (given != 1)
    refuse(t.where(), fmt::format("{} has {} of the keys constant, sine and profile, expected one",
                                  t.label(), given));
  if (t.has("constant")) return phs::constant(t.number("constant", unit));
  if (t.has("sine")) {
    const Table s = t.table("sine", {"amplitude", "frequency", "phase"});
    return phs::sine(s.required("amplitude", unit), s.required("frequency", " of Hz"),
                     s.number_or("phase", " of rad", 0));
  }
  const Table p = t.table("profile", {"times", "values"});
  p.require("times", "an array of seconds");
  p.require("values", "an array of numbers");
  return phs::profile(p.list("times", " of seconds"), p.list("values", unit));
}

JointPlace joint_place(const mechanics::MechanicalModel& model, const std::string& where,
                       const std::string& who, const std::string& joint) {
  std::string known;
  for (const auto& c : model.mechanism().coordinates()) {
    if (c.nq != 1 || c.nv != 1) continue;
    known += (known.empty() ? "" : ", ") + c.name;
    if (c.name != joint) continue;
    for (const auto& p : model.description().ports)
      if (p.size == 1 && p.name.rfind(c.name + ".", 0) == 0)
        return {"mechanism." + c.name, "mechanism." + p.name, c.q};
  }
  throw InvalidArgument(
      fmt::format("{}: {}: the model has no joint '{}' of one freedom, expected one of: {}", where,
                  who, joint, known.empty() ? "(none)" : known));
}

std::vector<Element> read_elements(const Table& scene) {
  std::vector<Element> list;
  scene.each_of("element", "type", element_keys, [&](const std::string& type, const Table& t) {
    Element e;
    e.type = type;
    e.where = t.where();
    if (!is_part(type)) {
      t.require("joint", "the name of a joint");
      e.joint = t.text("joint", "the name of a joint");
      e.name = t.has("name") ? t.text("name", "text") : e.joint + "." + type;
    }
    try {
      is_part(type) ? read_part(t, e) : read_one(t, e);
    } catch (const InvalidArgument& why) {
      const std::string text = why.what();  // of the element itself: it knows no line
      if (text.find(e.where.substr(0, e.where.find(':'))) == 0) throw;
      throw InvalidArgument(e.where + ": " + text);
    }
    list.push_back(std::move(e));
  });
  return list;
}

void add_elements(phs::Network& n, const mechanics::MechanicalModel& model,
                  const std::vector<Element>& elements) {
  for (const Element& e : elements) {
    if (e.joint.empty()) continue;  // on a body
    const JointPlace at = joint_place(model, e.where, "element '" + e.name + "'", e.joint);
    try {
      if (e.type == "limits") n.potential(e.name, at.coordinate, limits(model, e));
      if (e.potential) n.potential(e.name, at.coordinate, *e.potential);
      if (e.law) n.resist(e.name, at.port, e.law);
      if (e.wheel_gain) {
        phs::Network::Control how;
        if (!turns_on_the_ground(model, e)) how.sensors = {"mechanism.base.wrench"};
        if (e.rate > 0) how.period = 1 / e.rate;
        n.control(e.name, at.port, wheel(model, e), how);
      }
      if (e.gains) {
        const auto law = joint_controller(model, e);
        if (e.rate == 0)
          n.control(e.name, at.port, law);
        else
          n.control(e.name, at.port, law,
                    {1 / e.rate, e.mean ? std::vector{at.coordinate} : std::vector<std::string>{}});
      }
      if (e.motor) {
        n.add(e.name, phs::dc_drive(*e.motor));
        n.feedback(at.port, e.name + ".shaft");
        n.source(e.name + ".voltage", e.name + ".supply", e.source);
        if (e.motor->friction > 0)
          n.resist(e.name + ".rotor_friction", at.port,
                   phs::viscous(e.motor->friction * e.motor->gear * e.motor->gear));
      } else if (e.gimbal) {
        n.control(e.name, at.port, gimbal(model, e));
      } else if (e.source) {
        n.source(e.name, at.port, e.source);
      }
    } catch (const InvalidArgument& why) {
      const std::string text = why.what();
      throw InvalidArgument(text.rfind(e.where, 0) == 0 ? text : e.where + ": " + text);
    }
  }
}

}  // namespace porthos::scene
