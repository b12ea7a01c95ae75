// Dual numbers over every kind of scalar, and derivatives by them.
#include "phs/scalars/derivative.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/bounds.h"

namespace porthos::phs::dual_test {
namespace {

TEST(Dual, DerivativesOverScalars) {
  const auto f = [](auto x) {
    using S = decltype(x);
    return asinh(x) * exp(S(0.3) * x) / sqrt(S(2.0) + sin(x) * sin(x)) + log(S(3.0) + cos(x));
  };
  const double h = 1e-4, at = 0.7;  // central difference of order 4 in 113 bits
  const Quad d = (Quad(8.0) * (f(Quad(at) + Quad(h)) - f(Quad(at) - Quad(h))) -
                  (f(Quad(at) + Quad(2 * h)) - f(Quad(at) - Quad(2 * h)))) /
                 Quad(6 * (2 * h));
  test::keeps("double", std::fabs(f(BasicDual<double>(at, 1)).d - double(d)), 1e-14);
  test::keeps("113 bits", std::fabs(double(f(BasicDual<Quad>(Quad(at), Quad(1.0))).d - d)), 1e-14);
  const auto lanes = f(BasicDual<Pack4>(Pack4(at), Pack4(1.0)));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(lanes.d[i], f(BasicDual<double>(at, 1)).d);
  const auto twice = f(BasicDual<Dual>(Dual(at, 1), Dual(1.0)));  // d.d: the second derivative
  const double second =
      (f(BasicDual<double>(at + 1e-5, 1)).d - f(BasicDual<double>(at - 1e-5, 1)).d) / 2e-5;
  test::keeps("second derivative", std::fabs(twice.d.d - second), 1e-9);
}

TEST(Dual, AsinhHasSmallRelativeError) {
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

TEST(Dual, DerivativesOneDirectionAtATime) {
  EXPECT_EQ(derivative([](auto x) { return x * x * x; }, 2.0), 12);
  EXPECT_EQ(derivative([](auto x) { return x * x; }, Pack4(3.0))[3], 6);
  const auto H = [](std::span<const Dual> x) { return x[0] * x[0] * x[1] + x[2]; };
  const std::vector<Pack4> x{Pack4(2.0), Pack4(3.0), Pack4(5.0)};
  std::vector<Dual> duals(3);
  std::vector<Pack4> g(3);
  gradient_by_duals<Pack4>(H, x, duals, g);
  EXPECT_EQ(g[0][1], 12);
  EXPECT_EQ(g[1][2], 4);
  EXPECT_EQ(g[2][3], 1);
  for (const auto& y : duals) EXPECT_EQ(y.d, 0) << "a seed was left behind";
  duals[2].d = 1;  // the control: one left from before is seen in every other direction
  double sum = 0;
  for (int k = 0; k < 2; ++k) {
    duals[size_t(k)].d = 1;
    sum += H(duals).d;
    duals[size_t(k)].d = 0;
  }
  EXPECT_EQ(sum, 12 + 4 + 2);
}

}  // namespace
}  // namespace porthos::phs::dual_test
