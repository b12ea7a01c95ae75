#pragma once
#include <cstddef>
#include <span>

/// The dissipation inequality along data, measured or simulated:
///
///   H(t_j) - H(t_i) <= ∫ u·y dt from t_i to t_j,    for all i < j.
namespace porthos::phs {

/// How far the inequality is violated, and what the data allow to say.
struct PassivityReport {
  double violation = 0;  ///< largest H(t_j) - H(t_i) - ∫ u·y dt over all i <= j [J]; 0 at best
  std::size_t from = 0, to = 0;  ///< the samples i, j it was found at
  double supplied = 0;           ///< ∫ u·y dt over all the data [J]
  double quadrature = 0;         ///< error of that integral, see below [J]
  double rounding = 0;           ///< of the sums [J]
  bool passive() const { return violation <= quadrature + rounding; }
};

/// Times that do not decrease, the powers u·y and the energies H there. The power is taken as
/// smooth between different times; give a time twice where it jumps, with the power before and
/// after.
///
/// Each interval is integrated by the mean of the parabolas through its ends and the next sample on
/// either side, which is exact for cubics on equal intervals; their half difference, summed over
/// all intervals, is the error stated.
PassivityReport passivity(std::span<const double> times, std::span<const double> powers,
                          std::span<const double> energies);

}  // namespace porthos::phs
