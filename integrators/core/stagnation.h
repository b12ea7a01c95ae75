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
  /// Of a fixed-point iteration, whose moves shrink by a steady ratio: the largest move relative to
  /// its component itself, however small that is. Infinite: not known.
  double own = HUGE_VAL;

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
///
/// A fixed-point iteration that contracts fast need not be watched to its noise. The ratios of its
/// last two moves above rounding tell the error that is left: it ends when the evaluation after the
/// last sweep leaves less than 2⁻¹⁰ of a rounding, too little to bias the energy over 10⁶ steps
/// (Brouwer's law, tests/integrators/brouwer_test.cpp).
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
  explicit Stagnation(double settled, double tolerance = 0, double roundoff = 0)
      : settled_(settled), tolerance_(tolerance), roundoff_(roundoff) {}
  template <class T>
  static Stagnation of(double tolerance = 0) {
    return Stagnation(unit_roundoff<T> * 1e5, tolerance, unit_roundoff<T>);
  }

  /// patience: sweeps without a record, far from a solution, before divergence is declared
  void restart(int patience = 10) {
    patience_ = patience;
    smallest_ = HUGE_VAL;
    since_record_ = 0;
    grace_ = 1;
    ratio_ = 0;
    contraction_ = left_ = last_own_ = HUGE_VAL;
    own_ratio_ = 0;
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
    if (s.change <= tolerance_ || (std::isfinite(s.own) && foreseen(s.own)))
      return Verdict::stagnated;
    ratio_ = s.change / last_;
    last_ = s.change;
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
  static constexpr double small = 1e5;   ///< times `settled`: larger moves are not noise
  static constexpr double steady = 0.5;  ///< a contraction up to this is trusted

  /// Whether one evaluation more leaves a negligible error.
  bool foreseen(double move) {
    const double ratio = move / last_own_;
    const bool measured = move > 16 * roundoff_,
               as_expected = move <= std::max(4 * roundoff_, 2 * contraction_ * last_own_);
    if (measured) {
      contraction_ = own_ratio_ > 0 ? std::sqrt(ratio * own_ratio_) : HUGE_VAL;
      left_ = contraction_ * move;
    } else {
      left_ *= contraction_;
    }
    own_ratio_ = ratio;
    last_own_ = move;
    return !measured && as_expected && contraction_ < steady &&
           left_ * contraction_ < 0x1p-10 * roundoff_;
  }

  double settled_, tolerance_, roundoff_;
  double noise_ = 0;
  bool noise_known_ = false;
  double smallest_ = HUGE_VAL, ratio_ = 0, last_ = HUGE_VAL;
  double contraction_ = HUGE_VAL;  ///< the mean of the last two ratios that were measured
  double left_ = HUGE_VAL;         ///< error after the last sweep, extrapolated
  double last_own_ = HUGE_VAL, own_ratio_ = 0;
  int patience_ = 10, since_record_ = 0, grace_ = 1;
};

}  // namespace porthos::integrators
