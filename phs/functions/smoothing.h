#pragma once
#include <cstddef>
#include <utility>
#include <vector>

namespace porthos::phs {

/// Values at x of the natural cubic spline f that bends least, by ∫ f''², among those with
/// Σ ((f(x_i) - y_i)/s_i)² <= n. Where the straight line of least squares is that near, it is f.
/// Source: Reinsch 1967, Numerische Mathematik 10; equations of Green, Silverman 1994, section 2.3.
/// Cost: O(n), a hundred solutions of a system with five diagonals.
/// @param x  rises
/// @param y  as many, three or more
/// @param s  the standard deviation of the error of each y, 0 or more and not all 0; less than a
///   thousandth of their root mean square counts as that
std::vector<double> smoothed(const std::vector<double>& x, const std::vector<double>& y,
                             const std::vector<double>& s);

/// How far values scatter about cubics of least squares through ten neighbours each, as the
/// standard deviation of their errors. Fewer than seven values have polynomials of a lower degree.
/// x as above; 0 for fewer than three values.
double scatter(const std::vector<double>& x, const std::vector<double>& y);
/// The same in units of the errors s that are stated (as of smoothed): 1 where these are right.
double scatter(const std::vector<double>& x, const std::vector<double>& y,
               const std::vector<double>& s);
/// Between which two numbers the scatter of n values with the errors stated is, in units of these,
/// all but at `sigmas` standard deviations of a normal distribution on either side: the quantiles
/// of chi squared (Wilson, Hilferty 1931). n: three or more
std::pair<double, double> usual_scatter(std::size_t n, double sigmas);

/// By what share of its mean the slope of a spline through (x, y) is off because y scatters like
/// noise: √2 scatter over the distance of neighbours. 0 for a curve: there at most three, or a
/// fifth, of neighbouring second differences differ in sign; of noise two in three do.
double slope_error(const std::vector<double>& x, const std::vector<double>& y);
/// A slope_error that users of the slope are told.
inline constexpr double much_slope_error = 0.05;

}  // namespace porthos::phs
