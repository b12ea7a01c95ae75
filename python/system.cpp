// The port-Hamiltonian contract in Python: descriptions, models, their evaluation on numpy arrays,
// the checker.
#include "phs/system/system.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <mutex>

#include "phs/system/check.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

using namespace phs;
using ModelPtr = std::shared_ptr<const Model>;

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_description(py::module_& m) {
  py::enum_<BlockKind>(
      m, "BlockKind",
      "linear: any real number. angle: 2 pi-periodic, kept in (-pi, pi] plus a turn count. "
      "rotation: a "
      "quaternion (w, x, y, z), body to parent, whose conjugate block is its lift.")
      .value("linear", BlockKind::linear)
      .value("angle", BlockKind::angle)
      .value("rotation", BlockKind::rotation);
  py::class_<Block>(m, "Block", "A slice of the state vector.")
      .def(from_keywords<Block>({.name = {},
                                 .kind = BlockKind::linear,
                                 .at = 0,
                                 .size = 1,
                                 .momentum = -1,
                                 .unit = "1",
                                 .momentum_unit = "1"}))
      .def_readwrite("name", &Block::name)
      .def_readwrite("kind", &Block::kind)
      .def_readwrite("at", &Block::at, "Offset of its coordinates in the state.")
      .def_readwrite("size", &Block::size)
      .def_readwrite("momentum", &Block::momentum, "Offset of the conjugate block, -1 for none.")
      .def_readwrite("unit", &Block::unit)
      .def_readwrite("momentum_unit", &Block::momentum_unit);
  py::enum_<PortKind>(
      m, "PortKind",
      "effort in, flow out (a force or torque drives; a rate answers), or the other way round.")
      .value("effort_in", PortKind::effort_in)
      .value("flow_in", PortKind::flow_in);
  py::class_<Port>(m, "Port", "A power port. Sign: u y is the power flowing into the system [W].")
      .def(from_keywords<Port>({.name = {},
                                .kind = PortKind::effort_in,
                                .size = 1,
                                .at = 0,
                                .input_unit = "1",
                                .output_unit = "1"}))
      .def_readwrite("name", &Port::name)
      .def_readwrite("kind", &Port::kind)
      .def_readwrite("size", &Port::size)
      .def_readwrite("at", &Port::at, "Offset of this port in u and in y.")
      .def_readwrite("input_unit", &Port::input_unit)
      .def_readwrite("output_unit", &Port::output_unit)
      .def_readwrite("required", &Port::required,
                     "Means nothing unless it is joined to something.");
  py::enum_<PowerKind>(m, "PowerKind",
                       "supplied adds to the stored energy, dissipated takes away, observed is no "
                       "part of this balance.")
      .value("supplied", PowerKind::supplied)
      .value("dissipated", PowerKind::dissipated)
      .value("observed", PowerKind::observed);
  py::class_<PowerAccount>(m, "PowerAccount", "A power that changes the stored energy.")
      .def(from_keywords<PowerAccount>())
      .def_readwrite("name", &PowerAccount::name)
      .def_readwrite("kind", &PowerAccount::kind)
      .def_readwrite("control", &PowerAccount::control, "A controller's.");
  py::class_<Invariant>(m, "Invariant", "A quantity the unforced, undamped field keeps.")
      .def(from_keywords<Invariant>({.name = {}, .size = 1, .at = 0, .degree = 0, .unit = "1"}))
      .def_readwrite("name", &Invariant::name)
      .def_readwrite("size", &Invariant::size)
      .def_readwrite("at", &Invariant::at, "Offset in the vector of all invariants.")
      .def_readwrite("degree", &Invariant::degree,
                     "1 linear, 2 quadratic in x, 0 any other function.")
      .def_readwrite("unit", &Invariant::unit);
  py::class_<Traits>(m, "Traits")
      .def(from_keywords<Traits>())
      .def_readwrite("autonomous", &Traits::autonomous)
      .def_readwrite("canonical", &Traits::canonical,
                     "x = (q, p) in two halves and J = [0 I; -I 0].")
      .def_readwrite("separable", &Traits::separable, "H = T(p) + V(q).")
      .def_readwrite("quadratic", &Traits::quadratic,
                     "H has at most degree two in the momenta that blocks name.")
      .def_readwrite("lossless", &Traits::lossless, "R = 0.");
  py::class_<Description>(m, "Description",
                          "What a port-Hamiltonian system says of itself. Lists are handed out as "
                          "copies: set them whole.")
      .def(from_keywords<Description>())
      .def_readwrite("name", &Description::name)
      .def_readwrite("nx", &Description::nx, "Numbers in the state.")
      .def_readwrite("nu", &Description::nu, "Numbers in the input, and in the output.")
      .def_readwrite("blocks", &Description::blocks)
      .def_readwrite("ports", &Description::ports)
      .def_readwrite("invariants", &Description::invariants, "Besides H.")
      .def_readwrite("traits", &Description::traits)
      .def_readwrite("storages", &Description::storages, "Parts of H, for the ledger.")
      .def_readwrite(
          "powers", &Description::powers,
          "d/dt sum of storages = sum supplied - sum dissipated, with all open ports at u = 0.")
      .def("invariant_count", &Description::invariant_count)
      .def("__repr__", [](const Description& d) {
        return fmt::format("<porthos.Description '{}': {} states, {} inputs>", d.name, d.nx, d.nu);
      });
}

