#include "ensemble/distribution.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "ensemble/random.h"

namespace porthos::ensemble {

void Distribution::at(const double* u, double* value) const {
  switch (kind) {
    case Kind::uniform:
      *value = a + (b - a) * *u;
      return;
    case Kind::normal:
      *value = a + b * normal_quantile(*u);
      return;
    case Kind::log_uniform:
      *value = std::exp(std::log(a) + (std::log(b) - std::log(a)) * *u);
      return;
    case Kind::rotation: {
      const double r1 = std::sqrt(1 - u[0]), r2 = std::sqrt(u[0]);
      const double t1 = 2 * std::numbers::pi * u[1], t2 = 2 * std::numbers::pi * u[2];
      const double w = r2 * std::cos(t2), sign = w < 0 ? -1 : 1;
      value[0] = sign * w;
      value[1] = sign * r1 * std::sin(t1);
      value[2] = sign * r1 * std::cos(t1);
      value[3] = sign * r2 * std::sin(t2);
      return;
    }
  }
}

std::string Distribution::trouble() const {
  if (!std::isfinite(a) || !std::isfinite(b)) return "expected finite numbers";
  if (kind == Kind::normal && !(b > 0))
    return fmt::format("the standard deviation is {}, expected more than 0", b);
  if ((kind == Kind::uniform || kind == Kind::log_uniform) && !(a < b))
    return fmt::format("it is empty: low is {} and high {}, expected low < high", a, b);
  if (kind == Kind::log_uniform && !(a > 0))
    return fmt::format("low is {}, expected more than 0 for a logarithm", a);
  return "";
}

}  // namespace porthos::ensemble
