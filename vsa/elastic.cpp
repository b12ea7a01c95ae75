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
  if (sigma < l.sigma_lower || sigma > l.sigma_upper)
    throw InvalidArgument(fmt::format("{}: sigma starts at {} {}, expected {} to {} {}", who, sigma,
                                      traits_.sigma_unit, l.sigma_lower, l.sigma_upper,
                                      traits_.sigma_unit));
  for (const double s : strains(q, theta, sigma))
    if (!(std::fabs(s) <= l.deflection))
      throw InvalidArgument(fmt::format(
          "{}: starts with a spring deflected by {:.6g} rad (link {} rad, theta {} rad, "
          "sigma {} {}), expected no more than {} rad",
          who, s, q, theta, sigma, traits_.sigma_unit, l.deflection));
}

}  // namespace porthos::vsa
