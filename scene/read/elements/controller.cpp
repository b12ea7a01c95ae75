#include "mechanics/mechanical_model.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct Gains {
  double stiffness, damping, target, speed;
};

/// tau = stiffness (target - z) + damping (speed - z'). With a rate, z and z' are those at the
/// sampling instants.
phs::LawPtr joint_controller(const mechanics::MechanicalModel& model, const Element& e,
                             const Gains& own) {
  size_t at = 0;
  std::string unit = "rad";
  for (const auto& b : model.description().blocks)
    if (b.name == e.joint) {
      at = size_t(b.at);
      unit = b.unit;
    }
  const std::string force = unit == "rad" ? "N m" : "N";
  return phs::law({{"stiffness", own.stiffness, force + "/" + unit},
                   {"damping", own.damping, force + " s/" + unit},
                   {"target", own.target, unit},
                   {"speed", own.speed, unit + "/s"}},
                  [at](auto g, auto, auto x, auto y, auto u) {
                    u[0] = g[0] * (g[2] - x[at]) + g[1] * (g[3] - y[0]);
                  });
}

void read_controller(const Table& t, Element& e) {
  const Gains gains{t.not_negative("stiffness"), t.not_negative("damping"), t.number("target"),
                    t.number("speed")};
  if (gains.stiffness == 0 && gains.damping == 0)
    refuse(t.where(), t.label() + " does nothing, expected a stiffness or a damping");
  if (t.has("rate")) e.rate = t.positive("rate");
  const bool mean = t.choice("output") == "mean";
  if (mean && e.rate == 0) t.fail("output", "is \"mean\" without a rate, expected both or neither");
  e.add = [gains, mean](const Element& own, const JointElement& at) {
    at.require_freedom(own);
    if (gains.stiffness > 0 || mean) at.require_number(own);
    const auto law = joint_controller(at.model, own, gains);
    phs::Network::Control how;
    if (own.rate > 0) how.period = 1 / own.rate;
    if (own.rate > 0 && mean) how.encoder = {at.place.coordinate};
    at.network.control(own.name, at.place.port, law, how);
  };
}

}  // namespace

ElementType controller_element() {
  using namespace keys;
  return {"controller",
          "torque = stiffness · (target - z) + damping · (speed - ż)",
          ElementType::Place::joint,
          {number("target", "rad (m)", "0", ""), number("speed", "rad/s (m/s)", "0", ""),
           number("stiffness", "N m/rad (N/m)", "0", "one of the gains above 0"),
           number("damping", "N m s/rad (N s/m)", "0", ""),
           number("rate", "Hz", "continuous", "sampled and held, whole steps apart"),
           word("output", {"instant", "mean"}, "\"instant\"", "what it sees of ż")},
          read_controller};
}

}  // namespace porthos::scene
