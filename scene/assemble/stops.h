#pragma once
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/control/event.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/outputs.h"

namespace porthos::scene {

/// What a [[stop]] looks at: its output, of a stop `below` with the sign turned. So it is met where
/// the value exceeds the limit.
class StopValue {
 public:
  /// Scene, assembly and stop must outlive it.
  /// @throws InvalidArgument as Outputs; for one that ends the run, of an output that depends on a
  /// sampled controller
  StopValue(const Scene& scene, const Assembly& assembly, const Stop& stop);

  /// -HUGE_VAL before from(), NaN while a joint is locked. Allocates nothing after the first call.
  /// @param held  as of Outputs::at(); empty: what the sampled controllers hold at the start
  double at(double t, const phs::State& s, std::span<const double> held = {}) {
    if (t < from_) return -HUGE_VAL;
    const double value = outputs_.at(t, s, held.empty() ? fresh_ : held)[number_];
    return stop_.above ? value : -value;
  }
  double limit() const { return stop_.above ? stop_.limit : 0 - stop_.limit; }
  /// A value that exceeds the limit by less has the limit: a height of 400 km is the difference of
  /// two radii, of which each is rounded.
  double rounding() const { return 1e-12 * std::fabs(stop_.limit); }
  /// When it is first looked at [s]: at `after`, or at the end of a run that ends there but for the
  /// rounding of its steps.
  double from() const { return from_; }
  const Stop& stop() const { return stop_; }

 private:
  const Stop& stop_;
  const std::vector<Output> needed_;
  size_t number_;
  double from_;
  const std::vector<double> fresh_;
  Outputs outputs_;
};

/// The [[stop]]s of a scene that end its run, in their order. The scene must outlive them.
std::vector<const Stop*> ending_stops(const Scene& scene);
/// Those as events of its assembly: each g rises beyond 0.
/// Scene and assembly must outlive them.
/// @throws InvalidArgument as StopValue
std::vector<integrators::Event> stop_events(const Scene& scene, const Assembly& assembly);
/// The first of them whose condition holds at a state, or -1.
int stop_that_holds(const std::vector<integrators::Event>& stops, const Assembly& assembly,
                    double t, const phs::State& s);

}  // namespace porthos::scene
