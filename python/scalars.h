#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <span>
#include <string>

#include "phs/error.h"
#include "phs/scalars/scalar.h"

/// Conversion of numbers between C++ scalars and Python code: float64 and longdouble arrays, object
/// arrays of Dual and Quad. Lanes are converted one by one. Python code gets copies, which it may
/// keep.
namespace porthos::python {

namespace py = pybind11;

/// A Python object held by C++ threads: released with the GIL.
using Kept = std::shared_ptr<PyObject>;
inline Kept keep(py::object o) {
  return Kept(o.release().ptr(), [](PyObject* p) {
    if (!Py_IsInitialized()) return;
    const py::gil_scoped_acquire gil;
    Py_DECREF(p);
  });
}

/// Whether T is a type of its own in Python.
template <class T>
inline constexpr bool is_object = std::is_same_v<T, phs::Dual> || std::is_same_v<T, phs::Quad>;
/// Quad as a class: pybind11 has no class for a built-in type.
struct QuadNumber {
  phs::Quad v;
};

template <class T>
py::object to_python(const T& x) {
  if constexpr (std::is_same_v<T, phs::Quad>)
    return py::cast(QuadNumber{x});
  else if constexpr (std::is_same_v<T, phs::Dual>)
    return py::cast(x);
  else if constexpr (std::is_same_v<T, long double>)
    return py::array_t<long double>(1, &x)[py::int_(0)];
  else
    return py::float_(x);
}

template <class T>
py::object to_python(std::span<const T> x) {
  if constexpr (is_object<T>) {
    py::array a(py::dtype("O"), py::ssize_t(x.size()));
    auto** p = static_cast<PyObject**>(a.mutable_data());
    for (size_t i = 0; i < x.size(); ++i) {
      Py_XDECREF(p[i]);
      p[i] = to_python(x[i]).release().ptr();
    }
    return a;
  } else {
    return py::array_t<T>(py::ssize_t(x.size()), x.data());
  }
}

/// One number from a value that Python code returned. `who` begins the error message.
template <class T>
T from_python(py::handle h, const std::string& who) {
  try {
    if constexpr (std::is_same_v<T, double>) {
      return h.cast<double>();
    } else if constexpr (std::is_same_v<T, long double>) {
      const auto a = py::array_t<long double, py::array::forcecast>::ensure(h);
      if (!a || a.size() != 1) throw py::cast_error();
      return *a.data();
    } else {
      if constexpr (std::is_same_v<T, phs::Quad>) {
        if (py::isinstance<QuadNumber>(h)) return h.cast<QuadNumber>().v;
      } else {
        if (py::isinstance<T>(h)) return h.cast<T>();
      }
      if (py::isinstance<py::array>(h)) return from_python<T>(h.attr("item")(), who);
      return T(h.cast<double>());
    }
  } catch (const py::cast_error&) {
    PyErr_Clear();
    throw InvalidArgument(who + " returned a " +
                          std::string(py::str(py::type::of(h).attr("__name__"))) +
                          ", expected a number");
  }
}

/// Fills `to` with numbers. @throws InvalidArgument if there are fewer or more
template <class T>
void from_python(py::handle h, std::span<T> to, const std::string& who) {
  if (h.is_none())  // numpy would make a NaN of it
    throw InvalidArgument(who + " returned None, expected " + std::to_string(to.size()) +
                          " numbers");
  const auto expect = [&](py::ssize_t got) {
    if (size_t(got) != to.size())
      throw InvalidArgument(who + " returned " + std::to_string(got) + " numbers, expected " +
                            std::to_string(to.size()));
  };
  if constexpr (is_object<T>) {
    const auto a = py::array::ensure(h);
    if (!a) throw py::error_already_set();
    const py::object flat = a.attr("ravel")();
    expect(py::len(flat));
    py::ssize_t i = 0;
    for (const auto& x : flat) to[size_t(i++)] = from_python<T>(x, who);
  } else {
    if (py::isinstance<py::array>(h) && py::reinterpret_borrow<py::array>(h).dtype().kind() == 'c')
      throw InvalidArgument(who + " returned complex numbers, expected real ones");
    const auto a = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(h);
    if (!a) {
      PyErr_Clear();
      throw InvalidArgument(who + " returned a " +
                            std::string(py::str(py::type::of(h).attr("__name__"))) + ", expected " +
                            std::to_string(to.size()) + " numbers");
    }
    expect(a.size());
    std::copy_n(a.data(), to.size(), to.begin());
  }
}

}  // namespace porthos::python
