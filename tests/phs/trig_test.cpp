// phs::sincos against libquadmath in 113 bits: within 1 ulp everywhere, unbiased, the same in every
// lane.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::phs::trig_test {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Quad pi() {
  static const Quad value =
      strtoflt128("3.14159265358979323846264338327950288419716939937510582", nullptr);
  return value;
}

/// (got - exact) in units of the last place of a double of exact's size.
double ulps(Quad got, Quad exact) {
  double size = std::fabs(double(exact));
  if (Quad(size) > fabsq(exact))
    size = std::nextafter(size, 0.0);  // rounded up across a power of two
  const int exponent = size == 0 ? -1022 : std::max(std::ilogb(size), -1022);
  return double((got - exact) / Quad(std::ldexp(1.0, exponent - 52)));
}

/// Worst errors in ulp of a sine and cosine over many points, and where.
struct Worst {
  double sin = 0, cos = 0, at_sin = 0, at_cos = 0;
  template <class F>
  void note(F&& sin_and_cos, double x) {
    Quad S, C;
    sincosq(Quad(x), &S, &C);
    double s, c;
    sin_and_cos(x, s, c);
    note(ulps(s, S), ulps(c, C), x);
  }
  void note(double sin_error, double cos_error, double x) {
    if (!(std::fabs(sin_error) <= sin)) {
      sin = std::fabs(sin_error);
      at_sin = x;
    }
    if (!(std::fabs(cos_error) <= cos)) {
      cos = std::fabs(cos_error);
      at_cos = x;
    }
  }
  void expect_one_ulp(const char* where) const {
    std::printf("  %-36s sin %.4f ulp at %.17g, cos %.4f ulp at %.17g   bound 1\n", where, sin,
                at_sin, cos, at_cos);
    EXPECT_LE(sin, 1.0) << where;
    EXPECT_LE(cos, 1.0) << where;
  }
};

const auto ours = [](double x, double& s, double& c) { sincos(x, s, c); };

/// The double nearest to k π/4 and its three neighbours on either side.
std::vector<double> around(int k) {
  const double x = double(k * (pi() / 4));
  std::vector<double> v{x};
  double below = x, above = x;
  for (int i = 0; i < 3; ++i) {
    v.push_back(below = std::nextafter(below, -inf));
    v.push_back(above = std::nextafter(above, inf));
  }
  return v;
}

/// A bias that is a smooth function of the angle alone perturbs the energy function, not its
/// conservation. Ours has two parts: the polynomials (designed to 2^-58 = 0.03 ulp; mean 3e-3 of
/// the size, none signed), and the r³·tail/6 that cos_kernel drops, of one sign in the quadrant
/// about pi (at most 0.02 ulp; mean 1.3e-3).
constexpr double known_bias = 2e-3;

/// Mean and deviation of an error over n points; the mean of an unbiased error has the deviation
/// sigma/sqrt(n).
struct Bias {
  double sum = 0, sum2 = 0, n = 0;
  void note(double e) {
    sum += e;
    sum2 += e * e;
    ++n;
  }
  double mean() const { return sum / n; }
  double sigma() const { return std::sqrt(sum2 / n - mean() * mean()); }
  double chance() const { return 4 * sigma() / std::sqrt(n); }
  void expect_none(const char* what) const {
    std::printf(
        "  %-22s mean error %+.1e ulp, sigma %.3f   bound 2e-3 + chance: 4 sigma/sqrt(%.0e) = "
        "%.1e\n",
        what, mean(), sigma(), n, chance());
    EXPECT_LE(std::fabs(mean()), known_bias + chance()) << what;
  }
};

/// The kernels' polynomials in 113 bits after an exact reduction: what is left is their
/// approximation error.
void sincos_unrounded(double x, Quad& s, Quad& c) {
  const double k = std::nearbyint(x * trig::two_over_pi);
  const Quad r = Quad(x) - Quad(k) * (pi() / 2), sr = trig::sin_kernel<Quad>(r, 0),
             cr = trig::cos_kernel<Quad>(r, 0, sr);
  const int quadrant = static_cast<int>(k) & 3;
  s = quadrant & 1 ? cr : sr;
  c = quadrant & 1 ? sr : cr;
  if (quadrant & 2) s = -s;
  if (quadrant == 1 || quadrant == 2) c = -c;
}

