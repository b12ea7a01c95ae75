// Systems, laws and functions written in Python, as models, laws and functions of the C++ side.
#include "phs/system/user_model.h"
#include "phs/scalars/derivative.h"

#include <pybind11/stl.h>

#include <atomic>

#include "phs/functions/function.h"
#include "phs/functions/law.h"
#include "phs/system/time_scale.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using phs::Dual;

/// Calls f(lane) for every lane; for packs each lane is an evaluation in double.
template <class T, class F>
void each_lane(F f) {
  for (int lane = 0; lane < phs::lanes<T>; ++lane) f(lane);
}

template <class T>
using Plain = std::conditional_t<phs::is_pack<T>, double, T>;

template <class T>
py::object lane_array(std::span<const T> x, int lane) {
  if constexpr (!phs::is_pack<T>) {
    (void)lane;
    return to_python(x);
  } else {
    std::vector<double> v(x.size());
    for (size_t i = 0; i < v.size(); ++i) v[i] = x[i][lane];
    return to_python(std::span<const double>(v));
  }
}

template <class T>
void put_lane(py::handle result, std::span<T> out, int lane, const std::string& who) {
  if constexpr (!phs::is_pack<T>) {
    (void)lane;
    from_python<T>(result, out, who);
  } else {
    std::vector<double> v(out.size());
    from_python<double>(result, std::span<double>(v), who);
    for (size_t i = 0; i < v.size(); ++i) out[i].set(lane, v[i]);
  }
}

template <class T>
void put_lane(py::handle result, T& out, int lane, const std::string& who) {
  if constexpr (!phs::is_pack<T>) {
    (void)lane;
    out = from_python<T>(result, who);
  } else
    out.set(lane, from_python<double>(result, who));
}

/// An object with the methods of phs/system/user_model.h, which return what the C++ methods write.
/// Missing methods have the same defaults. Every evaluation takes the GIL.
class PythonSystem {
 public:
  explicit PythonSystem(py::object object) {
    const auto has = [&](const char* name) { return py::hasattr(object, name); };
    for (const char* needed : {"description", "hamiltonian"})
      if (!has(needed))
        throw InvalidArgument("a system needs the method " + std::string(needed) + "(" +
                              (std::string(needed) == "hamiltonian" ? "x" : "") + "), which " +
                              kind_of(object) + " does not have");
    description_ = object.attr("description")().cast<phs::Description>();
    gradient_ = has("gradient");
    structure_ = has("structure");
    dissipation_ = has("dissipation");
    input_ = has("input");
    drive_ = has("drive");
    invariants_ = has("invariants");
    stored_ = has("stored");
    powers_ = has("powers");
    flow_ = has("flow");
    auto& d = description_;
    if (!structure_ && d.nx % 2 != 0)
      throw InvalidArgument("system '" + d.name + "' has " + std::to_string(d.nx) +
                            " states and no structure(x, e), expected an even number for the "
                            "canonical one");
    if (!input_ && d.nu > 0)
      throw InvalidArgument("system '" + d.name + "' has " + std::to_string(d.nu) +
                            " inputs, expected a method input(x, u)");
    if (!invariants_ && !d.invariants.empty())
      throw InvalidArgument("system '" + d.name +
                            "' declares invariants, expected a method invariants(x)");
    if (!powers_) {
      d.powers.clear();
      if (dissipation_ && !d.traits.lossless)
        d.powers.push_back({"dissipation", phs::PowerKind::dissipated});
      if (drive_) d.powers.push_back({"drive", phs::PowerKind::supplied});
    }
    object_ = keep(std::move(object));
  }

