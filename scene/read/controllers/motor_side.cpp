#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "energy_shaping/elastic/motor_regulator.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/controllers/motor_spring.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct RegulatedMotor {
  std::string joint;
  std::optional<double> target = {};
  double stiffness = 0, damping = 0, limit = HUGE_VAL;
};

/// θ at which the spring carries a load at the joint's angle q, by Newton's iteration.
double balanced(const JointActuator& a, double q, double load) {
  const vsa::Elastic& E = *a.actuator.elastic;
  double theta = a.theta.value_or(q), step = 1;
  for (int i = 0; i < 100 && std::fabs(step) > 1e-15 * (1 + std::fabs(theta)); ++i) {
    step = (E.slopes(q, theta, a.sigma).q + load) / E.hessian(q, theta, a.sigma)[0][1];
    theta -= std::fmax(-0.1, std::fmin(0.1, step));
  }
  if (!(std::fabs(E.slopes(q, theta, a.sigma).q + load) <= 1e-9 * (1 + std::fabs(load))))
    throw InvalidArgument(fmt::format(
        "the spring of '{}' does not carry the load {:.6g} N m at the target", a.name, load));
  E.require_inside("controller, actuator '" + a.name + "' at the target", q, theta, a.sigma);
  return theta;
}

ControllerDesign design_motor_side(const Controller& c, const ControllerPlant& plant,
                                   const std::vector<RegulatedMotor>& motors) {
  auto rest = stated_start(plant);
  std::vector<ControlledJoint> at;
  for (const RegulatedMotor& m : motors) {
    at.push_back(controlled_joint(*plant.model, c, m.joint));
    if (m.target) rest[at.back().q] = *m.target;
  }
  const auto loads = energy_shaping::MotorRegulator::loads(*plant.model, rest);
  std::vector<energy_shaping::SprungJoint> joints;
  std::vector<double> thetas;  // of all actuators
  for (const JointActuator& a : plant.scene.actuators)
    thetas.push_back(a.theta.value_or(rest[controlled_joint(*plant.model, c, a.joint).q]));
  for (size_t i = 0; i < motors.size(); ++i) {
    const JointActuator& a = motor_spring(plant.scene, motors[i].joint);
    const double q = rest[at[i].q], theta = balanced(a, q, loads[at[i].q]);
    const auto& drive = a.actuator.theta;
    thetas[size_t(&a - plant.scene.actuators.data())] = theta;
    joints.push_back({at[i].port, theta, a.actuator.elastic->stiffness(q, theta, a.sigma),
                      drive.gear * drive.gear * drive.inertia, motors[i].stiffness,
                      motors[i].damping, motors[i].limit});
  }
  const energy_shaping::MotorRegulator made(*plant.model, joints, rest);
  ControllerDesign design;
  design.certificate = made.certificate();
  for (size_t i = 0; i < motors.size(); ++i) {
    const JointActuator& a = motor_spring(plant.scene, motors[i].joint);
    design.elsewhere.push_back({a.name, {"theta", made.law(i, size_t(motor_angle(a).at))}});
  }
  const auto laws = [&](phs::Network& n) {
    for (const auto& [member, law] : design.elsewhere)
      n.control(member + ".held", member + "." + law.port, law.law);
  };
  design.remark =
      certify_held(design.certificate, c, plant, with_actuators(plant, rest, thetas, laws), rest);
  return design;
}

void read_motor_side(const Table& t, Controller& c) {
  auto motors = read_joints<RegulatedMotor>(t, [&](const Table& own, RegulatedMotor& m) {
    if (own.has("target")) m.target = own.number("target");
    m.stiffness = own.positive("stiffness");
    m.damping = own.positive("damping");
    if (own.has("limit")) m.limit = own.positive("limit");
  });
  if (motors.empty())
    refuse(t.where(), t.label() + " names no joints, expected those with an actuator");
  c.design = made_of(design_motor_side, motors);
}

}  // namespace

const JointActuator& motor_spring(const Scene& scene, const std::string& joint) {
  using Kind = vsa::Drive::Kind;
  const auto a = std::ranges::find(scene.actuators, joint, &JointActuator::joint);
  if (a == scene.actuators.end())
    throw InvalidArgument(fmt::format(
        "joint '{}' has no [[actuator]], expected one with drive = \"torque\" at theta", joint));
  if (a->actuator.theta.kind != Kind::torque || a->actuator.sigma.kind != Kind::fixed)
    throw InvalidArgument(fmt::format(
        "actuator '{}' at joint '{}': expected drive = \"torque\" at theta, and at sigma \"fixed\" "
        "or none",
        a->name, joint));
  return *a;
}

phs::Block motor_angle(const JointActuator& a) {
  const auto model = vsa::actuator_model(a.actuator);
  return *std::ranges::find(model->description().blocks, "theta", &phs::Block::name);
}

ControllerType motor_side_controller() {
  using namespace keys;
  return {"motor_side",
          "Motors behind springs hold the joints at targets under gravity, by motor positions "
          "alone (Tomei).",
          {table("joints", "controller.motor_side.joint", required,
                 "by joint: those with an [[actuator]]", KeyKind::named)},
          {{"controller.motor_side.joint",
            "[controller.joints]",
            "The target of a joint and the gains of its motor.",
            {number("target", "rad", "the start", "of the joint, not of the motor"),
             number("stiffness", "N m/rad", required, "of the motor's position"),
             number("damping", "N m s/rad", required, "of the motor's rate"),
             number("limit", "N m", "none", "largest torque of the motor")}}},
          read_motor_side};
}

}  // namespace porthos::scene
