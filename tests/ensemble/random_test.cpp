// Random streams, distributions and Sobol's points.
#include "ensemble/random.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "ensemble/distribution.h"
#include "ensemble/sobol.h"
#include "tests/support/bounds.h"

namespace porthos::ensemble::random_test {
namespace {

using test::breaks, test::keeps, test::refusal;

TEST(RandomStream, BelongsToItsKeyAlone) {
  Stream a(7, 3, 5), b(7, 3, 5);
  std::vector<std::uint64_t> first;
  for (int i = 0; i < 9; ++i) first.push_back(a.bits());
  Stream(7, 4, 5).bits();
  for (int i = 0; i < 9; ++i) EXPECT_EQ(b.bits(), first[size_t(i)]);
  std::set<std::uint64_t> all(first.begin(), first.end());
  for (const auto& [seed, x, y] : {std::tuple{8, 3, 5}, {7, 5, 3}, {7, 3, 6}, {7, 4, 5}}) {
    Stream s{std::uint64_t(seed), std::uint64_t(x), std::uint64_t(y)};
    for (int i = 0; i < 9; ++i)
      EXPECT_TRUE(all.insert(s.bits()).second) << "another key, other numbers";
  }
}

TEST(RandomStream, IsPhilox4x64) {
  // Known answer of the authors' kat_vectors for 10 rounds: counter and key 0.
  Stream s(0, 0, 0);
  EXPECT_EQ(s.bits(), 0x16554d9eca36314cu);
  EXPECT_EQ(s.bits(), 0xdb20fe9d672d0fdcu);
  EXPECT_EQ(s.bits(), 0xd7e772cee186176bu);
  EXPECT_EQ(s.bits(), 0x7e68b68aec7ba23bu);
}

TEST(RandomStream, MomentsOfManyCases) {
  const int n = 40000;
  double mean = 0, square = 0, normal = 0, normal2 = 0;
  for (int i = 0; i < n; ++i) {
    Stream s(1, std::uint64_t(i), 0);
    const double u = s.uniform(), z = s.normal();
    EXPECT_TRUE(u > 0 && u < 1);
    mean += u / n;
    square += u * u / n;
    normal += z / n;
    normal2 += z * z / n;
  }
  const double sigma = 1 / std::sqrt(double(n));  // four standard errors
  keeps("mean of uniform", std::fabs(mean - 0.5), 4 * sigma * std::sqrt(1.0 / 12));
  keeps("mean square of uniform", std::fabs(square - 1.0 / 3), 4 * sigma * std::sqrt(4.0 / 45));
  keeps("mean of normal", std::fabs(normal), 4 * sigma);
  keeps("variance of normal", std::fabs(normal2 - 1), 4 * sigma * std::sqrt(2.0));
}

TEST(NormalQuantile, IsTheInverseOfErfc) {
  double worst = 0;
  for (double z = -8; z <= 8; z += 0.01) {
    const double p = 0.5 * std::erfc(-z / std::sqrt(2.0));
    if (p > 0.9) continue;  // 1 - p has lost its digits there
    worst = std::max(worst, std::fabs(normal_quantile(p) - z) / std::max(1.0, std::fabs(z)));
  }
  // erfc and p's last bit leave a few ulp: dz = dp / density, |z| / z² of p's relative error in the
  // tail
  keeps("|Φ⁻¹(Φ(z)) - z|", worst, 4e-15);
  EXPECT_EQ(normal_quantile(0.5), 0);
  EXPECT_EQ(normal_quantile(0.25), -normal_quantile(0.75));
}

/// Points of one coordinate in each of 2^k equal intervals, at most and at least, of a stretch of
/// 2^k.
bool one_in_each(const Sobol& s, int d, int k, std::uint64_t from) {
  std::set<int> seen;
  for (std::uint64_t i = 0; i < 1u << k; ++i) seen.insert(int(s(from + i, d) * (1 << k)));
  return seen.size() == size_t(1) << k;
}

TEST(SobolPoints, OneInEachInterval) {
  const Sobol s(Sobol::most_dimensions, 3);
  for (int d = 0; d < Sobol::most_dimensions; ++d) {
    for (const int k : {1, 5, 10}) EXPECT_TRUE(one_in_each(s, d, k, 0)) << d << " " << k;
    EXPECT_TRUE(one_in_each(s, d, 8, 3 * 256)) << d;
  }
  EXPECT_FALSE(one_in_each(s, 2, 6, 5)) << "control: a stretch that begins elsewhere";
}

/// Sobol's property A: the first bits of the first d direction numbers in d dimensions are
/// independent, so that any 2^d points in a row from a multiple of that have one in each of the 2^d
/// parts the cube is cut into by halves.
bool property_a(const Sobol& s, int dimensions) {
  std::vector<std::uint64_t> rows;
  for (int i = 0; i < dimensions; ++i) {
    std::uint64_t row = 0;
    for (int d = 0; d < dimensions; ++d) row |= (s.bits(std::uint64_t(1) << i, d) >> 63) << d;
    rows.push_back(row);
  }
  for (int d = 0; d < dimensions; ++d) {
    const auto pivot =
        std::find_if(rows.begin() + d, rows.end(), [&](auto r) { return r >> d & 1; });
    if (pivot == rows.end()) return false;
    std::swap(*pivot, rows[size_t(d)]);
    for (size_t i = size_t(d) + 1; i < rows.size(); ++i)
      if (rows[i] >> d & 1) rows[i] ^= rows[size_t(d)];
  }
  return true;
}

TEST(SobolPoints, PropertyAOfTheTable) {
  // A wrong digit in the table of direction numbers breaks it with probability one half, in every
  // dimension from there on.
  const Sobol s(Sobol::most_dimensions, 1);
  for (int n = 1; n <= Sobol::most_dimensions; ++n) EXPECT_TRUE(property_a(s, n)) << n;
}

TEST(SobolPoints, AverageFasterThanRandomOnes) {
  // ∏ (1 + (x_d - ½)/2) has the mean 1.
  const int dimensions = 6, n = 4096;
  const auto f = [&](const auto& x) {
    double p = 1;
    for (int d = 0; d < dimensions; ++d) p *= 1 + 0.5 * (x(d) - 0.5);
    return p;
  };
  double sobol = 0, random = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Sobol s(dimensions, seed);
    double a = 0, b = 0;
    for (std::uint64_t i = 0; i < std::uint64_t(n); ++i) {
      a += f([&](int d) { return s(i, d); }) / n;
      b += f([&](int d) { return Stream(seed, i, std::uint64_t(d)).uniform(); }) / n;
    }
    sobol += (a - 1) * (a - 1) / 8;
    random += (b - 1) * (b - 1) / 8;
  }
  // A shift moves the mean of each coordinate's n points by less than 1/n, uniformly: the slopes
  // are 1/2.
  const double expected = std::sqrt(double(dimensions) / 12) * 0.5 / n;
  keeps("Sobol: rms error of a mean of 4096", std::sqrt(sobol), 2 * expected);
  breaks("random points", std::sqrt(random), 20 * expected);
  EXPECT_NE(Sobol(2, 1)(5, 0), Sobol(2, 2)(5, 0)) << "another seed, another shift";
  EXPECT_EQ(refusal([] { Sobol(38, 1); }),
            "Sobol's sequence in 38 dimensions, expected at most 37");
}

TEST(Distributions, QuantilesAndRotations) {
  double x = 0;
  const double half = 0.5, u = 0.25;
  Distribution{Distribution::Kind::uniform, 2, 4}.at(&u, &x);
  EXPECT_EQ(x, 2.5);
  Distribution{Distribution::Kind::normal, 2, 4}.at(&half, &x);
  EXPECT_EQ(x, 2);
  Distribution{Distribution::Kind::log_uniform, 1, 100}.at(&half, &x);
  EXPECT_NEAR(x, 10, 1e-14);
  // Attitudes: unit, w >= 0, and no direction preferred: the mean of R is 0.
  double worst = 0, mean[4] = {}, square[4] = {};
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    Stream s(1, std::uint64_t(i), 0);
    const double v[3] = {s.uniform(), s.uniform(), s.uniform()};
    double q[4];
    Distribution{Distribution::Kind::rotation}.at(v, q);
    worst = std::max(worst, std::fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1));
    EXPECT_GE(q[0], 0);
    for (int k = 0; k < 4; ++k) {
      mean[k] += q[k] / n;
      square[k] += q[k] * q[k] / n;
    }
  }
  keeps("| |ξ|² - 1 |", worst, 1e-15);
  for (int k = 0; k < 4; ++k)
    keeps("mean of ξ_k² less 1/4", std::fabs(square[k] - 0.25), 4 * 0.25 / std::sqrt(double(n)));
  for (int k = 1; k < 4; ++k)
    keeps("mean of ξ_k", std::fabs(mean[k]), 4 * 0.5 / std::sqrt(double(n)));
}

}  // namespace
}  // namespace porthos::ensemble::random_test
