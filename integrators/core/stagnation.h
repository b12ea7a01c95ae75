#pragma once
#include <algorithm>
#include <cmath>

#include "phs/scalars/scalar.h"

/// When an implicit iteration is done. Shared by every implicit method.
namespace porthos::integrators {

/// The size of a number, derivative included; NaN stays NaN.
inline double magnitude(double x) { return std::fabs(x); }
inline double magnitude(phs::Quad x) { return double(phs::abs(x)); }
inline double magnitude(phs::Dual x) { return std::fabs(x.v) + std::fabs(x.d); }

template <class T>
inline constexpr double unit_roundoff = 0x1p-53;
template <>
inline constexpr double unit_roundoff<phs::Quad> = 0x1p-113;

/// What a sweep did.
struct Sweep {
  bool finite = true, changed = false;
  bool improved = false;  ///< some component moved less than ever before in this step
  double change = 0;      ///< largest move, relative to its component's size

  /// Moves below this much cannot be told from none.
  void blur(double noise) {
    if (noise > change) {
      change = noise;
      changed = changed || noise > 1e-12;
    }
  }
};

/// Sweeps go on to stagnation. A tolerance would stop on one side of the solution and bias the
/// energy.
///
/// They go on while some component still moves less than ever before; one sweep of grace, then they
/// stop. With many components one or another sets a record in its noise for long, so four sweeps
/// without a record of the largest move end it too. None of this counts above `settled`: there a
/// contraction that oscillates needs patience, and a pause is no solution.
class Stagnation {
 public:
  enum class Verdict {
    go_on,
    exact,      ///< nothing changed: a fixed point
    stagnated,  ///< as good as it gets
    diverges,   ///< no progress far from a solution
    not_finite
  };
  /// settled: relative move below which only noise is left; tolerance: see
  /// Options::iteration_tolerance
  explicit Stagnation(double settled, double tolerance = 0)
      : settled_(settled), tolerance_(tolerance) {}
  template <class T>
  static Stagnation of(double tolerance = 0) {
    return Stagnation(unit_roundoff<T> * 1e5, tolerance);
  }

  /// patience: sweeps without a record, far from a solution, before they diverge
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

  /// Whether the moves, small already, have all but stopped shrinking above `settled`: slow
  /// contraction, or rounding that the equations magnify, as a stiff spring does that of a
  /// difference of angles. Asked for once between restarts; who can tell then says how large moves
  /// by noise are.
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
  /// Whether the moves have become small enough for only noise to be left.
  bool settled() const { return last_ <= std::max(settled_, noise_); }
  /// The last move over the one before: the contraction where it is steady.
  double ratio() const { return ratio_; }

 private:
  static constexpr double small = 1e5;  ///< of `settled`: above, nothing is noise

  double settled_, tolerance_;
  double noise_ = 0;
  bool noise_known_ = false;
  double smallest_ = HUGE_VAL, ratio_ = 0, last_ = HUGE_VAL;
  int patience_ = 10, since_record_ = 0, grace_ = 1;
};

}  // namespace porthos::integrators
