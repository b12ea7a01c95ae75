#include "scene/assemble/stops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/assemble/steps.h"

namespace porthos::scene {
namespace {

/// A stop that ends the run is looked for inside steps, where nothing tells what a sampled
/// controller holds. One that judges sees the ends of steps, and what acted in them.
void refuse_held(const Stop& stop, const std::vector<Output>& needed, const Assembly& assembly) {
  if (!stop.ends || assembly.model->holds().empty()) return;
  if (std::any_of(needed.begin(), needed.end(), [](auto& o) { return o.needs_field(); }))
    throw InvalidArgument(fmt::format(
        "{}: '{}' depends on forces, and the scene has sampled controllers, expected outcome = "
        "\"judge\", or an output that depends on the state alone",
        stop.where, stop.output));
}

std::vector<double> held_at_start(const phs::Model& model) {
  std::vector<double> all;
  for (const auto& hold : model.holds())
    all.insert(all.end(), hold->fresh.begin(), hold->fresh.end());
  return all;
}

size_t place_among(const Stop& stop, const std::vector<Output>& needed) {
  const auto names = number_names(needed);
  return size_t(std::find(names.begin(), names.end(), stop.output) - names.begin());
}

double first_look(const Stop& stop, const Scene& s) {
  const Steps steps = steps_of(s);
  const bool fixed = s.step_control == integrators::StepControl::fixed;
  const double end = fixed ? steps.time(steps.total) : s.duration;
  return stop.after <= s.duration ? std::min(stop.after, end) : stop.after;
}

}  // namespace

StopValue::StopValue(const Scene& scene, const Assembly& assembly, const Stop& stop)
    : stop_(stop),
      needed_(needed_for(stop.output, scene.outputs)),
      number_(place_among(stop, needed_)),
      from_(first_look(stop, scene)),
      fresh_(held_at_start(*assembly.model)),
      outputs_(scene, assembly, needed_) {
  refuse_held(stop, needed_, assembly);
}

std::vector<const Stop*> ending_stops(const Scene& scene) {
  std::vector<const Stop*> all;
  for (const Stop& stop : scene.stops)
    if (stop.ends) all.push_back(&stop);
  return all;
}

std::vector<integrators::Event> stop_events(const Scene& scene, const Assembly& assembly) {
  std::vector<integrators::Event> all;
  for (const Stop* stop : ending_stops(scene)) {
    auto value = std::make_shared<StopValue>(scene, assembly, *stop);
    auto state = std::make_shared<phs::State>(assembly.model->description(), assembly.initial.x);
    all.push_back({[value, state](double t, std::span<const double> x) {
                     std::copy(x.begin(), x.end(), state->x.begin());
                     return value->at(t, *state) - value->limit();
                   },
                   integrators::Crossing::rising, value->rounding()});
  }
  return all;
}

int stop_that_holds(const std::vector<integrators::Event>& stops, const Assembly& assembly,
                    double t, const phs::State& s) {
  if (stops.empty()) return -1;
  const auto x = phs::with_turns(assembly.model->description(), s);
  const auto met = std::find_if(stops.begin(), stops.end(),
                                [&](const auto& e) { return e.g(t, x) > *e.beyond; });
  return met == stops.end() ? -1 : int(met - stops.begin());
}

}  // namespace porthos::scene
