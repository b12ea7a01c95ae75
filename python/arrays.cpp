#include "python/arrays.h"

#include <fmt/format.h>

namespace porthos::python {
namespace {

/// "(2, 7)", "(7,)", "()"
std::string text(const py::ssize_t* n, size_t count) {
  std::string s = "(";
  for (size_t i = 0; i < count; ++i)
    s += std::to_string(n[i]) + (i + 1 < count ? ", " : count == 1 ? "," : "");
  return s + ")";
}
std::string text(const Shape& s) { return text(s.data(), s.size()); }

std::string text_of_batch(const Shape& item) {
  std::string s = "(n";
  for (const auto k : item) s += ", " + std::to_string(k);
  return s + (item.empty() ? ",)" : ")");
}

}  // namespace

size_t size_of(const Shape& item) {
  size_t n = 1;
  for (const auto k : item) n *= size_t(k);
  return n;
}

std::string kind_of(py::handle h) {
  if (!py::isinstance<py::array>(h))
    return fmt::format("a {}", std::string(py::str(py::type::of(h).attr("__name__"))));
  const auto a = py::reinterpret_borrow<py::array>(h);
  return fmt::format("a numpy array of shape {}", text(a.shape(), size_t(a.ndim())));
}

py::array Rows::check(const char* name, py::handle h, const Shape& item) {
  if (!py::isinstance<py::array>(h))
    throw InvalidArgument(
        fmt::format("{} is {}, expected a numpy array of float64", name, kind_of(h)));
  const auto a = py::reinterpret_borrow<py::array>(h);
  if (!py::isinstance<py::array_t<double>>(a))
    throw InvalidArgument(
        fmt::format("{0} has dtype {1}, expected float64", name, std::string(py::str(a.dtype()))));
  const auto fits = [&](bool batched) {
    const py::ssize_t lead = batched;
    if (a.ndim() != py::ssize_t(item.size()) + lead) return false;
    for (size_t k = 0; k < item.size(); ++k)
      if (a.shape(py::ssize_t(k) + lead) != item[k]) return false;
    return true;
  };
  if (!known_) {
    if (!fits(false) && !fits(true))
      throw InvalidArgument(fmt::format("{} has shape {}, expected {} or {}", name,
                                        text(a.shape(), size_t(a.ndim())), text(item),
                                        text_of_batch(item)));
    known_ = true;
    batched_ = fits(true);
    first_ = name;
    rows_ = batched_ ? a.shape(0) : 1;
  } else if (!fits(batched_) || (batched_ && a.shape(0) != rows_)) {
    Shape wanted = item;
    if (batched_) wanted.insert(wanted.begin(), rows_);
    throw InvalidArgument(fmt::format(
        "{} has shape {}, expected {} as {} is {}", name, text(a.shape(), size_t(a.ndim())),
        text(wanted), first_, batched_ ? fmt::format("of {} states", rows_) : "of one state"));
  }
  constexpr int contiguous = int(py::array::c_style) | int(py::detail::npy_api::NPY_ARRAY_ALIGNED_);
  if ((a.flags() & contiguous) != contiguous)
    throw InvalidArgument(fmt::format(
        "{} is not contiguous in C order (its strides are {} bytes), expected one state after "
        "another as numpy.ascontiguousarray gives it",
        name, text(a.strides(), size_t(a.ndim()))));
  return a;
}

Source Rows::in(const char* name, py::handle h, const Shape& item, bool optional) {
  if (h.is_none() && optional) return {nullptr, size_of(item)};
  const py::array a = check(name, h, item);
  const char* data = static_cast<const char*>(a.data());
  taken_.push_back({name, data, data + a.nbytes()});
  return {static_cast<const double*>(a.data()), size_of(item)};
}

py::array_t<double> Rows::out(const char* name, py::handle h, const Shape& item) {
  Shape shape = item;
  if (batched_) shape.insert(shape.begin(), rows_);
  if (h.is_none()) return py::array_t<double>(shape);
  const py::array a = check(name, h, item);
  if (!a.writeable())
    throw InvalidArgument(fmt::format("{} is read-only, expected a writeable array", name));
  const char *begin = static_cast<const char*>(a.data()), *end = begin + a.nbytes();
  for (const auto& t : taken_)
    if (begin < t.end && t.begin < end)
      throw InvalidArgument(
          fmt::format("{} shares memory with {}, expected an array of its own", name, t.name));
  taken_.push_back({name, begin, end});
  return py::reinterpret_borrow<py::array_t<double>>(h);
}

}  // namespace porthos::python