/// A model with evaluators of its own, for one state and for eight. One evaluation at a time: the
/// lock is taken without the GIL, because a system written in Python takes the GIL inside.
class Evaluator {
 public:
  explicit Evaluator(ModelPtr m) : model_(std::move(m)), one_(model_->instantiate<double>()) {}
  const Description& description() const { return model_->description(); }
  const ModelPtr& model() const { return model_; }
  size_t nx() const { return size_t(description().nx); }
  size_t nu() const { return size_t(description().nu); }
  size_t storages() const { return description().storages.size(); }
  size_t powers() const { return description().powers.size(); }
  size_t invariants() const { return size_t(description().invariant_count()); }

  template <size_t I, class F>
  void run(const Rows& rows, const std::array<Source, I>& in, const Target& out, F f) {
    const py::gil_scoped_release released;
    const std::lock_guard lock(mutex_);
    if (!rows.batched()) {
      std::array<std::span<const double>, I> a;
      for (size_t k = 0; k < I; ++k)
        if (in[k].data) a[k] = {in[k].data, in[k].n};
      return f(*one_, a, std::span<double>(out.data, out.n));
    }
    if (!eight_) eight_ = model_->instantiate<Pack8>();
    Lanes<I, 1> lanes(in, std::array<Target, 1>{{out}});
    lanes.run(
        rows.count(), [&](const auto& a, const auto& b) { f(*one_, a, b[0]); },
        [&](const auto& a, const auto& b) { f(*eight_, a, b[0]); });
  }

 private:
  ModelPtr model_;
  std::unique_ptr<System<double>> one_;
  std::unique_ptr<System<Pack8>> eight_;
  std::mutex mutex_;
};

template <size_t I, class F>
py::array_t<double> evaluate(Evaluator& e, Rows& r, const std::array<Source, I>& in, py::handle out,
                             const Shape& item, F f) {
  auto y = r.out("out", out, item);
  e.run(r, in, {y.mutable_data(), size_of(item)}, f);
  return y;
}
using Size = size_t (Evaluator::*)() const;

