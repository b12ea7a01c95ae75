#include "vsa/planning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "phs/error.h"

namespace porthos::vsa {
namespace {

void require_plannable(const Elastic& e, const char* what) {
  const auto& t = e.traits();
  if (!t.translation_invariant || t.sigma.empty())
    throw InvalidArgument(fmt::format(
        "{}: the energy of '{}' {}, expected one of deflection and sigma", what, t.family,
        t.sigma.empty() ? "does not depend on sigma" : "is not translation invariant"));
}

}  // namespace

std::vector<RetuningPoint> constant_energy_path(const Elastic& e, double phi0, double sigma0,
                                                double phi1, int parts) {
  const char* const what = "constant-energy path";
  require_plannable(e, what);
  const Limits& l = e.traits().limits;
  if (!(std::isfinite(l.sigma_lower) && std::isfinite(l.sigma_upper)) || parts < 1)
    throw InvalidArgument(fmt::format(
        "{}: sigma from {} to {} in {} parts, expected a bounded range and 1 part or more", what,
        l.sigma_lower, l.sigma_upper, parts));
  e.require_inside(what, phi0, 0, sigma0);
  const double E = e.energy(phi0, 0.0, sigma0);
  std::vector<RetuningPoint> path{{phi0, sigma0, e.stiffness(phi0, 0, sigma0)}};
  for (int i = 1; i <= parts; ++i) {
    const double phi = phi0 + (phi1 - phi0) * i / parts, near = path.back().sigma;
    const auto excess = [&](double s) { return e.energy(phi, 0.0, s) - E; };
    // The crossing nearest to the last one; searched on both sides of it.
    double a = near, b = near;
    const double reach = (l.sigma_upper - l.sigma_lower) / 2000;
    bool found = excess(near) == 0;
    for (int k = 1; k <= 2000 && !found; ++k)
      for (const double side : {-reach, reach}) {
        const double from = std::clamp(near + (k - 1) * side, l.sigma_lower, l.sigma_upper);
        const double to = std::clamp(near + k * side, l.sigma_lower, l.sigma_upper);
        if (from == to || (excess(from) < 0) == (excess(to) < 0)) continue;
        a = from;
        b = to;
        found = true;
        break;
      }
    if (!found)
      throw InvalidArgument(fmt::format(
          "{}: no sigma between {} and {} has the energy {:.6g} J at a deflection of {:.6g} rad",
          what, l.sigma_lower, l.sigma_upper, E, phi));
    const bool below = excess(a) < 0;
    for (int k = 0; k < 100 && a != b; ++k) {
      const double mid = (a + b) / 2;
      if (mid == a || mid == b) break;
      ((excess(mid) < 0) == below ? a : b) = mid;
    }
    const double s = std::fabs(excess(a)) < std::fabs(excess(b)) ? a : b;
    path.push_back({phi, s, e.stiffness(phi, 0, s)});
  }
  return path;
}

Resonance resonant_sigma(const Elastic& e, double inertia, double amplitude, double omega,
                         double lower, double upper) {
  require_plannable(e, "resonance");
  constexpr int points = 64, places = 1000;  // the mean over a period converges exponentially
  const auto mean_square = [&](double sigma, bool spring) {
    double sum = 0;
    for (int i = 0; i < points; ++i) {
      const double q = amplitude * std::sin(2 * std::numbers::pi * (i + 0.5) / points);
      const double torque =
          -inertia * omega * omega * q + (spring ? e.slopes(q, 0.0, sigma).q : 0.0);
      sum += torque * torque;
    }
    return sum / points;
  };
  const auto allowed = [&](double sigma) {
    const auto s = e.strains(amplitude, 0, sigma);
    return std::all_of(s.begin(), s.end(),
                       [&](double x) { return std::fabs(x) <= e.traits().limits.deflection; });
  };
  double best = NAN, least = HUGE_VAL;
  const double part = (upper - lower) / places;
  for (int i = 0; i <= places; ++i) {
    const double s = lower + part * i;
    if (!allowed(s)) continue;
    if (const double m = mean_square(s, true); m < least) {
      least = m;
      best = s;
    }
  }
  if (std::isnan(best))
    throw InvalidArgument(
        fmt::format("resonance: an amplitude of {} rad is beyond the deflection limit for every "
                    "sigma from {} to {}",
                    amplitude, lower, upper));
  double a = std::max(lower, best - part), b = std::min(upper, best + part);
  const double golden = (std::sqrt(5.0) - 1) / 2;
  for (int k = 0; k < 60; ++k) {
    const double x = b - golden * (b - a), y = a + golden * (b - a);
    (mean_square(x, true) < mean_square(y, true) ? b : a) =
        mean_square(x, true) < mean_square(y, true) ? y : x;
  }
  if (const double s = (a + b) / 2; allowed(s) && mean_square(s, true) < least) best = s;
  return {best, std::sqrt(mean_square(best, true)), std::sqrt(mean_square(best, false)),
          e.stiffness(0, 0, best)};
}

}  // namespace porthos::vsa
