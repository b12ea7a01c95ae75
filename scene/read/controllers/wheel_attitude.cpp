#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "energy_shaping/wheel_base.h"
#include "mechanics/rotation.h"
#include "mechanics/urdf.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct WheelAttitude {
  std::string link;
  std::vector<std::string> wheels;
  mechanics::Vec3d stiffness, damping;
  std::array<double, 4> wxyz;
  double limit;
};

/// The base's attitude by a shaping that asks for a moment at the base, which the wheels make.
ControllerDesign design_attitude(const Controller& c, const ControllerPlant& plant,
                                 const WheelAttitude& w) {
  if (plant.scene.urdf.base != mechanics::UrdfOptions::Base::free)
    throw InvalidArgument("controller '" + c.name +
                          "' holds an attitude and the base is fixed, expected a free base");
  const auto& m = plant.model->mechanism();
  const auto& base = m.coordinate(std::string(mechanics::base_joint_name) + ".attitude");
  energy_shaping::WheelBaseOptions o;
  energy_shaping::PotentialShaping s;
  s.name = c.name;
  s.actuators = {o.base_port};
  s.rest = m.neutral();
  std::copy(w.wxyz.begin(), w.wxyz.end(), s.rest.begin() + base.q);
  energy_shaping::PoseSpring hold;
  hold.link = w.link;
  hold.attitude_stiffness = w.stiffness;
  hold.attitude = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(w.wxyz.data()));
  s.poses = {hold};
  s.damping = {{o.base_port, {w.damping.x, w.damping.y, w.damping.z, 0, 0, 0}}};
  for (const auto& wheel : w.wheels)
    o.wheels.push_back(controlled_joint(*plant.model, c, wheel).port);
  if (w.limit < HUGE_VAL) o.limits.assign(w.wheels.size(), w.limit);
  const energy_shaping::WheelBase held(
      std::make_shared<const energy_shaping::PotentialLoop>(plant.model, s), o);
  auto laws = held.port_laws();
  std::erase_if(laws, [&](const auto& l) { return l.port == o.base_port; });  // no thrusters
  auto all = held.shaped().certificate();
  for (const auto& item : held.certificate().items()) all.add(item);
  return {std::move(laws), std::move(all)};
}

void read_wheel_attitude(const Table& t, Controller& c) {
  WheelAttitude w;
  w.link = t.text("link", "the name of the root link");
  t.require("wheels", "an array of names of joints");
  w.wheels = t.texts("wheels", "names of joints");
  w.stiffness = t.vector("stiffness");
  w.damping = t.vector("damping");
  for (const auto& [key, v] : {std::pair{"stiffness", w.stiffness}, {"damping", w.damping}})
    if (!(v.x >= 0 && v.y >= 0 && v.z >= 0)) t.fail(key, "has a number below 0");
  w.wxyz = read_attitude(t, "attitude_wxyz");
  w.limit = t.has("limit") ? t.positive("limit") : HUGE_VAL;
  c.design = [w](const Controller& own, const ControllerPlant& plant) {
    return design_attitude(own, plant, w);
  };
}

}  // namespace

ControllerType wheel_attitude_controller() {
  using namespace keys;
  return {"wheel_attitude",
          "Holds a free base's attitude by reaction wheels, for any momentum they can take up.",
          {text("link", required, "the root link"),
           {"wheels", KeyKind::texts, "", required, "joints of three axes or more"},
           numbers("stiffness", 3, "N m", required, "of the trace potential, about its axes"),
           numbers("damping", 3, "N m s/rad", required, "of its body rates"),
           numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]", "wanted, to the world; normalised"),
           number("limit", "N m", "none", "largest torque of each wheel")},
          {},
          read_wheel_attitude};
}

}  // namespace porthos::scene
