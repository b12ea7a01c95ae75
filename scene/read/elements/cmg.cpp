#include <fmt/format.h>

#include "mechanics/mechanical_model.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// The drive of a gimbal follows a rate. The wheel needs no control: the angle of a balanced wheel
/// is a cyclic coordinate, so its momentum is constant.
phs::LawPtr gimbal_law(const mechanics::MechanicalModel& model, const Element& e, double gain,
                       const phs::FunctionPtr& command) {
  const auto& m = model.mechanism();
  const auto refuse_wheel = [&](const std::string& why) {
    throw InvalidArgument(
        fmt::format("{}: element '{}': wheel '{}' {}", e.where, e.name, e.turning_wheel, why));
  };
  const mechanics::JointCoordinates *wheel = nullptr, *own = nullptr;
  for (const auto& c : m.coordinates()) {
    if (c.name == e.turning_wheel && c.kind == phs::BlockKind::angle) wheel = &c;
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
  return phs::law([command, gain](auto t, auto, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(gain) * ((*command)(T(t)) - y[0]);
  });
}

void read_cmg(const Table& t, Element& e) {
  t.require("wheel", "the name of the joint its wheel turns on");
  e.turning_wheel = t.text("wheel", "the name of a joint");
  e.add = [gain = t.positive("gain"), command = read_signal(t, " of rad/s")](
              const Element& own, const JointElement& at) {
    at.require_number(own);
    at.network.control(own.name, at.place.port, gimbal_law(at.model, own, gain, command));
  };
}

}  // namespace

ElementType cmg_element() {
  using namespace keys;
  return {"cmg", "Drives the gimbal of a control-moment gyro: gain · (signal - its rate)",
          ElementType::Place::joint,
          joined({text("wheel", required, "joint of the balanced wheel it carries"),
                  number("gain", "N m s/rad", required, "more than 0")},
                 signal_keys("rad/s")),
          read_cmg};
}

}  // namespace porthos::scene
