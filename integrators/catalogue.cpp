#include "integrators/catalogue.h"

#include <cmath>

#include "integrators/cvode.h"
#include "integrators/gauss.h"
#include "integrators/rk4.h"
#include "integrators/stormer_verlet.h"

namespace porthos::integrators {
namespace {

constexpr auto yes = Claim::holds;

/// A maker for every scalar out of a function template.
#define PORTHOS_MAKER(function)                                             \
  [](const Declaration& d, const phs::Model& m, auto h, const Options& o) { \
    return function(d, m, h, o);                                            \
  }

Entry gauss_entry(std::string name, std::string title, int s) {
  return entry({.name = std::move(name),
                .title = std::move(title),
                .family = "Gauss collocation",
                .order = 2 * s,
                .symmetric = yes,
                .symplectic = yes,
                .quadratic_invariants = yes,
                .source = "Hairer, Lubich, Wanner 2006, II.1.3; Antonana, Makazaga, Murua 2017 "
                          "(round-off)"},
               [s](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
                 return make_gauss(d, s, m, h, o);
               });
}

void add_gauss(std::vector<Entry>& e) {
  for (int s = 8; s >= 1; --s)
    e.push_back(gauss_entry(
        "gauss" + std::to_string(2 * s),
        "Gauss collocation, " + std::to_string(s) + (s == 1 ? " stage" : " stages"), s));
  e.push_back(gauss_entry("midpoint", "implicit midpoint rule", 1));
}

void add_partitioned(std::vector<Entry>& e) {
  e.push_back(entry({.name = "stormer_verlet",
                     .title = "generalised Stormer-Verlet for mass that depends on q",
                     .family = "Partitioned",
                     .order = 2,
                     .symmetric = yes,
                     .symplectic = yes,
                     .needs = {.canonical = true, .lossless = true},
                     .source = "Hairer, Lubich, Wanner 2006, VI.3 (3.5); RATTLE multiplier on "
                               "quaternions, VII.1.4"},
                    PORTHOS_MAKER(make_stormer_verlet)));
}

void add_baselines(std::vector<Entry>& e) {
  e.push_back(entry({.name = "rk4",
                     .title = "classical Runge-Kutta, a baseline that keeps nothing",
                     .family = "Baselines",
                     .order = 4,
                     .source = "Kutta 1901"},
                    PORTHOS_MAKER(make_rk4)));
}

void add_rivals(std::vector<Entry>& e) {
  const auto rival = [&](std::string name, std::string title, std::string source, auto make) {
    e.push_back(double_entry({.name = std::move(name),
                              .title = std::move(title),
                              .family = "Rivals",
                              .resumable = false,
                              .rival = true,
                              .source = std::move(source)},
                             make));
  };
  rival("cvode_adams", "SUNDIALS CVODE, Adams-Moulton, variable step and order",
        "Hindmarsh et al. 2005", make_cvode_adams);
  rival("cvode_bdf", "SUNDIALS CVODE, BDF, variable step and order", "Hindmarsh et al. 2005",
        make_cvode_bdf);
}

std::vector<Entry> make_entries() {
  std::vector<Entry> e;
  add_gauss(e);
  add_partitioned(e);
  add_baselines(e);
  add_rivals(e);
  return e;
}

}  // namespace

const char* to_string(Claim c) {
  return c == Claim::holds ? "holds" : c == Claim::fails ? "fails" : "unknown";
}

const char* to_string(Outcome o) {
  switch (o) {
    case Outcome::ok:
      return "ok";
    case Outcome::not_converged:
      return "the implicit equations did not converge: take a smaller step";
    case Outcome::not_finite:
      return "the state became infinite or not a number";
    case Outcome::failed:
      return "the method gave up";
  }
  return "unknown";
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = make_entries();
  return all;
}

const std::vector<Declaration>& catalogue() {
  static const std::vector<Declaration> all = [] {
    std::vector<Declaration> d;
    for (const auto& e : entries()) d.push_back(e.declaration);
    return d;
  }();
  return all;
}

const Entry& entry_of(const std::string& method) {
  std::string known;
  for (const auto& e : entries()) {
    if (e.declaration.name == method) return e;
    known += (known.empty() ? "" : ", ") + e.declaration.name;
  }
  throw InvalidArgument("unknown method '" + method + "', expected one of " + known);
}
const Declaration& declaration_of(const std::string& method) {
  return entry_of(method).declaration;
}

std::optional<std::string> misfit(const Declaration& d, const phs::Description& system) {
  const auto& traits = system.traits;
  bool quaternions = false;
  for (const auto& b : system.blocks) quaternions |= b.kind == phs::BlockKind::rotation;
  const char* lacks =
      d.needs.canonical && !traits.canonical   ? "a canonical system"
      : d.needs.lossless && !traits.lossless   ? "a system without dissipation"
      : d.needs.separable && !traits.separable ? "a separable Hamiltonian T(p) + V(q)"
      : d.needs.linear_state && quaternions    ? "a system without quaternion blocks"
      : d.needs.flows && system.flows.empty() && !(traits.canonical && traits.separable)
          ? "a system that offers partial flows or has a separable Hamiltonian"
          : nullptr;
  if (!lacks) return std::nullopt;
  return "method '" + d.name + "' needs " + lacks + ", '" + system.name + "' is not one";
}

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_basic_integrator(const std::string& method,
                                                          const phs::Model& model, T h,
                                                          const Options& options) {
  const double step = phs::to_double(h);
  if (!std::isfinite(step) || step == 0)
    throw InvalidArgument("step is " + std::to_string(step) +
                          " s, expected a finite number other than 0");
  const Entry& e = entry_of(method);
  if (const auto reason = misfit(e.declaration, model.description()))
    throw InvalidArgument(*reason);
  if (!e.make<T>()) throw InvalidArgument("method '" + method + "' works in double only");
  return e.make<T>()(e.declaration, model, h, options);
}
#define PORTHOS_INSTANTIATE(T)                                           \
  template std::unique_ptr<BasicIntegrator<T>> make_basic_integrator<T>( \
      const std::string&, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)

}  // namespace porthos::integrators
