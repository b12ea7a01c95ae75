// Signals of pieces: polynomials through their values, in every scalar, 0 outside.
#include "phs/functions/pieces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "phs/error.h"

namespace porthos::phs::pieces_test {
namespace {

TEST(Pieces, HeldValuesJumpBetweenPeriods) {
  const auto f = pieces(0.5, {0.5}, {1, -2, 3});
  EXPECT_EQ((*f)(0.0), 1);
  EXPECT_EQ((*f)(0.49), 1);
  EXPECT_EQ((*f)(0.5), -2);
  EXPECT_EQ((*f)(1.49), 3);
  EXPECT_EQ((*f)(1.5), 0);
  EXPECT_EQ((*f)(-1e-9), 0);
}

/// A cubic through four values is that cubic, with its derivative, in lanes and in 113 bits.
/// Control: through two values it is not.
TEST(Pieces, ArePolynomials) {
  const auto cubic = [](auto s) { return 1.0 + s * (2.0 + s * (-3.0 + 0.5 * s)); };
  const auto slope = [](double s) { return 2 - 6 * s + 1.5 * s * s; };
  const double h = 0.25;
  const std::vector<double> four{0.07, 0.33, 0.67, 0.93}, two{0.2, 0.8};
  const auto through = [&](const std::vector<double>& nodes) {
    std::vector<double> values;
    for (int k = 0; k < 3; ++k)
      for (const double n : nodes) values.push_back(cubic((k + n) * h));
    return pieces(h, nodes, values);
  };
  const auto f = through(four), coarse = through(two);
  double off = 0, slope_off = 0, control = 0;
  for (double t = 0.01; t < 0.74; t += 0.03) {
    const Dual y = (*f)(Dual(t, 1.0));
    off = std::max(off, std::fabs(y.v - cubic(t)));
    slope_off = std::max(slope_off, std::fabs(y.d - slope(t)));
    control = std::max(control, std::fabs((*coarse)(t)-cubic(t)));
    EXPECT_EQ((*f)(t), y.v);
    EXPECT_EQ((*f)(Pack4(t))[2], y.v);
    EXPECT_NEAR(double((*f)(Quad(t))), y.v, 1e-14);
  }
  std::printf("  off by %.1e (bound 1e-14), slope by %.1e (1e-12); through two values %.1e\n", off,
              slope_off, control);
  EXPECT_LT(off, 1e-14);
  EXPECT_LT(slope_off, 1e-12);
  EXPECT_GT(control, 1e-3);
}

TEST(Pieces, Refusals) {
  EXPECT_THROW(pieces(0, {0.5}, {1}), InvalidArgument);
  EXPECT_THROW(pieces(1, {}, {1}), InvalidArgument);
  EXPECT_THROW(pieces(1, {0.5, 0.5}, {1, 2}), InvalidArgument);
  EXPECT_THROW(pieces(1, {0.2, 0.5}, {1, 2, 3}), InvalidArgument);
  EXPECT_THROW(pieces(1, {0.5}, {NAN}), InvalidArgument);
}

}  // namespace
}  // namespace porthos::phs::pieces_test
