#include "space/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "space/detail/parts_checks.h"

namespace porthos::space {
namespace {

using mechanics::Mechanism;

[[noreturn]] void refuse(const std::string& what, const std::string& name, const std::string& why) {
  throw InvalidArgument(what + " '" + name + "': " + why);
}
void require_unit(const Vec3d& d, const char* what, const std::string& name) {
  if (!finite(d) || std::fabs(mechanics::norm(d) - 1) > 1e-12)
    refuse(what, name, fmt::format("its direction has length {}, expected 1", mechanics::norm(d)));
}

const char* kind_of(const SoftLatch& l) {
  return l.line.stiffness + l.line.damping > 0 ? "line spring" : "soft latch";
}

void validate(const Parts& parts) {
  for (const Thruster& t : parts.thrusters) {
    require_unit(t.direction, "thruster", t.name);
    if (!(t.thrust >= 0) || !std::isfinite(t.thrust))
      refuse("thruster", t.name,
             fmt::format("its thrust is {} N, expected a number of 0 or more", t.thrust));
    if (!(t.specific_impulse >= 0))
      refuse("thruster", t.name,
             fmt::format("its specific impulse is {} s, expected a number above 0",
                         t.specific_impulse));
  }
  for (const Torquer& t : parts.torquers) {
    require_unit(t.direction, "torquer", t.name);
    if (!t.dipole && !(t.unload > 0 && std::isfinite(t.unload)))
      refuse("torquer", t.name,
             fmt::format("it has no dipole and unloads wheels by {} 1/s, expected a dipole or a "
                         "number above 0",
                         t.unload));
    if (!(t.limit >= 0))
      refuse("torquer", t.name, fmt::format("its limit is {} A m^2, expected 0 or more", t.limit));
  }
  for (const SoftLatch& l : parts.latches) {
    for (const Vec3d& k : {l.stiffness, l.turning_stiffness, l.damping, l.turning_damping})
      for (int i = 0; i < 3; ++i)
        if (!(k[i] >= 0) || !std::isfinite(k[i]))
          refuse("soft latch", l.name,
                 fmt::format("a stiffness or damping is {}, expected numbers of 0 or more", k[i]));
    for (const double k : {l.line.stiffness, l.line.rest, l.line.damping})
      if (!(k >= 0) || !std::isfinite(k))
        refuse(
            "line spring", l.name,
            fmt::format("its stiffness, rest or damping is {}, expected numbers of 0 or more", k));
    if (l.link == l.body)
      refuse(kind_of(l), l.name, "it joins '" + l.link + "' to itself, expected two bodies");
  }
}

bool in_world(const Mechanism& m, const std::string& link) {
  const auto& all = m.bodies();
  return link == "world" || std::any_of(all.begin(), all.end(), [&](const auto& b) {
           return b.name == link && b.node < 0;
         });
}

/// A body port at each attachment of the parts to a body that moves.
std::vector<mechanics::BodyPort> ports_of(const Mechanism& m, const Parts& parts) {
  std::vector<mechanics::BodyPort> ports;
  for (const auto& t : parts.thrusters) ports.push_back({t.name + ".nozzle", t.link, t.position});
  for (const auto& w : parts.wrenches) ports.push_back({w.name + ".place", w.link, w.position});
  for (const auto& l : parts.latches) {
    if (!in_world(m, l.link)) ports.push_back({l.name + ".on_link", l.link, l.on_link.r});
    if (!in_world(m, l.body)) ports.push_back({l.name + ".on_body", l.body, l.on_body.r});
  }
  return ports;
}

PartsModel::Mount mount(const mechanics::MechanicalModel& model, const std::string& port,
                        const std::string& link, const Pose& at) {
  const Pose origin{Mat3<double>::identity(), {0, 0, 0}};
  if (link == "world") return {-1, origin * Pose{origin.R, at.r}, at.R, 0};
  const auto& body = model.mechanism().body(link);
  PartsModel::Mount m{body.node, body.pose * Pose{Mat3<double>::identity(), at.r}, at.R, 0};
  for (const auto& p : model.description().ports)
    if (p.name == port + ".wrench") m.u = size_t(p.at);
  return m;
}

phs::Description description_of(const phs::Description& inner, const Parts& parts, bool held) {
  phs::Description d = inner;
  d.flows.clear();
  d.traits.separable = false;
  const bool pushed = parts.pushes() > 0;
  d.traits.autonomous = d.traits.autonomous && !pushed;
  using Kind = phs::PowerKind;
  for (const auto& l : parts.latches) {
    d.storages.push_back(l.name);
    if (!damped(l)) continue;
    d.powers.push_back({l.name + ".damping", Kind::dissipated});
    d.traits.lossless = false;
  }
  const auto pushes = push_accounts(parts);
  d.powers.insert(d.powers.end(), pushes.begin(), pushes.end());
  d.invariants.clear();
  int at = 0;
  for (auto i : inner.invariants) {
    if (held && i.name.find("_momentum") != std::string::npos) continue;
    if (i.name == "linear_momentum" && parts.forces() > 0) continue;
    if (i.name == "angular_momentum" && pushed) continue;
    i.at = at;
    at += i.size;
    d.invariants.push_back(std::move(i));
  }
  return d;
}

}  // namespace

bool damped(const SoftLatch& l) {
  return l.line.damping + l.damping.x + l.damping.y + l.damping.z + l.turning_damping.x +
             l.turning_damping.y + l.turning_damping.z >
         0;
}

std::vector<phs::PowerAccount> push_accounts(const Parts& parts) {
  using Kind = phs::PowerKind;
  std::vector<phs::PowerAccount> list;
  std::vector<std::string> forces;
  for (const auto& t : parts.thrusters) forces.push_back(t.name);
  for (const auto& w : parts.wrenches) forces.push_back(w.name);
  for (const auto& name : forces) list.push_back({name, Kind::supplied});
  for (const auto& t : parts.torquers) list.push_back({t.name, Kind::supplied});
  for (const auto& name : forces)
    for (const char* of : {".impulse", ".angular_impulse"})
      for (const char* axis : {".x", ".y", ".z"})
        list.push_back({name + of + axis, Kind::observed});
  for (const auto& t : parts.torquers)
    for (const char* axis : {".x", ".y", ".z"})
      list.push_back({t.name + ".angular_impulse" + axis, Kind::observed});
  return list;
}

PartsModel::PartsModel(std::shared_ptr<const mechanics::MechanicalModel> mechanical, Parts parts)
    : mechanical_(std::move(mechanical)), parts_(std::move(parts)) {
  validate(parts_);
  const std::shared_ptr<const Mechanism> mechanism(mechanical_, &mechanical_->mechanism());
  const auto* loops = mechanical_->constraint_set();
  with_ports_ = std::make_shared<const mechanics::MechanicalModel>(
      mechanism, ports_of(*mechanism, parts_), loops ? loops->spec() : mechanics::ConstraintSpec{});
  const auto push = [&](const std::string& port, const std::string& link, const Vec3d& at) {
    placed_.pushed.push_back(mount(*with_ports_, port, link, {Mat3<double>::identity(), at}));
  };
  for (const auto& t : parts_.thrusters) push(t.name + ".nozzle", t.link, t.position);
  for (const auto& w : parts_.wrenches) push(w.name + ".place", w.link, w.position);
  bool held = false;  // by a place fixed in the world
  for (const auto& l : parts_.latches) {
    placed_.a.push_back(mount(*with_ports_, l.name + ".on_link", l.link, l.on_link));
    placed_.b.push_back(mount(*with_ports_, l.name + ".on_body", l.body, l.on_body));
    held = held || placed_.a.back().node < 0 || placed_.b.back().node < 0;
    if (placed_.a.back().node == placed_.b.back().node)
      refuse(kind_of(l), l.name,
             "'" + l.link + "' and '" + l.body + "' are one rigid body, expected two that move");
  }
  const int base = free_base(*mechanism);
  for (const auto& t : parts_.torquers) {
    if (base < 0) refuse("torquer", t.name, "the base is fixed, expected a free one");
    if (!(mechanics::norm(parts_.field) > 0) || !finite(parts_.field))
      refuse("torquer", t.name,
             "there is no magnetic field, expected a planet with one or a constant field");
    placed_.base_u = size_t(mechanism->nodes()[size_t(base)].v);
    placed_.wheels.push_back(wheel_axes(*mechanism, "torquer '" + t.name + "'", t.wheels));
  }
  description_ = description_of(with_ports_->description(), parts_, held);
}

}  // namespace porthos::space
