#pragma once
#include <pybind11/pybind11.h>

#include <memory>
#include <string>

#include "mechanics/builder.h"
#include "phs/error.h"
#include "phs/linear_algebra/matrix.h"

namespace porthos::python {

namespace py = pybind11;

/// A constructor Name(a=1, b=2) of a plain struct whose members are bound as properties.
/// @throws InvalidArgument for a keyword that is no member
template <class C>
auto from_keywords(const C& prototype = {}) {
  return py::init([prototype](const py::kwargs& keywords) {
    auto made = std::make_unique<C>(prototype);
    const py::object self = py::cast(made.get(), py::return_value_policy::reference);
    for (const auto& [key, value] : keywords) {
      if (!py::hasattr(py::type::of<C>(), key))
        throw InvalidArgument(std::string(py::str(py::type::of<C>().attr("__name__"))) +
                              " has no '" + std::string(py::str(key)) + "', see help()");
      py::setattr(self, key, value);
    }
    return made;
  });
}

/// @throws pybind11::type_error with name, got and expected
double number(const std::string& name, py::handle value);
/// n numbers from a sequence. @throws InvalidArgument with name, got and expected
std::vector<double> numbers(const char* name, py::handle sequence, size_t n);
mechanics::Vec3d vector3(const char* name, py::handle sequence);
/// Rows of a 3 × 3 array, or of a list of lists.
mechanics::Mat3<double> matrix3(const char* name, py::handle rows);
phs::Matrix matrix(const char* name, py::handle rows);

inline py::tuple tuple_of(const mechanics::Vec3d& v) { return py::make_tuple(v.x, v.y, v.z); }
py::object array_of(const mechanics::Mat3<double>& m);
py::object array_of(const phs::Matrix& m);

}  // namespace porthos::python
