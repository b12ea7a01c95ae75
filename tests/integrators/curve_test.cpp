// A point on a curve, on a line, on a plane: closed forms, derivatives, order, energy, the bits of
// lanes, and what is refused.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/constraints/plane_curve.h"
#include "tests/integrators/problems.h"
#include "tests/support/exact_start.h"
#include "tests/support/robots.h"

namespace porthos::integrators::curve_test {
namespace {

using mechanics::PlaneCurve;
using phs::Quad;
using test::Linkage;
using test::Vec;
using Points = std::vector<PlaneCurve::Point>;

constexpr double pi = phs::pi_hi, g = 9.8125;

Points circle(int n) {
  Points p;
  for (int i = 0; i < n; ++i) p.push_back({std::sin(2 * pi * i / n), -std::cos(2 * pi * i / n)});
  return p;
}
/// y = x²/2 from -2 to 2, in binary fractions.
Points parabola() {
  Points p;
  for (int i = -8; i <= 8; ++i) p.push_back({0.25 * i, 0.03125 * i * i});
  return p;
}
/// The tautochrone of height 2, its lowest point at the origin.
Points cycloid(int n) {
  Points p;
  for (int i = 0; i <= n; ++i) {
    const double phi = -2.75 + 5.5 * i / n;
    p.push_back({phi + std::sin(phi), 1 - std::cos(phi)});
  }
  return p;
}
const Points bean{{1, 0},         {0.75, 0.75}, {0, 0.5},     {-1, 0.75},
                  {-1.25, -0.25}, {0, -1},      {0.75, -0.75}};

Linkage body_on(const char* joint, Vec q, Vec v, const mechanics::LoopJoint& loop) {
  mechanics::MechanismBuilder b("bead");
  mechanics::BodySpec body;
  body.name = "bead";
  body.parent = "world";
  body.joint.name = "bead";
  body.joint.type = joint;
  body.mass = {0.5, {0, 0, 0}, {0.1, 0, 0, 0.1, 0, 0.1}, mechanics::Mat3<double>::identity()};
  b.add(body).gravity({0, -g, 0});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, std::move(q), std::move(v)};
  l.spec.loops.push_back(loop);
  return l;
}
/// A bead that slides in the plane z = 0 under gravity along -y, at rest at (x, y).
Linkage bead(const Points& points, bool closed, double x, double y) {
  mechanics::LoopJoint track{"track", "on_curve", {}, test::at("bead", 0, 0)};
  track.points = points;
  track.closed = closed;
  Linkage l = body_on("planar", {0, 0, 0}, {0, 0, 0}, track);
  l.q[size_t(l.mechanism->coordinate("bead.x").q)] = x;
  l.q[size_t(l.mechanism->coordinate("bead.y").q)] = y;
  return l;
}
/// Coordinates "bead.x" and "bead.y" at time T, after so many steps of spark16.
std::array<double, 2> place_after(Linkage l, double T, int steps, const Options& o = {}) {
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const auto method = make_integrator("spark16", model, T / steps, o);
  for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), Outcome::ok) << i;
  return {s.x[size_t(l.mechanism->coordinate("bead.x").q)],
          s.x[size_t(l.mechanism->coordinate("bead.y").q)]};
}
std::string refusal(Linkage l) {
  try {
    l.start();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

/// On a circle it is a pendulum of 1 m: at a quarter of its period it is at the lowest point. The
/// interpolation is exact, so few points do. A rounding of the points moves the lowest point by
/// 1e-16 m; those of 64 steps at 5.3 m/s end at 1e-15 m.
TEST(OnCurve, OnACircleItIsAPendulum) {
  const double start = 2;  // rad
  double a = 1, b = std::cos(start / 2);
  while (std::fabs(a - b) > 1e-15) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  const double quarter = pi / (2 * a) / std::sqrt(g);
  for (const int n : {3, 8, 64}) {
    const auto l = bead(circle(n), true, std::sin(start), -std::cos(start));
    const auto end = place_after(l, quarter, 64);
    const double error = std::hypot(end[0], end[1] + 1);
    std::printf("  %d points: error %.1e m, 1e-14 allowed\n", n, error);
    EXPECT_LT(error, 1e-14);
  }
  // Control: a square's corners and middles of sides are points of another curve.
  const auto end =
      place_after(bead({{1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}}, true,
                       std::sin(start), -std::cos(start)),
                  quarter, 64);
  EXPECT_GT(std::hypot(end[0], end[1] + 1), 1e-2);
}

/// On the parabola y = x²/2 a quarter of the period from rest at x = a takes E(-a²)/√g. The
/// integral of sqrt(1 + a² sin²) over a quarter is a mean of equal steps, to rounding.
TEST(OnCurve, OnAParabola) {
  for (const double a : {0.5, 1.5}) {
    long double E = 0;
    constexpr int n = 64;
    for (int i = 0; i < n; ++i) {
      const long double s = std::sin(3.14159265358979323846L * (i + 0.5L) / (2 * n));
      E += std::sqrt(1 + a * a * s * s) / n;
    }
    const double quarter = double(E * 3.14159265358979323846L / 2 / std::sqrt((long double)g));
    const auto l = bead(parabola(), false, a, a * a / 2);
    const double error = std::fabs(place_after(l, quarter, 64)[0]);
    const double control = std::fabs(place_after(l, 1.0001 * quarter, 64)[0]);
    std::printf("  from %.1f m: error %.1e m, 1e-14 allowed; control %.1e\n", a, error, control);
    EXPECT_LT(error, 1e-14);
    EXPECT_GT(control, 1e-5);
  }
}

/// On a cycloid the way down takes π sqrt(1/g) from anywhere. No interpolation of it is exact:
/// errors fall as the fourth power of the distance between points.
TEST(OnCurve, OnACycloidAllPeriodsAreEqual) {
  for (const double phi : {0.5, 2.0}) {
    Vec errors;
    for (const int n : {16, 32, 64, 128}) {
      const auto l = bead(cycloid(n), false, phi + std::sin(phi), 1 - std::cos(phi));
      errors.push_back(std::fabs(place_after(l, pi * std::sqrt(1 / g), 64)[0]));
    }
    std::printf("  from %.1f: errors %.1e %.1e %.1e %.1e m\n", phi, errors[0], errors[1], errors[2],
                errors[3]);
    EXPECT_LT(errors[3], errors[0] / 512);  // 4096 at order 4, 64 at order 2
    EXPECT_LT(errors[3], 1e-6);
  }
}

/// On a 3-4-5 slope gravity is 0.6 g, whatever the body turns: SPARK of order 16 is exact for the
/// parabola of time, and 12 m and 64 steps round by 1e-14 m.
TEST(OnCurve, OnALineAndOnAPlaneGravityIsUniform) {
  const mechanics::Mat3<double> along{{0, 0, 1}, {-0.6, -0.8, 0}, {0.8, -0.6, 0}};
  const mechanics::Mat3<double> normal{{0.8, -0.6, 0}, {0, 0, -1}, {0.6, 0.8, 0}};
  const double t = 2, s = 0.5 * 0.6 * g * t * t;
  const auto miss = [&](const mechanics::LoopJoint& loop, double side, double turning) {
    Linkage l = body_on("free", {}, {turning, 2 * turning, 3 * turning, 0, 0, side}, loop);
    l.q = l.mechanism->neutral();
    const auto model = l.model();
    phs::State x(model.description(), l.start());
    const auto method = make_integrator("spark16", model, t / 64);
    for (int i = 0; i < 64; ++i) EXPECT_EQ(method->step(x), Outcome::ok) << i;
    return std::hypot(x.x[0] - 0.8 * s, x.x[1] + 0.6 * s, x.x[2] - side * t);
  };
  const auto loop = [](const char* type, const mechanics::Mat3<double>& axes) {
    return mechanics::LoopJoint{"track", type, {"", {axes, {0, 0, 0}}}, test::at("bead", 0, 0)};
  };
  const double on_plane = miss(loop("on_plane", normal), 1, 1);
  const double on_line = miss(loop("on_line", along), 0, 1);
  const double control = miss(loop("on_plane", along), 1, 1);
  std::printf("  errors on a plane %.1e m, on a line %.1e m, 5e-14 allowed; control %.1e m\n",
              on_plane, on_line, control);
  EXPECT_LT(on_plane, 5e-14);
  EXPECT_LT(on_line, 5e-14);
  EXPECT_GT(control, 1);
}

TEST(OnCurve, TheGradientIsTheDerivative) {
  double worst = 0, control = HUGE_VAL;
  for (const auto& [points, closed] : {std::pair{bean, true}, {cycloid(16), false}}) {
    const PlaneCurve curve(points, closed, "track");
    for (int i = 0; i < 100; ++i) {
      const double a = 0.0628 * i, r = closed ? 1 : 0.2;
      const Quad x = r * std::cos(a), y = closed ? r * std::sin(a) : 0.75 + r * std::sin(a);
      // Beside the centre of curvature nothing is smooth; the places keep away from it.
      const Quad h = 1e-9;
      const auto d = curve.distance(x, y);
      const Quad dx = (curve.distance(x + h, y).value - curve.distance(x - h, y).value) / (2 * h);
      const Quad dy = (curve.distance(x, y + h).value - curve.distance(x, y - h).value) / (2 * h);
      worst =
          std::max(worst, double(phs::sqrt((dx - d.nx) * (dx - d.nx) + (dy - d.ny) * (dy - d.ny))));
      const auto beside = curve.distance(x + Quad(1e-6), y + Quad(1e-6));
      control = std::min(control, double(phs::abs(dx - beside.nx) + phs::abs(dy - beside.ny)));
    }
  }
  std::printf("  gradient against differences %.1e, 1e-15 allowed; control %.1e\n", worst, control);
  // h² times a third derivative of about 10 /m² are 2e-17, roundings of 113 bits 1e-25.
  EXPECT_LT(worst, 1e-15);
  EXPECT_GT(control, 1e-10);  // the gradient 1.4 µm beside it
}

TEST(OnCurve, KeepsEnergyAndTheCurve) {
  struct Kept {
    double gap = 0, rms = 0, early = 0;
  };
  const auto run = [](const Points& points, const std::string& name, double h) {
    auto l = bead(points, true, 0.1, 1);
    l.v[size_t(l.mechanism->coordinate("bead.x").v)] = -3;  // round and round
    const auto model = l.model();
    test::Gauge gauge(model);
    phs::State s(model.description(), l.start());
    const auto rows = model.instantiate<double>()->constraints();
    const auto method = make_integrator(name, model, h);
    const long double first = gauge.energy(s);
    Kept k;
    double sum = 0;
    Vec r(size_t(rows->count()));
    constexpr int steps = 1 << 14;
    for (int i = 1; i <= steps; ++i) {
      EXPECT_EQ(method->step(s), Outcome::ok) << i;
      rows->place(s.x, r);
      for (const double x : r) k.gap = std::max(k.gap, std::fabs(x));
      const double error = double(gauge.energy(s) - first);
      sum += error * error;
      if (i == steps / 16) k.early = std::sqrt(sum / i);
    }
    k.rms = std::sqrt(sum / steps);
    std::printf("  %s, %zu points, h %.1e s: gap %.1e m, rms energy error %.1e J, of a 16th %.1e\n",
                name.c_str(), points.size(), h, k.gap, k.rms, k.early);
    return k;
  };
  for (const Points& points : {circle(24), bean}) {
    const Kept k = run(points, "spark16", 1. / 256);
    EXPECT_LT(k.gap, 1e-15);
    // 1.1e-17 sqrt(N) of 10 J, as of a four-bar, are 1.4e-14 J.
    EXPECT_LT(k.rms, 2e-14);  // with normals rounded in double 3.5e-14 on the bean, growing as t
  }
  EXPECT_GT(run(bean, "spark4", 1. / 256).rms, 1e-9);  // control
}

/// The curve is analytic, so no step loses order, wherever it passes points.
TEST(OnCurve, OrderIsThatOfTheMethod) {
  auto l = bead(bean, true, 0.1, 0.6);
  l.v[size_t(l.mechanism->coordinate("bead.x").v)] = -2;
  const auto model = l.model();
  const auto x = test::exact_start(l, model);
  const auto end = [&](const std::string& name, int steps) {
    phs::BasicState<Quad> s(model.description(), x);
    const auto method = make_basic_integrator<Quad>(name, model, Quad(0.5) / steps, {});
    for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), Outcome::ok);
    for (size_t i = 0; i < s.x.size(); ++i) s.x[i] += s.lo[i];
    return s.x;
  };
  const auto exact = end("spark16", 256);
  for (const auto& [name, order, steps] :
       {std::tuple{"spark4", 4, 128}, {"spark8", 8, 64}, {"spark16", 16, 8}}) {
    const double e1 = test::distance(end(name, steps), exact),
                 e2 = test::distance(end(name, 2 * steps), exact);
    std::printf("  %s: errors %.1e, %.1e, order %.2f\n", name, e1, e2, std::log2(e1 / e2));
    EXPECT_NEAR(std::log2(e1 / e2), order, 0.1 * order);
  }
}

