#include "scene/assemble/law_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>

#include "scene/assemble/outputs.h"

namespace porthos::scene {
namespace {

bool floats(const Scene& s) {
  return s.urdf.base == mechanics::UrdfOptions::Base::free || !s.bodies.empty() ||
         !s.robots.empty();
}

void check_input(const Scene& scene, const Output& o) {
  using Q = OutputQuantity;
  const auto is = [&](auto... q) { return ((o.quantity == q) || ...); };
  const bool moves = is(Q::position, Q::velocity),
             in_world = moves && o.seen_from.link == LinkPoint().link && floats(scene);
  if (in_world)
    throw InvalidArgument(fmt::format(
        "the input '{}' is a motion in the world where bodies float, expected one relative to a "
        "link, an attitude, an angular velocity, a distance or a joint",
        o.name));
  if (!moves && !is(Q::attitude, Q::angle, Q::angular_velocity, Q::distance, Q::joint_position,
                    Q::joint_rate, Q::formula))
    throw InvalidArgument(fmt::format(
        "the input '{}' is a force, a momentum, an energy or of the orbit, expected positions, "
        "attitudes, velocities or distances of links, joints, or formulas of these",
        o.name));
}

/// The outputs behind the inputs, their evaluator, and which of its numbers the law sees.
struct Inputs {
  Assembly assembly;
  std::unique_ptr<Scene> scene;  // Outputs keeps a reference
  std::unique_ptr<Outputs> outputs;
  std::vector<size_t> places;
  phs::State state;
  std::mutex mutex;
};

}  // namespace

energy_shaping::LawInputs law_inputs(const Scene& scene,
                                     const std::shared_ptr<const mechanics::MechanicalModel>& model,
                                     const std::vector<std::string>& names) {
  const auto in = std::make_shared<Inputs>();
  in->scene = std::make_unique<Scene>(scene);
  in->assembly.model = in->assembly.mechanical = model;
  in->assembly.mechanism = {model, &model->mechanism()};
  std::vector<Output> needed;
  for (const std::string& name : names) {
    const Output& o = find_named(scene.outputs, name, "there is no [[output]]");
    for (Output& each : needed_for(component_names(o).front(), scene.outputs)) {
      check_input(scene, each);
      if (std::none_of(needed.begin(), needed.end(),
                       [&](const Output& k) { return k.name == each.name; }))
        needed.push_back(std::move(each));
    }
  }
  const auto numbers = number_names(needed);
  for (const std::string& name : names)
    for (const auto& own : component_names(find_named(scene.outputs, name, "there is no output")))
      in->places.push_back(
          size_t(std::find(numbers.begin(), numbers.end(), own) - numbers.begin()));
  in->outputs = std::make_unique<Outputs>(*in->scene, in->assembly, std::move(needed));
  const auto& m = model->mechanism();
  const std::vector<double> at_rest(size_t(m.nv()), 0.0);
  in->state = phs::State(model->description(), model->state(m.neutral(), at_rest));
  const auto at = [in](double t, std::span<const double> x, std::span<double> values) {
    const std::lock_guard lock(in->mutex);
    std::copy_n(x.begin(), in->state.x.size(), in->state.x.begin());
    const auto all = in->outputs->at(t, in->state, {});
    for (size_t k = 0; k < values.size(); ++k) values[k] = all[in->places[k]];
  };
  return {in->places.size(), at};
}

}  // namespace porthos::scene
