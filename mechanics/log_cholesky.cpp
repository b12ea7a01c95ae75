#include "mechanics/log_cholesky.h"

#include <cmath>

namespace porthos::mechanics {
namespace {

/// ½ tr(S) 1 - S takes an inertia to Σ; the inertia is tr(Σ) 1 - Σ.
Sym3<double> complement(const Sym3<double>& S, double of_trace) {
  const double t = of_trace * (S.xx + S.yy + S.zz);
  return {t - S.xx, -S.xy, -S.xz, t - S.yy, -S.yz, t - S.zz};
}

}  // namespace

LogCholesky log_cholesky(const MassProperties& b) {
  const auto S = complement(rotated(b.axes, b.inertia), 0.5);
  const auto root = [&](double square) {
    if (square > 0 && b.mass > 0) return std::sqrt(square / b.mass);
    throw InvalidArgument(
        "an inertia with mass " + number(b.mass) +
        " kg has no log-Cholesky numbers, expected a positive mass and principal moments of which "
        "each is less than the sum of the other two");
  };
  const double l33 = root(S.zz), l23 = S.yz / b.mass / l33, l13 = S.xz / b.mass / l33;
  const double l22 = root(S.yy - b.mass * l23 * l23), l12 = (S.xy / b.mass - l13 * l23) / l22;
  const double l11 = root(S.xx - b.mass * (l12 * l12 + l13 * l13));
  return {std::log(b.mass) / 2,
          std::log(l11),
          std::log(l22),
          std::log(l33),
          l12,
          l23,
          l13,
          b.com.x,
          b.com.y,
          b.com.z};
}

MassProperties from_log_cholesky(const LogCholesky& n) {
  const double m = std::exp(2 * n[0]), l11 = std::exp(n[1]), l22 = std::exp(n[2]),
               l33 = std::exp(n[3]), l12 = n[4], l23 = n[5], l13 = n[6];
  const Sym3<double> S{m * (l11 * l11 + l12 * l12 + l13 * l13),
                       m * (l12 * l22 + l13 * l23),
                       m * l13 * l33,
                       m * (l22 * l22 + l23 * l23),
                       m * l23 * l33,
                       m * l33 * l33};
  return {m, {n[7], n[8], n[9]}, complement(S, 1), Mat3<double>::identity()};
}

}  // namespace porthos::mechanics
