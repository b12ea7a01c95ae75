#include "vsa/elastic.h"

#include <fmt/format.h>

#include <cmath>

#include "phs/error.h"

namespace porthos::vsa {

void Elastic::require_inside(const std::string& who, double q, double theta, double sigma) const {
  for (const auto& [name, value] : {std::pair{"link", q}, {"theta", theta}, {"sigma", sigma}})
    if (!std::isfinite(value))
      throw InvalidArgument(
          fmt::format("{}: {} starts at {}, expected a finite number", who, name, value));
  const Limits& l = traits_.limits;
  const std::string unit = traits_.sigma_unit == "1" ? "" : " " + traits_.sigma_unit;
  if (sigma < l.sigma_lower || sigma > l.sigma_upper)
    throw InvalidArgument(fmt::format("{}: sigma starts at {:g}{}, expected {:g} to {:g}{}", who,
                                      sigma, unit, l.sigma_lower, l.sigma_upper, unit));
  for (const double s : strains(q, theta, sigma))
    if (!(std::fabs(s) <= l.deflection))
      throw InvalidArgument(fmt::format(
          "{}: starts with a spring deflected by {:.6g} rad (link {} rad, theta {} rad, "
          "sigma {} {}), expected no more than {} rad",
          who, s, q, theta, sigma, traits_.sigma_unit, l.deflection));
}

}  // namespace porthos::vsa
