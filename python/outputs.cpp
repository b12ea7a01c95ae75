// The [[output]]s of a scene at states that are given.
#include "scene/assemble/outputs.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

using py::arg;

class SceneOutputs {
 public:
  SceneOutputs(const scene::Scene& s, const scene::Assembly& a,
               const std::vector<std::string>& names)
      : scene_(s), assembly_(a) {
    const auto named = [&](const std::string& n) {
      return names.empty() || std::ranges::count(names, n) > 0;
    };
    for (const auto& o : s.outputs)
      for (const auto& number : scene::component_names(o))
        if (named(o.name) || named(number)) names_.push_back(number);
    std::vector<scene::Output> needed;
    for (const auto& o : s.outputs)
      if (std::ranges::any_of(names_, [&](const auto& number) {
            const auto of = scene::needed_for(number, s.outputs);
            return std::ranges::any_of(of, [&](const auto& n) { return n.name == o.name; });
          }))
        needed.push_back(o);
    const auto given = scene::number_names(needed);
    for (const auto& number : names_)
      columns_.push_back(size_t(std::ranges::find(given, number) - given.begin()));
    outputs_.emplace(scene_, assembly_, std::move(needed));
  }
  SceneOutputs(const SceneOutputs&) = delete;

  const std::vector<std::string>& names() const { return names_; }
  py::array_t<double> at(const py::object& times, const py::object& states,
                         const py::object& inputs) {
    Rows r;
    const auto& d = assembly_.model->description();
    const auto nx = size_t(d.nx), nu = size_t(d.nu);
    const double* x = r.in("states", states, nx).data;
    const double* u = r.in("inputs", inputs, nu, true).data;
    const auto t = numbers("times", times, r.count());
    std::vector<double> found;
    for (size_t i = 0; i < r.count(); ++i) {
      const phs::State s(d, {x + i * nx, x + (i + 1) * nx});
      const auto values =
          outputs_->at(t[i], s, {}, u ? std::span(u + i * nu, nu) : std::span<const double>());
      for (const size_t k : columns_) found.push_back(values[k]);
    }
    return as_array(std::move(found), Shape{py::ssize_t(r.count()), py::ssize_t(columns_.size())});
  }

 private:
  const scene::Scene scene_;
  const scene::Assembly assembly_;
  std::vector<std::string> names_;
  std::vector<size_t> columns_;
  std::optional<scene::Outputs> outputs_;
};

}  // namespace

void bind_outputs(py::module_& m) {
  py::class_<SceneOutputs>(
      m, "SceneOutputs",
      "[[output]]s of a scene without sampled controllers, at states of its "
      "assembly. names: of outputs, or of their numbers, as 'tip.x'; none: all.")
      .def(py::init<const scene::Scene&, const scene::Assembly&, const std::vector<std::string>&>(),
           arg("scene"), arg("assembly"), arg("names"))
      .def_property_readonly("names", &SceneOutputs::names,
                             "Of the numbers; outputs that the scene does not have are left out.")
      .def("at", &SceneOutputs::at, arg("times"), arg("states"), arg("inputs") = py::none(),
           "times: (n,) [s]; states: (n, nx); inputs: (n, nu) that act there, None: 0. Returns (n, "
           "numbers) in the units of the outputs.");
}

}  // namespace porthos::python
