// An impact with friction at one point: closed forms, and no energy from nothing.
#include "contact/friction_impact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "phs/error.h"

namespace porthos::contact::friction_impact_test {
namespace {

/// An impact in the plane of its normal and one tangent.
struct PlanarImpact {
  double nn, nt, tt, normal, tangent;
  operator PointImpact() const {
    return {{{{nn, nt, 0}, {nt, tt, 0}, {0, 0, 0}}}, {normal, tangent, 0}};
  }
};
/// A rod of half-length 1 and mass 1 at the angle θ to the ground, which its lower end touches.
struct Rod {
  double c, s, inertia = 1.0 / 3;
  explicit Rod(double angle) : c(std::cos(angle)), s(std::sin(angle)) {}
  /// From the rates of its centre and its spin.
  PlanarImpact impact(double vx, double vy, double spin) const {
    // The end is at (-c, -s) from the centre: its rate is v + spin × r.
    return {1 + c * c / inertia, -c * s / inertia, 1 + s * s / inertia, vy - spin * c,
            vx + spin * s};
  }
};
double kinetic(const PlanarImpact& w, double un, double ut) {
  // ½ uᵀ W⁻¹ u: the part of the kinetic energy that an impulse at the point can change
  const double det = w.nn * w.tt - w.nt * w.nt;
  return 0.5 * (w.tt * un * un - 2 * w.nt * un * ut + w.nn * ut * ut) / det;
}

TEST(FrictionImpact, WithoutFrictionItIsNewtons) {
  const PlanarImpact w = Rod(0.9).impact(0.3, -2, 0.4);
  const auto r = impact_with_friction(w, 0.6, 0);
  EXPECT_NEAR(r.u[0], -0.6 * w.normal, 1e-15);
  EXPECT_NEAR(r.impulse[0], -1.6 * w.normal / w.nn, 1e-15);
  EXPECT_EQ(r.impulse[1], 0);
  EXPECT_NEAR(r.normal_loss, (1 - 0.36) * w.normal * w.normal / (2 * w.nn), 1e-15);
}

/// A point mass that sticks before the impact ends keeps no slip; one that slips through has lost
/// μ (1 + e) of its normal rate.
TEST(FrictionImpact, PointMass) {
  const PlanarImpact mass{0.5, 0, 0.5, -1, 3};
  const auto slips = impact_with_friction(mass, 0.5, 0.4),
             sticks = impact_with_friction(mass, 0.5, 4);
  EXPECT_NEAR(slips.u[1], 3 - 0.4 * 1.5, 1e-15);
  EXPECT_EQ(sticks.u[1], 0);
  EXPECT_NEAR(sticks.u[0], 0.5, 1e-15);
  EXPECT_NEAR(sticks.impulse[1], -3 / 0.5, 1e-14);
}

/// 40 000 rods with μ up to 2, among them Painlevé's: the point leaves, no energy is made, losses
/// are what is missing, and neither is negative. Control: Newton's e with Coulomb's friction of
/// the whole impulse makes energy.
TEST(FrictionImpact, NoRodGainsEnergy) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  double gained = -1, booked = 0, least = 0, approach = 0, control = -1;
  int paradoxes = 0;
  for (int trial = 0; trial < 40000; ++trial) {
    const Rod rod(0.05 + 1.47 * unit(random));
    const double e = unit(random), mu = 2 * unit(random);
    PlanarImpact w = rod.impact(8 * unit(random) - 4, -4 * unit(random), 8 * unit(random) - 4);
    if (!(w.normal < 0)) w.normal = -w.normal - 1e-3;
    const double before = kinetic(w, w.normal, w.tangent);
    const auto r = impact_with_friction(w, e, mu);
    const double change = kinetic(w, r.u[0], r.u[1]) - before;
    gained = std::max(gained, change / before);
    booked = std::max(booked, std::fabs(change + r.normal_loss + r.friction_loss) / before);
    least = std::min({least, r.normal_loss, r.friction_loss});
    approach = std::max(approach, -r.u[0]);
    paradoxes += w.nn - mu * std::fabs(w.nt) < 0;
    // Newton's e, and the impulse that stops the slip or the limit against it
    const double det = w.nn * w.tt - w.nt * w.nt, dn = -(1 + e) * w.normal;
    double pn = (w.tt * dn + w.nt * w.tangent) / det, pt = (-w.nn * w.tangent - w.nt * dn) / det;
    if (std::fabs(pt) > mu * pn) {
      const double f = w.tangent > 0 ? -mu : mu;
      pn = dn / (w.nn + w.nt * f);
      pt = f * pn;
    }
    if (pn > 0)
      control = std::max(control, (kinetic(w, w.normal + w.nn * pn + w.nt * pt,
                                           w.tangent + w.nt * pn + w.tt * pt) -
                                   before) /
                                      before);
  }
  std::printf(
      "  energy gained %.1e   bound 1e-12 (Newton and Coulomb: %.2f); losses off by %.1e   bound "
      "1e-11; least loss %.1e J   bound -1e-14; %d rods of Painleve\n",
      gained, control, booked, least, paradoxes);
  EXPECT_LE(gained, 1e-12);
  EXPECT_LE(booked, 1e-11);
  EXPECT_GE(least, -1e-14);
  EXPECT_LE(approach, 0);
  EXPECT_GT(paradoxes, 100);
  EXPECT_GT(control, 0.1);
}

/// 20 000 impacts in space, whose slip turns: no energy is made, the losses are what is missing,
/// the friction is never more than μ times the normal impulse, and another choice of the directions
/// across the normal gives the same. Control: the friction of the first slip alone, for the whole
/// impact, is another.
TEST(FrictionImpact, InSpaceItTurnsWithTheSlip) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  double booked = 0, least = 0, beyond = -1, turned = 0, control = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    double B[3][4];
    for (auto& row : B)
      for (double& b : row) b = normal(random);
    PointImpact w;
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j)
        for (size_t k = 0; k < 4; ++k) w.W[i][j] += B[i][k] * B[j][k] + (i == j ? 0.05 : 0);
    w.u = {-unit(random), normal(random), normal(random)};
    const double e = unit(random), mu = 1.5 * unit(random);
    const auto r = impact_with_friction(w, e, mu);
    double change = 0, before = 0;
    for (size_t i = 0; i < 3; ++i) {
      change += 0.5 * r.impulse[i] * (w.u[i] + r.u[i]);
      before += std::fabs(r.impulse[i] * w.u[i]);
    }
    booked = std::max(booked, std::fabs(change + r.normal_loss + r.friction_loss) / before);
    least = std::min({least, r.normal_loss, r.friction_loss});
    beyond = std::max(beyond, std::hypot(r.impulse[1], r.impulse[2]) / r.impulse[0] - mu);
    // The same with the directions turned by 0.7 rad
    const double c = std::cos(0.7), s = std::sin(0.7), Q[3][3] = {{1, 0, 0}, {0, c, s}, {0, -s, c}};
    PointImpact other;
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) {
        other.u[i] += Q[i][j] * w.u[j];
        for (size_t k = 0; k < 3; ++k)
          for (size_t l = 0; l < 3; ++l) other.W[i][j] += Q[i][k] * w.W[k][l] * Q[j][l];
      }
    const auto same = impact_with_friction(other, e, mu);
    const double size = std::fabs(w.u[0]) + std::hypot(w.u[1], w.u[2]);
    turned = std::max(turned, std::hypot(same.u[0] - r.u[0], same.u[1] - c * r.u[1] - s * r.u[2],
                                         same.u[2] + s * r.u[1] - c * r.u[2]) /
                                  size);
    const double slip = std::hypot(w.u[1], w.u[2]);
    control = std::max(control, std::hypot(r.impulse[1] + mu * r.impulse[0] * w.u[1] / slip,
                                           r.impulse[2] + mu * r.impulse[0] * w.u[2] / slip) /
                                    r.impulse[0]);
  }
  std::printf(
      "  losses off by %.1e   bound 1e-9; least loss %.1e J   bound 0; friction beyond mu by %.1e  "
      " bound 1e-10; other directions %.1e   bound 1e-8; control %.1e\n",
      booked, least, beyond, turned, control);
  EXPECT_LE(booked, 1e-9);
  EXPECT_GE(least, 0);
  EXPECT_LE(beyond, 1e-10);
  EXPECT_LE(turned, 1e-8);
  EXPECT_GT(control, 0.1);
}

TEST(FrictionImpact, RefusesWhatIsNoImpact) {
  const auto refused = [](const PlanarImpact& w, double e, double mu) {
    try {
      impact_with_friction(w, e, mu);
    } catch (const InvalidArgument& why) {
      return std::string(why.what());
    }
    return std::string();
  };
  const PlanarImpact w{1, 0, 1, -1, 0};
  EXPECT_EQ(refused(w, 1.5, 0), "restitution is 1.5, expected 0 to 1");
  EXPECT_EQ(refused(w, 1, -1), "friction is -1, expected 0 or more");
  EXPECT_EQ(refused(PlanarImpact{1, 2, 1, -1, 0}, 1, 0),
            "the determinant of W is -3, expected more than 0");
  EXPECT_EQ(impact_with_friction(PlanarImpact{1, 0, 1, 2, 3}, 1, 1).u[1], 3);
}

}  // namespace
}  // namespace porthos::contact::friction_impact_test
