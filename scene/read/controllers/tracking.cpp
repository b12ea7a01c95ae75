#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/laws/computed_torque.h"
#include "energy_shaping/laws/tracking.h"
#include "mechanics/mechanical_model.h"
#include "scene/read/controllers/bandwidth.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/controllers/held_law.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// The wanted motion and the gains of one joint.
struct TrackedJoint {
  std::string joint;
  JointGains gains;
  std::optional<double> target = {};
  double amplitude = 0, frequency = 0;
};
struct Tracking {
  bool computed_torque = false;
  std::vector<TrackedJoint> joints;
  std::optional<double> over;  ///< from rest to rest in this time; empty: sines
};

ControllerDesign design_tracking(const Controller& c, const ControllerPlant& plant,
                                 const Tracking& w) {
  const auto n = size_t(plant.model->mechanism().nq());
  const auto start = stated_start(plant);
  std::vector<double> to = start, amplitude(n, 0.0), frequency(n, 0.0), kp(n, 0.0), kd(n, 0.0);
  const auto felt = energy_shaping::felt_masses(*plant.model, start);
  std::vector<JointGains> all_gains;
  for (const TrackedJoint& j : w.joints) {
    const size_t q = controlled_joint(*plant.model, c, j.joint).q;
    if (j.target) to[q] = *j.target;
    const JointGains g = all_gains.emplace_back(j.gains.for_mass(w.computed_torque ? 1 : felt[q]));
    kp[q] = g.stiffness;
    kd[q] = g.damping;
    amplitude[q] = j.amplitude;
    frequency[q] = j.frequency;
  }
  for (const auto& k : plant.model->mechanism().coordinates())
    if (k.nq == 1 && kp[size_t(k.q)] == 0)
      throw InvalidArgument(
          fmt::format("controller '{}' has no gains for joint '{}', expected those of every joint",
                      c.name, k.name));
  const auto path = w.over ? energy_shaping::rest_to_rest(start, to, *w.over)
                           : energy_shaping::sines(to, amplitude, frequency);
  energy_shaping::Certificate certificate(
      fmt::format("{} '{}'", w.computed_torque ? "computed torque" : "PD+", c.name));
  certificate.at_least("least kp", *std::min_element(kp.begin(), kp.end()), 0,
                       "and kd > 0: the error decays in the exact model");
  for (size_t i = 0; i < all_gains.size(); ++i)
    report_gains(certificate, w.joints[i].joint, all_gains[i]);
  ControllerDesign design{w.computed_torque
                              ? energy_shaping::computed_torque(plant.model, path, kp, kd)
                              : energy_shaping::PdPlus(plant.model, path, kp, kd).port_laws(),
                          std::move(certificate)};
  design.remark = certify_held(design.certificate, c, plant, design.laws, start);
  return design;
}

void read_tracking(const Table& t, Controller& c) {
  Tracking w;
  w.computed_torque = t.choice("law") == "computed_torque";
  if (t.has("over")) w.over = t.positive("over");
  w.joints = read_joints<TrackedJoint>(t, [&](const Table& own, TrackedJoint& j) {
    j.gains = read_gains(own, "kp", "kd", true);
    if (own.has("target")) j.target = own.number("target");
    if (own.has("amplitude")) {
      if (w.over)
        own.fail("amplitude", "is given with over, expected a motion from rest to rest or sines");
      j.amplitude = own.number("amplitude");
      j.frequency = own.positive("frequency");
    } else if (own.has("frequency")) {
      own.fail("frequency", "is given without amplitude, expected both");
    }
  });
  c.design = made_of(design_tracking, w);
}

}  // namespace

ControllerType tracking_controller() {
  using namespace keys;
  return {"tracking",
          "Moves every joint of an arm along a motion: PD+ or computed torque.",
          {word("law", {"pd_plus", "computed_torque"}, "\"pd_plus\"",
                "pd_plus is passive; computed_torque cancels the arm's own dynamics"),
           number("over", "s", "sines", "from the start to the targets in this time, then held"),
           table("joints", "controller.tracking.joint", required, "by joint: every one",
                 KeyKind::named)},
          {{"controller.tracking.joint", "[controller.joints]", "Gains and the motion of a joint.",
            joined({number("kp", "N m/rad or 1/s²", "required without bandwidth",
                           "1/s² of computed_torque: ω²"),
                    number("kd", "N m s/rad or 1/s", "required without bandwidth",
                           "1/s of computed_torque: 2 ζ ω"),
                    number("target", "rad (m)", "the start", "end, or centre of the sine"),
                    number("amplitude", "rad (m)", "0", "of a sine"),
                    number("frequency", "Hz", "with amplitude", "")},
                   bandwidth_keys(
                       "what the joint moves at the start while the others stand still; 1 of "
                       "computed_torque"))}},
          read_tracking};
}

}  // namespace porthos::scene
