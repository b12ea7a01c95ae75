#include "contact/law.h"

#include <fmt/format.h>

#include "phs/error.h"

namespace porthos::contact {
namespace {

void require(bool holds, const char* what, double value, const char* expected) {
  if (!holds || !std::isfinite(value))
    throw InvalidArgument(fmt::format("{} is {:g}, expected {}", what, value, expected));
}

}  // namespace

void check(const Law& l) {
  if (l.rigid()) {
    require(l.restitution >= 0 && l.restitution <= 1, "restitution", l.restitution, "0 to 1");
    require(l.friction >= 0, "friction", l.friction, "0 or more");
    return;
  }
  require(l.stiffness > 0, "stiffness", l.stiffness, "more than 0");
  if (l.form == Law::Form::smooth)
    require(l.width > 0, "width", l.width, "more than 0 m");
  else
    require(l.exponent == 1 || l.exponent == 1.5 || l.exponent == 2 || l.exponent == 3, "exponent",
            l.exponent, "1, 1.5, 2 or 3");
  require(l.loss >= 0, "loss", l.loss, "0 s/m or more");
  require(l.friction >= 0, "friction", l.friction, "0 or more");
  if (l.friction > 0) require(l.creep > 0, "creep", l.creep, "more than 0 m/s");
}

double loss_for(double e, double speed) {
  require(e > 0 && e <= 1, "restitution", e, "more than 0, at most 1");
  require(speed > 0, "the speed of the restitution", speed, "more than 0 m/s");
  if (e == 1) return 0;
  // The left minus the right side is positive for small z, and -inf at 1/e.
  const auto above = [e](double z) { return std::log1p(-e * z) + e * z - std::log1p(z) + z > 0; };
  double low = 0, high = 1 / e;
  for (double z = 0.5 * high; z > low && z < high; z = 0.5 * (low + high))
    (above(z) ? low : high) = z;
  return 0.5 * (low + high) / speed;
}

double contact_time(const Law& law, double mass, double speed) {
  const double p = law.exponent + 1, k = law.stiffness;
  if (p == 2) return M_PI * std::sqrt(mass / k);
  const double depth = std::pow(p * mass * speed * speed / (2 * k), 1 / p);
  // 2 d/v ∫ dz/√(1 - z^p) from 0 to 1
  return 2 * depth / speed * std::sqrt(M_PI) * std::tgamma(1 + 1 / p) / std::tgamma(0.5 + 1 / p);
}

double hertz_stiffness(double modulus, double curvature) {
  require(modulus > 0, "modulus", modulus, "more than 0 Pa");
  require(curvature > 0, "curvature", curvature, "more than 0 1/m");
  return 4. / 3 * modulus / std::sqrt(curvature);
}

}  // namespace porthos::contact
