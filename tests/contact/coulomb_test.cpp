// Friction at several contacts: the forces of closed ones, and impacts at one instant.
#include "contact/detail/coulomb.h"

#include <gtest/gtest.h>

#include <random>

#include "contact/detail/rough_impact.h"

namespace porthos::contact::coulomb_test {
namespace {

using phs::Quad;

/// Rows of `contacts` points on a random mechanism of 3 freedoms each and 3 more: all normals, then
/// two directions for each point.
struct Points {
  size_t m, contacts;
  std::vector<double> W;
  std::vector<Rubbing> rubs;

  Points(size_t count, std::mt19937_64& random) : m(3 * count), contacts(count), W(m * m, 0.0) {
    std::normal_distribution<double> normal;
    const size_t freedoms = m + 3;
    std::vector<double> G(m * freedoms);
    for (double& each : G) each = normal(random);
    for (size_t i = 0; i < m; ++i)
      for (size_t j = 0; j < m; ++j)
        for (size_t k = 0; k < freedoms; ++k)
          W[i * m + j] += G[i * freedoms + k] * G[j * freedoms + k];
    for (size_t k = 0; k < contacts; ++k) rubs.push_back({k, contacts + 2 * k, 0, false});
  }
  double w(size_t i, const std::vector<double>& a, const std::vector<double>& lambda) const {
    double sum = a[i];
    for (size_t k = 0; k < m; ++k) sum += W[i * m + k] * lambda[k];
    return sum;
  }
};

/// The conditions of every solution, for up to 4 points that slide or stick.
TEST(Coulomb, ForcesMeetTheirConditions) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  Coulomb solver(12);
  double off = 0, pulled = 0;
  size_t solved = 0, jammed = 0, pressed = 0, all = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    Points points(1 + size_t(trial) % 4, random);
    std::vector<double> a(points.m), lambda(points.m);
    for (double& each : a) each = normal(random);
    for (Rubbing& r : points.rubs) {
      r.mu = unit(random);
      r.sticks = unit(random) < 0.5;
    }
    if (!solver.solve(points.W, a, points.contacts, points.rubs, lambda)) {
      ++jammed;
      continue;
    }
    ++solved;
    for (const Rubbing& r : points.rubs) {
      const double n = lambda[r.normal], w = points.w(r.normal, a, lambda);
      pulled = std::max({pulled, -n, -w, std::min(n, w)});
      ++all;
      pressed += n > 0;
      if (r.sticks)
        off = std::max({off, std::fabs(points.w(r.across, a, lambda)),
                        std::fabs(points.w(r.across + 1, a, lambda))});
      else
        off = std::max({off, std::fabs(lambda[r.across] + r.mu * n), lambda[r.across + 1]});
    }
  }
  std::printf(
      "  %zu solved, %zu jam; %zu of %zu points press; conditions of the normals off by %.1e   "
      "bound 1e-9, of friction by %.1e   bound 1e-9\n",
      solved, jammed, pressed, all, pulled, off);
  EXPECT_LE(pulled, 1e-9);
  EXPECT_LE(off, 1e-9);
  EXPECT_GT(jammed, 10u);
  EXPECT_GT(pressed, all / 5);
  EXPECT_LT(pressed, all * 4 / 5);
}

/// A direction in which nothing can move bears no friction, and two that are one bear it once.
TEST(Coulomb, NothingMovesAcrossAPlane) {
  // A mass of 1 kg in the plane x, z, with the directions (c, s) and (-s, c) across z.
  const double c = 0.6, s = 0.8;
  const std::vector<double> W{1, 0, 0, 0, c * c, -c * s, 0, -c * s, s * s}, a{-10, 3 * c, -3 * s};
  std::vector<double> lambda(3);
  Coulomb solver(3);
  ASSERT_TRUE(solver.solve(W, a, 1, std::vector<Rubbing>{{0, 1, 0.5, true}}, lambda));
  EXPECT_NEAR(lambda[0], 10, 1e-14);
  EXPECT_NEAR(lambda[1], -3 * c, 1e-14);
  EXPECT_NEAR(lambda[2], 3 * s, 1e-14);
}

/// Three feet of 1 kg on parallel legs of a body that weighs nothing across them: one force of 6 N
/// pushes all, and each bears what its load lets it. Control: with a foot that is by itself, which
/// shares nothing.
TEST(Coulomb, FeetThatHoldEachOtherShareTheirFriction) {
  std::vector<double> W(144, 0), a(12, 0), lambda(12);
  std::vector<Rubbing> rubs;
  for (size_t i = 0; i < 4; ++i) {
    W[13 * i] = 1;
    a[i] = -10.0 * double(i + 1);
    rubs.push_back({i, 4 + 2 * i, 0.5, true});
    for (size_t k = 0; k < 4; ++k)
      if ((i < 3) == (k < 3))
        for (size_t x = 0; x < 2; ++x) W[(4 + 2 * i + x) * 12 + 4 + 2 * k + x] = 1;
    a[4 + 2 * i] = -6;
  }
  Coulomb solver(12);
  ASSERT_TRUE(solver.solve(W, a, 4, rubs, lambda));
  double off = 0, across = 0;
  for (size_t i = 0; i < 3; ++i) off = std::max(off, std::fabs(lambda[4 + 2 * i] - double(i + 1)));
  for (size_t i = 0; i < 4; ++i) across = std::max(across, std::fabs(lambda[5 + 2 * i]));
  std::printf("  shares off by %.1e N   bound 1e-14; across by %.1e N   bound 1e-14\n", off,
              across);
  EXPECT_LE(off, 1e-14);
  EXPECT_LE(across, 1e-14);
  EXPECT_NEAR(lambda[10], 6, 1e-14);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(solver.shared(i), i < 3);
}