TEST(Sincos, OneUlpAndUnbiasedWithinATurn) {
  std::mt19937_64 rng(1);
  const double half_turn = double(pi());
  std::uniform_real_distribution<double> turn(-half_turn, half_turn), digits(-1e-16, 1e-16);
  Worst w;
  Bias chopped, sine, cosine, sine_rounding, cosine_rounding, sine_size, cosine_size;
  for (int i = 0; i < 2000000; ++i) {
    const double x =
        turn(rng) + digits(rng);  // turn alone is a multiple of 2^-52: short where it is small
    Quad S, C, P, Q;
    sincosq(Quad(x), &S, &C);
    double s, c;
    sincos(x, s, c);
    const double es = ulps(s, S), ec = ulps(c, C);
    w.note(es, ec, x);
    sine.note(es);
    cosine.note(ec);
    chopped.note(ulps(Quad(s) > S ? std::nextafter(s, -inf) : s, S));
    if (i % 4) continue;
    // In size, so that nothing cancels between the quadrants: the roundings, and the polynomials.
    sincos_unrounded(x, P, Q);
    const double ps = ulps(P, S), pc = ulps(Q, C), up_s = S < 0 ? -1 : 1, up_c = C < 0 ? -1 : 1;
    sine_rounding.note(up_s * (es - ps));
    cosine_rounding.note(up_c * (ec - pc));
    sine_size.note(up_s * ps);
    cosine_size.note(up_c * pc);
  }
  w.expect_one_ulp("2e6 points of [-pi, pi]");
  EXPECT_LT(chopped.mean(), -0.4) << "control: rounding downwards is seen";
  sine.expect_none("sin");
  cosine.expect_none("cos");
  sine_rounding.expect_none("|sin|, roundings alone");
  cosine_rounding.expect_none("|cos|, roundings alone");
  std::printf("  polynomials alone: mean |sin| %+.1e, |cos| %+.1e ulp   bound 4e-3\n",
              sine_size.mean(), cosine_size.mean());
  EXPECT_LE(std::fabs(sine_size.mean()), 4e-3);
  EXPECT_LE(std::fabs(cosine_size.mean()), 4e-3);
}

TEST(Sincos, OneUlpNearMultiplesOfAQuarterTurn) {
  Worst near, odd, far;
  for (int k = -1000; k <= 1000; ++k)
    for (double x : around(2 * k)) near.note(ours, x);
  near.expect_one_ulp("k pi/2 and neighbours, |k| <= 1000");
  for (int k = -1001; k <= 1001; k += 2)  // where the quadrant changes
    for (double x : around(k)) odd.note(ours, x);
  odd.expect_one_ulp("(2k+1) pi/4 and neighbours");
  for (int k = 1001; k <= 63661; k += 7)
    for (double x : around(2 * k)) far.note(ours, x);
  far.expect_one_ulp("k pi/2 and neighbours up to 1e5");
}

TEST(Sincos, OneUlpUpToTheLimitAndBeyond) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> wide(-trig_fast_limit, trig_fast_limit), exponent(-300, 0),
      huge(5, 300);
  Worst fast, tiny, fallback;
  for (int i = 0; i < 200000; ++i) fast.note(ours, wide(rng));
  for (double x : {trig_fast_limit, -trig_fast_limit, std::nextafter(trig_fast_limit, 0.0)})
    fast.note(ours, x);
  fast.expect_one_ulp("2e5 points of [-1e5, 1e5]");
  for (int i = 0; i < 100000; ++i)
    tiny.note(ours, (i % 2 ? 1 : -1) * std::pow(10.0, exponent(rng)));
  for (double x : {5e-324, 1e-310, 2.2250738585072014e-308, 1e-9, 1.5e-8, 2.7e-8}) {
    tiny.note(ours, x);
    tiny.note(ours, -x);
  }
  tiny.expect_one_ulp("tiny numbers");
  for (int i = 0; i < 20000; ++i) fallback.note(ours, (i % 2 ? 1 : -1) * std::pow(10.0, huge(rng)));
  for (double x : {std::nextafter(trig_fast_limit, inf), 1.7976931348623157e308}) {
    fallback.note(ours, x);
    fallback.note(ours, -x);
  }
  fallback.expect_one_ulp("the C library beyond 1e5");
}

TEST(Sincos, SpecialValues) {
  double s, c;
  sincos(0.0, s, c);
  EXPECT_TRUE(s == 0 && !std::signbit(s) && c == 1);
  sincos(-0.0, s, c);
  EXPECT_TRUE(s == 0 && std::signbit(s) && c == 1) << "the sign of a zero is kept";
  for (double x : {inf, -inf, nan}) {
    sincos(x, s, c);
    EXPECT_TRUE(std::isnan(s) && std::isnan(c)) << x;
  }
  EXPECT_TRUE(std::isnan(sin(nan)) && std::isnan(cos(inf)));
}

/// sin is odd and cos even in every bit: a mirrored motion has mirrored rounding errors.
TEST(Sincos, OddAndEvenBitForBit) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> wide(-2 * trig_fast_limit, 2 * trig_fast_limit),
      turn(-4, 4);
  for (int i = 0; i < 200000; ++i) {
    const double x = i % 2 ? wide(rng) : turn(rng);
    double s, c, t, d;
    sincos(x, s, c);
    sincos(-x, t, d);
    ASSERT_TRUE(s == -t && c == d) << x;
  }
}

