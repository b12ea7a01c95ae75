#include "scene/assemble/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace porthos::scene {
namespace {

/// Thrusters, wrenches and torquers of the scene's elements.
void add_pushing(const Scene& scene, space::Parts& parts) {
  std::vector<std::string> wheels;
  for (const Element& e : scene.elements)
    if (e.wheel_gain) wheels.push_back(e.joint);
  for (const Element& e : scene.elements) {
    if (e.thruster) parts.thrusters.push_back(*e.thruster);
    if (e.wrench) parts.wrenches.push_back(*e.wrench);
    if (!e.torquer) continue;
    parts.torquers.push_back(*e.torquer);
    if (e.torquer->dipole || !e.torquer->wheels.empty()) continue;
    if (wheels.empty())
      throw InvalidArgument(e.where + ": torquer '" + e.name +
                            "' unloads wheels and the scene has none, expected an element of type "
                            "\"wheel\" or the key wheels");
    parts.torquers.back().wheels = wheels;
  }
}

}  // namespace

space::Parts parts_of(const Scene& scene) {
  space::Parts parts;
  parts.field = scene.magnetic_field;
  if (!scene.orbit) add_pushing(scene, parts);
  for (const Element& e : scene.elements) {
    if (!e.latch) continue;
    if (scene.orbit && e.latch->body == "world")
      throw InvalidArgument(e.where + ": " + e.type + " '" + e.name +
                            "' ends in the world, expected a link or [[body]] in orbit");
    parts.latches.push_back(*e.latch);
  }
  return parts;
}

space::Parts orbit_parts_of(const Scene& scene) {
  space::Parts parts;
  add_pushing(scene, parts);
  return parts;
}

std::vector<double> switches_of(const Scene& scene) {
  std::vector<double> all;
  for (const Element& e : scene.elements)
    if (e.thruster)
      for (const double t : e.thruster->schedule.switches())
        if (t > 0) all.push_back(t);
  for (const auto& d : scene.constraints.spec.driven)
    for (const double t : d.motion.instants)
      if (t > 0 && t < scene.duration) all.push_back(t);
  std::sort(all.begin(), all.end());
  return all;
}

void check_switching(const Scene& scene, double h) {
  for (const Element& e : scene.elements) {
    if (!e.thruster) continue;
    if (scene.step_control != integrators::StepControl::fixed) continue;  // it ends steps there
    const double t = e.thruster->schedule.off_grid(h);
    if (t >= 0)
      throw InvalidArgument(fmt::format(
          "{}: thruster '{}' switches at {:.10g} s, {:.10g} steps of {:g} s, expected a whole "
          "number of steps",
          e.where, e.name, t, t / h, h));
  }
}

std::vector<double> instants_of(const Scene& scene, const phs::Description& system) {
  std::vector<double> all = switches_of(scene);
  for (const auto& block : system.constraints)
    for (const double t : block.instants)
      if (t > 0 && t < scene.duration) all.push_back(t);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void check_moves(const Scene& scene, const phs::Description& system, double h) {
  if (scene.step_control != integrators::StepControl::fixed) return;  // it ends steps there
  for (const auto& block : system.constraints)
    for (const double t : block.instants) {
      const double steps = t / h;
      if (t <= 0 || t >= scene.duration) continue;
      if (std::fabs(steps - std::round(steps)) <= 1e-9 * std::fabs(steps)) continue;
      const auto where = scene.constraints.where.find(block.name);
      throw InvalidArgument(fmt::format(
          "{}a move of motion '{}' begins or ends at {:.10g} s, {:.10g} steps of {:g} s, expected "
          "a whole number of steps",
          where == scene.constraints.where.end() ? "" : where->second + ": ", block.name, t, steps,
          h));
    }
}

}  // namespace porthos::scene
