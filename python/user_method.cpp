// A method of integration written in Python, as an entry of the catalogue.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>

#include "integrators/catalogue.h"
#include "integrators/claims.h"
#include "integrators/core/stagnation.h"  // magnitude
#include "python/bind.h"
#include "python/keywords.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using namespace integrators;

/// What step() gets as x cannot be changed: in place, x(t + h) - x(t) would be zero.
py::object read_only(py::object array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

/// x moves by step(field, t, x, h). Every step takes the GIL.
template <class T>
class PythonMethod final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;

 public:
  PythonMethod(const Declaration& d, const phs::Model& m, T h, const Options& o, Kept step)
      : Base(d, m, h, o),
        step_(std::move(step)),
        who_("method '" + d.name + "'"),
        field_(std::make_shared<Field>(Field{this, std::vector<T>(this->n_)})),
        move_(this->n_) {
    const py::gil_scoped_acquire gil;
    called_ = keep(
        py::cpp_function([field = field_](py::object t, py::object x) { return field->at(t, x); }));
  }
  ~PythonMethod() override { field_->of = nullptr; }

  Outcome advance(T t, T h, typename Base::State& s) override {
    if constexpr (std::is_same_v<T, double>)
      if (!tried_) try_short_step(t, h, s);
    {
      const py::gil_scoped_acquire gil;
      call(t, h, s.x);
    }
    for (const T& d : move_)
      if (!(magnitude(d) < HUGE_VAL)) return Outcome::not_finite;
    for (size_t i = 0; i < this->n_; ++i) phs::compensated_add(s.x[i], s.lo[i], move_[i]);
    return Outcome::ok;
  }

 private:
  /// Sets move_.
  void call(T t, T h, std::span<const T> x) {
    py::object moved;
    try {
      moved = py::handle(step_.get())(py::handle(called_.get()), to_python(t),
                                      read_only(to_python(x)), to_python(h));
    } catch (py::error_already_set& e) {
      tell_place(e, phs::to_double(t));
      throw;
    }
    from_python<T>(moved, move_, who_);
  }
  /// An exception of the method gets its name, the time and the line.
  void tell_place(py::error_already_set& e, double t) const {
    if (!e.matches(PyExc_Exception)) return;  // as KeyboardInterrupt
    if (e.trace()) PyException_SetTraceback(e.value().ptr(), e.trace().ptr());
    py::module_::import("porthos.arguments").attr("tell_place")(e.value(), who_, t);
  }

  /// A change goes to 0 with h, as h f(x) does; what goes to x is the new state in its place.
  void try_short_step(double t, double h, typename Base::State& s) {
    tried_ = true;
    const Cost before = this->cost_;
    const double small = 1e-9 * h;
    std::vector<double> rates(this->n_), later(this->n_), ahead(s.x.begin(), s.x.end());
    this->system_->field(t, s.x, {}, rates);
    for (size_t i = 0; i < this->n_; ++i) ahead[i] += small * rates[i];
    this->system_->field(t + small, ahead, {}, later);
    const py::gil_scoped_acquire gil;
    call(t, small, s.x);
    const std::vector<T> first = move_;
    call(t, h, s.x);  // a method with a memory goes on from the end of this step
    std::vector<T> end(s.x.begin(), s.x.end());
    for (size_t i = 0; i < this->n_; ++i) end[i] += move_[i];
    if (std::all_of(end.begin(), end.end(), [](T x) { return std::isfinite(x); }))
      call(t + h, h, end);
    call(t, small, s.x);
    this->cost_ = before;
    double size = 0;
    for (const double x : s.x) size = std::fmax(size, std::fabs(x));
    bool is_state = size > 0;
    for (size_t i = 0; i < this->n_; ++i)
      is_state = is_state && std::fabs(move_[i] - s.x[i]) <= 1e-6 * size;  // false of NaN
    if (is_state)
      throw InvalidArgument(who_ +
                            " gives the new state x(t + h), expected the change x(t + h) - "
                            "x(t)");
    double off = 0, expected = 0, changed = 0,
           bent = 0;  // bent: by what the rates change meanwhile
    for (size_t i = 0; i < this->n_; ++i) {
      bent = std::fmax(bent, std::fabs(small * (later[i] - rates[i])));
      changed = std::fmax(changed, std::fabs(move_[i] - first[i]));
      off = std::fmax(off, std::fabs(move_[i] - small * rates[i]));
      expected = std::fmax(expected, std::fabs(small * rates[i]));
    }
    if (changed > 1e-6 * (expected + bent) + 0x1p-48 * size)
      throw InvalidArgument(who_ +
                            " gives another change when it is called again, expected one that "
                            "depends on its arguments alone: a method keeps no memory of steps");
    if (off > 0.5 * expected + bent + 0x1p-48 * size)  // 16 roundings of x
      throw InvalidArgument(fmt::format(
          "{}, tried with h = {:.3g} s, gives a change that differs from h times the rates "
          "field(t, x) by {:.2g}, and these are {:.2g}: expected nearly the same of a method of "
          "order 1 or more",
          who_, small, off, expected));
  }

  /// Python code may keep it longer than its method lives.
  struct Field {
    PythonMethod* of;
    std::vector<T> x;

    py::object at(py::handle time, py::handle state) {
      if (!of) throw InvalidArgument("the field belongs to a run that is over");
      const T t = from_python<T>(time, of->who_ + ", which calls field(t, x): t");
      from_python<T>(state, std::span<T>(x), of->who_ + ", which calls field(t, x): x");
      std::vector<T> dx(x.size());
      of->system_->field(t, x, {}, dx);
      ++of->cost_.evaluations;
      return to_python(std::span<const T>(dx));
    }
  };

  Kept step_, called_;
  std::string who_;
  std::shared_ptr<Field> field_;
  std::vector<T> move_;
  bool tried_ = false;  ///< whether it was looked at what it gives
};

