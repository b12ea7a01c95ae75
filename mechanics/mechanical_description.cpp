#include "mechanics/detail/mechanical_description.h"

#include <cmath>

#include "mechanics/joint_list.h"

namespace porthos::mechanics {
namespace {

/// The frame of a body port, relative to the node that contains its link.
BodyFrame port_frame(const Mechanism& m, const BodyPort& port) {
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument("body port '" + port.name + "': " + why);
  };
  if (port.name.empty()) throw InvalidArgument("a body port on '" + port.link + "' has no name");
  const Vec3d& r = port.position;
  if (!std::isfinite(r.x) || !std::isfinite(r.y) || !std::isfinite(r.z))
    refuse("its position is not finite");
  std::string known;
  for (const BodyFrame& link : m.bodies()) {
    if (link.name == port.link) {
      if (link.node < 0)
        refuse("its link '" + port.link + "' is fixed to the world and never moves");
      return {port.name, link.node, link.pose * Pose{Mat3<double>::identity(), r}};
    }
    add_to_list(known, link.name);
  }
  refuse("there is no link '" + port.link + "'; known: " + known);
  return {};
}

/// One per joint, then one per body port.
void add_ports(phs::Description& d, const Mechanism& m, const std::vector<BodyFrame>& body_ports) {
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const JointCoordinates* first = nullptr;
    int nv = 0;
    std::string effort, rate;  // for a joint that rotates and translates: "N m; N"
    for (const auto& c : m.coordinates()) {
      if (c.node != int(i)) continue;
      effort = !first || c.effort_unit == first->effort_unit ? c.effort_unit : "N m; N";
      rate = !first || c.rate_unit == first->rate_unit ? c.rate_unit : "rad/s; m/s";
      if (!first) first = &c;
      nv += c.nv;
    }
    const bool single = nv == 1;
    const std::string name = single ? first->name : first->joint;
    const char* suffix = !single ? ".wrench" : first->rate_unit == "rad/s" ? ".torque" : ".force";
    d.ports.push_back({name + suffix, phs::PortKind::effort_in, nv, m.nodes()[i].v, effort, rate});
  }
  int at_input = m.nv();
  for (const auto& frame : body_ports) {
    const std::string name = frame.name + ".wrench";
    for (const auto& other : d.ports)
      if (other.name == name)
        throw InvalidArgument("body port '" + frame.name + "': there is already a port '" + name +
                              "'");
    d.ports.push_back({name, phs::PortKind::effort_in, 6, at_input, "N m; N", "rad/s; m/s"});
    at_input += 6;
  }
}

void add_ledger(phs::Description& d, const Mechanism& m) {
  bool free_base = false;
  for (const auto& n : m.nodes()) free_base = free_base || is_type(n, "free");
  d.storages = {"kinetic"};
  if (free_base) d.storages = {base_storage, "links.kinetic"};
  if (m.has_gravity()) d.storages.push_back("gravity");
  for (const auto& j : m.joint_properties()) {
    if (j.stiffness != 0) d.storages.push_back(j.joint + ".spring");
    if (j.damping != 0) d.powers.push_back({j.joint + ".damping", phs::PowerKind::dissipated});
  }
}

/// With an account for each block: the power of its reactions, which is zero to rounding unless the
/// block moves.
void add_constraints(phs::Description& d, const ConstraintSet& constraints) {
  d.constraints = constraints.blocks();
  for (auto& block : d.constraints) {
    block.power = int(d.powers.size());
    d.powers.push_back(
        {block.name + (block.moving ? ".power" : ".reaction"), phs::PowerKind::supplied});
    if (block.moving) d.traits.autonomous = false;
  }
}

/// held: constraints act between a link and the world.
void add_invariants(phs::Description& d, const Mechanism& m, bool held) {
  bool free_in_world = !m.has_gravity() && !held;
  int roots = 0;
  bool on_pivot = false;
  for (const auto& n : m.nodes()) {
    if (n.parent >= 0) continue;
    ++roots;
    free_in_world = free_in_world && is_type(n, "free");
    on_pivot = is_type(n, "spherical");
  }
  int at = 0;
  const auto declare = [&](std::string name, int size, int degree, const char* unit) {
    d.invariants.push_back({std::move(name), size, at, degree, unit});
    at += size;
  };
  if (free_in_world) declare("linear_momentum", 3, 1, "kg m/s");
  if (free_in_world || (roots == 1 && on_pivot && !m.has_gravity() && !held))
    declare("angular_momentum", 3, 2, "kg m^2/s");
  for (const auto& c : m.coordinates())
    if (c.kind == phs::BlockKind::rotation) {
      declare("quaternion_norm." + c.name, 1, 2, "1");
      declare("quaternion_gauge." + c.name, 1, 2, "kg m^2/s");
    }
}

}  // namespace

bool is_type(const Node& n, std::string_view name) {
  bool is = false;
  visit_joint(n.type, [&](auto J) { is = decltype(J)::name == name; });
  return is;
}

std::vector<BodyFrame> port_frames(const Mechanism& m, const std::vector<BodyPort>& ports) {
  std::vector<BodyFrame> frames;
  for (const auto& port : ports) frames.push_back(port_frame(m, port));
  return frames;
}

phs::Description describe(const Mechanism& m, const std::vector<BodyFrame>& body_ports,
                          const ConstraintSet* constraints) {
  phs::Description d;
  d.name = m.name();
  d.nx = 2 * m.nq();
  d.nu = m.nv() + 6 * int(body_ports.size());
  d.traits.canonical = d.traits.quadratic = true;
  for (const auto& j : m.joint_properties())
    d.traits.lossless = d.traits.lossless && j.damping == 0;

  for (const auto& c : m.coordinates()) {
    d.blocks.push_back({c.name, c.kind, c.q, c.nq, m.nq() + c.q, c.unit, c.momentum_unit});
  }
  add_ports(d, m, body_ports);
  add_ledger(d, m);
  if (constraints) add_constraints(d, *constraints);
  add_invariants(d, m, constraints && constraints->on_the_world());
  return d;
}

}  // namespace porthos::mechanics
