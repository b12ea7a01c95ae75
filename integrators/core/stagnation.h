#pragma once
#include <algorithm>
#include <cmath>

#include "phs/scalars/scalar.h"

/// The stopping rule of all implicit iterations.
namespace porthos::integrators {

/// The size of a number, including its derivative; NaN stays NaN.
inline double magnitude(double x) { return std::fabs(x); }
inline double magnitude(phs::Quad x) { return double(phs::abs(x)); }
inline double magnitude(phs::Dual x) { return std::fabs(x.v) + std::fabs(x.d); }

template <class T>
inline constexpr double unit_roundoff = 0x1p-53;
template <>
inline constexpr double unit_roundoff<phs::Quad> = 0x1p-113;

/// The effect of one sweep.
struct Sweep {
  bool finite = true, changed = false;
  bool improved = false;  ///< some component made its smallest move in this step
  double change = 0;      ///< largest move, relative to its component's size

  /// Moves smaller than the noise count as the noise.
  void blur(double noise) {
    if (noise > change) {
      change = noise;
      changed = changed || noise > 1e-12;
    }
  }
};

/// Iterates to stagnation. A tolerance would stop on one side of the solution and bias the energy.
///
/// The iteration continues while the move of some component is the smallest in this step, then for
/// one more sweep. With many components, one or another sets such a record within its noise for
/// long. So it also ends after four sweeps without a record of the largest move. These rules apply
/// only below `settled`: above it, a contraction that oscillates needs patience, and a pause does
/// not mean convergence.
class Stagnation {
 public:
  enum class Verdict {
    go_on,
    exact,      ///< nothing changed: a fixed point
    stagnated,  ///< no further progress possible
    diverges,   ///< no progress far from a solution
    not_finite
  };
  /// settled: relative move below which only noise remains; tolerance: see
  /// Options::iteration_tolerance
  explicit Stagnation(double settled, double tolerance = 0)
      : settled_(settled), tolerance_(tolerance) {}
  template <class T>
  static Stagnation of(double tolerance = 0) {
    return Stagnation(unit_roundoff<T> * 1e5, tolerance);
  }

  /// patience: sweeps without a record, far from a solution, before divergence is declared
  void restart(int patience = 10) {
    patience_ = patience;
    smallest_ = HUGE_VAL;
    since_record_ = 0;
    grace_ = 1;
    ratio_ = 0;
    last_ = HUGE_VAL;
    noise_ = 0;
    noise_known_ = false;
  }

  /// Whether the moves are small but have almost stopped shrinking above `settled`. The cause is
  /// either slow contraction or rounding that the equations amplify (as a stiff spring does for a
  /// difference of angles). It is asked once between restarts; the caller then answers with
  /// set_noise().
  bool wants_noise() const {
    return !noise_known_ && last_ > settled_ && last_ < small * settled_ && ratio_ > 0.3;
  }
  void set_noise(double noise) {
    noise_ = std::min(noise, small * settled_);
    noise_known_ = true;
  }

  Verdict after(const Sweep& s) {
    if (!s.finite) return Verdict::not_finite;
    if (!s.changed) return Verdict::exact;
    ratio_ = s.change / last_;
    last_ = s.change;
    if (s.change <= tolerance_) return Verdict::stagnated;
    since_record_ = s.change < smallest_ ? 0 : since_record_ + 1;
    smallest_ = std::min(smallest_, s.change);
    if (!settled())
      return since_record_ > patience_ || s.change > 1e6 * smallest_ ? Verdict::diverges
                                                                     : Verdict::go_on;
    grace_ = s.improved || since_record_ == 0 ? 1 : grace_ - 1;
    return grace_ < 0 || since_record_ >= 4 ? Verdict::stagnated : Verdict::go_on;
  }
  /// Whether the moves are so small that only noise remains.
  bool settled() const { return last_ <= std::max(settled_, noise_); }
  /// The last move divided by the one before: the contraction rate if it is steady.
  double ratio() const { return ratio_; }

 private:
  static constexpr double small = 1e5;  ///< times `settled`: larger moves are not noise

  double settled_, tolerance_;
  double noise_ = 0;
  bool noise_known_ = false;
  double smallest_ = HUGE_VAL, ratio_ = 0, last_ = HUGE_VAL;
  int patience_ = 10, since_record_ = 0, grace_ = 1;
};

}  // namespace porthos::integrators