  phs::Description description() const { return description_; }

  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const py::gil_scoped_acquire gil;
    T H;
    each_lane<T>(
        [&](int l) { put_lane(call("hamiltonian", lane_array(x, l)), H, l, who("hamiltonian")); });
    return H;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    if (gradient_) return evaluate("gradient", e, x);
    if constexpr (phs::has_gradient_by_duals<T>) {
      const py::gil_scoped_acquire gil;
      std::vector<Dual> d(x.size());
      const auto H = [&](std::span<const Dual> y) {
        return from_python<Dual>(call("hamiltonian", to_python(y)), who("hamiltonian"));
      };
      phs::gradient_by_duals<T>(H, x, d, e);
    } else {
      throw InvalidArgument("system '" + description_.name +
                            "' has no gradient(x), expected a gradient(x) for compare, monodromy, "
                            "derivatives and 113 bits: duals replace it in double only");
    }
  }
  template <class T>
  void structure(std::span<const T> x, std::span<const T> e, std::span<T> Je) const {
    if (structure_) return evaluate("structure", Je, x, e);
    const size_t n = e.size() / 2;
    for (size_t i = 0; i < n; ++i) {
      Je[i] = e[n + i];
      Je[n + i] = -e[i];
    }
  }
  template <class T>
  void dissipation(std::span<const T> x, std::span<const T> e, std::span<T> Re) const {
    if (dissipation_) return evaluate("dissipation", Re, x, e);
    for (T& r : Re) r = T(0.0);
  }
  template <class T>
  void input(std::span<const T> x, std::span<const T> u, std::span<T> Gu) const {
    if (input_) return evaluate("input", Gu, x, u);
    for (T& g : Gu) g = T(0.0);
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    if (!drive_) return;
    std::vector<T> d(dx.size());
    timed("drive", t, std::span<T>(d), x);
    for (size_t i = 0; i < dx.size(); ++i) dx[i] = dx[i] + d[i];
  }
  template <class T>
  void invariants(std::span<const T> x, std::span<T> values) const {
    if (invariants_) evaluate("invariants", values, x);
  }
  template <class T>
  void stored(std::span<const T> x, std::span<T> values) const {
    if (stored_) return evaluate("stored", values, x);
    values[0] = hamiltonian(x);
  }
  template <class T>
  void powers(T t, std::span<const T> x, std::span<const T> e, std::span<T> values) const {
    if (powers_) return timed("powers", t, values, x, e);
    size_t k = 0;
    std::vector<T> w(x.size());
    const auto along = [&] {
      T sum(0.0);
      for (size_t i = 0; i < w.size(); ++i) sum = sum + e[i] * w[i];
      return sum;
    };
    if (dissipation_ && !description_.traits.lossless) {
      dissipation(x, e, std::span<T>(w));
      values[k++] = along();
    }
    if (drive_) {
      timed("drive", t, std::span<T>(w), x);
      values[k] = along();
    }
  }
  template <class T>
  void flow(int k, T t, T h, std::span<T> x) const {
    if (!flow_)
      throw InvalidArgument("system '" + description_.name + "' has no partial flow " +
                            std::to_string(k));
    const py::gil_scoped_acquire gil;
    const std::vector<T> before(x.begin(), x.end());
    each_lane<T>([&](int l) {
      put_lane(call("flow", py::int_(k), to_python(phs::lane_of(t, l)),
                    to_python(phs::lane_of(h, l)), lane_array(std::span<const T>(before), l)),
               x, l, who("flow"));
    });
  }

 private:
  std::string who(const char* method) const {
    return "system '" + description_.name + "': " + method;
  }
  template <class... A>
  py::object call(const char* method, A&&... a) const {
    return py::handle(object_.get()).attr(method)(std::forward<A>(a)...);
  }
  template <class T, class... A>
  void evaluate(const char* method, std::span<T> out, A... a) const {
    const py::gil_scoped_acquire gil;
    each_lane<T>([&](int l) { put_lane(call(method, lane_array(a, l)...), out, l, who(method)); });
  }
  template <class T, class... A>
  void timed(const char* method, T t, std::span<T> out, A... a) const {
    const py::gil_scoped_acquire gil;
    each_lane<T>([&](int l) {
      put_lane(call(method, to_python(phs::lane_of(t, l)), lane_array(std::span<const T>(a), l)...),
               out, l, who(method));
    });
  }

  Kept object_;
  phs::Description description_;
  bool gradient_ = false, structure_ = false, dissipation_ = false, input_ = false, drive_ = false;
  bool invariants_ = false, stored_ = false, powers_ = false, flow_ = false;
};

/// u = f(t, x, y). A law that remembers something is seen by its first evaluations: they are asked
/// for twice.
class PythonLaw {
 public:
  explicit PythonLaw(Kept f) : f_(std::move(f)) {}

