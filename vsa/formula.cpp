#include "vsa/formula.h"

#include <algorithm>

#include "phs/functions/formula.h"
#include "vsa/elastic-inl.h"

namespace porthos::vsa {
namespace {

[[noreturn]] void refuse_formula(const std::string& why) {
  throw InvalidArgument("formula: " + why);
}

struct FormulaEnergy {
  phs::Formula formula;
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T variables[] = {phi, sigma};
    return formula.at(std::span<const T>(variables));
  }
};

phs::Formula parsed(const Formula& p) {
  try {
    return {p.energy, {"phi", "sigma"}, p.parameters};
  } catch (const InvalidArgument& e) {
    refuse_formula(std::string("the energy ") + e.what());
  }
}

/// Refuses a place where the energy is not finite or the stiffness is negative.
void check_places(const Elastic& e, bool with_sigma) {
  constexpr int deflections = 201, sigmas = 21;
  const Limits& l = e.traits().limits;
  const double most = std::min(l.deflection, M_PI);
  double softest = HUGE_VAL, stiffest = 0, phi_there = 0, sigma_there = 0;
  for (int j = 0; j < (with_sigma ? sigmas : 1); ++j)
    for (int i = 0; i < deflections; ++i) {
      const double phi = most * (2.0 * i / (deflections - 1) - 1);
      const double sigma =
          with_sigma ? l.sigma_lower + (l.sigma_upper - l.sigma_lower) * j / (sigmas - 1) : 0;
      const auto place = [&] {
        return fmt::format(" at phi = {:.4g} rad{}", phi,
                           with_sigma ? fmt::format(" and sigma = {:.4g}", sigma) : "");
      };
      const char* const expected =
          "expected a finite number over the range of the limits (of phi: ± pi without a limit)";
      const auto finite = [&](const char* what, double x) {
        if (!std::isfinite(x))
          refuse_formula(
              fmt::format("the {} is {}{}, {}", what, std::isnan(x) ? NAN : x, place(), expected));
      };
      const auto s = e.slopes(phi, 0.0, sigma);
      const auto H = e.hessian(phi, 0.0, sigma);
      finite("energy", e.energy(phi, 0.0, sigma));
      finite("torque", s.q);
      finite("effort of sigma", s.sigma);
      finite("stiffness", H[0][0]);
      finite("derivative of the torque by sigma", H[0][2]);
      finite("second derivative by sigma", H[2][2]);
      stiffest = std::max(stiffest, H[0][0]);
      if (H[0][0] < softest) {
        softest = H[0][0];
        phi_there = phi;
        sigma_there = sigma;
      }
    }
  if (!(softest >= -1e-9 * stiffest))  // rounding of sums that cancel
    refuse_formula(fmt::format(
        "the stiffness is {:.6g} N m/rad at phi = {:.4g} rad{}, expected 0 or more over the range "
        "of the limits (of phi: ± pi without a limit): the equilibrium would not be unique",
        softest, phi_there, with_sigma ? fmt::format(" and sigma = {:.4g}", sigma_there) : ""));
  if (!(stiffest > 0))
    refuse_formula("the stiffness is 0 everywhere, expected an energy that bends with phi");
}

}  // namespace

ElasticPtr formula(const Formula& p, const Limits& l) {
  FormulaEnergy energy{parsed(p)};
  const bool with_sigma = energy.formula.depends_on(1);
  if (!energy.formula.depends_on(0))
    refuse_formula(
        fmt::format("the energy \"{}\" does not depend on phi, expected one that does", p.energy));
  if (with_sigma && !(std::isfinite(l.sigma_lower) && std::isfinite(l.sigma_upper)))
    refuse_formula(
        "the energy depends on sigma, expected limits with sigma = [lower, upper]: over this range "
        "it is checked");
  auto e = make_elastic(std::move(energy), {.family = "formula",
                                            .title = p.energy,
                                            .sigma = with_sigma ? "as in the formula" : "",
                                            .sigma_unit = with_sigma ? "1" : "",
                                            .limits = l});
  check_places(*e, with_sigma);
  return e;
}

}  // namespace porthos::vsa
