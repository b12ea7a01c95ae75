// Levenberg and Marquardt on residuals with closed forms.
#include "scene/identification/detail/least_squares.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bounds.h"

namespace porthos::scene::least_squares_test {
namespace {

using test::keeps;

FitOptions options() {
  return {.go_on = [](const Fit&) { return true; }};
}

/// A place 40 of its units from the start: steps begin with half a unit and grow where the model is
/// right. Steps of half a unit at most would take 80.
TEST(LeastSquares, StepsGrowWhereTheModelIsRight) {
  const auto line = [](const std::vector<double>& z, Eigen::VectorXd& r, Eigen::MatrixXd* slopes) {
    r = Eigen::Vector2d{100 * (z[0] - 40), 10 * std::atan(z[0] - 40)};
    if (slopes) *slopes = Eigen::Vector2d{100, 10 / (1 + std::pow(z[0] - 40, 2))};
    return true;
  };
  const Fit fit = least_squares(line, {0}, options());
  EXPECT_TRUE(fit.converged);
  keeps("place", std::fabs(fit.z[0] - 40), 1e-6);
  keeps("iterations", fit.iterations, 25);
}

/// Beyond |z - 2| = 1 there are no residuals: a region that has grown shrinks again.
TEST(LeastSquares, StopsGrowingAtAnEdge) {
  const auto well = [](const std::vector<double>& z, Eigen::VectorXd& r, Eigen::MatrixXd* slopes) {
    if (z[0] > 3) return false;
    r = Eigen::VectorXd::Constant(1, 50 * std::log(3.5 - z[0]) - 50 * std::log(1.5));
    if (slopes) *slopes = Eigen::MatrixXd::Constant(1, 1, -50 / (3.5 - z[0]));
    return true;
  };
  const Fit fit = least_squares(well, {-20}, options());
  EXPECT_TRUE(fit.converged);
  keeps("place", std::fabs(fit.z[0] - 2), 1e-4);
  EXPECT_LT(fit.iterations, 30);
}

}  // namespace
}  // namespace porthos::scene::least_squares_test
