// Tangents over every kind of scalar, and the functions that came with them.
#include "phs/scalars/tangent.h"

#include <gtest/gtest.h>

#include "tests/support/bounds.h"

namespace porthos::phs::tangent_test {
namespace {

TEST(Tangent, DerivativesOverScalars) {
  const auto f = [](auto x) {
    using S = decltype(x);
    return asinh(x) * exp(S(0.3) * x) / sqrt(S(2.0) + sin(x) * sin(x)) + log(S(3.0) + cos(x));
  };
  const double h = 1e-4, at = 0.7;  // central difference of order 4 in 113 bits
  const Quad d = (Quad(8.0) * (f(Quad(at) + Quad(h)) - f(Quad(at) - Quad(h))) -
                  (f(Quad(at) + Quad(2 * h)) - f(Quad(at) - Quad(2 * h)))) /
                 Quad(6 * (2 * h));
  test::keeps("double", std::fabs(f(Tangent<double>(at, 1)).d - double(d)), 1e-14);
  test::keeps("113 bits", std::fabs(double(f(Tangent<Quad>(Quad(at), Quad(1.0))).d - d)), 1e-14);
  const auto lanes = f(Tangent<Pack4>(Pack4(at), Pack4(1.0)));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(lanes.d[i], f(Tangent<double>(at, 1)).d);
  const auto twice = f(Tangent<Dual>(Dual(at, 1), Dual(1.0)));  // d.d: the second derivative
  const double second =
      (f(Tangent<double>(at + 1e-5, 1)).d - f(Tangent<double>(at - 1e-5, 1)).d) / 2e-5;
  test::keeps("second derivative", std::fabs(twice.d.d - second), 1e-9);
}

TEST(Tangent, AsinhHasSmallRelativeError) {
  double worst = 0;
  for (double x = 1e-300; x < 1e10; x *= 3.7) {
    worst = std::max(worst, std::fabs(asinh(x) / std::asinh(x) - 1));
    EXPECT_EQ(asinh(-x), -asinh(x));
    const Pack4 lanes = asinh(Pack4(x));
    EXPECT_EQ(lanes[2], asinh(x));
  }
  test::keeps("asinh, relative", worst, 1e-15);
  test::breaks("log(x + sqrt(1 + x²)) at 1e-9",
               std::fabs(std::log(1e-9 + std::sqrt(1 + 1e-18)) / 1e-9 - 1), 1e-9);
}

}  // namespace
}  // namespace porthos::phs::tangent_test
