#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "integrators/control/event_legs-inl.h"
#include "integrators/control/phase_steps-inl.h"

/// What gradients and tangents across events share. Private to event_*.cpp.
namespace porthos::integrators {

inline double product_of(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (size_t k = 0; k < b.size(); ++k) sum = std::fma(a[k], b[k], sum);
  return sum;
}

/// Parameters of an event: those of its numbers, in their order, then that of its time, if given.
inline std::vector<std::string> names_of(const RunEvent& event) {
  std::vector<std::string> names;
  for (const auto& number : event.numbers) names.push_back(event.name + "." + number.name);
  if (!event.guard) names.push_back(event.name + ".at");
  return names;
}

/// Why a guard's rate at its zero is nothing against its change over a step; empty: it is not.
inline std::string graze(const RunEvent& event, const EventLeg& leg, PhaseSteps& steps, double t,
                         double rate, const EventGradientOptions& options) {
  const auto& d = steps.model().description();
  const double size = leg.steps.back().size, before = t - size;
  EventInDuals in_duals(event);
  const auto slopes = in_duals.guard_slopes(before, whole_numbers(d, leg.last));
  const double rate_before =
                   product_of(slopes, steps.field(before, leg.last)) + slopes[size_t(d.nx)],
               bend = std::fabs(rate - rate_before) * steps.step_size() / size;
  if (std::fabs(rate) > options.grazing * bend && rate != 0) return "";
  return "the event '" + event.name + "' grazes at t = " + number(t) +
         " s: its guard passes 0 at " + number(rate) + "/s, and within a step that changes by " +
         number(bend) + ": there is no derivative to trust";
}

inline void check_phases(const std::vector<RunPhase>& phases, const phs::State& start,
                         double duration, double h) {
  if (phases.empty()) throw InvalidArgument("there are no phases, expected one or more");
  if (!(duration > 0) || !(h > 0))
    throw InvalidArgument("duration is " + number(duration) + " s and the step " + number(h) +
                          " s, expected both > 0");
  if (start.origin_step != 0 || start.step != 0 || start.origin != 0)
    throw InvalidArgument("the start of a run with events is a state of a run, expected time 0");
  require_size("x", start.x.size(), size_t(phases[0].model->description().nx));
  for (const RunPhase& phase : phases) {
    if (!phase.model->holds().empty())
      throw InvalidArgument("a gradient across events takes no sampled controllers, and '" +
                            phase.model->description().name + "' has '" +
                            phase.model->holds().front()->name + "'");
    for (const RunEvent& event : phase.events) {
      const auto refuse = [&](const std::string& what) {
        throw InvalidArgument("the event '" + event.name + "' " + what);
      };
      if (event.then >= int(phases.size()))
        refuse("goes on to phase " + std::to_string(event.then) + " of " +
               std::to_string(phases.size()));
      if (!event.guard && !(event.at > 0)) refuse("has no guard, expected a time at > 0");
      const phs::Model& to = event.then < 0 ? *phase.model : *phases[size_t(event.then)].model;
      if (!event.reset && !event.sets.empty()) refuse("sets parameters, expected a reset");
      if (!event.reset && to.description().nx != phase.model->description().nx)
        refuse("has no reset, expected one: the phases have " +
               std::to_string(phase.model->description().nx) + " and " +
               std::to_string(to.description().nx) + " numbers");
    }
  }
}

}  // namespace porthos::integrators