/// 4000 impacts of up to 4 points at one instant: no energy is made, no loss is negative, no
/// friction is beyond μ times its normal impulse, and in the end nothing approaches. Points that
/// push each other hard may need more than one call, as a run makes them at one instant.
/// Control: Newton's e with Coulomb's friction at each point, in the same order, makes energy.
TEST(RoughImpact, NoSequenceGainsEnergy) {
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  RoughImpact impact(12);
  double gained = -1, booked = 0, least = 0, beyond = -1, left = 0, control = -1;
  int most_calls = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    Points points(1 + size_t(trial) % 4, random);
    const size_t m = points.m;
    std::vector<Quad> W(points.W.begin(), points.W.end()), v(m);
    std::vector<double> e(points.contacts), before(m), newton(m);
    for (size_t i = 0; i < m; ++i) v[i] = before[i] = newton[i] = normal(random);
    for (size_t k = 0; k < points.contacts; ++k) e[k] = unit(random);
    for (Rubbing& r : points.rubs) r.mu = 1.5 * unit(random);
    ASSERT_TRUE(impact.solve(W, v, e, points.rubs));
    double change = 0, size = 0, losses = 0, fastest = 1e-300;
    for (size_t i = 0; i < m; ++i) {
      const double iota = double(impact.impulses()[i]);
      change += 0.5 * iota * (before[i] + double(v[i]));
      size += std::fabs(iota * before[i]);
    }
    for (const Rubbing& r : points.rubs) {
      const size_t i = r.normal;
      losses += impact.normal_loss(i) + impact.friction_loss(i);
      least = std::min({least, impact.normal_loss(i), impact.friction_loss(i)});
      fastest = std::max(fastest, -before[i]);
      const auto iota = impact.impulses();
      beyond = std::max(beyond, std::hypot(double(iota[r.across]), double(iota[r.across + 1])) -
                                    r.mu * double(iota[i]));
    }
    const auto approach = [&] {
      double most = 0;
      for (size_t i = 0; i < points.contacts; ++i) most = std::max(most, -double(v[i]));
      return most / fastest;
    };
    int calls = 1;
    for (; calls < 100 && approach() > 1e-12; ++calls) {
      ASSERT_TRUE(impact.solve(W, v, e, points.rubs));
      for (size_t i = 0; i < points.contacts; ++i)
        least = std::min({least, impact.normal_loss(i), impact.friction_loss(i)});
    }
    most_calls = std::max(most_calls, calls);
    left = std::max(left, approach());
    if (size > 0) {
      gained = std::max(gained, change / size);
      booked = std::max(booked, std::fabs(change + losses) / size);
    }
    double made = 0;
    for (int k = 0; k < 20; ++k) {
      const size_t i =
          size_t(std::min_element(newton.begin(), newton.begin() + long(points.contacts)) -
                 newton.begin());
      if (!(newton[i] < 0)) break;
      const Rubbing& r = points.rubs[i];
      const double slip = std::hypot(newton[r.across], newton[r.across + 1]);
      double f[3]{1, -r.mu * newton[r.across] / slip, -r.mu * newton[r.across + 1] / slip};
      const size_t rows[3]{i, r.across, r.across + 1};
      double yields = 0;
      for (size_t j = 0; j < 3; ++j) yields += points.W[i * m + rows[j]] * f[j];
      if (!(yields > 0)) break;
      const double p = -(1 + e[i]) * newton[i] / yields;
      for (size_t l = 0; l < 3; ++l) {
        const double old = newton[rows[l]];
        for (size_t j = 0; j < m; ++j) newton[j] += points.W[j * m + rows[l]] * f[l] * p;
        made += 0.5 * f[l] * p * (old + newton[rows[l]]);
      }
      control = std::max(control, made / size);
    }
  }
  std::printf(
      "  energy gained %.1e of its turnover   bound 1e-11 (Newton and Coulomb: %.1e); losses off "
      "by %.1e   bound 1e-10; least loss %.1e J   bound 0; friction beyond mu by %.1e N s   bound "
      "1e-9; approach left %.1e   bound 1e-12, after %d calls or fewer\n",
      gained, control, booked, least, beyond, left, most_calls);
  EXPECT_LE(gained, 1e-11);
  EXPECT_LE(booked, 1e-10);
  EXPECT_GE(least, 0);
  EXPECT_LE(beyond, 1e-9);
  EXPECT_LE(left, 1e-12);
  EXPECT_GT(control, 0.1);
}

}  // namespace
}  // namespace porthos::contact::coulomb_test
