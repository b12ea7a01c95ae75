// Thrust in orbit: kicks on the centre of mass and on the internal motion, against the plain
// mechanism in free space.
#include "space/push.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/space/support.h"

namespace porthos::test::push_test {
namespace {

using namespace space;
using Vec = std::vector<double>;

TEST(OrbitPush, OnAnArmFarFromThePlanetIsThatOfFreeSpace) {
  // A planet of almost no mass: attitude and joints go as in free space, to the order of the
  // splitting.
  const auto arm = small_arm();
  Thruster jet;
  jet.name = "jet";
  jet.link = "lower";
  jet.position = {0.3, -0.2, 1.0};
  jet.direction = {0.6, 0, 0.8};
  jet.thrust = 3;
  jet.schedule = Schedule({1, 3, 4, 5});
  const Parts parts{.thrusters = {jet}};
  auto q = arm->mechanism().neutral();
  q[7] = 0.4;
  q[8] = -0.7;
  q[9] = 0.2;
  const Vec v{0.05, -0.02, 0.03, 0.01, 0.02, -0.01, 0.3, -0.2, 0.1};
  const Vec x = arm->state(q, v);
  const double T = 6;

  const PartsModel plain(arm, parts);
  phs::State free(plain.description(), x);
  const auto gauss = integrators::make_integrator("gauss16", plain, 0.02);
  for (int i = 0; i < int(T / 0.02 + 0.5); ++i)
    ASSERT_EQ(gauss->step(free), integrators::Outcome::ok);

  Environment env;
  env.planet.mu = 1e-6;
  env.planet.radius = 1;
  const Spacecraft craft(arm, arm, env, parts);
  // The thrust is no small perturbation here: of order 2 for lobatto4, whose order 4 holds in what
  // is linear in it.
  for (const auto& [scheme, order] : {std::pair{"lobatto4", 2}, {"aba864", 4}}) {
    double before = 0;
    for (const double h : {0.1, 0.05, 0.025}) {
      phs::State s(craft.description(), craft.state(x, {{1e7, 0, 0}, {0, 0, 0}}));
      SplitIntegrator split(craft, h, {.splitting = scheme});
      for (int i = 0; i < int(T / h + 0.5); ++i) ASSERT_EQ(split.step(s), integrators::Outcome::ok);
      double off = 0, dv = 0;
      for (size_t i = 3; i < 10; ++i) off = std::max(off, std::fabs(s.x[i] - free.x[i]));
      // The centre of mass: as the momentum of free space, less what it had at the start.
      const size_t n = craft.internal_size();
      for (size_t c = 0; c < 3; ++c)
        dv = std::max(dv, std::fabs(s.x[n + 3 + c] * 30 - (free.x[10 + c] - x[10 + c])));
      const auto r = split.ledgers().report();
      const double found = before > 0 ? std::log2(before / off) : 0;
      std::printf(
          "  %-8s h = %.3f s: attitude and joints off by %.1e (order %.2f), momentum by "
          "%.1e N s; angular ledger %.1e, orbital %.1e   bound 1e-14\n",
          scheme, h, off, found, dv, r.angular_defect, r.orbital.relative());
      if (before > 0 && off > 1e-11) {
        EXPECT_GT(found, order - 0.2);
      }
      EXPECT_LE(r.angular_defect, 1e-14);
      EXPECT_LE(r.orbital.relative(), 1e-14);
      before = off;
    }
    EXPECT_LE(before, order == 2 ? 1e-6 : 1e-9);
  }
}

TEST(OrbitPush, FieldOfATiltedDipoleTurnsWithThePlanet) {
  Planet p;
  p.rotation_rate = 7.292115e-5;
  p.magnetic = MagneticDipole{3e-5, 0.2, 0.5};
  const double day = 2 * M_PI / *p.rotation_rate, a = p.radius;
  // Over its north: twice the equator's, pointing down; a day later the same, half a day later not.
  const Vec3d north{std::sin(0.2) * std::cos(0.5), std::sin(0.2) * std::sin(0.5), std::cos(0.2)};
  const Vec3d B = magnetic_field(p, (2 * a) * north, 0);
  EXPECT_NEAR(mechanics::norm(B + (2 * 3e-5 / 8) * north), 0, 1e-19);
  EXPECT_NEAR(mechanics::norm(magnetic_field(p, (2 * a) * north, day) - B), 0, 1e-18);
  EXPECT_GT(mechanics::norm(magnetic_field(p, (2 * a) * north, day / 2) - B), 1e-6);
  // No sources: its divergence is zero.
  double divergence = 0, size = 0;
  const Vec3d r{3e6, -5e6, 4e6};
  for (int c = 0; c < 3; ++c) {
    Vec3d up = r, down = r;
    up[c] += 100;
    down[c] -= 100;
    const double slope = (magnetic_field(p, up, 7)[c] - magnetic_field(p, down, 7)[c]) / 200;
    divergence += slope;
    size += std::fabs(slope);
  }
  EXPECT_LE(std::fabs(divergence), 1e-7 * size);
  p.magnetic = {};
  EXPECT_THROW(magnetic_field(p, r, 0), InvalidArgument);
}

}  // namespace
}  // namespace porthos::test::push_test
