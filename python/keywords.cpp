// Numbers, vectors and matrices out of Python sequences and back.
#include "python/keywords.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "python/arrays.h"

namespace porthos::python {

std::vector<double> numbers(const char* name, py::handle sequence, size_t n) {
  std::vector<double> v;
  try {
    v = sequence.cast<std::vector<double>>();
  } catch (const py::cast_error&) {
    throw InvalidArgument(fmt::format("{} is {}, expected {} numbers", name, kind_of(sequence), n));
  }
  if (v.size() != n)
    throw InvalidArgument(fmt::format("{} has {} numbers, expected {}", name, v.size(), n));
  return v;
}

double number(const std::string& name, py::handle value) {
  try {
    return value.cast<double>();
  } catch (const py::cast_error&) {
    throw py::type_error(fmt::format("{} is {}, expected a number", name, kind_of(value)));
  }
}

mechanics::Vec3d vector3(const char* name, py::handle sequence) {
  const auto v = numbers(name, sequence, 3);
  return {v[0], v[1], v[2]};
}

phs::Matrix matrix(const char* name, py::handle rows) {
  std::vector<std::vector<double>> a;
  try {
    a = rows.cast<std::vector<std::vector<double>>>();
  } catch (const py::cast_error&) {
    throw InvalidArgument(fmt::format("{} is {}, expected rows of numbers", name, kind_of(rows)));
  }
  phs::Matrix m(int(a.size()), a.empty() ? 0 : int(a[0].size()));
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].size() != a[0].size())
      throw InvalidArgument(fmt::format("row {} of {} has {} numbers, expected {} as the first", i,
                                        name, a[i].size(), a[0].size()));
    for (size_t j = 0; j < a[i].size(); ++j) m(int(i), int(j)) = a[i][j];
  }
  return m;
}

mechanics::Mat3<double> matrix3(const char* name, py::handle rows) {
  const phs::Matrix a = matrix(name, rows);
  if (a.rows != 3 || a.cols != 3)
    throw InvalidArgument(
        fmt::format("{} has shape ({}, {}), expected (3, 3)", name, a.rows, a.cols));
  mechanics::Mat3<double> m;
  for (int i = 0; i < 3; ++i) {
    m.x[i] = a(i, 0);
    m.y[i] = a(i, 1);
    m.z[i] = a(i, 2);
  }
  return m;
}

py::object array_of(const mechanics::Mat3<double>& m) {
  std::vector<double> a;
  for (int i = 0; i < 3; ++i) a.insert(a.end(), {m.x[i], m.y[i], m.z[i]});
  return as_array(std::move(a), {3, 3});
}
py::object array_of(const phs::Matrix& m) { return as_array(m.a, {m.rows, m.cols}); }

}  // namespace porthos::python
