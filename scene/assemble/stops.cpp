#include "scene/assemble/stops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/assemble/outputs.h"

namespace porthos::scene {
namespace {

/// A stop is looked for inside steps, where nothing tells what a sampled controller holds.
void refuse_held(const Stop& stop, const std::vector<Output>& needed, const Assembly& assembly) {
  if (assembly.model->holds().empty()) return;
  if (std::any_of(needed.begin(), needed.end(), [](auto& o) { return o.needs_field(); }))
    throw InvalidArgument(fmt::format(
        "{}: '{}' depends on forces, and the scene has sampled controllers, expected an output "
        "that depends on the state alone",
        stop.where, stop.output));
}

}  // namespace

std::vector<integrators::Event> stop_events(const Scene& scene, const Assembly& assembly) {
  std::vector<integrators::Event> all;
  for (const Stop& stop : scene.stops) {
    const auto needed = needed_for(stop.output, scene.outputs);
    refuse_held(stop, needed, assembly);
    const auto names = number_names(needed);
    const auto at = size_t(std::find(names.begin(), names.end(), stop.output) - names.begin());
    auto outputs = std::make_shared<Outputs>(scene, assembly, needed);
    auto state = std::make_shared<phs::State>(assembly.model->description(), assembly.initial.x);
    all.push_back({[outputs, state, stop, at](double t, std::span<const double> x) {
                     if (t < stop.after) return -HUGE_VAL;
                     std::copy(x.begin(), x.end(), state->x.begin());
                     const double value = outputs->at(t, *state, {})[at];
                     return stop.above ? value - stop.limit : stop.limit - value;
                   },
                   integrators::Crossing::rising});
  }
  return all;
}

int stop_that_holds(const std::vector<integrators::Event>& stops, const Assembly& assembly,
                    double t, const phs::State& s) {
  if (stops.empty()) return -1;
  const auto x = phs::with_turns(assembly.model->description(), s);
  const auto met =
      std::find_if(stops.begin(), stops.end(), [&](const auto& e) { return e.g(t, x) >= 0; });
  return met == stops.end() ? -1 : int(met - stops.begin());
}

}  // namespace porthos::scene
