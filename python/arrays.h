#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "phs/error.h"
#include "python/lanes.h"

/// Numpy arrays as they are: inputs are neither converted nor copied. An array that does not fit is
/// refused with a message that names it, what was given and what was expected.
namespace porthos::python {

namespace py = pybind11;
using Shape = std::vector<py::ssize_t>;

/// The rows of one call: one state (arrays of the item's own shape), or n states, one after another
/// in C order.
class Rows {
 public:
  bool batched() const { return batched_; }
  size_t count() const { return size_t(rows_); }

  /// The numbers of an input with shape `item` per state; the first input determines whether the
  /// call is batched. None: null if optional.
  Source in(const char* name, py::handle array, const Shape& item, bool optional = false);
  Source in(const char* name, py::handle array, size_t n, bool optional = false) {
    return in(name, array, Shape{py::ssize_t(n)}, optional);
  }
  /// `out` checked as an input is, writeable and apart from the inputs; or a new array if it is
  /// None.
  py::array_t<double> out(const char* name, py::handle out, const Shape& item);
  py::array_t<double> out(const char* name, py::handle array, size_t n) {
    return out(name, array, Shape{py::ssize_t(n)});
  }

 private:
  struct Known {
    std::string name;
    const char *begin, *end;
  };
  py::array check(const char* name, py::handle array, const Shape& item);
  bool known_ = false, batched_ = false;
  py::ssize_t rows_ = 1;
  std::string first_;         ///< the array that determined the number of states
  std::vector<Known> taken_;  ///< memory of this call
};

/// How many numbers an item of a shape has.
size_t size_of(const Shape& item);

/// "a numpy array of shape (2, 7)", "a list", ...
std::string kind_of(py::handle object);

/// A read-only array over memory that `owner` keeps alive.
template <class T>
py::array_t<T> view(const T* data, const Shape& shape, py::handle owner) {
  py::array_t<T> a(shape, data, owner);
  py::detail::array_proxy(a.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return a;
}

/// A vector passed to numpy without a copy.
template <class T>
py::array_t<T> as_array(std::vector<T> values, const Shape& shape) {
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* v) { delete static_cast<std::vector<T>*>(v); });
  return py::array_t<T>(shape, kept->data(), owner);
}
template <class T>
py::array_t<T> as_array(std::vector<T> values) {
  const auto n = py::ssize_t(values.size());
  return as_array(std::move(values), Shape{n});
}

}  // namespace porthos::python
