// Environments for learning and planning: reset, act, observe, over a batch.
#include "ensemble/environment.h"

#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using ensemble::Environment;
using ensemble::EnvironmentOptions;
using ensemble::Stream;
using py::arg;

py::array_t<double> to_array(std::span<const double> x) {
  return py::array_t<double>(py::ssize_t(x.size()), x.data());
}

/// begin(uniform, x) -> x, with the random numbers of the episode as a function uniform(n).
std::function<void(Stream&, std::span<double>)> begin_of(const py::object& f) {
  if (f.is_none()) return {};
  return [kept = keep(f)](Stream& random, std::span<double> x) {
    const py::gil_scoped_acquire gil;
    const auto stream = std::make_shared<Stream*>(&random);  // until this call ends
    const py::cpp_function uniform([stream](size_t n) {
      if (!*stream) throw InvalidArgument("uniform(n) belongs to one call of begin, which is over");
      std::vector<double> u(n);
      for (double& v : u) v = (*stream)->uniform();
      return as_array(std::move(u));
    });
    const py::object start = py::handle(kept.get())(uniform, to_array(x));
    *stream = nullptr;
    from_python<double>(start, x, "begin");
  };
}
std::function<bool(std::span<const double>)> ended_of(const py::object& f) {
  if (f.is_none()) return {};
  return [kept = keep(f)](std::span<const double> x) {
    const py::gil_scoped_acquire gil;
    const py::object is = py::handle(kept.get())(to_array(x));
    if (is.is_none()) throw InvalidArgument("ended(x) returned None, expected True or False");
    if (py::isinstance<py::array>(is) && is.cast<py::array>().size() != 1)
      throw InvalidArgument("ended gave " + kind_of(is) + ", expected True or False");
    return py::bool_(is).cast<bool>();
  };
}

using GivenCase = std::tuple<std::shared_ptr<const phs::Model>, py::object, py::object>;
/// Those of a list; without one, the model and its start.
std::vector<ensemble::EnvironmentCase> cases_of(const std::vector<GivenCase>& given,
                                                std::shared_ptr<const phs::Model> model,
                                                const py::object& start) {
  std::vector<ensemble::EnvironmentCase> all;
  for (const auto& [own, x, ended] : given) {
    if (!own) throw InvalidArgument("a case has no model, expected (model, start, ended or None)");
    all.push_back({own, numbers("start", x, size_t(own->description().nx)), ended_of(ended)});
  }
  if (all.empty()) {
    auto x = numbers("start", start, size_t(model->description().nx));
    all.push_back({std::move(model), std::move(x)});
  }
  return all;
}

/// A read-only view of a table of the environment, which writes it in reset() and step().
template <class T>
py::array_t<T> table(py::handle self, std::span<const T> values, int rows, int columns = -1) {
  return columns < 0 ? view(values.data(), {rows}, self)
                     : view(values.data(), {rows, columns}, self);
}
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;
Environment& of(py::handle self) { return self.cast<Environment&>(); }

