#pragma once
#include <vector>

namespace porthos::phs {

/// Values at x of the natural cubic spline f that bends least, by ∫ f''², among those with
/// Σ (f(x_i) - y_i)² <= n s². Where the straight line of least squares is that near, it is f.
/// Source: Reinsch 1967, Numerische Mathematik 10; equations of Green, Silverman 1994, section 2.3.
/// Cost: O(n), a hundred solutions of a system with five diagonals.
/// @param x  rises;  y: as many, three or more;  s: standard deviation of the errors of y, > 0
std::vector<double> smoothed(const std::vector<double>& x, const std::vector<double>& y, double s);

/// How far values scatter about the straight line through their two neighbours, as the standard
/// deviation of their errors (Gasser, Sroka, Jennen-Steinmetz 1986, Biometrika 73). A curve that
/// bends between neighbours adds to it. x as above; 0 for fewer than three values.
double scatter(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace porthos::phs
