#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "energy_shaping/elastic/motor_regulator.h"
#include "energy_shaping/elastic/structure_preserving_regulator.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/controllers/motor_spring.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct RegulatedLink {
  std::string joint;
  std::optional<double> target = {};
  double damping = 0, stiffness = 0, motor_damping = 0;
};

/// K of a spring with the torque K (θ - q).
double linear_stiffness(const JointActuator& a) {
  const vsa::Elastic& E = *a.actuator.elastic;
  const double K = E.stiffness(0, 0, a.sigma);
  for (const double twist : {-0.3, -0.05, 0.0, 0.1, 0.3}) {
    const double torque = -E.slopes(0.0, twist, a.sigma).q;
    if (!(std::fabs(torque - K * twist) <= 1e-9 * K))
      throw InvalidArgument(fmt::format(
          "actuator '{}' gives {:.6g} N m at a deflection of {:g} rad and has {:.6g} N m/rad at 0, "
          "expected a linear spring with type = \"esp\"",
          a.name, torque, twist, K));
  }
  if (a.actuator.damping > 0 || a.actuator.damper)
    throw InvalidArgument(fmt::format(
        "actuator '{}' has a damper beside its spring, expected none with type = \"esp\": the law "
        "makes the damping of the links",
        a.name));
  return K;
}

ControllerDesign design_esp(const Controller& c, const ControllerPlant& plant,
                            const std::vector<RegulatedLink>& links) {
  const auto start = stated_start(plant);
  std::vector<energy_shaping::PreservedJoint> joints;
  ControllerDesign design;
  design.whole = true;
  auto rest = start;
  for (const RegulatedLink& l : links) {
    const ControlledJoint at = controlled_joint(*plant.model, c, l.joint);
    const JointActuator& a = motor_spring(plant.scene, l.joint);
    const auto& drive = a.actuator.theta;
    joints.push_back({at.port, linear_stiffness(a), drive.gear * drive.gear * drive.inertia,
                      l.target.value_or(start[at.q]), l.damping, l.stiffness, l.motor_damping});
    rest[at.q] = joints.back().rest;
    design.elsewhere.push_back({a.name, {"theta", nullptr}});
  }
  const energy_shaping::StructurePreservingRegulator made(plant.model, joints);
  design.certificate = made.certificate();
  const auto laws_in = [&](const auto& offset) {
    std::vector<energy_shaping::StructurePreservingRegulator::MotorPlace> motors;
    for (const RegulatedLink& l : links) {
      const JointActuator& a = motor_spring(plant.scene, l.joint);
      const phs::Block theta = motor_angle(a);
      const size_t own = offset(a.name);
      motors.push_back({own + size_t(theta.at), own + size_t(theta.momentum)});
    }
    return made.laws(motors);
  };
  const auto laws = laws_in(plant.offset);
  for (size_t k = 0; k < laws.size(); ++k) design.elsewhere[k].law.law = laws[k];
  // at rest the springs carry the loads
  const auto loads = energy_shaping::MotorRegulator::loads(*plant.model, rest);
  std::vector<double> thetas;
  for (const JointActuator& a : plant.scene.actuators) {
    const size_t q = controlled_joint(*plant.model, c, a.joint).q;
    thetas.push_back(rest[q] + loads[q] / linear_stiffness(a));
  }
  const auto held = [&](phs::Network& n) {
    const auto own = laws_in([&](const std::string& member) { return size_t(n.offset(member)); });
    for (size_t k = 0; k < own.size(); ++k)
      n.control(design.elsewhere[k].member + ".held", design.elsewhere[k].member + ".theta", own[k],
                {.whole = true});
  };
  design.remark =
      certify_held(design.certificate, c, plant, with_actuators(plant, rest, thetas, held), rest);
  return design;
}

void read_esp(const Table& t, Controller& c) {
  auto links = read_joints<RegulatedLink>(t, [&](const Table& own, RegulatedLink& l) {
    if (own.has("target")) l.target = own.number("target");
    l.damping = own.not_negative("damping");
    l.stiffness = own.positive("stiffness");
    l.motor_damping = own.not_negative("motor_damping");
  });
  if (links.empty())
    refuse(t.where(), t.label() + " names no joints, expected every joint of the arm");
  c.design = made_of(design_esp, links);
}

}  // namespace

ControllerType esp_controller() {
  using namespace keys;
  return {"esp",
          "Motors behind linear springs hold the joints at targets and damp the links, by "
          "accelerations and jerks from the model (elastic structure preservation).",
          {table("joints", "controller.esp.joint", required,
                 "by joint: every one, each with an [[actuator]]", KeyKind::named)},
          {{"controller.esp.joint",
            "[controller.joints]",
            "The target of a joint, and the dampers and the spring that the law makes.",
            {number("target", "rad", "the start", "of the joint, not of the motor"),
             number("damping", "N m s/rad", "0", "at the link"),
             number("stiffness", "N m/rad", required, "between the motor and its target"),
             number("motor_damping", "N m s/rad", "0", "at the motor")}}},
          read_esp};
}

}  // namespace porthos::scene
