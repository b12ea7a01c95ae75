// Gradients of runs across events.
#include <pybind11/stl.h>

#include <optional>
#include <utility>

#include "integrators/control/event_gradient.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/gradient_request.h"
#include "python/interruptible.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using integrators::EventGradient, integrators::RunEvent, integrators::RunPhase;
using phs::Dual;

/// The numbers of an event by name.
py::dict numbers_of(const std::vector<phs::LawGain>& names, std::span<const Dual> values) {
  py::dict d;
  for (size_t k = 0; k < names.size(); ++k) d[py::str(names[k].name)] = to_python(values[k]);
  return d;
}

integrators::Crossing crossing(const std::string& direction) {
  using integrators::Crossing;
  if (direction == "rising") return Crossing::rising;
  if (direction == "falling") return Crossing::falling;
  if (direction == "both") return Crossing::both;
  throw InvalidArgument("direction is '" + direction + "', expected 'rising', 'falling' or 'both'");
}

/// @throws InvalidArgument for both a guard and a time, and for neither
RunEvent run_event(const std::string& name, const py::object& guard, const std::string& direction,
                   std::optional<double> at, const py::object& reset, const py::dict& numbers,
                   int then, bool ends) {
  if (guard.is_none() == !at)
    throw InvalidArgument("the event '" + name + "' has " +
                          (at ? "a guard and a time, expected one of them"
                              : "no guard and no time, expected one of them"));
  RunEvent event{.name = name,
                 .direction = crossing(direction),
                 .at = at.value_or(0),
                 .then = then,
                 .ends = ends};
  for (const auto& [key, value] : numbers) {
    const auto own = py::str(key).cast<std::string>();
    event.numbers.push_back({own, number(own, py::reinterpret_borrow<py::object>(value))});
  }
  const auto names = event.numbers;
  if (!guard.is_none())
    event.guard = [f = keep(guard), names, name](auto values, const Dual& t, auto x) {
      const py::gil_scoped_acquire gil;
      return from_python<Dual>(
          py::handle(f.get())(to_python(t), to_python(x), numbers_of(names, values)),
          "the guard of '" + name + "'");
    };
  if (!reset.is_none())
    event.reset = [f = keep(reset), names, name](auto values, const Dual& t, auto x, auto after) {
      const py::gil_scoped_acquire gil;
      from_python<Dual>(py::handle(f.get())(to_python(t), to_python(x), numbers_of(names, values)),
                        after, "the reset of '" + name + "'");
    };
  return event;
}

EventGradient gradient_across(
    const std::vector<std::pair<std::shared_ptr<const phs::Model>, std::vector<RunEvent>>>& given,
    const py::object& x, double step, double duration, const std::string& method,
    const py::object& end, const py::object& sampled, const py::object& end_by_time,
    double grazing) {
  if (given.empty()) throw InvalidArgument("phases is empty, expected [(model, [events])]");
  std::vector<RunPhase> phases;
  for (const auto& [model, events] : given) phases.push_back({model.get(), events});
  const auto& d = phases[0].model->description();
  phs::State start(d, numbers("x", x, size_t(d.nx)));
  phs::wrap_angles(d, start);
  integrators::EventObjective objective{.end = part_of("end", end),
                                        .sampled = part_of("sampled", sampled)};
  if (!end_by_time.is_none())
    objective.end_by_time = [&end_by_time](double t, std::span<const double> at) {
      const py::gil_scoped_acquire gil;
      return number("end_by_time",
                    end_by_time(t, as_array(std::vector<double>(at.begin(), at.end()))));
    };
  EventGradient r;
  interruptibly([&](const std::atomic<bool>& stop) {
    r = integrators::gradient_across_events(method, phases, start, step, duration, objective,
                                            {.grazing = grazing, .stop = &stop});
  });
  if (r.outcome != integrators::Outcome::ok)
    throw std::runtime_error("the gradient by " + method + " stopped: " + r.remark);
  return r;
}

}  // namespace

void bind_event_derivatives(py::module_& m) {
  py::class_<RunEvent>(m, "RunEvent",
                       "What ends a part of a run and changes its state, for "
                       "gradient_across_events(): functions of (t, x, numbers), in Dual.")
      .def(
          py::init(&run_event), py::arg("name"), py::kw_only(), py::arg("guard") = py::none(),
          py::arg("direction") = "rising", py::arg("at") = py::none(),
          py::arg("reset") = py::none(), py::arg("numbers") = py::dict(), py::arg("then") = -1,
          py::arg("ends") = false,
          R"(guard: its zero is the instant, from below ("rising"), above ("falling") or "both"; or `at` [s] is the instant.
reset: returns the state after it, of the phase that follows; without one it is the same. numbers: of the event, by name
(a restitution, a place), which are parameters. then: the phase that follows; -1: the same. ends: it ends the run.)")
      .def_readonly("name", &RunEvent::name, "Its name.");
  py::class_<EventGradient>(m, "EventGradient",
                            "The cost of a run and its gradient, from gradient_across_events().")
      .def_readonly("cost", &EventGradient::cost, "J.")
      .def_readonly("time", &EventGradient::time, "Of the end [s].")
      .def_readonly("end", &EventGradient::end, "The last state.")
      .def_property_readonly(
          "start", [](const EventGradient& g) { return as_array(g.start); },
          "dJ/dx at the start, (nx,).")
      .def_property_readonly(
          "parameters",
          [](const EventGradient& g) {
            py::dict d;
            for (size_t k = 0; k < g.names.size(); ++k) d[py::str(g.names[k])] = g.parameters[k];
            return d;
          },
          "dJ/dtheta by name, with the state at the start kept: of the models, "
          "\"<event>.<number>\", "
          "and \"<event>.at\" of an event at a given time.")
      .def_property_readonly(
          "events",
          [](const EventGradient& g) {
            py::list all;
            for (const auto& e : g.events) all.append(py::make_tuple(e.phase, e.event, e.t));
            return all;
          },
          "(phase, number of the event, time [s]) of each that happened.");
  m.def(
      "gradient_across_events", &gradient_across, py::arg("phases"), py::arg("x"), py::arg("step"),
      py::arg("duration"), py::kw_only(), py::arg("method") = "gauss16",
      py::arg("end") = py::none(), py::arg("sampled") = py::none(),
      py::arg("end_by_time") = py::none(), py::arg("grazing") = 1e-6,
      R"(The gradient of a run that jumps: bounces, locks, forces that switch on. phases: [(model, [RunEvent, ...]), ...]; the run
begins in the first, from the state x (nx,) at time 0. A step is cut at the instant of an event, which moves with the
start, and the gradient is that of the steps as they are cut, to rounding.

The cost is J = end(t, x) + the sum of sampled(t, x) over the ends of steps that no event cuts, each a function that returns
(value, gradient (nx,)). end_by_time(t, x): d end/dt, for a run that an event ends. grazing: of a guard's rate at its zero,
against its change over a step; below it the event grazes.

Raises InvalidArgument as gradient(), for sampled controllers and for methods without it (docs/derivatives.md), and
RuntimeError where an event grazes, two are at one instant, or a step or its adjoint does not converge.)");
}

}  // namespace porthos::python
