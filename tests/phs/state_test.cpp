// The double-length state: exact two-sums, compensated additions, and wraps that change no angle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "phs/scalars/quad.h"
#include "phs/system/state.h"

namespace porthos::phs::state_test {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

Quad two_pi() {
  return strtoflt128("6.28318530717958647692528676655900576839433879875021164", nullptr);
}

TEST(TwoSum, IsExact) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> number(-1, 1), exponent(-25, 25);
  for (int i = 0; i < 1000000; ++i) {
    // Up to 50 bits apart: their exact sum has at most 103 bits and fits the 113 of a Quad.
    const double a = number(rng), b = i % 3 ? std::ldexp(number(rng), int(exponent(rng)))
                                            : -a * (1 + 1e-15 * number(rng));
    double s, e;
    two_sum(a, b, s, e);
    ASSERT_EQ(s, a + b);
    ASSERT_TRUE(Quad(s) + Quad(e) == Quad(a) + Quad(b)) << a << " + " << b;
    ASSERT_LE(std::fabs(e), 0.5 * (std::nextafter(std::fabs(s), inf) - std::fabs(s)));
  }
  double s, e;
  two_sum(1.0, 1e-300, s, e);  // too far apart for a Quad: nothing is lost all the same
  EXPECT_TRUE(s == 1.0 && e == 1e-300);
  two_sum(-1e-300, 1e300, s, e);
  EXPECT_TRUE(s == 1e300 && e == -1e-300);
  two_sum(0.1, -0.1, s, e);
  EXPECT_TRUE(s == 0 && e == 0);
}

/// n additions of seeded increments to x: what the compensated pair and a plain sum have lost at
/// the end.
struct Lost {
  double pair, plain, increments;  ///< increments: the sum of |d|
  bool normalised = true;          ///< |lo| <= ulp(x)/2 throughout
};
template <class Increment>
Lost accumulate(double x, int n, Increment&& increment) {
  double hi = x, lo = 0, plain = x;
  Quad exact = x, size = 0;
  bool normalised = true;
  for (int i = 0; i < n; ++i) {
    const double d = increment(i);
    compensated_add(hi, lo, d);
    plain += d;
    exact += Quad(d);
    size += fabsq(Quad(d));
    normalised =
        normalised && std::fabs(lo) <= 0.5 * (std::nextafter(std::fabs(hi), inf) - std::fabs(hi));
  }
  return {double(fabsq(Quad(hi) + Quad(lo) - exact)), double(fabsq(Quad(plain) - exact)),
          double(size), normalised};
}

TEST(CompensatedAdd, KeepsWhatIsFarBelowAnUlp) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> tiny(-1e-17, 1e-17);
  const auto l = accumulate(1.0, 1000000, [&](int) { return tiny(rng); });
  // d + lo is rounded to ulp(1e-17 … 1e-16)/2 < 2^-107 = 6e-33, a million times, at random: 6e-33 ·
  // 1e3 · 0.6.
  std::printf(
      "  1e6 additions of 1e-17 to 1: pair off by %.1e  bound 1e-28   plain sum off by %.1e\n",
      l.pair, l.plain);
  EXPECT_LE(l.pair, 1e-28);
  EXPECT_GT(l.plain, 1e-15) << "control: a plain sum never leaves 1";
  EXPECT_TRUE(l.normalised);
}

TEST(CompensatedAdd, ExactWhereIncrementsAreShort) {
  std::mt19937_64 rng(3);
  const auto l = accumulate(1.0, 1000000,
                            [&](int) { return std::ldexp(double(int(rng() % 1024) - 300), -70); });
  EXPECT_EQ(l.pair, 0);
  EXPECT_GT(l.plain, 1e-14) << "control";
  EXPECT_TRUE(l.normalised);
}

TEST(CompensatedAdd, LosesLessThanTheIncrementsOwnRounding) {
  std::mt19937_64 rng(4);
  std::uniform_real_distribution<double> step(-1e-3, 1.1e-3);
  const auto l = accumulate(1.0, 1000000, [&](int) { return step(rng); });
  // Each addition rounds d + lo, half an ulp of d or less: at random, 1e3 · 2^-53 · 1e-3 · 0.3; at
  // worst, sum |d| · 2^-53.
  std::printf(
      "  1e6 additions of 1e-3 to 1: pair off by %.1e  bounds 5e-16 (random), %.1e (worst)   plain "
      "sum off by %.1e\n",
      l.pair, l.increments * 0x1p-53, l.plain);
  EXPECT_LE(l.pair, 5e-16);
  EXPECT_LE(l.pair, l.increments * 0x1p-53);
  EXPECT_GT(l.plain, 20 * l.pair) << "control";
  EXPECT_TRUE(l.normalised);
}

