#include "scene/run/smoothed_friction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/scalars/derivative.h"
#include "scene/assemble/assembly.h"
#include "scene/run/lone_inertia.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

struct SteepestFriction {
  std::string what;        ///< "element 'rub'"
  double time = HUGE_VAL;  ///< inertia / slope at rest [s]
  bool in_joint = false;   ///< false: in a motor

  void see(const std::string& name, const phs::FunctionPtr& law, double inertia, bool joint) {
    const double own = inertia / phs::derivative([&](auto v) { return (*law)(v); }, 0.0);
    if (own < time) *this = {name, own, joint};
  }
};

SteepestFriction steepest_friction(const Scene& scene, const Assembly& a, const phs::State& s) {
  SteepestFriction worst;
  for (const JointActuator& motor : scene.actuators)
    for (const vsa::Drive& d : {motor.actuator.theta, motor.actuator.sigma})
      if (d.friction)
        worst.see("actuator '" + motor.name + "'", d.friction, d.gear * d.gear * d.inertia, false);
  if (!a.mechanical) return worst;
  const auto& m = a.mechanical->mechanism();
  mechanics::Workspace<double> w(m);
  w.set_turns(s.turns);
  const auto q = std::span(s.x).first(size_t(m.nq()));
  for (const Element& e : scene.elements) {
    const auto* const rub = e.add.target<SmoothedFriction>();
    const auto at = std::ranges::find(m.coordinates(), e.joint, &mechanics::JointCoordinates::name);
    if (rub && at != m.coordinates().end() && at->nq == 1)
      worst.see("element '" + e.name + "'", rub->law, lone_inertia(m, w, q, *at), true);
  }
  return worst;
}

}  // namespace

void note_smoothed_friction(RunReport& r, const Scene& scene, const Assembly& assembly,
                            const phs::State& end, bool rings) {
  const bool ended = r.outcome == integrators::Outcome::not_converged ||
                     r.outcome == integrators::Outcome::not_finite;
  const bool fails = std::ranges::any_of(r.checks, [](const Check& c) {
    return !c.pass && (c.name == "energy" || c.name == "balance");
  });
  if (!ended && !fails && !rings) return;
  const SteepestFriction worst = steepest_friction(scene, assembly, end);
  const double most = 2 * worst.time;
  if (!(r.step_s > (ended || rings ? most : 2 * most))) return;  // else the method's own error
  r.notes.push_back(
      fmt::format("the smoothed friction of {} turns round within a step of {:.2g} s: expected "
                  "steps of at most {:.2g} s or a larger smoothing{}",
                  worst.what, r.step_s, most,
                  worst.in_joint ? ", or \"dry_friction\", which sticks at rest" : ""));
}

}  // namespace porthos::scene
