// Gradients of runs.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/tangent_run.h"
#include "mechanics/derivatives/linearised_mechanism.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/gradient_request.h"
#include "python/interruptible.h"
#include "scene/assemble/assembly.h"
#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/event_run.h"
#include "scene/sensitivity/sensitivity.h"

namespace porthos::python {
namespace {

using integrators::RunGradient;

py::dict named(const std::vector<std::string>& names, const std::vector<double>& values) {
  py::dict d;
  for (size_t i = 0; i < names.size(); ++i) d[py::str(names[i])] = values[i];
  return d;
}

RunGradient gradient_from(const phs::Model& model, const phs::State& start,
                          const std::function<scene::RunSteps(const std::atomic<bool>&)>& steps,
                          const std::string& method, const GradientRequest& request) {
  RunGradient r;
  interruptibly([&](const std::atomic<bool>& stop) {
    const scene::RunSteps run = steps(stop);
    r.outcome = run.taken.outcome;
    r.remark = run.taken.remark;
    if (r.outcome != integrators::Outcome::ok) return;
    r = integrators::gradient_of_run(method, model, start, run.steps.size, run.count(),
                                     request.objective,
                                     {.memory = request.memory,
                                      .direction = request.direction,
                                      .parameter_direction = request.parameter_direction,
                                      .last = run.last(),
                                      .taken = run.taken.steps,
                                      .stop = &stop});
  });
  if (r.outcome != integrators::Outcome::ok)
    throw std::runtime_error("the gradient by " + method + " stopped: " + r.remark);
  return r;
}

/// The start of a run from x, with its angles wrapped.
phs::State state_of(const phs::Model& model, const py::object& x) {
  const auto& d = model.description();
  phs::State start(d, numbers("x", x, size_t(d.nx)));
  phs::wrap_angles(d, start);
  return start;
}

RunGradient gradient(std::shared_ptr<const phs::Model> model, const py::object& x, double step,
                     std::int64_t steps, const std::string& method, const py::object& end,
                     const py::object& sampled, const py::object& running, size_t memory,
                     const py::object& direction, const py::object& parameter_direction,
                     const py::object& end_curvature, const py::object& sampled_curvature,
                     const py::object& running_curvature) {
  const auto of_one_size = [&](const std::atomic<bool>&) {
    return scene::RunSteps{.steps = {.size = step, .total = steps}};
  };
  return gradient_from(*model, state_of(*model, x), of_one_size, method,
                       {*model, end, sampled, running, memory, direction, parameter_direction,
                        end_curvature, sampled_curvature, running_curvature});
}

/// The same across the events of a scene. The parts of the cost get the states of its phases.
RunGradient across_events_of(const scene::Scene& s, const scene::Assembly& a, const py::object& end,
                             const py::object& sampled, size_t memory) {
  const integrators::EventObjective objective{.end = part_of("end", end),
                                              .sampled = part_of("sampled", sampled)};
  integrators::EventGradient g;
  RunGradient r;
  interruptibly([&](const std::atomic<bool>& stop) {
    const scene::EventRun run(s, a, "", &stop);
    r.remark = run.failure();
    if (!r.remark.empty()) return;
    g = integrators::gradient_across_events(s.method, run.phases(), a.initial, s.step, s.duration,
                                            objective, {.memory = memory, .stop = &stop});
    r.remark = g.remark;
    r.names = integrators::parameters_of_run(s.method, *a.model, s.step);
    for (const auto& input : run.inputs()) r.names.push_back(input.name);
  });
  if (!r.remark.empty())
    throw std::runtime_error("the gradient across events stopped: " + r.remark);
  r.cost = g.cost;
  r.end = std::move(g.end);
  r.start = std::move(g.start);
  for (const auto& name : r.names) {
    const auto at = std::ranges::find(g.names, name);
    r.parameters.push_back(at == g.names.end() ? 0 : g.parameters[size_t(at - g.names.begin())]);
  }
  r.duration = r.growth = NAN;
  return r;
}

RunGradient gradient_of_scene(const scene::Scene& s, const scene::Assembly& a,
                              const py::object& end, const py::object& sampled,
                              const py::object& running, size_t memory, const py::object& direction,
                              const py::object& parameter_direction,
                              const py::object& end_curvature, const py::object& sampled_curvature,
                              const py::object& running_curvature) {
  if (!s.events.empty()) {
    for (const auto* other : {&running, &direction, &parameter_direction})
      if (!other->is_none())
        throw InvalidArgument(
            "a gradient across events has no running cost and no direction, expected end and "
            "sampled alone");
    return across_events_of(s, a, end, sampled, memory);
  }
  const scene::Steps steps = scene::differentiable_steps(s, a);
  const auto of_run = [&](const std::atomic<bool>& stop) {
    return scene::run_steps(s, a, steps, &stop);
  };
  return gradient_from(*a.model, a.initial, of_run, s.method,
                       {*a.model, end, sampled, running, memory, direction, parameter_direction,
                        end_curvature, sampled_curvature, running_curvature});
}

void require_end(integrators::Outcome outcome, const std::string& remark) {
  if (outcome != integrators::Outcome::ok) throw std::runtime_error(remark);
}

py::tuple monodromy(std::shared_ptr<const phs::Model> model, const py::object& x, double step,
                    std::int64_t steps, const std::string& method) {
  const phs::State start = state_of(*model, x);
  integrators::Monodromy r;
  interruptibly([&](const std::atomic<bool>& stop) {
    r = integrators::monodromy(method, *model, start, step, steps, &stop);
  });
  require_end(r.outcome, r.remark);
  const auto n = py::ssize_t(model->description().nx);
  return py::make_tuple(as_array(std::move(r.matrix), {n, n}), r.end);
}

integrators::LyapunovSpectrum lyapunov_spectrum(std::shared_ptr<const phs::Model> model,
                                                const py::object& x, double step,
                                                std::int64_t steps, const std::string& method,
                                                int count, std::int64_t settle, int every) {
  const phs::State start = state_of(*model, x);
  integrators::LyapunovSpectrum r;
  interruptibly([&](const std::atomic<bool>& stop) {
    r = integrators::lyapunov_spectrum(
        method, *model, start, step, steps,
        {.count = count, .settle = settle, .every = every, .stop = &stop});
  });
  require_end(r.outcome, r.remark);
  return r;
}

/// (inputs, quantities, notes) of scene::end_sensitivity(), as lists of columns.
py::dict sensitivity_of_scene(const scene::Scene& s, std::vector<std::string> of,
                              std::vector<std::string> by, std::optional<double> uncertainty,
                              int threads) {
  scene::SensitivityRequest request{
      .of = std::move(of), .by = std::move(by), .uncertainty = uncertainty, .threads = threads};
  scene::EndSensitivity r;
  interruptibly([&](const std::atomic<bool>& stop) {
    request.stop = &stop;
    r = scene::end_sensitivity(s, request);
  });
  if (!r.failure.empty()) throw std::runtime_error(r.failure);
  std::vector<double> slopes, errors;
  for (const auto& q : r.of) {
    slopes.insert(slopes.end(), q.slopes.begin(), q.slopes.end());
    errors.insert(errors.end(), q.errors.begin(), q.errors.end());
  }
  errors.resize(slopes.size(), NAN);
  const auto column = [](const auto& list, auto member) {
    py::list values;
    for (const auto& item : list) values.append(item.*member);
    return values;
  };
  using scene::EndSlopes, scene::Input;
  py::dict d;
  d["inputs"] = column(r.inputs, &Input::name);
  d["input_units"] = column(r.inputs, &Input::unit);
  d["input_values"] = column(r.inputs, &Input::value);
  d["is_start"] = column(r.inputs, &Input::start);
  d["of"] = column(r.of, &EndSlopes::name);
  d["units"] = column(r.of, &EndSlopes::unit);
  d["values"] = column(r.of, &EndSlopes::value);
  d["growth"] = column(r.of, &EndSlopes::growth);
  const std::vector<py::ssize_t> shape{py::ssize_t(r.of.size()), py::ssize_t(r.inputs.size())};
  d["slopes"] = as_array(std::move(slopes), shape);
  d["errors"] = as_array(std::move(errors), shape);
  d["runs"] = r.runs;
  d["notes"] = py::cast(r.notes);
  d["text"] = scene::sensitivity_text(r);
  return d;
}

py::tuple in_rates(const mechanics::MechanicalModel& model, const py::object& q,
                   const py::object& v, const py::object& start) {
  const auto& m = model.mechanism();
  const size_t nq = size_t(m.nq());
  const auto g = mechanics::start_in_rates(m, numbers("q", q, nq), numbers("v", v, size_t(m.nv())),
                                           numbers("start", start, 2 * nq));
  return py::make_tuple(as_array(g.q), as_array(g.v),
                        named(mechanics::linearise<double>(m)->parameters(), g.parameters));
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_derivatives(py::module_& m) {
  py::class_<RunGradient>(m, "Gradient", "The cost of a run and its gradient, from gradient().")
      .def_readonly("cost", &RunGradient::cost, "J.")
      .def_property_readonly(
          "start", [](const RunGradient& g) { return as_array(g.start); },
          "dJ/dx at the start, (nx,).")
      .def_property_readonly(
          "parameters", [](const RunGradient& g) { return named(g.names, g.parameters); },
          "dJ/dtheta by name, with the state at the start kept.")
      .def_property_readonly(
          "start_along", [](const RunGradient& g) { return as_array(g.start_along); },
          "The change of start along the direction, (nx,): d2J/dx2 times it, and that by its "
          "parameters; empty without one.")
      .def_property_readonly(
          "parameters_along",
          [](const RunGradient& g) {
            return g.parameters_along.empty() ? py::dict() : named(g.names, g.parameters_along);
          },
          "The change of parameters along the direction, by name; empty without one.")
      .def_readonly("duration", &RunGradient::duration,
                    "dJ/dT by the duration [1/s], all steps made longer alike, if no part of J "
                    "depends on t itself; nan "
                    "where the model does, and with sampled controllers.")
      .def_readonly("end", &RunGradient::end, "The last state.")
      .def_readonly("growth", &RunGradient::growth,
                    "log10 of |dJ/dx at the start| / |d end/dx at the end|, nan without an end "
                    "cost. Large: the run is chaotic over its length, and the gradient, though "
                    "exact, tells nothing of a finite change.")
      .def_readonly("steps_taken", &RunGradient::steps_taken,
                    "By the method, those repeated from checkpoints included.");
  m.def(
      "gradient", &gradient, py::arg("model"), py::arg("x"), py::arg("step"), py::arg("steps"),
      py::kw_only(), py::arg("method") = "gauss16", py::arg("end") = py::none(),
      py::arg("sampled") = py::none(), py::arg("running") = py::none(),
      py::arg("memory") = size_t(64) << 20, py::arg("direction") = py::none(),
      py::arg("parameter_direction") = py::none(), py::arg("end_curvature") = py::none(),
      py::arg("sampled_curvature") = py::none(), py::arg("running_curvature") = py::none(),
      R"(The gradient of a run of `steps` steps [s] from the state x (nx,), by the discrete adjoint: exact to rounding for
the numbers the run computes. It takes the time of a few runs, however many parameters there are.

The cost is J = end(t, x) + the sum of sampled(t, x) over the ends of all steps + the integral of running(t, x) by the
method's quadrature. Each is a function that returns (value, gradient (nx,)), with the angles of x unwrapped; the last step
is asked first. Parameters: "<body>.mass", ".moment.x" (mass times centre), ".inertia.xx" (about the body's origin),
"<joint>.rotor_inertia", ".stiffness", ".damping", ".rest", and "<element>.factor", a factor on the force of an element of a
network; networks with controllers or wrenches have none. memory: bytes for stages and checkpoints.

direction (nx,): a change of the start, along which the gradient is differentiated too: start_along is the product of the
Hessian of J with it, parameters_along that of the mixed derivatives, exact to rounding as the gradient (tangent over
adjoint). parameter_direction: a change of parameters by name, {"link_3.mass": 1.0}, which the direction goes along too. end_curvature and the others are functions of (t, x, v) that return the Hessian of their part times v; without
one, its gradient is differenced, with an error of some 1e-10.

Raises InvalidArgument for a method without it (docs/derivatives.md, "What is covered"), a model with constraints or
a sampled law without derivatives, a direction with sampled controllers or in a system without second derivatives, and RuntimeError where a step or its adjoint does not converge.)");
  m.def("gradient_of_scene", &gradient_of_scene, py::arg("scene"), py::arg("assembly"),
        py::arg("end"), py::arg("sampled"), py::arg("running"), py::arg("memory"),
        py::arg("direction"), py::arg("parameter_direction"), py::arg("end_curvature"),
        py::arg("sampled_curvature"), py::arg("running_curvature"), "What Scene.gradient() calls.");
  m.def(
      "monodromy", &monodromy, py::arg("model"), py::arg("x"), py::arg("step"), py::arg("steps"),
      py::kw_only(), py::arg("method") = "gauss16",
      R"(The derivative of the end of a run by its start, (nx, nx), and the last state. Over one period of a periodic orbit it is
the monodromy matrix: its eigenvalues are the multipliers, 1 twice in a Hamiltonian system. Cost: nx tangents.

Raises InvalidArgument as gradient(), and RuntimeError where a step or its tangent does not converge.)");
  using integrators::LyapunovSpectrum;
  py::class_<LyapunovSpectrum>(m, "LyapunovSpectrum",
                               "Lyapunov exponents along a run, from lyapunov_spectrum().")
      .def_property_readonly(
          "exponents", [](const LyapunovSpectrum& s) { return as_array(s.exponents); },
          "[1/s], (count,); largest first where they have settled.")
      .def_property_readonly(
          "of_second_half", [](const LyapunovSpectrum& s) { return as_array(s.of_second_half); },
          "The same over the second half: how far the two differ tells how far they have settled.")
      .def_readonly("time", &LyapunovSpectrum::time, "That they are means over [s].")
      .def_readonly("end", &LyapunovSpectrum::end, "The last state.")
      .def("__repr__", [](const LyapunovSpectrum& s) {
        return fmt::format("LyapunovSpectrum([{:.4g}] 1/s over {:g} s)",
                           fmt::join(s.exponents, ", "), s.time);
      });
  m.def(
      "lyapunov_spectrum", &lyapunov_spectrum, py::arg("model"), py::arg("x"), py::arg("step"),
      py::arg("steps"), py::kw_only(), py::arg("method") = "gauss16", py::arg("count") = 0,
      py::arg("settle") = 0, py::arg("every") = 1,
      R"(The Lyapunov exponents [1/s] along a run of `steps` steps [s] from x (nx,): tangents carried by the derivative of the steps
and made orthonormal by QR (Benettin et al. 1980). They converge like 1/t. All nx of a Hamiltonian system come in pairs and
add up to zero to rounding, those of a damped one to the mean trace of its field's derivative. Each quaternion with its
momenta has two that are zero.

count: of the largest; 0: all. settle: steps before the first that counts. every: steps between orthonormalisations.

Raises InvalidArgument as gradient() and for options out of range, and RuntimeError where a step or its tangent does not
converge.)");
  m.def("sensitivity_of_scene", &sensitivity_of_scene, py::arg("scene"), py::arg("of"),
        py::arg("by"), py::arg("uncertainty"), py::arg("threads"),
        "What Scene.sensitivity() calls.");
  m.def(
      "gradient_in_rates", &in_rates, py::arg("model"), py::arg("q"), py::arg("v"),
      py::arg("start"),
      R"(From Gradient.start of a MechanicalModel that started at coordinates q (nq,) and joint rates v (nv,): (dJ/dq, dJ/dv,
parameters). The momenta at given rates depend on the inertias, so a parameter's whole derivative is that of
Gradient.parameters plus the one here.)");
}

}  // namespace porthos::python
