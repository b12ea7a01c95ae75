#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/laws/potential_loop.h"
#include "mechanics/rotation.h"
#include "mechanics/urdf.h"
#include "scene/read/controllers/bandwidth.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/half_turn.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/controllers/held_pose.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// What the shaping wants of one joint.
struct JointShaping {
  std::string joint;
  JointGains gains;
  double limit = HUGE_VAL;
  std::optional<double> target = {};
  bool periodic = false, actuated = true;
};
struct Wanted {
  std::vector<JointShaping> joints;
  std::vector<HeldPose> poses;
  std::string gravity;
  bool zero_momentum = false;
};

/// The attitude of a free base at rest. Other links cannot be held on a free base, where the rest
/// of the joints would have to be found together with the base's.
void put_rest_of_base(const ControllerPlant& plant, const HeldPose& h, std::vector<double>& rest) {
  const auto& m = plant.model->mechanism();
  const auto& body = m.body(h.spring.link);
  const auto& base = m.coordinate(std::string(mechanics::base_joint_name) + ".attitude");
  const auto& R = body.pose.R;
  if (h.spring.stiffness > 0 || body.node != base.node || R.x.x + R.y.y + R.z.z != 3)
    throw InvalidArgument(fmt::format(
        "pose of '{}': the base is free, expected attitude_stiffness of its root link alone",
        h.spring.link));
  std::copy(h.wxyz.begin(), h.wxyz.end(), rest.begin() + base.q);
}

/// A sentence on joints of a fixed base on which neither law nor model act, nor anything else of
/// the scene; empty: there is none.
std::string of_drifting(const std::vector<std::string>& without, const Scene& scene) {
  std::string names;
  for (const std::string& joint : without) {
    const auto acts = [&](const auto& other) {
      return other.joint == joint || other.joint.empty();
    };
    if (std::ranges::none_of(scene.elements, acts) && std::ranges::none_of(scene.actuators, acts))
      add_to_list(names, "'" + joint + "'");
  }
  if (names.empty() || scene.controllers.size() > 1 || !scene.contacts.empty() ||
      scene.urdf.base != mechanics::UrdfOptions::Base::fixed)
    return "";
  return fmt::format(
      "nothing holds joint {}: no actuator, spring or gravity acts there, so it "
      "drifts",
      names);
}

ControllerDesign design_potential(const Controller& c, const ControllerPlant& plant,
                                  const Wanted& w) {
  energy_shaping::PotentialShaping s;
  s.name = c.name;
  for (const HeldPose& h : w.poses) s.poses.push_back(h.spring);
  s.compensate = w.gravity == "compensate";
  s.constant_compensation = w.gravity == "constant";
  s.zero_momentum = w.zero_momentum;
  s.rest = stated_start(plant);
  const bool free = plant.scene.urdf.base == mechanics::UrdfOptions::Base::free;
  if (free && plant.model->mechanism().has_gravity())
    throw InvalidArgument(
        "a free base falls in gravity, so no energy of the joints has a rest point: expected an "
        "[[element]] of type \"controller\" at each joint, which holds it as softly");
  std::vector<std::pair<int, double>> limits;
  bool limited = false;
  for (const JointShaping& j : w.joints)
    if (j.target) s.rest[controlled_joint(*plant.model, c, j.joint).q] = *j.target;
  const auto felt = energy_shaping::felt_masses(*plant.model, s.rest);
  std::vector<JointGains> all_gains;
  for (const JointShaping& j : w.joints) {
    const ControlledJoint at = controlled_joint(*plant.model, c, j.joint);
    const JointGains g = all_gains.emplace_back(j.gains.for_mass(felt[at.q]));
    if (!j.actuated) continue;
    if (g.stiffness > 0) s.joints.push_back({at.port, g.stiffness, s.rest[at.q], j.periodic});
    if (g.damping > 0) s.damping.push_back({at.port, {g.damping}});
    s.actuators.push_back(at.port);
    limits.emplace_back(energy_shaping::port_offsets(plant.model->description(), {at.port})[0],
                        j.limit);
    limited = limited || j.limit < HUGE_VAL;
  }
  for (const HeldPose& h : w.poses)
    if (free) put_rest_of_base(plant, h, s.rest);
  s.search_rest = !free && !w.poses.empty();
  std::sort(limits.begin(), limits.end());  // the order of ClosedLoop::actuated
  std::vector<double> bounds;
  for (const auto& l : limits)
    if (limited) bounds.push_back(l.second);
  const auto loop = std::make_shared<const energy_shaping::PotentialLoop>(plant.model, s);
  auto certificate = loop->certificate();
  for (size_t i = 0; i < all_gains.size(); ++i)
    report_gains(certificate, w.joints[i].joint, all_gains[i]);
  const auto rest = std::span(loop->rest()).first(s.rest.size());
  auto remark = certify_held(certificate, c, plant, port_laws(loop), rest);
  for (const HeldPose& h : w.poses)
    if (near_half_turn(start_attitude(plant, h.spring.link), h.wxyz, h.spring.attitude_stiffness))
      add_sentence(remark, half_turn_of_pose(h.spring.link));
  add_sentence(remark, of_drifting(loop->free_joints(), plant.scene));
  ControllerDesign design{port_laws(loop, bounds), certificate};
  design.remark = std::move(remark);
  return design;
}

