// The Riccati equation against closed forms. The regulator: tests/run/controller_scene_test.cpp.
#include "phs/linear_algebra/riccati.h"

#include <gtest/gtest.h>

#include <cmath>

namespace porthos::test::riccati_test {

using phs::Matrix;

/// A double integrator with weights of 1: P = [√3 1; 1 √3].
TEST(Riccati, DoubleIntegratorInClosedForm) {
  const Matrix A{{0, 1}, {0, 0}}, B{{0}, {1}}, Q{{1, 0}, {0, 1}}, R{{1}};
  const auto P = phs::riccati(A, B, Q, R);
  EXPECT_NEAR(P(0, 0), std::sqrt(3.0), 1e-14);  // measured 0 to 4e-16
  EXPECT_NEAR(P(0, 1), 1, 1e-14);
  EXPECT_NEAR(P(1, 1), std::sqrt(3.0), 1e-14);
}

/// x' = a x + b u: p = r (a + √(a² + b² q / r)) / b², also over many orders of magnitude.
TEST(Riccati, ScalarInClosedForm) {
  for (const double a : {-3.0, 0.0, 2.0})
    for (const double q : {1e-6, 1.0, 1e6}) {
      const double b = 0.7, r = 3;
      const auto P = phs::riccati(Matrix{{a}}, Matrix{{b}}, Matrix{{q}}, Matrix{{r}});
      const double root = std::sqrt(a * a + b * b * q / r),
                   p = a > 0 ? r * (a + root) / (b * b) : q / (root - a);
      EXPECT_NEAR(P(0, 0) / p, 1, 1e-9) << a << ' ' << q;  // a = -3, q = 1e-6 cancels: 1e-10
    }
}

TEST(Riccati, WhatCannotBeStabilisedIsNotANumber) {
  const auto P = phs::riccati(Matrix{{1, 0}, {0, -1}}, Matrix{{0}, {1}}, Matrix{{1, 0}, {0, 1}},
                              Matrix{{1}});  // the unstable mode has no input
  EXPECT_FALSE(std::fabs(P(0, 0)) < 1e12) << P(0, 0);
}

}  // namespace porthos::test::riccati_test
