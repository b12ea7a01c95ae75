// An impact with friction at one point: closed forms, and no energy from nothing.
#include "contact/friction_impact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "phs/error.h"

namespace porthos::contact::friction_impact_test {
namespace {

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
  EXPECT_NEAR(r.normal, -0.6 * w.normal, 1e-15);
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
  EXPECT_NEAR(slips.tangent, 3 - 0.4 * 1.5, 1e-15);
  EXPECT_EQ(sticks.tangent, 0);
  EXPECT_NEAR(sticks.normal, 0.5, 1e-15);
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
    const double change = kinetic(w, r.normal, r.tangent) - before;
    gained = std::max(gained, change / before);
    booked = std::max(booked, std::fabs(change + r.normal_loss + r.friction_loss) / before);
    least = std::min({least, r.normal_loss, r.friction_loss});
    approach = std::max(approach, -r.normal);
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
  EXPECT_EQ(refused({1, 2, 1, -1, 0}, 1, 0), "the determinant of W is -3, expected more than 0");
  EXPECT_EQ(impact_with_friction({1, 0, 1, 2, 3}, 1, 1).tangent, 3);
}

}  // namespace
}  // namespace porthos::contact::friction_impact_test
