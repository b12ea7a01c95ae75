// The scalars: a lane of a Pack is a double bit for bit, a Dual carries the exact derivative, a
// Quad 113 bits.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <string>

#include "phs/scalars/scalar.h"

namespace porthos::phs::scalar_test {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The same bits; any NaN equals any other where `any_nan` (which of two NaNs an addition returns
/// is not IEEE's business).
bool same(double a, double b, bool any_nan = false) {
  if (any_nan && std::isnan(a) && std::isnan(b)) return true;
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Numbers of every kind: zeros of both signs, denormals, infinities, NaNs of both signs, ordinary
/// ones of any size.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : rng_(seed) {}
  double operator()() {
    static const double special[] = {0.0, -0.0, 1.0,    -1.0,    inf,    -inf,
                                     nan, -nan, 5e-324, -5e-324, 1e-310, 1.7976931348623157e308};
    switch (rng_() % 4) {
      case 0:
        return special[rng_() % std::size(special)];
      case 1:
        return std::bit_cast<double>(rng_()) + 0.0;  // any bits; + 0 quiets a NaN
      default:
        return std::uniform_real_distribution<double>(-2, 2)(rng_);
    }
  }

 private:
  std::mt19937_64 rng_;
};

template <class P>
class PackLanes : public testing::Test {
 protected:
  static constexpr int W = P::width;
  P random(Numbers& r) {
    P p(0.0);
    for (int l = 0; l < W; ++l) p.set(l, r());
    return p;
  }
};
using Packs = testing::Types<Pack<double, 2>, Pack4, Pack8>;
TYPED_TEST_SUITE(PackLanes, Packs);

TYPED_TEST(PackLanes, ArithmeticEqualsDouble) {
  Numbers r(1);
  for (int i = 0; i < 50000; ++i) {
    const TypeParam a = this->random(r), b = this->random(r);
    const TypeParam sum = a + b, difference = a - b, product = a * b, quotient = a / b,
                    negative = -a, root = sqrt(a);
    TypeParam s = a, d = a, p = a;
    s += b;
    d -= b;
    p *= b;
    for (int l = 0; l < this->W; ++l) {
      const double x = a[l], y = b[l];
      ASSERT_TRUE(same(sum[l], x + y, true)) << x << " + " << y;
      ASSERT_TRUE(same(difference[l], x - y, true)) << x << " - " << y;
      ASSERT_TRUE(same(product[l], x * y, true)) << x << " * " << y;
      ASSERT_TRUE(same(quotient[l], x / y, true)) << x << " / " << y;
      ASSERT_TRUE(same(negative[l], -x)) << "-" << x;
      ASSERT_TRUE(same(root[l], std::sqrt(x), true)) << "sqrt " << x;
      ASSERT_TRUE(same(s[l], sum[l], true) && same(d[l], difference[l], true) &&
                  same(p[l], product[l], true));
    }
  }
}

TYPED_TEST(PackLanes, ComparisonsMasksAndSelectEqualDouble) {
  Numbers r(2);
  for (int i = 0; i < 50000; ++i) {
    TypeParam a = this->random(r);
    const TypeParam b = this->random(r), c = this->random(r);
    if (i % 2) a.set(i % this->W, b[i % this->W]);  // equal ones too
    const auto less = a<b, greater = a> b, less_equal = a <= b, greater_equal = a >= b,
               equal = a == b;
    const auto both = less & (b < c), either = less | equal, not_less = !less;
    const TypeParam chosen = select(less, a, c), smallest = min(a, b), largest = max(a, b),
                    size = abs(a);
    bool any_less = false;
    for (int l = 0; l < this->W; ++l) {
      const double x = a[l], y = b[l], z = c[l];
      ASSERT_EQ(less[l], x < y);
      ASSERT_EQ(greater[l], x > y);
      ASSERT_EQ(less_equal[l], x <= y);
      ASSERT_EQ(greater_equal[l], x >= y);
      ASSERT_EQ(equal[l], x == y);
      ASSERT_EQ(both[l], x < y && y < z);
      ASSERT_EQ(either[l], x < y || x == y);
      ASSERT_EQ(not_less[l], !(x < y));
      ASSERT_TRUE(same(chosen[l], select(x < y, x, z)));
      ASSERT_TRUE(same(smallest[l], min(x, y)) && same(largest[l], max(x, y))) << x << ", " << y;
      ASSERT_TRUE(same(size[l], abs(x))) << x;
      any_less |= x < y;
    }
    ASSERT_EQ(any(less), any_less);
    ASSERT_TRUE(any(either | !either) && !any(either & !either));
  }
}

TYPED_TEST(PackLanes, FunctionsEqualDouble) {
  Numbers r(3);
  for (int i = 0; i < 20000; ++i) {
    const TypeParam a = this->random(r), e = exp(a), g = log(a), t = tanh(a);
    for (int l = 0; l < this->W; ++l) {
      ASSERT_TRUE(same(e[l], std::exp(a[l]), true)) << a[l];
      ASSERT_TRUE(same(g[l], std::log(a[l]), true)) << a[l];
      ASSERT_TRUE(same(t[l], std::tanh(a[l]), true)) << a[l];
    }
  }
}

TYPED_TEST(PackLanes, OneNumberFillsEveryLane) {
  for (double x : {0.0, -0.0, 1.5, -inf, nan, 5e-324}) {
    const TypeParam p(x);
    for (int l = 0; l < this->W; ++l) EXPECT_TRUE(same(p[l], x, true)) << x;
  }
  EXPECT_EQ(lanes<TypeParam>, this->W);
  EXPECT_TRUE(is_pack<TypeParam> && !is_real<TypeParam>);
}

/// Calls by the qualified name do not look at the arguments, so they need a declaration.
template <class T>
std::array<T, 5> qualified(T x) {
  return {porthos::phs::sqrt(x * x), porthos::phs::abs(x), porthos::phs::fma(x, x, T(1.0)),
          porthos::phs::select(x < T(0.0), -x, x), porthos::phs::sin(x)};
}

TEST(Scalar, QualifiedCallsOfEveryScalar) {
  for (const double x : {-0.0, 0.5, -1.5, inf}) {
    const auto d = qualified(x);
    const auto check = [&](const auto& f, auto number) {
      for (size_t k = 0; k < d.size(); ++k) EXPECT_TRUE(same(number(f[k]), d[k], true)) << x;
    };
    const auto lane = [](const auto& p) { return p[1]; };
    check(qualified(Pack<double, 2>(x)), lane);
    check(qualified(Pack4(x)), lane);
    check(qualified(Pack8(x)), lane);
    if (x != 0) check(qualified(Dual{x, 1.0}), [](const Dual& f) { return f.v; });
  }
  EXPECT_EQ(double(qualified(Quad(-1.5))[0]), 1.5);
  EXPECT_EQ(double(qualified(-1.5L)[1]), 1.5);
  EXPECT_FALSE(same(select(Pack4(-0.0) < Pack4(0.0), -Pack4(-0.0), Pack4(-0.0))[0],
                    porthos::phs::abs(Pack4(-0.0))[0]))
      << "control: abs by comparison keeps the sign of a zero";
}

TEST(Scalar, AbsMinMaxOfDouble) {
  EXPECT_EQ(abs(-2.5), 2.5);
  EXPECT_EQ(abs(-inf), inf);
  EXPECT_EQ(abs(-0.0), 0.0);
  EXPECT_TRUE(std::isnan(abs(nan)));
  EXPECT_EQ(min(1.0, 2.0), 1.0);
  EXPECT_EQ(max(1.0, 2.0), 2.0);
  EXPECT_TRUE(same(min(0.0, -0.0), 0.0) && same(max(0.0, -0.0), 0.0)) << "of equal ones the first";
  EXPECT_TRUE(any(true) && !any(false));
}

// --- Dual ----------------------------------------------------------------------------------------

/// Every operation of a scalar, each as a function of one number; smooth for x in (0.2, 1.8), x !=
/// 1.
template <class T>
std::array<T, 18> functions(T x) {
  const T one(1.0), two(2.0), y = x * x + one;
  T add = x, subtract = x, multiply = x;
  add += y;
  subtract -= y;
  multiply *= y;
  return {x + y,          x - y,        x * y,
          x / y,          y / x,        -x,
          sqrt(y),        exp(x),       log(x),
          tanh(x),        sin(x * two), cos(x / y),
          abs(x - one),   min(x, one),  max(y, x),
          add * subtract, multiply,     select(x < one, x * x, x / two)};
}
/// Their derivatives by hand.
std::array<double, 18> derivatives(double x) {
  const double y = x * x + 1, t = std::tanh(x), quotient = (1 - x * x) / (y * y);
  return {1 + 2 * x,
          1 - 2 * x,
          3 * x * x + 1,
          quotient,
          1 - 1 / (x * x),
          -1,
          x / std::sqrt(y),
          std::exp(x),
          1 / x,
          1 - t * t,
          2 * std::cos(2 * x),
          -std::sin(x / y) * quotient,
          x < 1 ? -1.0 : 1.0,
          x < 1 ? 1.0 : 0.0,
          2 * x,
          (1 + 2 * x) * (x - y) + (x + y) * (1 - 2 * x),
          3 * x * x + 1,
          x < 1 ? 2 * x : 0.5};
}

TEST(Dual, AnalyticDerivativesAndCentralDifferences) {
  std::mt19937_64 rng(4);
  std::uniform_real_distribution<double> argument(0.2, 1.8);
  double analytic = 0, differences = 0, plain = 0;
  for (int i = 0; i < 5000; ++i) {
    const double x = argument(rng), seed = argument(rng);
    if (std::fabs(x - 1) < 1e-6) continue;  // the kinks
    const auto f = functions(Dual(x, seed));
    const auto value = functions(x);
    const auto exact = derivatives(x);
    // Central differences in 113 bits: error h²/6 f''' < 1e-21 and 1e-34/h = 1e-23.
    const Quad h = 1e-11;
    const auto up = functions(Quad(x) + h), down = functions(Quad(x) - h);
    const double step = 1e-6;
    const auto up_plain = functions(x + step), down_plain = functions(x - step);
    for (size_t k = 0; k < f.size(); ++k) {
      ASSERT_EQ(f[k].v, value[k]) << "the value of a dual is the double's, function " << k;
      const double d = f[k].d / seed, size = 1 + std::fabs(exact[k]);
      analytic = std::max(analytic, std::fabs(d - exact[k]) / size);
      differences =
          std::max(differences, std::fabs(d - double((up[k] - down[k]) / (2 * h))) / size);
      if (std::fabs(x - 1) > 2 * step)
        plain = std::max(plain, std::fabs(d - (up_plain[k] - down_plain[k]) / (2 * step)) / size);
    }
  }
  std::printf(
      "  duals against formulas %.1e  bound 2e-15   against 113-bit differences %.1e  bound 2e-15  "
      " (double differences: %.1e)\n",
      analytic, differences, plain);
  EXPECT_LE(analytic, 2e-15);
  EXPECT_LE(differences, 2e-15);
  EXPECT_GT(plain, 1e-12) << "control: differences of doubles are far off the duals";
}

TEST(Dual, ConstantsHaveNoDerivative) {
  EXPECT_EQ(Dual(3.0).d, 0);
  EXPECT_EQ(Dual().v, 0);
  EXPECT_EQ((Dual(3.0) * Dual(2.0)).d, 0);
  const Dual a(1, 5), b(2, 7);
  EXPECT_TRUE(a < b && b > a && a <= b && b >= a && a == Dual(1, 9)) << "ordered by value alone";
  EXPECT_EQ(to_double(a), 1);
}

// --- Quad ----------------------------------------------------------------------------------------

Quad quad(const char* digits) { return strtoflt128(digits, nullptr); }
double relative(Quad a, Quad b) { return double(fabsq(a - b) / fabsq(b)); }

TEST(Quad, KnownDigits) {
  constexpr double eps = 2e-34;  // 2^-112
  EXPECT_LE(relative(exp(Quad(1)), quad("2.71828182845904523536028747135266249775724709369995957")),
            eps);
  EXPECT_LE(
      relative(log(Quad(2)), quad("0.693147180559945309417232121458176568075500134360255254")),
      eps);
  EXPECT_LE(
      relative(sqrt(Quad(2)), quad("1.41421356237309504880168872420969807856967187537694807")),
      eps);
  EXPECT_LE(
      relative(tanh(Quad(1)), quad("0.761594155955764888119458282604793590412768597257936552")),
      eps);
  EXPECT_LE(
      relative(sin(Quad(1)), quad("0.841470984807896506652502321630298999622563060798371066")),
      eps);
  EXPECT_LE(
      relative(cos(Quad(1)), quad("0.540302305868139717400936607442976603733239920231840063")),
      eps);
  EXPECT_LE(relative(powq(Quad(2), Quad(0.5)), sqrt(Quad(2))), eps);
  EXPECT_EQ(double(fabsq(Quad(-2))), 2);
  EXPECT_EQ(double(sinq(Quad(0.5)) - sin(Quad(0.5))), 0);
  EXPECT_EQ(double(cosq(Quad(0.5)) - cos(Quad(0.5))), 0);
  char text[64];
  quadmath_snprintf(text, sizeof text, "%.33Qe", quad("0.1"));
  EXPECT_EQ(std::string(text), "1.000000000000000000000000000000000e-01");
}

TEST(Quad, FunctionsInvertEachOther) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> argument(0.1, 10);
  double worst = 0;
  for (int i = 0; i < 5000; ++i) {
    const Quad x = argument(rng), s = sin(x), c = cos(x), e = exp(2 * x);
    worst = std::max({worst, relative(exp(log(x)), x), relative(sqrt(x) * sqrt(x), x),
                      relative(s * s + c * c, 1), relative(tanh(x), (e - 1) / (e + 1)),
                      relative(powq(x, 3), x * x * x)});
  }
  std::printf("  identities %.1e  bound 5e-33 (25 units of 2^-112: exp of a rounded log)\n", worst);
  EXPECT_LE(worst, 5e-33);
  EXPECT_EQ(to_double(quad("0.1")), 0.1);
  EXPECT_EQ(to_double(0.1L), 0.1);
}

/// x·x - fl(x·x) is the rounding error of a product: not zero if and only if fma rounds once.
TEST(Fma, RoundsOnceWhereTheMachineCan) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> number(1, 2);
  int exact = 0, rounded = 0;
  for (int i = 0; i < 1000; ++i) {
    const double x = number(rng), y = number(rng);
    const double error = fma(x, y, -(x * y));
    exact += Quad(error) == Quad(x) * Quad(y) - Quad(x * y);
    rounded += error != 0;
  }
  std::printf("  %d of 1000 exact, %d not zero; fuses: %d\n", exact, rounded, int(fuses));
  EXPECT_TRUE(!fuses || exact == 1000);
  EXPECT_EQ(rounded > 900, fuses);
}
TEST(Fma, LanesAndDualsHaveTheBitsOfDouble) {
  Numbers number(8);
  for (int i = 0; i < 20000; ++i) {
    Pack4 a4, b4, c4;
    Pack8 a8, b8, c8;
    std::array<std::array<double, 3>, 8> x;
    for (int k = 0; k < 8; ++k) {
      x[size_t(k)] = {number(), number(), number()};
      const auto [a, b, c] = x[size_t(k)];
      a8.set(k, a);
      b8.set(k, b);
      c8.set(k, c);
      if (k >= 4) continue;
      a4.set(k, a);
      b4.set(k, b);
      c4.set(k, c);
    }
    const Pack4 r4 = fma(a4, b4, c4);
    const Pack8 r8 = fma(a8, b8, c8);
    for (int k = 0; k < 8; ++k) {
      const auto [a, b, c] = x[size_t(k)];
      const double r = fma(a, b, c);
      EXPECT_TRUE(same(r8[k], r, true)) << a << ' ' << b << ' ' << c;
      EXPECT_TRUE(k >= 4 || same(r4[k], r, true)) << a << ' ' << b << ' ' << c;
      EXPECT_TRUE(same(fma(Dual(a), Dual(b), Dual(c)).v, r, true));
    }
  }
}
TEST(Fma, OfADualHasTheDerivativeOfTheSum) {
  const Dual r = fma(Dual(3, 5), Dual(7, 11), Dual(13, 17));
  EXPECT_EQ(r.v, 34);
  EXPECT_EQ(r.d, 5 * 7 + 3 * 11 + 17);
}

}  // namespace
}  // namespace porthos::phs::scalar_test
