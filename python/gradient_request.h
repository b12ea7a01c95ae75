#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "integrators/derivatives/run_gradient.h"
#include "phs/system/linearised.h"
#include "python/arrays.h"
#include "python/keywords.h"

/// What Python asks of a gradient.
namespace porthos::python {

using integrators::Objective;

/// A part of the cost from Python: a function of (t, x) that returns (value, gradient).
inline Objective::Part part_of(const char* name, const py::object& f) {
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
    return number("value", both[0]);
  };
}

/// The Hessian of a part of the cost times v, from a function of (t, x, v).
inline Objective::Curvature curvature_of(const char* name, const py::object& f) {
  if (f.is_none()) return {};
  return [name, f](double t, std::span<const double> x, std::span<const double> v,
                   std::span<double> product) {
    const py::gil_scoped_acquire held;
    const auto array = [](std::span<const double> a) {
      return as_array(std::vector<double>(a.begin(), a.end()));
    };
    const auto given = numbers(name, f(t, array(x), array(v)), x.size());
    std::copy(given.begin(), given.end(), product.begin());
  };
}

/// Numbers by the names of parameters, of a model; those that are not named are 0.
inline std::vector<double> parameters_of(const phs::Model& model, const py::object& by_name) {
  if (by_name.is_none()) return {};
  if (!py::isinstance<py::dict>(by_name))
    throw InvalidArgument("parameter_direction is " + kind_of(by_name) +
                          ", expected numbers by name: {\"link_3.mass\": 1.0}");
  const auto names = phs::linearise<double>(model)->parameters();
  std::vector<double> values(names.size(), 0.0);
  for (const auto& [key, value] : by_name.cast<py::dict>()) {
    const auto name = py::str(key).cast<std::string>();
    const auto at = std::ranges::find(names, name);
    if (at == names.end())
      throw InvalidArgument("parameter_direction has '" + name +
                            "', which is none of Gradient.parameters");
    values[size_t(at - names.begin())] =
        number(name.c_str(), py::reinterpret_borrow<py::object>(value));
  }
  return values;
}

/// The cost and how its gradient is computed, as the arguments of both functions give them.
struct GradientRequest {
  Objective objective;
  std::vector<double> direction, parameter_direction;
  size_t memory;

  GradientRequest(const phs::Model& model, const py::object& end, const py::object& sampled,
                  const py::object& running, size_t memory_, const py::object& along,
                  const py::object& along_parameters, const py::object& end_curvature,
                  const py::object& sampled_curvature, const py::object& running_curvature)
      : objective{part_of("end", end),
                  part_of("sampled", sampled),
                  part_of("running", running),
                  curvature_of("end_curvature", end_curvature),
                  curvature_of("sampled_curvature", sampled_curvature),
                  curvature_of("running_curvature", running_curvature)},
        parameter_direction(parameters_of(model, along_parameters)),
        memory(memory_) {
    if (!along.is_none()) direction = numbers("direction", along, size_t(model.description().nx));
    if (along.is_none() && along_parameters.is_none() &&
        (objective.end_curvature || objective.sampled_curvature || objective.running_curvature))
      throw InvalidArgument("a curvature is given without direction, expected both");
  }
};

}  // namespace porthos::python
