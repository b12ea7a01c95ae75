#pragma once
#include <cstddef>
#include <span>

/// The dissipation inequality along measured or simulated data:
///
///   H(t_j) - H(t_i) <= ∫ u·y dt from t_i to t_j,    for all i < j.
namespace porthos::phs {

/// How far the data violate the inequality, and the error bounds of that number.
struct PassivityReport {
  double violation = 0;  ///< largest H(t_j) - H(t_i) - ∫ u·y dt over all i <= j [J]; 0 at best
  std::size_t from = 0, to = 0;  ///< the samples i, j of the violation
  double supplied = 0;           ///< ∫ u·y dt over all the data [J]
  double quadrature = 0;         ///< error of that integral, see passivity() [J]
  double rounding = 0;           ///< of the sums [J]
  bool passive() const { return violation <= quadrature + rounding; }
};

/// Checks the inequality for non-decreasing `times`, the `powers` u·y and the `energies` H at them.
/// The power is taken as smooth between different times. Where it jumps, give the time twice, with
/// the power before and after.
///
/// Each interval is integrated by the mean of two parabolas, each through the interval's ends and
/// the next sample on one side. This is exact for cubics on equal intervals. Half the difference of
/// the two, summed over all intervals, is the stated error.
PassivityReport passivity(std::span<const double> times, std::span<const double> powers,
                          std::span<const double> energies);

}  // namespace porthos::phs
