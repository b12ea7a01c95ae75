#include "energy_shaping/laws/null_space.h"

#include <fmt/format.h>

#include <optional>

#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/half_turn.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/controllers/held_pose.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// The posture's spring at a joint, and its damper.
struct PostureJoint {
  std::string joint;
  std::optional<double> target = {};
  double stiffness = 0, damping = 0;
};
struct HandAndPosture {
  HeldPose task;
  std::vector<PostureJoint> joints;
  double fill = 0;
};

ControllerDesign design_null_space(const Controller& c, const ControllerPlant& plant,
                                   const HandAndPosture& w) {
  if (plant.scene.urdf.base == mechanics::UrdfOptions::Base::free)
    throw InvalidArgument(fmt::format(
        "controller '{}': the base is free, expected [model] base = \"fixed\": a posture moves a "
        "hand on a free base through its momentum",
        c.name));
  if (c.sensing.any())
    throw InvalidArgument(fmt::format(
        "controller '{}' has a delay, a resolution or noise, expected none of them with type = "
        "\"null_space\": its dampers fill the tank with what they measure exactly",
        c.name));
  const auto& m = plant.model->mechanism();
  energy_shaping::PotentialShaping task;
  task.name = c.name;
  task.poses = {w.task.spring};
  task.rest = stated_start(plant);
  energy_shaping::NullSpacePosture posture;
  posture.level = c.tank->level;
  posture.least = c.tank->bounds.least;
  posture.most = c.tank->bounds.most;
  posture.fill = w.fill;
  posture.rest = task.rest;
  posture.stiffness.assign(size_t(m.nv()), 0.0);
  ControllerDesign::Paid paid;
  paid.fill = w.fill;
  for (const PostureJoint& j : w.joints) {
    const ControlledJoint at = controlled_joint(*plant.model, c, j.joint);
    if (j.target) posture.rest[at.q] = *j.target;
    posture.stiffness[at.q] = j.stiffness;
    task.damping.push_back({at.port, {j.damping}});
    paid.damped.push_back(at.port);
    paid.damping.push_back(j.damping);
  }
  for (const auto& k : m.coordinates())
    if (k.nq == 1 && posture.stiffness[size_t(k.q)] == 0)
      throw InvalidArgument(
          fmt::format("controller '{}' has no posture for joint '{}', expected one of every joint",
                      c.name, k.name));
  const auto loop =
      std::make_shared<const energy_shaping::NullSpaceLoop>(plant.model, task, posture);
  paid.laws = projection_laws(loop);
  ControllerDesign design{spring_laws(loop), loop->certificate()};
  const HeldNetwork network{[&](phs::Network& n) {
                              for (size_t i = 0; i < paid.damped.size(); ++i)
                                n.resist("damper " + paid.damped[i],
                                         {"mechanism." + paid.damped[i]},
                                         phs::Matrix{{paid.damping[i]}});
                            },
                            [&](phs::Network& n) {
                              energy_shaping::control(n, "springs", "mechanism", design.laws);
                              energy_shaping::control(n, "projection", "mechanism", paid.laws);
                            }};
  design.remark = certify_held(design.certificate, c, plant, network,
                               std::span(loop->rest()).first(size_t(m.nq())));
  design.paid = std::move(paid);
  const auto& held = w.task.spring;
  if (near_half_turn(start_attitude(plant, held.link), w.task.wxyz, held.attitude_stiffness))
    add_sentence(design.remark, half_turn_of_pose(held.link));
  return design;
}

void read_null_space(const Table& t, Controller& c) {
  HandAndPosture w;
  t.require("task", "the link that is held, and where");
  const Table task = t.table("task");
  w.task = read_pose(task.text("link", "the name of a link"), task);
  w.joints = read_joints<PostureJoint>(t, [&](const Table& own, PostureJoint& j) {
    if (own.has("target")) j.target = own.number("target");
    j.stiffness = own.positive("stiffness");
    j.damping = own.positive("damping");
  });
  w.fill = t.not_negative("fill");
  if (w.fill > 1) t.fail("fill", fmt::format("is {:g}, expected a share in [0, 1]", w.fill));
  t.require("tank", "the energy that pays for the projection, { level = ... }");
  c.design = made_of(design_null_space, w);
}

}  // namespace

ControllerType null_space_controller() {
  using namespace keys;
  return {
      "null_space",
      "A redundant arm holds a link, and keeps a posture that does not move it; a tank pays for "
      "the projection.",
      {table("task", "controller.null_space.task", required, "the link that is held"),
       table("joints", "controller.null_space.joint", required, "by joint: every one",
             KeyKind::named),
       number("fill", "1", "0.5", "share of the dampers' power that fills the tank, 0 to 1")},
      {{"controller.null_space.task", "[controller.task]", "A spring between a link and the world.",
        joined({text("link", required, "that is held")}, pose_keys())},
       {"controller.null_space.joint",
        "[controller.joints]",
        "The posture of a joint, and its damper.",
        {number("target", "rad (m)", "the start", "of the posture"),
         number("stiffness", "N m/rad (N/m)", required, "of the posture"),
         number("damping", "N m s/rad (N s/m)", required, "acts between sampling instants too")}}},
      read_null_space};
}

}  // namespace porthos::scene
