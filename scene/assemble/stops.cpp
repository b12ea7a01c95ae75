#include "scene/assemble/stops.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/assemble/outputs.h"
#include "scene/read/formula.h"

namespace porthos::scene {
namespace {

/// A stop is looked for inside steps, where nothing tells what a sampled controller holds.
void refuse_held(const Stop& stop, const Scene& scene, const Assembly& assembly) {
  if (assembly.model->holds().empty()) return;
  std::vector<std::string> known, held;
  for (const Output& o : scene.outputs) {
    const auto own = component_names(o);
    bool forces = o.needs_field();
    if (o.quantity == OutputQuantity::formula)
      for (const auto& name : held) forces = forces || Formula(o.formula, known).uses(name);
    known.insert(known.end(), own.begin(), own.end());
    if (forces) held.insert(held.end(), own.begin(), own.end());
  }
  if (std::find(held.begin(), held.end(), stop.output) != held.end())
    throw InvalidArgument(fmt::format(
        "{}: '{}' depends on forces, and the scene has sampled controllers, expected an output "
        "that depends on the state alone",
        stop.where, stop.output));
}

}  // namespace

std::vector<integrators::Event> stop_events(const Scene& scene, const Assembly& assembly) {
  std::vector<integrators::Event> all;
  std::vector<std::string> names;
  for (const Output& o : scene.outputs)
    for (auto& name : component_names(o)) names.push_back(std::move(name));
  for (const Stop& stop : scene.stops) {
    refuse_held(stop, scene, assembly);
    const auto at = size_t(std::find(names.begin(), names.end(), stop.output) - names.begin());
    auto outputs = std::make_shared<Outputs>(scene, assembly);
    auto state = std::make_shared<phs::State>(assembly.model->description(),
                                              std::vector<double>(assembly.initial.x));
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

int stop_that_holds(const Scene& scene, const Assembly& assembly, double t, const phs::State& s) {
  if (scene.stops.empty()) return -1;
  auto x = s.x;
  size_t angle = 0;
  for (const auto& b : assembly.model->description().blocks)
    if (b.kind == phs::BlockKind::angle)
      x[size_t(b.at)] += double(s.turns[angle++]) * phs::two_pi_hi;
  const auto events = stop_events(scene, assembly);
  for (size_t k = 0; k < events.size(); ++k)
    if (events[k].g(t, x) >= 0) return int(k);
  return -1;
}

}  // namespace porthos::scene
