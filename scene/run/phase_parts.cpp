#include "scene/run/phase_parts.h"

#include <algorithm>
#include <utility>

#include "scene/assemble/parts.h"
#include "scene/run/loop_events.h"

namespace porthos::scene {
namespace {

/// Whether a coordinate or freedom has the name of a locked joint, or begins with it.
bool is_of_locked(const mechanics::MovingMechanism& moving, const std::string& name) {
  return std::any_of(moving.locked.begin(), moving.locked.end(), [&](const auto& lock) {
    return name == lock.first || name.starts_with(lock.first + ".");
  });
}

/// A torquer unloads those of its wheels that are not locked; without any it has nothing to do.
void rest_torquers(std::vector<Element>& elements, const mechanics::MovingMechanism& moving) {
  const bool wheels =
      std::ranges::any_of(elements, [](const Element& e) { return e.wheel_gain.has_value(); });
  std::erase_if(elements, [&](Element& e) {
    if (!e.torquer || e.torquer->unload == 0) return false;
    if (e.torquer->wheels.empty()) return !wheels;
    std::erase_if(e.torquer->wheels, [&](const auto& w) { return is_of_locked(moving, w); });
    return e.torquer->wheels.empty();
  });
}

}  // namespace

Event without_limits(Event e) {
  e.latch.reach = e.latch.speed = e.latch.rate = HUGE_VAL;
  return e;
}

Scene phase_of(const Scene& scene, const mechanics::MovingMechanism& moving,
               const Latching& latching, double end) {
  Scene s = scene;
  s.events.clear();
  s.duration = end;
  const auto& mechanism = moving.model->mechanism();
  std::erase_if(s.elements, [&](const Element& e) {
    return !e.joint.empty() && is_of_locked(moving, e.joint) && !has_place(mechanism, e.joint);
  });
  rest_torquers(s.elements, moving);
  latching.apply_to(s, mechanism);
  s.constraints.spec = moving.constraints;
  return s;
}

Assembly assembly_of_phase(const Scene& phase, const Assembly& whole,
                           const mechanics::MovingMechanism& moving, const MotorStates& motors,
                           const OrbitApart& orbit) {
  Assembly a = whole;
  a.is_phase = true;
  a.mechanical = moving.model;
  a.mechanism =
      std::shared_ptr<const mechanics::Mechanism>(moving.model, &moving.model->mechanism());
  AddedControllers added;
  a.model = with_joint_parts(moving.model, phase, &added);
  a.hindered = std::move(added.hindered);
  a.initial = moving.state;
  a.parts = moving.parts;
  motors.put_back(*a.model, a.initial);
  orbit.put_back(a, phase);
  return a;
}

mechanics::Impact apply_one(const Scene& scene, const Event& e, mechanics::MovingMechanism& moving,
                            Latching& latching, const OrbitApart& orbit) {
  const auto impact = e.on_latch()                   ? latching.change(scene, moving, e)
                      : e.type == Event::Type::close ? close(scene, moving, e)
                                                     : apply(moving, e);
  orbit.settle(moving);
  return impact;
}

}  // namespace porthos::scene
