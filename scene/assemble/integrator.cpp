// The integrator of a scene.
#include "scene/assemble/assembly.h"
#include "scene/assemble/contacts.h"
#include "scene/assemble/detail/start.h"
#include "scene/assemble/parts.h"
#include "scene/read/variation.h"

namespace porthos::scene {

std::unique_ptr<integrators::Integrator> make_integrator(const Assembly& a,
                                                         const std::string& method, double h,
                                                         const integrators::Options& options) {
  if (!a.spacecraft)
    return with_touches(*a.model, method, h, options, [&](const phs::Model& model) {
      return integrators::make_integrator(method, model, h, options);
    });
  return std::make_unique<space::SplitIntegrator>(
      *a.spacecraft, h, split_options(*a.spacecraft, a.splitting, method, options));
}

namespace {

/// Where the sampled controller is stated that a refusal begins with; else the table [orbit].
std::string stated_at(const Scene& scene, const std::string& refusal) {
  const auto is_of = [&](const std::string& name) {
    const std::string controller = "the controller '" + name;
    return refusal.starts_with(controller + "'") || refusal.starts_with(controller + ".");
  };
  for (const Controller& c : scene.controllers)
    if (is_of(c.name)) return c.where;
  for (const Element& e : scene.elements)
    if (is_of(e.name)) return e.where;
  return scene.orbit ? scene.orbit->where : "";
}

std::unique_ptr<integrators::Integrator> integrator_of(const Scene& scene, const phs::Model& model,
                                                       double h) {
  const integrators::Options options{.rtol = scene.rtol,
                                     .iteration_tolerance = scene.iteration_tolerance,
                                     .instants = instants_of(scene, model.description())};
  if (scene.orbit)
    if (const auto* craft = dynamic_cast<const space::Spacecraft*>(&model))
      return std::make_unique<space::SplitIntegrator>(
          *craft, h, split_options(*craft, scene.orbit->splitting, scene.method, options));
  return with_touches(model, scene.method, h, options, [&](const phs::Model& of_run) {
    auto method = integrators::make_controlled(
        scene.step_control, scene.method, of_run, h,
        {.rate = scene.control_rate, .length = scene.control_length}, options);
    if (!method->sees_inside())
      for (const Element& e : scene.elements) {
        const std::string here = "at the ends of steps, where " + scene.method + " has a stage: ",
                          expected =
                              "expected a method that keeps a ledger of its own, such as gauss8";
        if (e.thruster)
          throw InvalidArgument(e.where + ": thruster '" + e.name + "' switches " + here +
                                "it would push before its time, " + expected);
        if (e.period > 0)
          throw InvalidArgument(e.where + ": '" + e.name + "' jumps " + here + expected);
      }
    return method;
  });
}

}  // namespace

std::unique_ptr<integrators::Integrator> make_integrator(const Scene& scene,
                                                         const phs::Model& model, double h) {
  check_switching(scene, h);
  check_moves(scene, model.description(), h);
  try {
    return integrator_of(scene, model, h);
  } catch (const InvalidArgument& e) {
    const std::string place = stated_at(scene, e.what());
    if (place.empty()) throw;
    throw InvalidArgument(in_file(place) + e.what());
  }
}

}  // namespace porthos::scene