// --- wraps ---------------------------------------------------------------------------------------

Description two_angles_and_a_length() {
  Description d;
  d.nx = 6;
  d.blocks = {{"a", BlockKind::angle, 0, 1, 3, "rad", ""},
              {"length", BlockKind::linear, 1, 1, 4, "m", ""},
              {"b", BlockKind::angle, 2, 1, 5, "rad", ""}};
  return d;
}
Quad value(const State& s, size_t i, size_t turn) {
  return Quad(s.x[i]) + Quad(s.lo[i]) + Quad((long double)s.turns[turn]) * two_pi();
}
/// One state of two angles at x, a length between them.
State at(double x, double lo = 0) {
  State s(two_angles_and_a_length(), {x, 100.0, 0.5, 100.0, 100.0, 100.0});
  s.lo[0] = lo;
  return s;
}

TEST(WrapAngles, ChangesNoAngle) {
  const auto d = two_angles_and_a_length();
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> step(-0.5, 2), back(-2, 0.5);
  State s = at(0);
  Quad a = 0, b = 0.5, worst = 0;
  int wraps = 0;
  for (int i = 0; i < 1000000; ++i) {
    const Quad before_a = value(s, 0, 0), before_b = value(s, 2, 1);
    wraps += wrap_angles(d, s);
    worst = std::max({worst, fabsq(value(s, 0, 0) - before_a) / (1 + fabsq(before_a)),
                      fabsq(value(s, 2, 1) - before_b) / (1 + fabsq(before_b))});
    const double da = std::ldexp(std::floor(step(rng) * 0x1p40), -40),
                 db = std::ldexp(std::floor(back(rng) * 0x1p40), -40);
    compensated_add(s.x[0], s.lo[0], da);
    compensated_add(s.x[2], s.lo[2], db);
    a += Quad(da);
    b += Quad(db);
  }
  const double total =
      double(std::max(fabsq(value(s, 0, 0) - a) / fabsq(a), fabsq(value(s, 2, 1) - b) / fabsq(b)));
  std::printf(
      "  %d wraps, %lld and %lld turns: one wrap changes an angle by %.1e of it  bound 1e-31   1e6 "
      "additions and wraps: %.1e  bound 2e-17\n",
      wraps, (long long)s.turns[0], (long long)s.turns[1], double(worst), total);
  EXPECT_GT(wraps, 100000);
  EXPECT_LE(double(worst), 1e-31);
  // The additions round d + lo to an ulp of d, here 1e-16, and with it the low word each of the 1e5
  // wraps leaves: an angle of 7e5 may be off by 1e5 · 1e-16.
  EXPECT_LE(total, 2e-17);
  EXPECT_EQ(s.x[1], 100) << "a length is not wrapped";
  EXPECT_EQ(s.x[3], 100) << "nor a momentum";
}

TEST(WrapAngles, ManyWrapsKeepTheAngleTo31Digits) {
  // Whole radians added exactly, so that only the wraps round.
  const auto d = two_angles_and_a_length();
  State s = at(0);
  Quad exact = 0;
  int wraps = 0;
  for (int i = 0; i < 1000000; ++i) {
    double x, e, lo;
    two_sum(s.x[0], 3.0, x, e);
    two_sum(x, e + s.lo[0], s.x[0], lo);
    s.lo[0] = lo;
    exact += 3;
    wraps += wrap_angles(d, s);
  }
  const double error = double(fabsq(value(s, 0, 0) - exact) / exact);
  std::printf("  after %d wraps, 3e6 rad: off by %.1e of it  bound 1e-30\n", wraps, error);
  EXPECT_GT(wraps, 400000);
  EXPECT_LE(error, 1e-30);
}

