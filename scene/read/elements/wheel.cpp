#include <fmt/format.h>

#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

bool turns_on_the_ground(const mechanics::MechanicalModel& model, const Element& e) {
  const auto& c = model.mechanism().coordinate(e.joint);
  return c.kind == phs::BlockKind::angle && model.mechanism().nodes()[size_t(c.node)].parent < 0;
}

/// The wheel takes up the rate of the base about its axis: tau = gain a·omega, and the base feels
/// the opposite torque. A fixed base has no rate, so a wheel on it gets no torque.
phs::LawPtr wheel_law(const mechanics::MechanicalModel& model, const Element& e) {
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

void read_wheel(const Table& t, Element& e) {
  e.wheel_gain = t.positive("gain");
  e.turning_wheel = e.joint;
  if (t.has("rate")) e.rate = t.positive("rate");
  e.add = [](const Element& own, const JointElement& at) {
    at.require_number(own);
    phs::Network::Control how;
    if (!turns_on_the_ground(at.model, own)) how.sensors = {"mechanism.base.wrench"};
    if (own.rate > 0) how.period = 1 / own.rate;
    at.network.control(own.name, at.place.port, wheel_law(at.model, own), how);
  };
}

}  // namespace

ElementType wheel_element() {
  using namespace keys;
  return {"wheel",
          "A reaction wheel: takes up the base's rate about its axis.",
          ElementType::Place::joint,
          {number("gain", "N m s/rad", required, "more than 0"),
           number("rate", "Hz", "continuous", "sampled")},
          read_wheel};
}

}  // namespace porthos::scene
