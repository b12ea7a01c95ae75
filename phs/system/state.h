#pragma once
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "phs/system/description.h"

namespace porthos::phs {

/// s = a + b rounded; e = its exact rounding error (Knuth 1969, TwoSum).
template <class T>
void two_sum(T a, T b, T& s, T& e) {
  s = a + b;
  const T bb = s - a;
  e = (a - (s - bb)) + (b - bb);
}

/// x + lo += d, keeping |lo| below half an ulp of x.
template <class T>
void compensated_add(T& x, T& lo, std::type_identity_t<T> d) {
  T s, e;
  two_sum(x, d, s, e);
  two_sum(s, e + lo, x, lo);
}

/// A state of double-length numbers x + lo. Whole turns are removed from its angle blocks. The
/// clock counts steps: t = origin + (step - origin_step)·h, so no sum accumulates while h is
/// constant. T: double or the scalars of step maps.
template <class T>
struct BasicState {
  std::vector<T> x;                  ///< value, size nx
  std::vector<T> lo;                 ///< low word, |lo| <= ulp(x)/2
  std::vector<std::int64_t> turns;   ///< one per angle block: the true angle is x + lo + 2π·turns
  std::int64_t step = 0;             ///< steps taken
  double origin = 0, origin_lo = 0;  ///< time (value + low word) at origin_step [s]
  std::int64_t origin_step = 0;      ///< where the step size last changed

  BasicState() = default;
  BasicState(const Description& d, std::vector<T> values)
      : x(std::move(values)), lo(x.size(), T(0.0)) {
    turns.assign(size_t(d.angle_count()), 0);
  }
  /// Takes the clock of another state, of this system or of any other.
  void take_clock(const BasicState& other) {
    step = other.step;
    origin = other.origin;
    origin_lo = other.origin_lo;
    origin_step = other.origin_step;
  }
  /// The time [s] when every step since origin_step had size h.
  T time(T h) const { return T(origin) + (T(origin_lo) + T(double(step - origin_step)) * h); }
  /// The duration from time(h) to an instant [s]; exact to the last bit if the last step was off
  /// the grid.
  T until(double instant, T h) const {
    return origin_step == step ? T((instant - origin) - origin_lo) : T(instant) - time(h);
  }
  /// Counts a step of size `taken`, which differs from the h before. Its end becomes the new
  /// origin.
  void step_off_the_grid(double h, double taken) {
    const double n = double(step - origin_step), p = n * h;
    double s, e, d;
    two_sum(origin, p, s, e);
    e += origin_lo + std::fma(n, h, -p);
    two_sum(s, taken, s, d);
    two_sum(s, e + d, origin, origin_lo);
    origin_step = ++step;
  }
  friend bool operator==(const BasicState&, const BasicState&) = default;
};
using State = BasicState<double>;

inline constexpr double two_pi_hi = 6.283185307179586476925286766559005768394;
inline constexpr double two_pi_lo = 2.449293598294706355e-16;  ///< 2π - two_pi_hi
inline constexpr double pi_hi = 3.141592653589793238462643383279502884197;

/// x with all turns in its angles.
inline std::vector<double> with_turns(const Description& d, const State& s) {
  std::vector<double> x = s.x;
  size_t a = 0;
  for (const auto& b : d.blocks)
    if (b.kind == BlockKind::angle) x[size_t(b.at)] += two_pi_hi * double(s.turns[a++]);
  return x;
}

/// Brings every angle block back into [-π, π] with a two-word 2π. Returns true if any turn count
/// changed. Leaves angles beyond 1e15, inf and NaN alone; the integrator reports those.
inline bool wrap_angles(const Description& d, State& s) {
  bool changed = false;
  size_t a = 0;
  for (const auto& b : d.blocks) {
    if (b.kind != BlockKind::angle) continue;
    double &x = s.x[size_t(b.at)], &lo = s.lo[size_t(b.at)];
    while (std::fabs(x) > pi_hi && std::fabs(x) < 1e15) {
      double n = std::round(x / two_pi_hi);  // a large x may be off by one turn: repeat
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