TEST(OnCurve, LanesHaveTheSameBits) {
  const auto l = bead(bean, true, 1, 0);
  EXPECT_EQ(place_after(l, 1, 64), place_after(l, 1, 64, {.lanes = false}));
  EXPECT_NE(place_after(l, 1, 64), place_after(l, 1, 65));  // control
}

/// The distance, its sign and its gradient where they are known; closed curves meet their start.
TEST(OnCurve, DistanceIsSigned) {
  const PlaneCurve line({{0, 0}, {1, 1}, {2, 2}, {3, 3}}, false, "line");
  const auto d = line.distance(Quad(3.25), Quad(2.75));
  EXPECT_NEAR(double(d.value + phs::sqrt(Quad(0.125))), 0, 1e-15);  // right of it
  EXPECT_NEAR(double(d.nx + phs::sqrt(Quad(0.5))), 0, 1e-15);
  EXPECT_TRUE(std::isnan(line.distance(4.5, 4.5).value));  // beyond an end
  const PlaneCurve ring(circle(12), true, "ring");
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const double a = 0.05 * i, r = 0.5 + 0.005 * i;
    const auto out = ring.distance(phs::Dual(r * std::cos(a), std::cos(a)),
                                   phs::Dual(r * std::sin(a), std::sin(a)));
    // counterclockwise: the inside is left
    worst = std::max({worst, std::fabs(out.value.v - (1 - r)), std::fabs(out.value.d + 1)});
  }
  std::printf("  distance from a circle: %.1e, 1e-15 allowed\n", worst);
  EXPECT_LT(worst, 1e-15);
  // Across the start of the ring nothing jumps: x is 1e-9 m on either side of it.
  const auto a = ring.distance(1e-9, -1.25), b = ring.distance(-1e-9, -1.25);
  EXPECT_NEAR(a.value, b.value, 1e-15);
  EXPECT_NEAR(a.nx + b.nx, 0, 1e-15);
}

