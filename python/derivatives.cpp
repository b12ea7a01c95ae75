// Gradients of runs.
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "integrators/derivatives/run_gradient.h"
#include "mechanics/derivatives/linearised_mechanism.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/interruptible.h"
#include "python/keywords.h"
#include "scene/assemble/assembly.h"
#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/sensitivity.h"

namespace porthos::python {
namespace {

using integrators::Objective;
using integrators::RunGradient;

/// A part of the cost from Python: a function of (t, x) that returns (value, gradient).
Objective::Part part_of(const char* name, const py::object& f) {
  if (f.is_none()) return {};
  return [name, f](double t, std::span<const double> x, std::span<double> gradient) {
    const py::gil_scoped_acquire held;
    const py::object given = f(t, as_array(std::vector<double>(x.begin(), x.end())));
    const std::string expected =
        std::string(name) + "(t, x) returned " + kind_of(given) + ", expected (value, gradient)";
    if (!py::isinstance<py::tuple>(given) || py::len(given) != 2) throw InvalidArgument(expected);
    const auto both = given.cast<py::tuple>();
    const auto g = numbers("gradient", both[1], x.size());
    std::copy(g.begin(), g.end(), gradient.begin());
    return both[0].cast<double>();
  };
}

py::dict named(const std::vector<std::string>& names, const std::vector<double>& values) {
  py::dict d;
  for (size_t i = 0; i < names.size(); ++i) d[py::str(names[i])] = values[i];
  return d;
}

RunGradient gradient_from(const phs::Model& model, const phs::State& start, double step,
                          std::int64_t steps, const std::string& method, const py::object& end,
                          const py::object& sampled, const py::object& running, size_t memory) {
  const Objective objective{part_of("end", end), part_of("sampled", sampled),
                            part_of("running", running)};
  RunGradient r;
  interruptibly([&](const std::atomic<bool>& stop) {
    r = integrators::gradient_of_run(method, model, start, step, steps, objective,
                                     {.memory = memory, .stop = &stop});
  });
  if (r.outcome != integrators::Outcome::ok)
    throw std::runtime_error("the gradient by " + method + " stopped: " + r.remark);
  return r;
}

RunGradient gradient(std::shared_ptr<const phs::Model> model, const py::object& x, double step,
                     std::int64_t steps, const std::string& method, const py::object& end,
                     const py::object& sampled, const py::object& running, size_t memory) {
  const auto& d = model->description();
  phs::State start(d, numbers("x", x, size_t(d.nx)));
  phs::wrap_angles(d, start);
  return gradient_from(*model, start, step, steps, method, end, sampled, running, memory);
}

RunGradient gradient_of_scene(const scene::Scene& s, const scene::Assembly& a,
                              const py::object& end, const py::object& sampled,
                              const py::object& running, size_t memory) {
  const scene::Steps steps = scene::differentiable_steps(s, a);
  return gradient_from(*a.model, a.initial, steps.size, steps.total, s.method, end, sampled,
                       running, memory);
}

/// (inputs, quantities, notes) of scene::end_sensitivity(), as lists of columns.
py::dict sensitivity_of_scene(const scene::Scene& s, std::vector<std::string> of,
                              std::optional<double> uncertainty) {
  scene::SensitivityRequest request{.of = std::move(of), .uncertainty = uncertainty};
  scene::EndSensitivity r;
  interruptibly([&](const std::atomic<bool>& stop) {
    request.stop = &stop;
    r = scene::end_sensitivity(s, request);
  });
  if (!r.failure.empty()) throw std::runtime_error(r.failure);
  std::vector<double> slopes;
  for (const auto& q : r.of) slopes.insert(slopes.end(), q.slopes.begin(), q.slopes.end());
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
  d["slopes"] =
      as_array(std::move(slopes), {py::ssize_t(r.of.size()), py::ssize_t(r.inputs.size())});
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

void bind_derivatives(py::module_& m) {
  py::class_<RunGradient>(m, "Gradient", "The cost of a run and its gradient, from gradient().")
      .def_readonly("cost", &RunGradient::cost, "J.")
      .def_property_readonly(
          "start", [](const RunGradient& g) { return as_array(g.start); },
          "dJ/dx at the start, (nx,).")
      .def_property_readonly(
          "parameters", [](const RunGradient& g) { return named(g.names, g.parameters); },
          "dJ/dtheta by name, with the state at the start kept.")
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
      py::arg("memory") = size_t(64) << 20,
      R"(The gradient of a run of `steps` steps [s] from the state x (nx,), by the discrete adjoint: exact to rounding for
the numbers the run computes. It takes the time of a few runs, however many parameters there are.

The cost is J = end(t, x) + the sum of sampled(t, x) over the ends of all steps + the integral of running(t, x) by the
method's quadrature. Each is a function that returns (value, gradient (nx,)), with the angles of x unwrapped; the last step
is asked first. Parameters: "<body>.mass", ".moment.x" (mass times centre), ".inertia.xx" (about the body's origin),
"<joint>.rotor_inertia", ".stiffness", ".damping", ".rest", and "<element>.factor", a factor on the force of an element of a
network; networks with controllers or wrenches have none. memory: bytes for stages and checkpoints.

Raises InvalidArgument for a method that is not Gauss collocation, a model with constraints or sampled controllers, and
RuntimeError where a step or its adjoint does not converge.)");
  m.def("gradient_of_scene", &gradient_of_scene, py::arg("scene"), py::arg("assembly"),
        py::arg("end"), py::arg("sampled"), py::arg("running"), py::arg("memory"),
        "What Scene.gradient() calls.");
  m.def("sensitivity_of_scene", &sensitivity_of_scene, py::arg("scene"), py::arg("of"),
        py::arg("uncertainty"), "What Scene.sensitivity() calls.");
  m.def(
      "gradient_in_rates", &in_rates, py::arg("model"), py::arg("q"), py::arg("v"),
      py::arg("start"),
      R"(From Gradient.start of a MechanicalModel that started at coordinates q (nq,) and joint rates v (nv,): (dJ/dq, dJ/dv,
parameters). The momenta at given rates depend on the inertias, so a parameter's whole derivative is that of
Gradient.parameters plus the one here.)");
}

}  // namespace porthos::python
