#include <fmt/format.h>

#include <cmath>
#include <map>

#include "energy_shaping/joint_swing_up.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct SwingUp {
  std::string drives;
  std::map<std::string, double> upright;  ///< by joint
  energy_shaping::SwingUpGains gains;
};

ControllerDesign design_swing_up(const Controller& c, const ControllerPlant& plant,
                                 const SwingUp& w) {
  const auto start = stated_start(plant);
  auto upright = start, rates = std::vector<double>(start.size(), 0.0);
  for (const auto& [joint, target] : w.upright)
    upright[controlled_joint(*plant.model, c, joint).q] = target;
  const auto driven = controlled_joint(*plant.model, c, w.drives);
  const energy_shaping::JointSwingUp swing(plant.model, driven.port, upright, w.gains);
  for (const auto& k : plant.model->mechanism().coordinates())
    if (const auto s = plant.scene.joints.find(k.name); s != plant.scene.joints.end())
      rates[size_t(k.v)] = s->second.velocity;
  if (!plant.scene.random) swing.check_start(plant.model->state(start, rates));
  return {{swing.port_law()}, swing.certificate()};
}

void read_swing_up(const Table& t, Controller& c) {
  SwingUp w;
  w.drives = t.text("drives", "the name of the joint with an actuator");
  t.each("joints", [&](const std::string& joint, const std::string&, const Table& own) {
    w.upright[joint] = own.number("target");
  });
  w.gains.energy = t.positive("energy");
  w.gains.inertia = t.not_negative("inertia");
  w.gains.stiffness = t.not_negative("stiffness");
  w.gains.damping = t.not_negative("damping");
  if (t.has("limit")) w.gains.limit = t.positive("limit");
  if (t.has("then")) {
    c.then = {t.text("then", "the name of another controller")};
    if (t.has("level")) c.then->level = t.positive("level");
    c.then->leave = t.positive("leave");
    if (!(c.then->leave > 1)) t.fail("leave", "is not above 1, expected a factor of the level");
  }
  for (const char* key : {"level", "leave"})
    if (t.has(key) && !c.then) t.fail(key, "is given without then, expected both");
  c.design = [w](const Controller& own, const ControllerPlant& plant) {
    return design_swing_up(own, plant, w);
  };
}

}  // namespace

ControllerType swing_up_controller() {
  using namespace keys;
  return {"swing_up",
          "Swings a mechanism up by the energy of one driven joint, then hands over to a law that "
          "balances it.",
          {text("drives", required, "the joint with the actuator"),
           table("joints", "controller.swing_up.joint", required, "by joint: the upright",
                 KeyKind::named),
           number("energy", "see docs/controllers.md", required, "gain of the error of the energy"),
           number("inertia", "see docs/controllers.md", "0",
                  "gain of the driven joint's acceleration; 0: the joint is not brought back"),
           number("stiffness", "see docs/controllers.md", "0", "gain of its angle"),
           number("damping", "see docs/controllers.md", "0", "gain of its rate"),
           number("limit", "N m (N)", "none", "largest torque or force"),
           text("then", "none", "the lqr that takes over, at the same rate"),
           number("level", "1", "the largest known", "of its cost-to-go below which it takes over"),
           number("leave", "1", "4", "above that many times the level it gives back")},
          {{"controller.swing_up.joint",
            "[controller.joints]",
            "Where a joint is in the upright.",
            {number("target", "rad (m)", required, "angles count turns")}}},
          read_swing_up};
}

}  // namespace porthos::scene
