// Methods applied to a model, step by step.
#include "integrators/core/integrator.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/interruptible.h"
#include "python/keywords.h"
#include "scene/run/measure.h"

namespace porthos::python {
namespace {

using namespace integrators;
using phs::Model;
using phs::State;

/// A method with the model it refers to. One run at a time.
struct Method {
  std::shared_ptr<const Model> model;
  std::unique_ptr<Integrator> integrator;
};

void require_ok(Outcome o, const Method& m, const State& s) {
  if (o != Outcome::ok)
    throw std::runtime_error(
        fmt::format("{} stopped at t = {} s: {}; the state is the last good one",
                    m.integrator->declaration().name, m.integrator->time(s), to_string(o)));
}

/// A state of another system would be written beyond its end.
void require_fit(const Method& m, const State& s) {
  const auto& d = m.model->description();
  require_size("state", s.x.size(), size_t(d.nx));
  require_size("low words of a state", s.lo.size(), size_t(d.nx));
  require_size("turns of a state", s.turns.size(), size_t(d.angle_count()));
}

/// Takes steps, and returns the states at every `every`-th of them.
py::tuple run(Method& m, State& s, std::int64_t steps, std::int64_t every) {
  if (steps < 0 || every < 1)
    throw InvalidArgument(fmt::format(
        "steps is {} and every is {}, expected steps >= 0 and every >= 1", steps, every));
  require_fit(m, s);
  const size_t n = s.x.size();
  std::vector<double> t, x;
  t.reserve(size_t(steps / every) + 1);
  x.reserve((size_t(steps / every) + 1) * n);
  const auto record = [&] {
    t.push_back(m.integrator->time(s));
    x.insert(x.end(), s.x.begin(), s.x.end());
  };
  Outcome o = Outcome::ok;
  interruptibly([&](const std::atomic<bool>& stop) {
    record();
    for (std::int64_t i = 1; i <= steps && !stop.load(std::memory_order_relaxed); ++i) {
      o = m.integrator->step(s);
      if (o != Outcome::ok) break;
      if (i % every == 0) record();
    }
  });
  require_ok(o, m, s);
  const auto rows = py::ssize_t(t.size());
  return py::make_tuple(as_array(std::move(t)), as_array(std::move(x), {rows, py::ssize_t(n)}));
}

void bind_declarations(py::module_& m) {
  py::enum_<Claim>(
      m, "Claim",
      "What a method says of a property; the test suite checks every `holds` and `fails`.")
      .value("holds", Claim::holds)
      .value("fails", Claim::fails)
      .value("unknown", Claim::unknown);
  py::class_<Declaration>(m, "Declaration",
                          "What a method keeps, for lossless systems unless said otherwise.")
      .def_readonly("name", &Declaration::name, "The name in scenes.")
      .def_readonly("title", &Declaration::title)
      .def_readonly("family", &Declaration::family)
      .def_readonly("order", &Declaration::order, "0: varies with a tolerance.")
      .def_readonly("symmetric", &Declaration::symmetric)
      .def_readonly("symplectic", &Declaration::symplectic)
      .def_readonly("energy_exact", &Declaration::energy_exact, "H kept to rounding for any H.")
      .def_readonly("passivity_exact", &Declaration::passivity_exact,
                    "The discrete power balance closes to rounding for any H.")
      .def_readonly("quadratic_invariants", &Declaration::quadratic_invariants)
      .def_readonly("constraints", &Declaration::constraints,
                    "Whether it keeps closed loops and couplings.")
      .def_readonly("resumable", &Declaration::resumable)
      .def_readonly("rival", &Declaration::rival, "Another library's method, for comparison.")
      .def_readonly("source", &Declaration::source)
      .def("__repr__",
           [](const Declaration& d) { return fmt::format("<{}: {}>", d.name, d.title); });
  m.def("methods", &catalogue, "All methods, in the order of docs and `porthos methods`.");
  m.def("declaration_of", &declaration_of, py::arg("method"),
        "The declaration of a method; InvalidArgument for an unknown name lists the known ones.");
  m.def(
      "misfit",
      [](const std::string& method, const Model& model) {
        return misfit(declaration_of(method), model.description());
      },
      py::arg("method"), py::arg("model"), "Why a method cannot take a system, or None if it can.");
  py::enum_<Solver>(m, "Solver", "How an implicit method solves its equations.")
      .value("automatic", Solver::automatic)
      .value("fixed_point", Solver::fixed_point)
      .value("newton_articulated", Solver::newton_articulated)
      .value("newton_dense", Solver::newton_dense)
      .value("newton_krylov", Solver::newton_krylov);
  py::class_<Cost>(m, "Cost")
      .def_readonly("steps", &Cost::steps)
      .def_readonly("evaluations", &Cost::evaluations, "Of the field (or its parts) for one state.")
      .def_readonly("sweeps", &Cost::sweeps, "Of the implicit iteration.")
      .def_readonly("factorisations", &Cost::factorisations, "Of a Newton matrix.");
}

void bind_state(py::module_& m) {
  py::class_<State>(
      m, "State",
      R"(A state of double-length numbers x + lo, with the turns taken off its angle blocks and an integer clock.

`x` and `lo` are views: they change with the state.)")
      .def(py::init([](const Model& model, py::object x) {
             const auto& d = model.description();
             State s(d, numbers("x", x, size_t(d.nx)));
             phs::wrap_angles(d, s);
             return s;
           }),
           py::arg("model"), py::arg("x"))
      .def_property_readonly(
          "x",
          [](py::object self) {
            auto& s = self.cast<State&>();
            return py::array_t<double>(py::ssize_t(s.x.size()), s.x.data(), self);
          },
          "Value, (nx,).")
      .def_property_readonly(
          "lo",
          [](py::object self) {
            auto& s = self.cast<State&>();
            return py::array_t<double>(py::ssize_t(s.lo.size()), s.lo.data(), self);
          },
          "Low word, |lo| <= ulp(x)/2.")
      .def_property_readonly(
          "turns",
          [](py::object self) {
            auto& s = self.cast<State&>();
            return py::array_t<std::int64_t>(py::ssize_t(s.turns.size()), s.turns.data(), self);
          },
          "One per angle block: the true angle is x + lo + 2 pi turns.")
      .def_readonly("step", &State::step, "Steps taken.")
      .def("copy", [](const State& s) { return s; })
      .def(
          "__eq__", [](const State& a, const State& b) { return a == b; }, py::is_operator());
}

}  // namespace

void bind_integrators(py::module_& m) {
  bind_declarations(m);
  bind_state(m);
  py::class_<Method>(m, "Integrator",
                     "A method at work on one system with one step size. One object per thread.")
      .def_property_readonly("declaration",
                             [](const Method& i) { return i.integrator->declaration(); })
      .def_property_readonly("step_size", [](const Method& i) { return i.integrator->step_size(); })
      .def_property_readonly("cost", [](const Method& i) { return i.integrator->cost(); })
      .def_property_readonly(
          "remark", [](const Method& i) { return i.integrator->remark(); },
          "What the method has to say of how it went. Empty: nothing unusual.")
      .def_property_readonly(
          "port_work",
          [](const Method& i) {
            const auto w = i.integrator->port_work();
            return as_array(std::vector<double>(w.begin(), w.end()));
          },
          "Energy that went through each of the system's powers in the last step [J].")
      .def(
          "time", [](const Method& i, const State& s) { return i.integrator->time(s); },
          py::arg("state"), "The time of a state that step() has brought here [s].")
      .def(
          "step",
          [](Method& i, State& s) {
            require_fit(i, s);
            Outcome o;
            {
              const py::gil_scoped_release released;
              o = i.integrator->step(s);
            }
            require_ok(o, i, s);
          },
          py::arg("state"),
          "Advances the state by one step. RuntimeError if it does not converge or is not finite: "
          "the state is unchanged.")
      .def(
          "run", &run, py::arg("state"), py::arg("steps"), py::arg("every") = 1,
          R"(Advances the state by that many steps, without the GIL. Returns (t, x): times (n,) and states (n, nx) at the start and
after every `every`-th step. Ctrl-C stops between steps; the state is then where it came to.)");
  m.def(
      "integrator",
      [](const std::string& name, std::shared_ptr<const Model> model, double step, double rtol,
         double atol, int max_sweeps, Solver solver, bool lanes, double binding,
         double iteration_tolerance) {
        Options o;
        o.rtol = rtol;
        o.atol = atol;
        o.max_sweeps = max_sweeps;
        o.solver = solver;
        o.lanes = lanes;
        o.binding = binding;
        o.iteration_tolerance = iteration_tolerance;
        auto made = make_integrator(name, *model, step, o);
        return std::make_unique<Method>(Method{std::move(model), std::move(made)});
      },
      py::arg("name"), py::arg("model"), py::arg("step"), py::kw_only(), py::arg("rtol") = 1e-12,
      py::arg("atol") = 1e-14, py::arg("max_sweeps") = 100, py::arg("solver") = Solver::automatic,
      py::arg("lanes") = true, py::arg("binding") = 0.0, py::arg("iteration_tolerance") = 0.0,
      R"(A method by its name in methods() on a system, step [s].

rtol, atol: of methods that work to a tolerance. max_sweeps: of implicit iterations. iteration_tolerance: 0 iterates to
rounding, see Options in C++. Raises InvalidArgument for an unknown name (lists the known ones), a step that is zero or not
finite, a system the method cannot take, or a sampled controller whose period is not a whole number of steps.)");
}

}  // namespace porthos::python