/// Negative control: the reduction with π/2 in one word, the same kernels after it.
void sincos_naive(double x, double& s, double& c) {
  const double k = std::nearbyint(x * trig::two_over_pi), r = x - k * 1.5707963267948966;
  const double sr = trig::sin_kernel(r, 0.0), cr = trig::cos_kernel(r, 0.0, sr);
  switch (static_cast<long>(k) & 3) {
    case 0:
      s = sr;
      c = cr;
      break;
    case 1:
      s = cr;
      c = -sr;
      break;
    case 2:
      s = -sr;
      c = -cr;
      break;
    default:
      s = -cr;
      c = sr;
  }
}
TEST(Sincos, NaiveReductionFails) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> turn(-double(pi()), double(pi())),
      wide(-trig_fast_limit, trig_fast_limit);
  Worst one_turn, far, near;
  for (int i = 0; i < 100000; ++i) {
    one_turn.note(sincos_naive, turn(rng));
    far.note(sincos_naive, wide(rng));
  }
  for (int k = -1000; k <= 1000; ++k)
    for (double x : around(2 * k)) near.note(sincos_naive, x);
  std::printf(
      "  control, pi/2 in one word: [-pi, pi] %.1e ulp, [-1e5, 1e5] %.1e ulp, near k pi/2 %.1e "
      "ulp\n",
      std::max(one_turn.sin, one_turn.cos), std::max(far.sin, far.cos),
      std::max(near.sin, near.cos));
  EXPECT_GT(std::max(one_turn.sin, one_turn.cos), 1.0);
  EXPECT_GT(std::max(far.sin, far.cos), 1e3);
  EXPECT_GT(std::max(near.sin, near.cos), 1e3);
}

template <class P>
class SincosLanes : public testing::Test {};
using Packs = testing::Types<Pack<double, 2>, Pack4, Pack8>;
TYPED_TEST_SUITE(SincosLanes, Packs);

template <class P>
void expect_lanes_equal_double(const P& x) {
  P s, c;
  sincos(x, s, c);
  for (int l = 0; l < P::width; ++l) {
    double sl, cl;
    sincos(x[l], sl, cl);
    const auto same = [](double a, double b) {
      return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    };
    ASSERT_TRUE(same(s[l], sl)) << "sin, lane " << l << " at " << x[l];
    ASSERT_TRUE(same(c[l], cl)) << "cos, lane " << l << " at " << x[l];
  }
}

TYPED_TEST(SincosLanes, EqualDoubleBitForBit) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> turn(-4, 4), wide(-trig_fast_limit, trig_fast_limit),
      exponent(-320, 308);
  const double special[] = {0.0, -0.0,  inf, -inf, nan, 5e-324, -1e-310, trig_fast_limit,
                            1e6, -1e300};
  TypeParam x;
  const auto fill_and_check = [&](auto value) {
    for (int l = 0; l < TypeParam::width; ++l) x.set(l, value(l));
    expect_lanes_equal_double(x);
  };
  for (int i = 0; i < 100000; ++i)
    fill_and_check([&](int) { return i % 2 ? turn(rng) : wide(rng); });
  for (int k = -1000; k <= 1000; ++k) {
    const auto v = around(k);
    fill_and_check([&](int l) { return v[size_t(l) % v.size()]; });
  }
  for (int i = 0; i < 50000; ++i)  // fast, fallback and special lanes side by side
    fill_and_check([&](int) {
      switch (rng() % 4) {
        case 0:
          return turn(rng);
        case 1:
          return wide(rng);
        case 2:
          return std::pow(10.0, exponent(rng));
        default:
          return special[rng() % std::size(special)];
      }
    });
}

TEST(SincosScalars, QuadAndLongDouble) {
  std::mt19937_64 rng(6);
  std::uniform_real_distribution<double> wide(-100, 100);
  double quad = 0, extended = 0;
  for (int i = 0; i < 20000; ++i) {
    const double x = wide(rng);
    Quad S, C, s, c;
    sincosq(Quad(x), &S, &C);
    sincos(Quad(x), s, c);
    ASSERT_TRUE(s == S && c == C && sin(Quad(x)) == S && cos(Quad(x)) == C);
    // independent of sincosq: the double-angle identities
    const Quad s2 = sin(Quad(2 * x)), c2 = cos(Quad(2 * x));
    quad = std::max({quad, double(fabsq(s2 - 2 * s * c)), double(fabsq(c2 - (c - s) * (c + s)))});
    long double sl, cl;
    sincos((long double)x, sl, cl);
    extended = std::max(
        {extended, double(fabsq(Quad(sl) - S) / fabsq(S)), double(fabsq(Quad(cl) - C) / fabsq(C))});
  }
  std::printf(
      "  Quad double-angle %.1e  bound 1e-33   long double against Quad %.1e  bound 2^-63 = "
      "1.1e-19\n",
      quad, extended);
  EXPECT_LE(quad, 1e-33);
  EXPECT_LE(extended, 0x1p-63);
}

TEST(SincosScalars, DualDerivative) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> wide(-100, 100);
  for (int i = 0; i < 20000; ++i) {
    const double x = wide(rng), d = wide(rng);
    double sv, cv;
    sincos(x, sv, cv);
    Dual s, c;
    sincos(Dual(x, d), s, c);
    ASSERT_TRUE(s.v == sv && c.v == cv);
    ASSERT_TRUE(s.d == cv * d && c.d == -sv * d);
    ASSERT_TRUE(sin(Dual(x, d)).d == s.d && cos(Dual(x, d)).d == c.d);
  }
}

}  // namespace
}  // namespace porthos::phs::trig_test
