// Parameters from logs.
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/interruptible.h"
#include "scene/identification/identification.h"

namespace porthos::python {
namespace {

using scene::Identification;

/// The residuals of all columns, (times, columns).
py::array_t<double> residuals(const std::vector<std::vector<double>>& columns) {
  std::vector<double> all;
  const size_t rows = columns.empty() ? 0 : columns.front().size();
  for (size_t row = 0; row < rows; ++row)
    for (const auto& column : columns) all.push_back(column[row]);
  return as_array(std::move(all), {py::ssize_t(rows), py::ssize_t(columns.size())});
}

py::dict columns_of(Identification r, const scene::Scene& s) {
  const auto n = py::ssize_t(r.found.size());
  py::list names, units, start, values, deviations, told, columns;
  std::vector<double> moves, along;
  for (const auto& f : r.found) {
    names.append(f.of.name);
    units.append(f.of.unit);
    start.append(f.of.start);
    values.append(f.value);
    deviations.append(f.deviation);
  }
  for (const auto& c : r.combinations) {
    along.push_back(c.deviation);
    told.append(c.told);
    moves.insert(moves.end(), c.moves.begin(), c.moves.end());
  }
  for (const auto& c : r.columns) columns.append(c.of.name);
  py::dict d;
  d["text"] = scene::identification_text(r);
  d["json"] = scene::identification_json(s, r);
  d["parameters"] = names;
  d["units"] = units;
  d["start"] = start;
  d["values"] = values;
  d["deviations"] = deviations;
  d["covariance"] = as_array(std::move(r.covariance), {n, n});
  d["combinations"] = as_array(std::move(moves), {n, n});
  d["combination_deviations"] = as_array(std::move(along));
  d["told"] = told;
  d["columns"] = columns;
  d["times"] = as_array(std::move(r.times));
  d["before"] = residuals(r.before);
  d["after"] = residuals(r.after);
  d["chi_square"] = r.chi_square;
  d["freedoms"] = r.freedoms;
  d["converged"] = r.converged;
  d["scene"] = r.scene;
  d["notes"] = py::cast(r.notes);
  return d;
}

/// Log: a path or columns by name.
py::dict identify_scene(const scene::Scene& s, const py::object& log,
                        std::vector<std::string> parameters, std::optional<double> sigma_of_all,
                        std::map<std::string, double> sigma_by_name,
                        const std::optional<std::string>& out) {
  scene::IdentificationRequest request;
  request.parameters = std::move(parameters);
  request.noise = {sigma_of_all, std::move(sigma_by_name)};
  const bool columns = py::isinstance<py::dict>(log);
  const auto given = columns ? log.cast<scene::NamedColumns>() : scene::NamedColumns();
  const std::string path = columns ? "" : py::str(log).cast<std::string>();
  Identification r;
  interruptibly([&](const std::atomic<bool>& stop) {
    request.stop = &stop;
    r = columns ? scene::identify(s, given, request) : scene::identify(s, path, request);
  });
  if (!r.failure.empty()) throw std::runtime_error(r.failure);
  if (out) scene::write_identification(*out, s, r);
  return columns_of(std::move(r), s);
}

}  // namespace

void bind_identification(py::module_& m) {
  m.def("identify_scene", &identify_scene, py::arg("scene"), py::arg("log"), py::arg("parameters"),
        py::arg("sigma_of_all"), py::arg("sigma_by_name"), py::arg("out"),
        "What Scene.identify() calls.");
}

}  // namespace porthos::python