/// The methods of x; of x and one more array; of these at a time, which f takes last.
template <class F>
auto of_x(Size result, F f) {
  return [=](Evaluator& e, py::object x, py::object out) {
    Rows r;
    return evaluate(e, r, std::array{r.in("x", x, e.nx())}, out, {long((e.*result)())}, f);
  };
}
template <class F>
auto at_time(const char* second, Size n, bool optional, Size result, F f) {
  return [=](Evaluator& e, double t, py::object x, py::object a, py::object out) {
    Rows r;
    const std::array in{r.in("x", x, e.nx()), r.in(second, a, (e.*n)(), optional)};
    return evaluate(e, r, in, out, {long((e.*result)())},
                    [&](auto& s, const auto& at, auto o) { f(s, at, o, t); });
  };
}
template <class F>
auto of_two(const char* second, Size n, Size result, F f) {
  return [at = at_time(second, n, false, result, f)](Evaluator& e, py::object x, py::object a,
                                                     py::object out) {
    return at(e, 0, std::move(x), std::move(a), std::move(out));
  };
}

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_evaluator(py::module_& m) {
  using py::arg;
  const py::object none = py::none();
  py::class_<Evaluator, std::shared_ptr<Evaluator>>(
      m, "System",
      R"(One system evaluated: an immutable model seen through a workspace of its own. Model.instantiate() makes one.

    x' = (J(x) - R(x)) e + G(x) u,    y = G(x)^T e,    e = dH/dx(x)

Arrays: x, e, dx have nx numbers, u and y have nu; each of one state, or all of n, (n, nx). u left out is zero. Angles
count no turns.)")
      .def_property_readonly("description", &Evaluator::description, py::return_value_policy::copy)
      .def_property_readonly(
          "model", [](const Evaluator& e) { return std::const_pointer_cast<Model>(e.model()); })
      .def(
          "hamiltonian",
          [](Evaluator& e, py::object x, py::object out) -> py::object {
            Rows r;
            auto y = evaluate(e, r, std::array{r.in("x", x, e.nx())}, out, {},
                              [](auto& s, const auto& a, auto o) { o[0] = s.hamiltonian(a[0]); });
            if (!r.batched()) return py::float_(*y.data());
            return y;
          },
          arg("x"), arg("out") = none, "H(x) [J]: a number, or (n,) of a batch.")
      .def("gradient",
           of_x(&Evaluator::nx, [](auto& s, const auto& a, auto o) { s.gradient(a[0], o); }),
           arg("x"), arg("out") = none, "e = dH/dx.")
      .def("field",
           at_time("u", &Evaluator::nu, true, &Evaluator::nx,
                   [](auto& s, const auto& a, auto o, double t) { s.field(t, a[0], a[1], o); }),
           arg("t"), arg("x"), arg("u") = none, arg("out") = none,
           "dx = (J - R) e + G u at time t, plus the system's own sources.")
      .def("rate",
           at_time("e", &Evaluator::nx, false, &Evaluator::nx,
                   [](auto& s, const auto& a, auto o, double t) { s.rate(t, a[0], a[1], o); }),
           arg("t"), arg("x"), arg("e"), arg("out") = none,
           "The field for any efforts e instead of dH/dx(x), as discrete gradients put them in.")
      .def("apply_structure",
           of_two("e", &Evaluator::nx, &Evaluator::nx,
                  [](auto& s, const auto& a, auto o, double) { s.apply_structure(a[0], a[1], o); }),
           arg("x"), arg("e"), arg("out") = none, "J(x) e, for any e.")
      .def("apply_dissipation",
           of_two(
               "e", &Evaluator::nx, &Evaluator::nx,
               [](auto& s, const auto& a, auto o, double) { s.apply_dissipation(a[0], a[1], o); }),
           arg("x"), arg("e"), arg("out") = none, "R(x) e, for any e. Zero for a lossless system.")
      .def("apply_input",
           of_two("u", &Evaluator::nu, &Evaluator::nx,
                  [](auto& s, const auto& a, auto o, double) { s.apply_input(a[0], a[1], o); }),
           arg("x"), arg("u"), arg("out") = none, "G(x) u.")
      .def("output",
           of_two("e", &Evaluator::nx, &Evaluator::nu,
                  [](auto& s, const auto& a, auto o, double) { s.output(a[0], a[1], o); }),
           arg("x"), arg("e"), arg("out") = none, "y = G(x)^T e.")
      .def("stored",
           of_x(&Evaluator::storages, [](auto& s, const auto& a, auto o) { s.stored(a[0], o); }),
           arg("x"), arg("out") = none, "The energy in each of description.storages [J].")
      .def("powers",
           at_time("e", &Evaluator::nx, false, &Evaluator::powers,
                   [](auto& s, const auto& a, auto o, double t) { s.powers(t, a[0], a[1], o); }),
           arg("t"), arg("x"), arg("e"), arg("out") = none,
           "Each of description.powers at the efforts e [W].")
      .def("invariants",
           of_x(&Evaluator::invariants,
                [](auto& s, const auto& a, auto o) { s.invariants(a[0], o); }),
           arg("x"), arg("out") = none, "The declared invariants, one after another.");
}

