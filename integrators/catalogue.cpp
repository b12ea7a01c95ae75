#include "integrators/catalogue.h"

#include <cmath>

#include "integrators/cvode.h"
#include "integrators/gauss.h"
#include "integrators/rk4.h"
#include "integrators/stormer_verlet.h"

namespace porthos::integrators {
namespace {

constexpr auto yes = Claim::holds, no = Claim::fails;

Entry gauss_entry(std::string name, std::string title, int s) {
  return {{std::move(name), std::move(title), 2 * s, yes, yes, no, no, yes, true,
           "Hairer, Lubich, Wanner 2006, II.1.3; Antonana, Makazaga, Murua 2017 (round-off)"},
          [s](const Declaration& d, const phs::Model& m, double h, const Options& o) {
            return make_gauss(d, s, m, h, o);
          }};
}

std::vector<Entry> make_entries() {
  std::vector<Entry> e;
  for (int s = 8; s >= 1; --s)
    e.push_back(gauss_entry(
        "gauss" + std::to_string(2 * s),
        "Gauss collocation, " + std::to_string(s) + (s == 1 ? " stage" : " stages"), s));
  e.push_back(gauss_entry("midpoint", "implicit midpoint rule", 1));
  e.push_back(
      {{"stormer_verlet", "generalised Stormer-Verlet for mass that depends on q", 2, yes, yes, no,
        no, no, true,
        "Hairer, Lubich, Wanner 2006, VI.3 (3.5); RATTLE multiplier on quaternions, VII.1.4"},
       make_stormer_verlet});
  e.push_back({{"rk4", "classical Runge-Kutta, a baseline that keeps nothing", 4, no, no, no, no,
                no, true, "Kutta 1901"},
               make_rk4});
  e.push_back({{"cvode_adams", "SUNDIALS CVODE, Adams-Moulton, variable step and order (a rival)",
                0, no, no, no, no, no, false, "Hindmarsh et al. 2005"},
               make_cvode_adams});
  e.push_back({{"cvode_bdf", "SUNDIALS CVODE, BDF, variable step and order (a rival)", 0, no, no,
                no, no, no, false, "Hindmarsh et al. 2005"},
               make_cvode_bdf});
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

std::unique_ptr<Integrator> make_integrator(const std::string& method, const phs::Model& model,
                                            double h, const Options& options) {
  if (!std::isfinite(h) || h == 0)
    throw InvalidArgument("step is " + std::to_string(h) +
                          " s, expected a finite number other than 0");
  std::string known;
  for (const auto& e : entries()) {
    if (e.declaration.name == method) return e.make(e.declaration, model, h, options);
    known += (known.empty() ? "" : ", ") + e.declaration.name;
  }
  throw InvalidArgument("unknown method '" + method + "', expected one of " + known);
}

}  // namespace porthos::integrators