/// Of the names that Python gives.
Needs needs_of(const std::vector<std::string>& names) {
  Needs needs;
  const std::pair<const char*, bool*> known[] = {{"canonical", &needs.canonical},
                                                 {"lossless", &needs.lossless},
                                                 {"separable", &needs.separable},
                                                 {"linear_state", &needs.linear_state}};
  for (const auto& name : names) {
    const auto found = std::ranges::find(known, name, [](const auto& k) { return k.first; });
    if (found == std::end(known))
      throw InvalidArgument("needs has '" + name +
                            "', expected canonical, lossless, separable or linear_state");
    *found->second = true;
  }
  return needs;
}

Claim claim(bool holds) { return holds ? Claim::holds : Claim::unknown; }

}  // namespace

void bind_user_method(py::module_& m) {
  m.def(
      "add_method",
      [](const std::string& name, py::function step, int order, const std::string& title,
         bool symmetric, bool symplectic, bool quadratic_invariants, bool energy_exact,
         const std::vector<std::string>& needs) {
        if (order < 1)
          throw InvalidArgument(
              fmt::format("the order of '{}' is {}, expected 1 or more", name, order));
        const auto version = py::module_::import("porthos.fingerprints").attr("of")(step);
        add_entry(entry({.name = name,
                         .title = title.empty() ? name + ", a method in Python" : title,
                         .family = "Methods in Python",
                         .order = order,
                         .symmetric = claim(symmetric),
                         .symplectic = claim(symplectic),
                         .energy_exact = claim(energy_exact),
                         .quadratic_invariants = claim(quadratic_invariants),
                         .needs = needs_of(needs)},
                        [step = keep(step)]<class T>(const Declaration& d, const phs::Model& model,
                                                     T h, const Options& o) {
                          return std::make_unique<PythonMethod<T>>(d, model, h, o, step);
                        }),
                  version.cast<std::string>());
      },
      py::arg("name"), py::arg("step"), py::kw_only(), py::arg("order"), py::arg("title") = "",
      py::arg("symmetric") = false, py::arg("symplectic") = false,
      py::arg("quadratic_invariants") = false, py::arg("energy_exact") = false,
      py::arg("needs") = std::vector<std::string>{},
      R"(Adds a method of integration of your own to those of scenes, simulate() and compare().

step(field, t, x, h) returns x(t + h) - x(t), an array (nx,): the difference keeps the digits that x + difference would lose. t
[s] and h [s] are numbers, h also negative; x is a read-only array (nx,) of state numbers; field(t, x) returns their rates (nx,). A
step may depend on its arguments alone. In derivatives and 113-bit references the arrays hold Dual or Quad numbers: write
the step with operators and numpy's functions. symmetric and energy_exact are checked by
verify(), all claims by check_method(); else a run or compare() tells what contradicts them. needs: what
a system must have, of "canonical" (x = (q, p) in two halves), "lossless", "separable" (H = T(p) + V(q)) and "linear_state" (no
quaternions); others are refused in one sentence. A second call with the same name replaces the method; a run
by the one before is not resumed by another (see method_version). One step costs some microseconds for Python beside its evaluations. Raises InvalidArgument for the name of a method of Porthos.)");
  py::class_<ClaimResult>(m, "ClaimResult", "One claim of a method, as it shows on a system.")
      .def_readonly("claim", &ClaimResult::claim)
      .def_readonly("declared", &ClaimResult::declared)
      .def_readonly("measured", &ClaimResult::measured, "The error; of the order, the order.")
      .def_readonly("bound", &ClaimResult::bound,
                    "The largest error, the smallest order of what holds.")
      .def_readonly("why_not", &ClaimResult::why_not,
                    "Why it could not be measured; empty if it was.")
      .def_property_readonly("holds", &ClaimResult::holds, "Whether what is declared shows.");
  py::class_<ClaimReport>(m, "ClaimReport", "What check_method() found, for print().")
      .def_readonly("claims", &ClaimReport::claims)
      .def_property_readonly("holds", &ClaimReport::holds,
                             "All declared claims do; False too where the steps break down.")
      .def("__str__", &ClaimReport::text)
      .def("__repr__", &ClaimReport::text);
  m.def(
      "check_method",
      [](const std::string& method, const std::shared_ptr<const phs::Model>& model,
         const py::object& start, double step) {
        return check_claims(method, *model,
                            numbers("start", start, size_t(model->description().nx)), step);
      },
      py::arg("method"), py::arg("model"), py::arg("start"), py::kw_only(), py::arg("step"),
      R"(Measures what a method claims, one of your own too, on a model from a start: order, symmetry, symplecticity by the exact
derivative of two steps, quadratic invariants, energy, of systems with losses or sources the balance. step [s]: as long as runs have, for the errors of a false claim shrink
with it. A claim that holds here need not hold on every system.)");
  m.def("method_version", &version_of, py::arg("method"),
        "Of a method that was added: the digest of its code, with the numbers, arrays and "
        "functions that it uses; it ends in "
        "'not checked' where it uses other objects, whose change a resumed run does not see. "
        "Empty: a method of Porthos.");
}

}  // namespace porthos::python