void bind_check(py::module_& m) {
  py::class_<AxiomResult>(
      m, "AxiomResult",
      "One axiom: the worst relative violation found and the state where it was found.")
      .def_readonly("axiom", &AxiomResult::axiom)
      .def_readonly("worst", &AxiomResult::worst)
      .def_readonly("limit", &AxiomResult::limit)
      .def_readonly("state", &AxiomResult::state)
      .def_readonly("why_not", &AxiomResult::why_not,
                    "Why it could not be tried; empty: it was tried.")
      .def("applies", &AxiomResult::applies)
      .def_property_readonly("holds", &AxiomResult::holds)
      .def("__repr__", [](const AxiomResult& a) {
        if (!a.applies()) return fmt::format("<{}: not applicable, {}>", a.axiom, a.why_not);
        return fmt::format("<{}: {:.2g}, limit {:.2g}>", a.axiom, a.worst, a.limit);
      });
  py::class_<CheckReport>(m, "CheckReport")
      .def_readonly("axioms", &CheckReport::axioms)
      .def_property_readonly("holds", &CheckReport::holds)
      .def("text", &CheckReport::text,
           "One line per axiom; a violated one names the worst value, the limit and the state.")
      .def("__str__", &CheckReport::text)
      .def("__bool__", &CheckReport::holds);
  m.def(
      "check",
      [](const ModelPtr& model, int samples, double spread, double tolerance, std::uint64_t seed) {
        const py::gil_scoped_release released;
        return check(*model, {samples, spread, tolerance, seed, {}});
      },
      py::arg("model"), py::kw_only(), py::arg("samples") = 32, py::arg("spread") = 1.0,
      py::arg("tolerance") = 1e-11, py::arg("seed") = 1,
      R"(Checks the axioms at random states: J skew, R symmetric and >= 0, e = dH/dx against forward duals, field = rate(e) + Gu,
the storages' sum against H, H' = y u + supplied - dissipated, no dissipated power below 0, and the declared invariants.

States are normal with deviation `spread`; rotation blocks are unit quaternions. tolerance: relative to the sizes of the
terms compared. Cost: about 3 nx evaluations per sample.)");
}

/// A model as notebooks show it: its sizes, ports and invariants.
std::string html_of(const Model& model) {
  const auto escape = py::module_::import("html").attr("escape");
  const auto safe = [&](const std::string& text) {
    return py::str(escape(text)).cast<std::string>();
  };
  const auto& d = model.description();
  std::string rows =
      fmt::format("<p><b>{}</b>: {} states, {} inputs</p><table>", safe(d.name), d.nx, d.nu);
  const auto add = [&](const char* kind, const std::string& name, const std::string& what) {
    rows += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td></tr>", kind, safe(name), safe(what));
  };
  for (const auto& p : d.ports) add("port", p.name, p.input_unit + " → " + p.output_unit);
  for (const auto& i : d.invariants) add("invariant", i.name, i.unit);
  for (const auto& c : d.constraints) add("constraint", c.name, c.kind);
  return rows + "</table>";
}
}  // namespace

void bind_system(py::module_& m) {
  bind_description(m);
  py::class_<Model, std::shared_ptr<Model>> model(
      m, "Model", "A port-Hamiltonian system: immutable, shared by threads.");
  bind_evaluator(m);
  model.def_property_readonly("description", &Model::description, py::return_value_policy::copy)
      .def("__repr__",
           [](const Model& p) {
             const auto& d = p.description();
             return fmt::format("<porthos.Model '{}': {} states, {} inputs>", d.name, d.nx, d.nu);
           })
      .def("_repr_html_", &html_of)
      .def(
          "instantiate", [](const ModelPtr& p) { return std::make_shared<Evaluator>(p); },
          "The evaluator: hamiltonian, gradient, field and the rest on numpy arrays.");
  bind_check(m);
}

}  // namespace porthos::python
