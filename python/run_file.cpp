// The file run.h5 of a run.
#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/bind.h"
#include "scene/files/hdf5_reader.h"

namespace porthos::python {

using py::arg;
using scene::Hdf5Reader;

void bind_run_file(py::module_& m) {
  py::class_<Hdf5Reader>(m, "RunFile", "The run.h5 of a run.")
      .def(py::init([](py::object path) {
             return std::make_unique<Hdf5Reader>(std::string(py::str(path)));
           }),
           arg("path"))
      .def_property_readonly(
          "names",
          [](const Hdf5Reader& f) {
            std::vector<std::string> names;
            for (const auto& [name, d] : f.datasets()) names.push_back(name);
            return names;
          },
          "Every dataset, 'state/elbow', 'energy_error', ...")
      .def(
          "read",
          [](const Hdf5Reader& f, const std::string& name) -> py::object {
            const auto& d = f.dataset(name);
            if (d.kind == Hdf5Reader::Kind::text) return py::str(f.text(name));
            const Shape shape(d.shape.begin(), d.shape.end());
            if (d.kind == Hdf5Reader::Kind::integer) {
              py::array_t<std::int64_t> a(shape);
              f.read(name, a.mutable_data());
              return a;
            }
            py::array_t<double> a(shape);
            f.read(name, a.mutable_data());
            return a;
          },
          arg("name"), "A dataset as an array, or its text.")
      .def(
          "attributes",
          [](const Hdf5Reader& f, const std::string& object) {
            py::dict all;
            for (const auto& [name, text] : f.texts(object)) all[py::str(name)] = text;
            for (const auto& [name, x] : f.numbers(object)) all[py::str(name)] = x;
            return all;
          },
          arg("object") = "/", "Attributes of a dataset or group ('/': of the file).");
}

}  // namespace porthos::python