  void operator()(double t, std::span<const double> x, std::span<const double> y,
                  std::span<double> u) const {
    evaluate(t, x, y, u);
    if (asked_->load(std::memory_order_relaxed) >= 4) return;
    ++*asked_;
    std::vector<double> again(u.size());
    evaluate(t, x, y, std::span<double>(again));
    for (size_t k = 0; k < u.size(); ++k)
      if (again[k] != u[k] && (again[k] == again[k] || u[k] == u[k]))
        throw phs::LawFailure(
            "the law gives " + porthos::number(u[k], 6) + " and then " +
            porthos::number(again[k], 6) +
            " for the same t, x and y: it remembers something, expected a function of these alone, "
            "or Network.control(name, [ports], object, period=...)");
  }
  template <class T>
  void operator()(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u) const {
    evaluate(t, x, y, u);
  }

 private:
  template <class T>
  void evaluate(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u) const {
    const py::gil_scoped_acquire gil;
    each_lane<T>([&](int l) {
      put_lane(
          py::handle(f_.get())(to_python(phs::lane_of(t, l)), lane_array(x, l), lane_array(y, l)),
          u, l, "the law");
    });
  }

  Kept f_;
  std::shared_ptr<std::atomic<int>> asked_ = std::make_shared<std::atomic<int>>(0);
};

/// y = f(x).
struct PythonFunction {
  Kept f;
  template <class T>
  T operator()(const T& x) const {
    const py::gil_scoped_acquire gil;
    T y;
    each_lane<T>([&](int l) {
      put_lane(py::handle(f.get())(to_python(phs::lane_of(x, l))), y, l, "the function");
    });
    return y;
  }
};

}  // namespace

void bind_user_model(py::module_& m) {
  using phs::Function;
  using phs::Law;
  using UserModel = phs::UserModel<PythonSystem>;
  py::class_<UserModel, phs::Model, std::shared_ptr<UserModel>>(
      m, "UserModel",
      R"(Makes a Model out of an object with two methods:

    description() -> Description
    hamiltonian(x) -> number

and any of these, which return what they give (x, e, u are arrays; a method that is missing has the default):

    gradient(x)           dH/dx                                  default: duals of hamiltonian
    structure(x, e)       J(x) e                                 default: canonical
    dissipation(x, e)     R(x) e                                 default: zero
    input(x, u)           G(x) u                                 default: no ports
    drive(t, x)           what the field has besides             default: none
    invariants(x)         the declared ones                      default: none declared
    flow(k, t, h, x)      x moved by the exact flow of part k    default: none
    stored(x)             the energy in each storage             default: one storage, H
    powers(t, x, e)       the declared powers                    default: dissipation and drive, where there are such

y = G^T e is derived from `input`, so ports are collocated by construction. Arrays are of float64 in runs, of longdouble where
errors are measured, and object arrays of Dual and Quad in checks and references: write the mathematics with operators
and numpy's sin, cos, sqrt, exp, log, tanh. compare, monodromy and gradient need gradient(x).

Raises InvalidArgument for blocks outside of x, ports outside of u, slices that overlap, and methods that are missing.)")
      .def(py::init([](py::object system) {
             return std::make_shared<UserModel>(PythonSystem(std::move(system)));
           }),
           py::arg("system"));

  // NOLINTNEXTLINE(bugprone-unused-raii): it registers the type.
  py::class_<Law, std::shared_ptr<Law>>(m, "Law",
                                        "u = kappa(t, x, y): a controller's, see Network.control.");
  m.def(
      "law",
      [](py::function f) {
        return std::const_pointer_cast<Law>(phs::law(PythonLaw(keep(std::move(f)))));
      },
      py::arg("f"),
      "f(t, x, y) -> u as a Law: x the state of the system it acts on, y the output of its port, u "
      "the input there. A function of these alone: InvalidArgument in the run if it gives two "
      "answers. See "
      "UserModel for what the arrays hold; of laws that remember see Network.control.");
  py::class_<Function, std::shared_ptr<Function>>(
      m, "Function", "y = f(x): a law of an element, or a signal v(t).")
      .def(
          "__call__", [](const Function& f, double x) { return f(x); }, py::arg("x"));
  m.def(
      "function",
      [](py::function f) {
        return std::const_pointer_cast<Function>(phs::function(PythonFunction{keep(std::move(f))}));
      },
      py::arg("f"), "f(x) -> number as a Function, in every scalar; see UserModel.");
}

}  // namespace porthos::python