void read_potential(const Table& t, Controller& c) {
  Wanted w;
  int actuated = 0;
  w.joints = read_joints<JointShaping>(t, [&](const Table& own, JointShaping& j) {
    j.gains = read_gains(own, "stiffness", "damping", false);
    j.periodic = own.boolean("periodic");
    if (own.has("target")) j.target = own.number("target");
    j.actuated = own.boolean("actuated");
    for (const char* key :
         {"stiffness", "damping", "bandwidth", "damping_ratio", "periodic", "limit"})
      if (!j.actuated && own.has(key))
        own.fail(key, "is given with actuated = false, expected a target alone");
    actuated += j.actuated;
    if (own.has("limit")) j.limit = own.positive("limit");
  });
  if (actuated == 0)
    refuse(t.where(), t.label() + " names no actuated joint, expected one or more");
  t.each("poses", [&](const std::string& link, const std::string&, const Table& own) {
    w.poses.push_back(read_pose(link, own));
  });
  w.gravity = t.choice("gravity");
  w.zero_momentum = t.boolean("zero_momentum");
  c.design = made_of(design_potential, w);
}

}  // namespace

std::vector<SchemaKey> pose_keys() {
  using namespace keys;
  return {numbers("point", 3, "m", "[0, 0, 0]", "that is held, in the link's frame"),
          number("stiffness", "N/m", "0", ""),
          numbers("position", 3, "m", "required with a stiffness", "in the world"),
          numbers("attitude_stiffness", 3, "N m", "none", "of the trace potential"),
          numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]", "link to world; normalised")};
}

HeldPose read_pose(const std::string& link, const Table& t) {
  HeldPose h;
  energy_shaping::PoseSpring& p = h.spring;
  p.link = link;
  p.point = t.vector("point");
  p.stiffness = t.not_negative("stiffness");
  if (p.stiffness > 0) t.require("position", "3 numbers of metres, because there is a stiffness");
  if (t.has("position")) p.position = t.vector("position");
  if (t.has("attitude_stiffness")) p.attitude_stiffness = t.vector("attitude_stiffness");
  if (p.stiffness == 0 && mechanics::norm(p.attitude_stiffness) == 0)
    refuse(t.where(), t.label() + " does nothing, expected a stiffness or attitude_stiffness");
  h.wxyz = read_attitude(t, "attitude_wxyz");
  p.attitude = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(h.wxyz.data()));
  return h;
}

ControllerType potential_controller() {
  using namespace keys;
  return {
      "potential",
      "Potential shaping and damping: the joints make springs at joints and between links and the "
      "world.",
      {table("joints", "controller.potential.joint", required,
             "by joint: those with an actuator, and the rest of others", KeyKind::named),
       table("poses", "controller.potential.pose", "none", "by link: where it is held",
             KeyKind::named),
       word("gravity", {"compensate", "constant", "keep"}, "\"compensate\"",
            "of gravity and the model's springs: compensated everywhere, balanced at the target "
            "by a constant, or kept"),
       yes_or_no("zero_momentum", "false",
                 "a free base is held by its joints, for a total momentum of 0")},
      {{"controller.potential.joint", "[controller.joints]",
        "The spring and the damper that an actuated joint makes, or the rest of another.",
        joined(
            {number("target", "rad (m)", "the start", ""),
             number("stiffness", "N m/rad (N/m)", "0", ""),
             number("damping", "N m s/rad (N s/m)", "0", ""),
             yes_or_no("actuated", "true", "false: it has no actuator; its target is its rest"),
             yes_or_no("periodic", "false", "stiffness · (1 - cos(q - target)): does not unwind"),
             number("limit", "N m (N)", "none", "largest torque or force")},
            bandwidth_keys(
                "ζ of it; m is what the joint moves at the target while the others stand still"))},
       {"controller.potential.pose", "[controller.poses]",
        "A spring between a link and the world; of a free base: the attitude of its root link.",
        pose_keys()}},
      read_potential};
}

}  // namespace porthos::scene