TEST(WrapAngles, RangeAndNoChangeInside) {
  const auto d = two_angles_and_a_length();
  std::mt19937_64 rng(6);
  std::uniform_real_distribution<double> wide(-1e4, 1e4), inside(-pi_hi, pi_hi);
  for (int i = 0; i < 200000; ++i) {
    State s = at(wide(rng));
    const bool out = std::fabs(s.x[0]) > pi_hi;
    const Quad before = value(s, 0, 0);
    ASSERT_EQ(wrap_angles(d, s), out);
    ASSERT_LE(std::fabs(s.x[0]), pi_hi);
    ASSERT_LE(double(fabsq(value(s, 0, 0) - before)), 1e-31 * (1 + double(fabsq(before))));
    State t = at(inside(rng), 1e-17);
    const State same = t;
    ASSERT_FALSE(wrap_angles(d, t));
    ASSERT_EQ(t, same) << "an angle in range keeps every bit";
  }
}

TEST(WrapAngles, EndsOfTheRange) {
  const auto d = two_angles_and_a_length();
  State plus = at(pi_hi);
  EXPECT_FALSE(wrap_angles(d, plus)) << "+pi stays";
  EXPECT_EQ(plus, at(pi_hi));

  // The double -pi_hi is 1.2e-16 above -pi: it is in (-pi, pi] already, and one turn on it would be
  // past +pi.
  State minus = at(-pi_hi);
  const Quad before = value(minus, 0, 0);
  wrap_angles(d, minus);
  EXPECT_LE(std::fabs(minus.x[0]), pi_hi) << minus.x[0] - pi_hi << " past pi";
  EXPECT_LE(double(fabsq(value(minus, 0, 0) - before)), 1e-31);
  EXPECT_FALSE(wrap_angles(d, minus)) << "-pi: wrapped twice";

  // Neighbours of odd multiples of pi: in range after one wrap, and wrapping again changes nothing.
  int outside = 0, again = 0;
  double worst = 0;
  for (int k = -2001; k <= 2001; k += 2)
    for (int i = -3; i <= 3; ++i) {
      double x = double(k * (two_pi() / 2));
      for (int n = 0; n < std::abs(i); ++n) x = std::nextafter(x, i < 0 ? -inf : inf);
      State s = at(x);
      const Quad start = value(s, 0, 0);
      wrap_angles(d, s);
      outside += std::fabs(s.x[0]) > pi_hi;
      again += wrap_angles(d, s);
      worst = std::max(worst, double(fabsq(value(s, 0, 0) - start) / fabsq(start)));
    }
  EXPECT_EQ(outside, 0) << "of 14007 neighbours of odd multiples of pi end outside [-pi, pi]";
  EXPECT_EQ(again, 0) << "of them are wrapped again";
  EXPECT_LE(worst, 1e-31);
}

TEST(WrapAngles, LargeStartValues) {
  const auto d = two_angles_and_a_length();
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> exponent(4, 14.99);
  double worst = 0, outside = 0;
  for (int i = 0; i < 100000; ++i) {
    State s = at((i % 2 ? 1 : -1) * std::pow(10.0, exponent(rng)));
    const Quad before = value(s, 0, 0);
    ASSERT_TRUE(wrap_angles(d, s));
    worst = std::max(worst, double(fabsq(value(s, 0, 0) - before) / fabsq(before)));
    outside = std::max(outside, std::fabs(s.x[0]) - pi_hi);
  }
  std::printf(
      "  angles of 1e4 … 1e15: changed by %.1e of them  bound 1e-31   largest |x| - pi %.1e\n",
      worst, outside);
  EXPECT_LE(worst, 1e-31);
  EXPECT_LE(outside, 0);
}

TEST(WrapAngles, LeavesAloneWhatIsNoAngle) {
  const auto d = two_angles_and_a_length();
  for (double x : {inf, -inf, 1e15, -1e300}) {
    State s = at(x);
    EXPECT_FALSE(wrap_angles(d, s)) << x;
    EXPECT_EQ(s, at(x));
  }
  State s = at(std::nan(""));
  EXPECT_FALSE(wrap_angles(d, s));
  EXPECT_TRUE(std::isnan(s.x[0]) && s.lo[0] == 0 && s.turns[0] == 0);
}

TEST(StateOf, CountsItsAngles) {
  const State s = at(1);
  EXPECT_EQ(s.turns.size(), 2u);
  EXPECT_EQ(s.lo, std::vector<double>(6, 0.0));
  EXPECT_EQ(s.step, 0);
  EXPECT_EQ(s, at(1));
  EXPECT_NE(s, at(1, 1e-20));
}

}  // namespace
}  // namespace porthos::phs::state_test
