#include "scene/assemble/steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integrators/catalogue.h"
#include "scene/assemble/parts.h"

namespace porthos::scene {
namespace {

/// Whether a number of steps is whole up to the rounding of the two times it is computed from.
bool is_whole(double n) { return std::fabs(n - std::round(n)) <= 1e-9 * n; }

/// The longest time of which both are whole multiples, up to their rounding.
double common(double a, double b) {
  const double rounding = 1e-9 * std::max(a, b);
  while (b > rounding) {
    const double rest = std::fmod(a, b);
    a = b;
    b = b - rest < rounding ? 0 : rest;
  }
  return a;
}

/// The times at which steps must end [s]: events, switches, and the periods of sampled controllers.
std::vector<double> instants(const Scene& s) {
  std::vector<double> all = switches_of(s);
  for (const Event& e : s.events)
    if (!e.waits()) all.push_back(e.at);
  for (const Element& e : s.elements)
    if (e.rate > 0) all.push_back(1 / e.rate);
  for (const Controller& c : s.controllers)
    if (c.rate > 0) all.push_back(1 / c.rate);
  return all;
}

}  // namespace

Steps steps_of(const Scene& s) {
  const double n = s.duration / s.step;
  Steps steps{.size = s.step, .duration = s.duration};
  steps.every = std::max<std::int64_t>(1, std::llround(s.record_every / s.step));
  if (is_whole(n)) {
    steps.total = std::llround(n);
    return steps;
  }
  const double whole = std::floor(n);
  steps.total = std::int64_t(whole) + 1;
  steps.last = std::fma(-whole, s.step, s.duration);
  return steps;
}

double fitting_step(const Scene& s, double longest) {
  const bool by_records =
      s.record_every_given && s.record_every >= longest && is_whole(s.duration / s.record_every);
  double unit = by_records ? s.record_every : s.duration;
  for (const double t : instants(s)) unit = common(unit, t);
  return unit / std::max(1.0, std::ceil(unit / longest * (1 - 1e-12)));
}

std::vector<std::string> notes_on_numbers(const Scene& s, std::int64_t sweeps) {
  std::vector<std::string> notes;
  const bool fixed = s.step_control == integrators::StepControl::fixed;
  if (const Steps steps = steps_of(s); fixed) {
    if (steps.last > 0)
      notes.push_back(
          fmt::format("duration is {:g} s, {:g} steps of {:g} s: the last step is {:g} s long, the "
                      "only one of another size",
                      s.duration, s.duration / s.step, s.step, steps.last));
    if (s.record_every_given && !is_whole(s.record_every / s.step))
      notes.push_back(fmt::format(
          "record_every is {:g} s, {:g} steps of {:g} s: there is a record every {:g} s",
          s.record_every, s.record_every / s.step, s.step, double(steps.every) * s.step));
  }
  if (s.rtol != Scene().rtol &&
      !integrators::works_to_tolerance(integrators::declaration_of(s.method)))
    notes.push_back(
        fmt::format("rtol has no effect: {} does not work to a tolerance of this kind", s.method));
  if (s.iteration_tolerance > 0 && sweeps == 0)
    notes.push_back(
        fmt::format("iteration_tolerance has no effect: {} iterates nothing", s.method));
  for (const Element& e : s.elements)
    if (e.wheel_gain && s.urdf.base == mechanics::UrdfOptions::Base::fixed)
      notes.push_back(
          fmt::format("the gain of wheel '{}' has no effect: the base is fixed", e.name));
  const bool torquers = std::any_of(s.elements.begin(), s.elements.end(),
                                    [](const Element& e) { return e.torquer.has_value(); });
  if (mechanics::norm(s.magnetic_field) > 0 && !torquers)
    notes.push_back("magnetic_field has no effect: the scene has no torquer");
  return notes;
}

}  // namespace porthos::scene
