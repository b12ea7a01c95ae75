#include "contact/dry_friction.h"

#include <fmt/format.h>

#include <cmath>

#include "phs/error.h"

namespace porthos::contact {

void check(const DryFriction& f) {
  const auto require = [](bool holds, const char* what, double value, const std::string& expected) {
    if (!holds || !std::isfinite(value))
      throw InvalidArgument(fmt::format("{} is {:g}, expected {}", what, value, expected));
  };
  require(f.coulomb > 0, "coulomb", f.coulomb, "a force above 0");
  require(f.breakaway == 0 || f.breakaway >= f.coulomb, "breakaway", f.breakaway,
          fmt::format("coulomb, {:g}, or more", f.coulomb));
  require(f.stribeck >= 0, "stribeck", f.stribeck, "a rate of 0 or more");
  require(f.stribeck == 0 || f.holds() > f.coulomb, "stribeck", f.stribeck,
          "none without a breakaway above coulomb");
  require(f.viscous >= 0, "viscous", f.viscous, "0 or more");
}

}  // namespace porthos::contact
