// Dual and Quad in Python: the scalars, besides floats, in which a system or law written in Python
// is evaluated.
#include "python/scalars.h"

#include <pybind11/operators.h>

#include "python/bind.h"

namespace porthos::python {
namespace {

using phs::Dual;
using phs::Quad;

Quad value(const QuadNumber& q) { return q.v; }
Dual value(const Dual& d) { return d; }
template <class P>
P wrap(decltype(value(std::declval<P>())) x) {
  return P{x};
}

std::string text(const Dual& d) {
  return "Dual(" + std::to_string(d.v) + ", " + std::to_string(d.d) + ")";
}
std::string text(const QuadNumber& q) {
  char s[64];
  phs::quadmath_snprintf(s, sizeof s, "%.34Qg", q.v);
  return "Quad(" + std::string(s) + ")";
}

template <class T>
T power(T x, double n) {
  if (n == std::round(n) && std::fabs(n) <= 64) {
    T y(1.0);
    for (int k = 0; k < int(std::fabs(n)); ++k) y = y * x;
    return n < 0 ? T(1.0) / y : y;
  }
  return phs::exp(T(n) * phs::log(x));
}

/// Arithmetic with each other and with floats, and the functions numpy calls on object arrays:
/// np.sin(x) is x.sin().
template <class P, class Class>
void arithmetic(Class& c) {
  const auto both = [&](const char* name, const char* reflected, auto f) {
    c.def(
        name, [f](const P& a, const P& b) { return wrap<P>(f(value(a), value(b))); },
        py::is_operator());
    c.def(
        name, [f](const P& a, double b) { return wrap<P>(f(value(a), decltype(value(a))(b))); },
        py::is_operator());
    c.def(
        reflected,
        [f](const P& a, double b) { return wrap<P>(f(decltype(value(a))(b), value(a))); },
        py::is_operator());
  };
  both("__add__", "__radd__", [](auto a, auto b) { return a + b; });
  both("__sub__", "__rsub__", [](auto a, auto b) { return a - b; });
  both("__mul__", "__rmul__", [](auto a, auto b) { return a * b; });
  both("__truediv__", "__rtruediv__", [](auto a, auto b) { return a / b; });
  const auto compare = [&](const char* name, auto f) {
    c.def(
        name, [f](const P& a, const P& b) { return f(value(a), value(b)); }, py::is_operator());
    c.def(
        name, [f](const P& a, double b) { return f(value(a), decltype(value(a))(b)); },
        py::is_operator());
  };
  compare("__lt__", [](auto a, auto b) { return a < b; });
  compare("__gt__", [](auto a, auto b) { return a > b; });
  compare("__le__", [](auto a, auto b) { return a <= b; });
  compare("__ge__", [](auto a, auto b) { return a >= b; });
  compare("__eq__", [](auto a, auto b) { return a == b; });
  c.def("__neg__", [](const P& a) { return wrap<P>(-value(a)); });
  c.def("__pos__", [](const P& a) { return a; });
  c.def(
      "__pow__", [](const P& a, double n) { return wrap<P>(power(value(a), n)); },
      py::is_operator());
  c.def("__float__", [](const P& a) {
    if constexpr (std::is_same_v<P, Dual>)
      throw py::type_error(
          "this number carries a derivative, which a float would lose: expected operators and "
          "numpy's functions (np.sqrt in place of math.sqrt, no float(), no arrays of floats)");
    return phs::to_double(value(a));
  });
  c.def("__repr__", [](const P& a) { return text(a); });
  c.def("__abs__", [](const P& a) { return wrap<P>(phs::abs(value(a))); });
  c.def("fabs", [](const P& a) { return wrap<P>(phs::abs(value(a))); });
  c.def("square", [](const P& a) { return wrap<P>(value(a) * value(a)); });
  c.def("conjugate", [](const P& a) { return a; });
  const auto unary = [&](const char* name, auto f) {
    c.def(name, [f](const P& a) { return wrap<P>(f(value(a))); });
  };
  unary("sin", [](auto x) {
    decltype(x) s, k;
    phs::sincos(x, s, k);
    return s;
  });
  unary("cos", [](auto x) {
    decltype(x) s, k;
    phs::sincos(x, s, k);
    return k;
  });
  unary("tan", [](auto x) {
    decltype(x) s, k;
    phs::sincos(x, s, k);
    return s / k;
  });
  unary("sqrt", [](auto x) { return phs::sqrt(x); });
  unary("exp", [](auto x) { return phs::exp(x); });
  unary("log", [](auto x) { return phs::log(x); });
  unary("tanh", [](auto x) { return phs::tanh(x); });
  unary("sinh", [](auto x) { return (phs::exp(x) - phs::exp(-x)) * decltype(x)(0.5); });
  unary("cosh", [](auto x) { return (phs::exp(x) + phs::exp(-x)) * decltype(x)(0.5); });
}

}  // namespace

void bind_scalars(py::module_& m) {
  py::class_<Dual> dual(m, "Dual",
                        R"(Forward-mode derivative along one direction: v + d eps with eps^2 = 0.

Object arrays of it go through systems and laws written in Python; numpy's sin, cos, tan, sqrt, exp, log, tanh, sinh and cosh
take them, those of math do not.)");
  dual.def(py::init<double, double>(), py::arg("v"), py::arg("d") = 0.0)
      .def_readwrite("v", &Dual::v, "Value.")
      .def_readwrite("d", &Dual::d, "Derivative along the seeded direction.");
  arithmetic<Dual>(dual);
  py::class_<QuadNumber> quad(
      m, "Quad", "A 113-bit float, of reference solutions. Like Dual in object arrays.");
  quad.def(py::init([](double v) { return QuadNumber{Quad(v)}; }), py::arg("v"));
  arithmetic<QuadNumber>(quad);
}

}  // namespace porthos::python