py::object observations(py::handle self) {
  auto& e = of(self);
  return table(self, e.observations(), e.count(), e.observation_size());
}
int index(const Environment& e, int i) {
  if (i < 0 || i >= e.count())
    throw InvalidArgument("environment is " + std::to_string(i) + ", expected 0 to " +
                          std::to_string(e.count() - 1));
  return i;
}
/// A number of each environment.
template <class Member>
auto each(Member member) {
  return [member](py::object self) { return table(self, (of(self).*member)(), of(self).count()); };
}
/// Those after a change that needs no GIL.
template <class Change>
py::object observations_after(const py::object& self, Change change) {
  {
    auto& e = of(self);
    const py::gil_scoped_release released;
    change(e);
  }
  return observations(self);
}
/// Flags of one byte as bool.
py::object flags(py::handle self, std::span<const std::uint8_t> f) {
  return table(self, f, of(self).count()).attr("view")(py::dtype::of<bool>());
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_environment(py::module_& m) {
  py::class_<Environment>(
      m, "Environment",
      R"(Environments for learning and planning: reset, act, observe, over a batch.

An action is a row of port inputs u, held over `substeps` steps; rewards are the caller's, from observations and actions.
Random numbers belong to (seed, environment, episode): the same seed and actions give the same bits. An environment whose
episode ends (reached, cut off, or the method failed) begins the next in the same step; its last observation is in
final_observations. Arrays are views, (count, ...), written by reset() and step(): copy what is to stay.)")
      .def(
          py::init([](std::shared_ptr<const phs::Model> model, py::object start, int count,
                      const std::string& method, double step, int substeps, std::uint64_t seed,
                      std::int64_t longest, int threads, std::vector<std::string> ports,
                      std::vector<int> observed, bool outputs, py::object begin, py::object ended,
                      const std::vector<GivenCase>& cases) {
            EnvironmentOptions o;
            o.count = count;
            o.method = method;
            o.step = step;
            o.substeps = substeps;
            o.seed = seed;
            o.longest = longest;
            o.threads = threads;
            o.outputs = outputs;
            o.ports = std::move(ports);
            o.observed = std::move(observed);
            o.begin = begin_of(begin);
            o.ended = ended_of(ended);
            auto all = cases_of(cases, std::move(model), start);
            const py::gil_scoped_release released;
            return std::make_unique<Environment>(std::move(all), std::move(o));
          }),
          arg("model"), arg("start"), py::kw_only(), arg("count") = 1, arg("method") = "gauss4",
          arg("step") = 0.01, arg("substeps") = 1, arg("seed") = 0, arg("longest") = 0,
          arg("threads") = 1, arg("ports") = std::vector<std::string>{},
          arg("observed") = std::vector<int>{}, arg("outputs") = false, arg("begin") = py::none(),
          arg("ended") = py::none(), arg("cases") = std::vector<GivenCase>{},
          R"(start: state an episode begins from, nx numbers. longest: actions after which an episode is cut off; 0: never. threads: 0
for as many as the machine has. ports: that actions drive; empty: all. observed: state numbers; empty: all. outputs:
whether y of the ports that are driven is observed after them.

begin(uniform, x) -> x: where an episode begins; uniform(n) gives n random numbers in [0, 1) of the episode's own.
ended(x) -> bool: whether an episode has ended at x. Both take the GIL: end() ends episodes by one call for all.
cases: [(model, start, ended or None), ...] in place of model and start: models that differ in numbers alone. Every episode draws
the one it begins as; what each environment has now stands in `cases`.)")
      .def_property_readonly("count", &Environment::count)
      .def_property_readonly("action_size", &Environment::action_size)
      .def_property_readonly("observation_size", &Environment::observation_size)
      .def_property_readonly("interval", &Environment::interval, "Seconds from action to action.")
      .def(
          "reset",
          [](py::object self, std::optional<std::uint64_t> seed) {
            return observations_after(self, [&](Environment& e) { e.reset(seed); });
          },
          arg("seed") = py::none(),
          "Begins the first episode of a seed in every environment; without one, the next episode, "
          "which is the one that the last step began where it ended one. Returns observations.")
      .def(
          "reset_each",
          [](py::object self, const std::vector<std::uint64_t>& seeds) {
            return observations_after(self, [&](Environment& e) { e.reset(seeds); });
          },
          arg("seeds"), "The same with a seed for each environment.")
      .def(
          "step",
          [](py::object self, py::object actions) {
            auto& e = of(self);
            Rows r;
            const Source a = r.in("actions", actions, Shape{e.count(), e.action_size()});
            if (r.batched())
              throw InvalidArgument("actions is " + kind_of(actions) +
                                    ", expected one row per environment");
            {
              const py::gil_scoped_release released;
              e.step({a.data, a.n});
            }
            return py::make_tuple(observations(self), flags(self, e.terminated()),
                                  flags(self, e.truncated()));
          },
          arg("actions"),
          "actions: (count, action_size). Returns (observations, terminated, truncated).")
      .def(
          "end",
          [](py::object self, const Flags& which, bool failed) {
            const std::vector<std::uint8_t> flagged(which.data(), which.data() + which.size());
            return observations_after(self, [&](Environment& e) { e.end(flagged, failed); });
          },
          arg("which"), py::kw_only(), arg("failed") = false,
          "Ends the episodes of the environments where `which` is True, (count,), in the step just "
          "taken, as `ended` does, or as a failure does: what it observed last is then what it did "
          "before the step. Returns observations.")
      .def_property_readonly(
          "observations", [](py::object self) { return observations(self); },
          "(count, observation_size)")
      .def_property_readonly(
          "final_observations",
          [](py::object self) {
            auto& e = of(self);
            return table(self, e.final_observations(), e.count(), e.observation_size());
          },
          "Of the environments whose episode ended in the last step, what was observed at its end; "
          "else as observations.")
      .def_property_readonly(
          "terminated", [](py::object self) { return flags(self, of(self).terminated()); },
          "Where an episode ended in the last step, by `ended` or a failure.")
      .def_property_readonly(
          "truncated", [](py::object self) { return flags(self, of(self).truncated()); },
          "Where it ended by its length.")
      .def_property_readonly(
          "failed", [](py::object self) { return flags(self, of(self).failed()); },
          "Where the method failed.")
      .def_property_readonly(
          "outcomes",
          [](const Environment& e) {
            std::vector<std::string> said;
            for (const auto o : e.outcomes())
              said.push_back(o == integrators::Outcome::ok ? "" : to_string(o));
            return said;
          },
          "Why the method failed in the last step; '' where it did not.")
      .def_property_readonly("energies", each(&Environment::energies), "H of each environment [J].")
      .def_property_readonly("final_energies", each(&Environment::final_energies),
                             "H of each environment at its final_observations [J].")
      .def_property_readonly("iterations", &Environment::iterations,
                             "Iterations of the method per step of it in the last step(), mean of "
                             "all environments; of an explicit method 1.")
      .def_property_readonly(
          "alone", &Environment::alone,
          "How many environments left the SIMD lanes in the last step(), because the iteration did "
          "not contract: each took Newton's method alone, some ten times as long.")
      .def_property_readonly("lengths", each(&Environment::lengths), "Steps taken in the episode.")
      .def_property_readonly("cases", each(&Environment::cases), "The case of each environment.")
      .def_property_readonly("final_cases", each(&Environment::final_cases),
                             "The case of each environment at its final_observations.")
      .def_property_readonly("episodes", each(&Environment::episodes), "Number of the episode.")
      .def(
          "state", [](const Environment& e, int i) { return e.state(index(e, i)); },
          arg("environment"), "The state of an environment.")
      .def(
          "set_state",
          [](Environment& e, int i, const phs::State& s) { e.set_state(index(e, i), s); },
          arg("environment"), arg("state"),
          "Puts another state in its place; its episode goes on.");
}

}  // namespace porthos::python
