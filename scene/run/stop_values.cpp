#include "scene/run/stop_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace porthos::scene {

StopValues::StopValues(const Scene& scene, const Assembly& assembly) {
  for (const Stop& stop : scene.stops)
    if (stop.is_requirement()) stops_.push_back(std::make_unique<StopValue>(scene, assembly, stop));
  largest_.assign(stops_.size(), -HUGE_VAL);
}

void StopValues::see(double t, const phs::State& s, std::span<const double> held) {
  for (size_t k = 0; k < stops_.size(); ++k)
    largest_[k] = std::fmax(largest_[k], stops_[k]->at(t, s, held));  // of numbers
}

void StopValues::fill(RunReport& r) const {
  for (size_t k = 0; k < stops_.size(); ++k) {
    const StopValue& of = *stops_[k];
    const Stop& stop = of.stop();
    const std::string name = name_of_check(stop);
    const bool failed = r.stopped && r.stopped->fails && r.stopped->name == stop.name;
    if (failed)  // at the limit, up to the rounding of its instant
      r.checks.push_back({name, std::max(largest_[k], of.limit()), of.limit(), false, false});
    else if (largest_[k] > -HUGE_VAL)
      r.checks.push_back({name, largest_[k], of.limit(),
                          stop.ends || largest_[k] <= of.limit() + of.rounding(), false});
    else
      r.not_applicable.push_back(
          {name,
           r.simulated_s < of.from()
               ? fmt::format("begins at {:g} s, the run ended at {:g} s", stop.after, r.simulated_s)
               : fmt::format("'{}' had no value", stop.output)});
  }
}

void StopValues::restore(std::span<const double> memory) {
  require_size("values of the stops", memory.size(), largest_.size());
  largest_.assign(memory.begin(), memory.end());
}

std::string name_of_check(const Stop& stop) {
  return fmt::format("stop.{}{}", stop.name, stop.above ? "" : " (sign turned)");
}

}  // namespace porthos::scene