TEST(OnCurve, ItMeetsItsPoints) {
  double worst = 0;
  for (const auto& [points, closed] :
       {std::pair{bean, true}, {circle(24), true}, {parabola(), false}, {cycloid(16), false}}) {
    const PlaneCurve curve(points, closed, "track");
    for (const auto& p : points)
      worst = std::max(worst, std::fabs(curve.distance(p[0], p[1]).value));
  }
  std::printf("  the curves miss their points by %.1e m, 1e-15 allowed\n", worst);
  EXPECT_LT(worst, 1e-15);
}

TEST(OnCurve, WhatIsNoCurveIsRefused) {
  const auto why = [](const Points& points, bool closed) -> std::string {
    try {
      PlaneCurve(points, closed, "track");
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(why({{0, 0}}, false), "track: the number of points is 1, expected 2 or more");
  EXPECT_EQ(why({{0, 0}, {1, 0}}, true), "track: the number of points is 2, expected 3 or more");
  EXPECT_EQ(why({{0, 0}, {1, 0}, {1, 0}}, false),
            "track: point 3 lies where the one before it does");
  EXPECT_EQ(why({{0, 0}, {1, NAN}}, false), "track: point 2 is not finite");
  EXPECT_EQ(why({{0, 0}, {1, 0}, {6, 0}}, false),
            "track: point 2 is 1 m from the one before it and 5 m from the next, expected points "
            "about equally far apart, within a factor of 4");
  EXPECT_EQ(why({{0, 0}, {1, 0}, {0, 0}}, false),
            "track: the curve has a cusp at or after point 2, expected one that turns smoothly");
  EXPECT_EQ(why({{0, 0}, {1, 1}, {1, 0}, {0, 1}}, true),
            "track: the curve crosses itself, after point 1 and after point 3, expected one that "
            "does not");
  EXPECT_EQ(why(bean, true), "");  // control
  EXPECT_NE(refusal(bead({}, false, 0, 0)), "");
  Linkage l = bead(circle(8), true, 0, -1);
  l.spec.loops[0].type = "on_plane";
  EXPECT_EQ(refusal(l), "constraint 'track': points mean nothing to the type 'on_plane'");
}

TEST(OnCurve, AStartFarAwayIsRefused) {
  EXPECT_EQ(refusal(bead(circle(8), true, 3, 3)), "");  // the bead is moved there
  EXPECT_EQ(refusal(bead(parabola(), false, 30, -3)),
            "constraint 'track' (on_curve) between 'the world' and 'bead' has its point beyond an "
            "end of the curve, expected a start nearer to the curve, or points farther on");
}

/// Over the end at x = 2 by more than a quarter of a metre no step is taken; 6 m/s reach 1.8 m up.
TEST(OnCurve, ARunEndsBeyondTheCurve) {
  for (const double speed : {6., 8.}) {
    Linkage l = bead(parabola(), false, 0, 0);
    l.v[size_t(l.mechanism->coordinate("bead.x").v)] = speed;
    const auto model = l.model();
    phs::State s(model.description(), l.start());
    const auto method = make_integrator("spark16", model, 1. / 256);
    Outcome end = Outcome::ok;
    for (int i = 0; i < 512 && end == Outcome::ok; ++i) end = method->step(s);
    const double x = s.x[size_t(l.mechanism->coordinate("bead.x").q)];
    std::printf("  %g m/s: '%s' at x = %.3f m\n", speed, to_string(end), x);
    EXPECT_EQ(end == Outcome::ok, speed < 7);
    if (speed > 7) {
      EXPECT_NEAR(std::fabs(x), 2.2, 0.06);
    }
  }
}

}  // namespace
}  // namespace porthos::integrators::curve_test
