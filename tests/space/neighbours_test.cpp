#include "tests/space/support.h"

// Bodies that float beside each other in orbit: one system about its common centre of mass.
namespace porthos::space::neighbours_test {
namespace {

using test::breaks;
using test::keeps;

std::shared_ptr<const mechanics::MechanicalModel> two_bodies() {
  mechanics::MechanismBuilder b("pair");
  for (const auto& [name, mass] : {std::pair{"base", 800.0}, {"target", 300.0}}) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = "world";
    s.joint.name = name;
    s.joint.type = "free";
    s.mass.mass = mass;
    s.mass.com = {0.1, -0.2, 0.05};
    s.mass.inertia.xx = 0.3 * mass;
    s.mass.inertia.yy = 0.2 * mass;
    s.mass.inertia.zz = 0.4 * mass;
    b.add(s);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

TEST(Neighbours, MoveAsHillClohessyAndWiltshireSay) {
  const auto pair = two_bodies();
  Environment env;
  const double a = 6878e3, n = std::sqrt(env.planet.mu / a) / a, h = 20;
  // Radial x, along the track y, across z; rates as the turning frame sees them.
  const Vec3d r0{12, -30, 4}, v0{0.004, -2 * n * 12, 0.006};  // they stay together
  const Vec3d turn{0, 0, n}, inertial = v0 + cross(turn, r0);
  const std::vector<double> q{0, 0, 0, 1, 0, 0, 0, r0.x, r0.y, r0.z, 1, 0, 0, 0};
  const std::vector<double> v{0, 0, 0, 0, 0, 0, 0, 0, 0, inertial.x, inertial.y, inertial.z};
  for (const char* splitting : {"aba864", "strang"}) {
    Spacecraft craft(pair, pair, env);
    phs::State s(craft.description(), craft.state(pair->state(q, v), {{a, 0, 0}, {0, n * a, 0}}));
    SplitIntegrator by(craft, h, {.splitting = splitting, .method = "gauss8"});
    // The relative motion is that of the centres of mass; bodies that do not turn carry them along.
    const auto centre = [&](size_t at) {
      const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&s.x[at + 3]));
      const Vec3d c = R * Vec3d{0.1, -0.2, 0.05};
      return Vec3d{s.x[at], s.x[at + 1], s.x[at + 2]} + c;
    };
    double worst = 0, momentum = 0;
    for (int k = 1; k <= 850; ++k) {  // three orbits
      ASSERT_EQ(by.step(s), integrators::Outcome::ok);
      const double t = k * h, c = std::cos(n * t), w = std::sin(n * t);
      const Vec3d e{
          (4 - 3 * c) * r0.x + w / n * v0.x + 2 / n * (1 - c) * v0.y,
          6 * (w - n * t) * r0.x + r0.y - 2 / n * (1 - c) * v0.x + (4 * w - 3 * n * t) / n * v0.y,
          r0.z * c + v0.z / n * w};
      const Vec3d there{c * e.x - w * e.y, w * e.x + c * e.y, e.z};
      worst = std::max(worst, mechanics::norm(centre(7) - centre(0) - there));
      for (size_t i = 0; i < 3; ++i)
        momentum =
            std::max(momentum, std::fabs(s.x[14 + i] + s.x[21 + i] + s.lo[14 + i] + s.lo[21 + i]));
    }
    const auto r = by.ledgers().report();
    if (std::string(splitting) == "strang") {
      breaks("the same by strang [m]", worst, 1e-4);
      continue;
    }
    keeps("three orbits of two bodies, 30 m and more apart [m]", worst, 1e-7);
    keeps("sum of their linear momenta [kg m/s]", momentum, 1e-28);
    keeps("angular momentum less impulses", r.angular_defect, 1e-14);
    keeps("next order of the gradient", r.next_order, 1e-3);
  }
}

/// The reach tells what is neglected: two bodies 3 km apart along the track against two Kepler
/// orbits. The bound of space.md holds for each, and is not ten times too large.
TEST(Neighbours, WhatIsNeglectedIsBoundedByTheReach) {
  const auto pair = two_bodies();
  Environment env;
  const double a = 6998e3, n = std::sqrt(env.planet.mu / a) / a, T = 2 * M_PI / n;
  const int steps = 400;
  const std::vector<double> q{0, 0, 0, 1, 0, 0, 0, 0, 3000, 0, 1, 0, 0, 0};
  const std::vector<double> v{0, 0, 0, 0, 0, 0, 0, 0, 0, -n * 3000, 0, 0};
  Spacecraft craft(pair, pair, env);
  phs::State s(craft.description(), craft.state(pair->state(q, v), {{a, 0, 0}, {0, n * a, 0}}));
  SplitIntegrator by(craft, T / steps, {.splitting = "aba864", .method = "gauss8"});
  const auto centre = [&](size_t at) {
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&s.x[at + 3]));
    return Vec3d{s.x[at], s.x[at + 1], s.x[at + 2]} + R * Vec3d{0.1, -0.2, 0.05};
  };
  // Each by Störmer and Verlet in its own field, in 100 parts of a step: 1e-6 m.
  struct Point {
    Vec3d r, v;
  };
  const Vec3d R0{s.x[s.x.size() - 6], s.x[s.x.size() - 5], s.x[s.x.size() - 4]},
      V0{s.x[s.x.size() - 3], s.x[s.x.size() - 2], s.x[s.x.size() - 1]};
  const double share = 300.0 / 1100.0;
  const Vec3d rel = centre(7) - centre(0), rate{-n * 3000, 0, 0};
  Point one{R0 - share * rel, V0 - share * rate},
      two{R0 + (1 - share) * rel, V0 + (1 - share) * rate};
  const double h = T / (100 * steps);
  const auto pull = [&](const Vec3d& r) {
    const double d = mechanics::norm(r);
    return (-env.planet.mu / (d * d * d)) * r;
  };
  for (int k = 0; k < 100 * steps; ++k)
    for (Point* p : {&one, &two}) {
      p->v += (h / 2) * pull(p->r);
      p->r += h * p->v;
      p->v += (h / 2) * pull(p->r);
    }
  for (int k = 0; k < steps; ++k) ASSERT_EQ(by.step(s), integrators::Outcome::ok);
  const double off = mechanics::norm((centre(7) - centre(0)) - (two.r - one.r));
  const auto r = by.ledgers().report();
  const double far = r.reach * r.reach, near = std::pow(3000 - r.reach, 2);
  const double bound = 6 * M_PI * (far + near) / a;
  keeps("relative place after an orbit off two Kepler orbits [m]", off, bound);
  breaks("ten times that [m]", 10 * off, bound);
  keeps("reported next order less 3/2 r/R, of it",
        std::fabs(r.next_order / (1.5 * r.reach / a) - 1), 1e-2);
}

