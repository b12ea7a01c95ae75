#include "energy_shaping/laws/lqr.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/read/controllers/controller_type.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct WeighedJoint {
  std::string joint;
  std::optional<double> target = {};
  double position = 0, rate = 0, effort = 1, limit = HUGE_VAL;
  bool actuated = true, periodic = false;
};

ControllerDesign design_lqr(const Controller& c, const ControllerPlant& plant,
                            const std::vector<WeighedJoint>& joints) {
  const auto n = size_t(plant.model->mechanism().nq());
  auto rest = stated_start(plant);
  energy_shaping::LqrWeights weights;
  weights.position.assign(n, 0.0);
  weights.rate.assign(n, 0.0);
  std::vector<std::string> actuators;
  std::vector<double> limits;
  std::vector<bool> periodic(n, false);
  for (const WeighedJoint& j : joints) {
    const ControlledJoint at = controlled_joint(*plant.model, c, j.joint);
    if (j.target) rest[at.q] = *j.target;
    weights.position[at.q] = j.position;
    weights.rate[at.q] = j.rate;
    periodic[at.q] = j.periodic;
    if (!j.actuated) continue;
    actuators.push_back(at.port);
    weights.effort.push_back(j.effort);
    limits.push_back(j.limit);
  }
  const auto lqr =
      std::make_shared<energy_shaping::Lqr>(plant.model, actuators, rest, weights, periodic);
  if (c.rate > 0) lqr->certify_sampled(1 / c.rate, c.sensing.delay);
  ControllerDesign made{lqr->port_laws(limits), lqr->certificate()};
  const auto takes_over = [&](const Controller& other) {
    return other.then && other.then->by == c.name;
  };
  if (!std::ranges::any_of(plant.scene.controllers, takes_over)) return made;  // costs 30 ms
  const double level = lqr->falling_level(limits);
  made.certificate.report("falling up to", level,
                          "the cost-to-go V falls where it is less: continuous law, 400 directions "
                          "and the worst near them");
  if (level > 0)
    made.holds = {
        [lqr](std::span<const double> x) { return lqr->cost_to_go(x.first(lqr->size())); }, level,
        [lqr, level, limits, period = c.rate > 0 ? 1 / c.rate : 0](double higher) {
          return lqr->lost(higher, level, limits, period);
        },
        made.laws};
  return made;
}

void read_lqr(const Table& t, Controller& c) {
  int actuated = 0;
  auto joints = read_joints<WeighedJoint>(t, [&](const Table& own, WeighedJoint& j) {
    if (own.has("target")) j.target = own.number("target");
    j.position = own.not_negative("position");
    j.rate = own.not_negative("speed");
    j.periodic = own.boolean("periodic");
    j.actuated = own.boolean("actuated");
    if (!j.actuated && (own.has("effort") || own.has("limit")))
      own.fail(own.has("effort") ? "effort" : "limit",
               "is given with actuated = false, expected an actuated joint");
    j.effort = own.positive("effort");
    if (own.has("limit")) j.limit = own.positive("limit");
    actuated += j.actuated;
  });
  if (actuated == 0) refuse(t.where(), t.label() + " has no actuated joint, expected one or more");
  c.design = made_of(design_lqr, joints);
}

}  // namespace

ControllerType lqr_controller() {
  using namespace keys;
  return {"lqr",
          "The linear-quadratic regulator about an equilibrium, its gains computed from weights.",
          {table("joints", "controller.lqr.joint", required, "by joint: weights", KeyKind::named)},
          {{"controller.lqr.joint",
            "[controller.joints]",
            "The equilibrium and the weights of a joint.",
            {number("target", "rad (m)", "the start", "of the equilibrium; angles count turns"),
             number("position", "1/rad² (1/m²)", "0", "weight of (q - target)²"),
             number("speed", "s²/rad² (s²/m²)", "0", "weight of the rate squared"),
             yes_or_no("periodic", "false", "the nearest of the targets that are full turns apart"),
             yes_or_no("actuated", "true", "false: it has no actuator"),
             number("effort", "1/(N m)² (1/N²)", "1", "weight of the torque squared"),
             number("limit", "N m (N)", "none", "largest torque or force")}}},
          read_lqr};
}

}  // namespace porthos::scene
