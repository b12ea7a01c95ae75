#include <fmt/format.h>

#include <cmath>
#include <map>

#include "energy_shaping/laws/joint_swing_up.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/held_law.h"
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
  if (!plant.scene.random && !plant.scene.start_from)
    swing.check_start(plant.model->state(start, rates));
  ControllerDesign made{{swing.port_law()}, swing.certificate()};
  hold_not_checked(made.certificate, c, "a law that pumps energy has no rest to linearise it at");
  // not of cases: an ensemble of failing ones would take its time
  const bool one_start = !plant.scene.random && !plant.scene.start_from && !plant.scene.of_case;
  made.progress = one_start && c.rate > 0
                      ? swing.progress(energy_shaping::SwingUpRun{
                            plant.model->state(start, rates), plant.scene.duration, 1 / c.rate,
                            plant.scene.step > 0 ? plant.scene.step : 1 / c.rate})
                      : swing.progress();
  return made;
}

energy_shaping::SwingUpGains read_swing_up_gains(const Table& t) {
  if (t.has("bandwidth")) {
    for (const char* key : {"energy", "inertia", "stiffness", "damping"})
      if (t.has(key)) t.fail(key, "is given besides bandwidth, expected one of both");
    auto g = energy_shaping::SwingUpGains::of_bandwidth(
        t.positive("bandwidth"), t.has("damping_ratio") ? t.positive("damping_ratio") : 0.3);
    if (t.has("pump")) g.pump = t.positive("pump");
    return g;
  }
  if (t.has("pump")) t.fail("pump", "is given without bandwidth, expected both");
  if (t.has("damping_ratio")) t.fail("damping_ratio", "is given without bandwidth, expected both");
  t.require("energy", "the gain of the error of the energy, or bandwidth");
  energy_shaping::SwingUpGains g;
  g.energy = t.positive("energy");
  g.inertia = t.not_negative("inertia");
  g.stiffness = t.not_negative("stiffness");
  g.damping = t.not_negative("damping");
  return g;
}

void read_swing_up(const Table& t, Controller& c) {
  SwingUp w;
  w.drives = t.text("drives", "the name of the joint with an actuator");
  t.each("joints", [&](const std::string& joint, const std::string&, const Table& own) {
    w.upright[joint] = own.number("target");
  });
  w.gains = read_swing_up_gains(t);
  if (t.has("limit")) w.gains.limit = t.positive("limit");
  if (t.has("energy_margin")) w.gains.margin = t.not_negative("energy_margin");
  if (t.has("then")) {
    c.then = {t.text("then", "the name of another controller")};
    if (t.has("level")) c.then->level = t.positive("level");
    c.then->leave = t.positive("leave");
    if (!(c.then->leave > 1)) t.fail("leave", "is not above 1, expected a factor of the level");
  }
  for (const char* key : {"level", "leave"})
    if (t.has(key) && !c.then) t.fail(key, "is given without then, expected both");
  c.design = made_of(design_swing_up, w);
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
           number("bandwidth", "rad/s", "none",
                  "of the driven joint, ω: instead of the four gains, which follow from it"),
           number("damping_ratio", "1", "0.3", "ζ, beside bandwidth"),
           number("pump", "rad/s² (m/s²)", "none",
                  "largest acceleration of the driven joint that pumps, beside bandwidth, also "
                  "against friction of the other joints: begin with the certificate's twentieth"),
           number("energy_margin", "J", "0, of a pump by the friction",
                  "aims at so much above the energy of the upright"),
           number("energy", "see docs/controllers.md", "required without bandwidth",
                  "gain of the error of the energy"),
           number("inertia", "see docs/controllers.md", "0",
                  "gain of the driven joint's acceleration; 0: the joint is not brought back"),
           number("stiffness", "see docs/controllers.md", "0", "gain of its angle"),
           number("damping", "see docs/controllers.md", "0", "gain of its rate"),
           number("limit", "N m (N)", "none", "largest torque or force"),
           text("then", "none", "the lqr that takes over, at the same rate"),
           number("level", "1", "up to which it falls",
                  "of its cost-to-go below which it takes over; more is tried by runs"),
           number("leave", "1", "4", "above that many times the level it gives back")},
          {{"controller.swing_up.joint",
            "[controller.joints]",
            "Where a joint is in the upright.",
            {number("target", "rad (m)", required, "angles count turns")}}},
          read_swing_up};
}

}  // namespace porthos::scene