TEST(Neighbours, OneThatIsFarAwayIsRefused) {
  const auto pair = two_bodies();
  Environment env;
  const Spacecraft craft(pair, pair, env);
  std::vector<double> q{0, 0, 0, 1, 0, 0, 0, 9e3, 0, 0, 1, 0, 0, 0}, v(12, 0.0);
  const auto at = [&] { return craft.state(pair->state(q, v), {{7e6, 0, 0}, {0, 7.5e3, 0}}); };
  EXPECT_EQ(test::refusal([&] { (void)at(); }), "");
  q[7] = 11e3;
  EXPECT_NE(test::refusal([&] { (void)at(); }).find("km from the common centre of mass"),
            std::string::npos);
}

TEST(Split, CorrectedKicksTakeTheTermInEpsilonSquaredAway) {
  // A body that librates in the gradient, where the coupling is as large as the rest. Both step
  // forwards alone.
  const auto body = test::rigid_body(1000, {2000, 12250, 11000});
  Environment env;
  const double a = 6878e3, n = std::sqrt(env.planet.mu / a) / a;
  const double xi[] = {std::cos(0.3), 0.1 * std::sin(0.3), 0, std::sqrt(0.99) * std::sin(0.3)};
  const auto fly = [&](const char* splitting, double h) {
    Spacecraft craft(body, body, env);
    phs::State s(craft.description(), craft.state(test::body_state(*body, xi, {0, 0, 1.3 * n}),
                                                  {{a, 0, 0}, {0, n * a, 0}}));
    SplitIntegrator by(craft, h, {.splitting = splitting});
    for (int k = 0; k < int(std::lround(16000 / h)); ++k) (void)by.step(s);
    keeps("angular momentum less impulses", by.ledgers().report().angular_defect, 1e-14);
    return s;
  };
  const auto exact = fly("aba864", 10);
  const auto off = [&](const char* splitting, double h) {
    const auto s = fly(splitting, h);
    double d = 0;
    for (size_t k = 3; k < 7; ++k) d = std::max(d, std::fabs(s.x[k] - exact.x[k]));
    return d;
  };
  for (const auto& [plain, corrected] :
       {std::pair{"lobatto4", "lobatto4c"}, {"lobatto8", "lobatto8c"}}) {
    const double p1 = off(plain, 40), p2 = off(plain, 20), c1 = off(corrected, 40),
                 c2 = off(corrected, 20);
    std::printf("  %s %.1e %.1e order %.2f; corrected %.1e %.1e order %.2f\n", plain, p1, p2,
                std::log2(p1 / p2), c1, c2, std::log2(c1 / c2));
    EXPECT_NEAR(std::log2(p1 / p2), 2, 0.2);
    EXPECT_GT(std::log2(c1 / c2), 3.5);
    EXPECT_LT(c1, 0.02 * p1);
  }
}

}  // namespace
}  // namespace porthos::space::neighbours_test
