#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "phs/description.h"

namespace porthos::phs {

/// A state of double-length numbers x + lo, with the turns taken off its angle blocks and an integer clock:
/// t = step · h, never a running sum.
struct State {
  std::vector<double> x;            ///< value, size nx
  std::vector<double> lo;           ///< low word, |lo| <= ulp(x)/2
  std::vector<std::int64_t> turns;  ///< one per angle block: the true angle is x + lo + 2π·turns
  std::int64_t step = 0;

  State() = default;
  State(const Description& d, std::vector<double> values)
      : x(std::move(values)), lo(x.size(), 0.0) {
    for (const auto& b : d.blocks)
      if (b.kind == BlockKind::angle) turns.push_back(0);
  }
  friend bool operator==(const State&, const State&) = default;
};

/// s = a + b rounded, e = its rounding error exactly (Knuth 1969, TwoSum).
inline void two_sum(double a, double b, double& s, double& e) {
  s = a + b;
  const double bb = s - a;
  e = (a - (s - bb)) + (b - bb);
}

/// x + lo += d, keeping |lo| below half an ulp of x.
inline void compensated_add(double& x, double& lo, double d) {
  double s, e;
  two_sum(x, d, s, e);
  two_sum(s, e + lo, x, lo);
}

inline constexpr double two_pi_hi = 6.283185307179586476925286766559005768394;
inline constexpr double two_pi_lo = 2.449293598294706355e-16;  ///< 2π - two_pi_hi
inline constexpr double pi_hi = 3.141592653589793238462643383279502884197;

/// Brings every angle block back into [-π, π] with a two-word 2π. Returns true if any turn count changed.
/// Angles beyond 1e15, inf and NaN are left alone: those are the integrator's to report.
inline bool wrap_angles(const Description& d, State& s) {
  bool changed = false;
  size_t a = 0;
  for (const auto& b : d.blocks) {
    if (b.kind != BlockKind::angle) continue;
    double &x = s.x[size_t(b.at)], &lo = s.lo[size_t(b.at)];
    while (std::fabs(x) > pi_hi && std::fabs(x) < 1e15) {
      double n = std::round(
          x / two_pi_hi);  // rounded, of a large x by a turn too few or too many: go round again
      if (n == 0) n = x > 0 ? 1 : -1;
      const double p = n * two_pi_hi, p_lo = std::fma(n, two_pi_hi, -p) + n * two_pi_lo;
      double hi, e;
      two_sum(x, -p, hi, e);
      two_sum(hi, (e + lo) - p_lo, x, lo);
      s.turns[a] += static_cast<std::int64_t>(n);
      changed = true;
    }
    ++a;
  }
  return changed;
}

}  // namespace porthos::phs
