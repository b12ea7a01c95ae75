// Distances of shapes: the support functions of convex bodies prove them, forward differentiation
// their normals.
#include <gtest/gtest.h>

#include <random>

#include "contact/geometry/pairs.h"
#include "mechanics/builder.h"

namespace porthos::contact::geometry_test {
namespace {

using phs::Dual;
using Vec = Vec3<double>;

Shape shape(Kind kind, double radius, double half_length = 0, Vec3d half = {0, 0, 0}) {
  Shape s;
  s.kind = kind;
  s.radius = radius;
  s.half_length = half_length;
  s.half = half;
  return s;
}
const std::vector<Shape> solids{shape(Kind::sphere, 0.4), shape(Kind::capsule, 0.2, 0.5),
                                shape(Kind::box, 0.05, 0, {0.3, 0.5, 0.4}),
                                shape(Kind::box, 0, 0, {0.3, 0.5, 0.4}),
                                shape(Kind::cylinder, 0.3, 0.4)};

/// max n·x over a solid at the origin with axes R.
double support(const Shape& s, const Mat3<double>& R, const Vec& n) {
  const Vec a = R.tmul(n);
  switch (s.kind) {
    case Kind::sphere:
      return s.radius;
    case Kind::capsule:
      return s.half_length * std::fabs(a.z) + s.radius;
    case Kind::cylinder:
      return s.half_length * std::fabs(a.z) + s.radius * std::hypot(a.x, a.y);
    default: {
      double h = s.radius;
      for (int i = 0; i < 3; ++i) h += (s.half[i] - s.radius) * std::fabs(a[i]);
      return h;
    }
  }
}

std::mt19937_64 random_bits(7);
double normal() { return std::normal_distribution<double>()(random_bits); }
Vec direction() {
  const Vec v{normal(), normal(), normal()};
  return (1 / norm(v)) * v;
}
Frames<double> pose(double apart) {
  const auto axes = [] { return mechanics::rotation_from_rpy(normal(), normal(), normal()); };
  return {axes(), axes(), apart * Vec{normal(), normal(), normal()}};
}
std::vector<Touch<double>> of(const Shape& a, const Shape& b, const Frames<double>& f) {
  std::vector<Touch<double>> out(size_t(points(a.kind, b.kind, Ends::fade)));
  touches<double>(a, b, f, out);
  return out;
}
template <class T>
Frames<T> converted(const Frames<double>& f) {
  return {Mat3<T>(f.A), Mat3<T>(f.B), Vec3<T>(f.d)};
}

/// The distance of convex bodies is the largest n·d - h_A(n) - h_B(-n) over all directions; where
/// they overlap, that is minus the depth. So the value at the normal must be the gap, and no other
/// direction may give more.
TEST(Geometry, SupportFunctionsProveTheDistance) {
  int pairs = 0;
  double worst = 0, beaten = 0, control = 0;
  for (const Shape& a : solids)
    for (const Shape& b : solids) {
      if (points(a.kind, b.kind, Ends::fade) != 1) continue;
      ++pairs;
      for (int k = 0; k < 400; ++k) {
        const auto f = pose(0.7);
        const auto t = of(a, b, f)[0];
        const auto dual = [&](const Vec& n) {
          return dot(n, f.d) - support(a, f.A, n) - support(b, f.B, -n);
        };
        // Two capsules whose axes cross have a deeper translation than their balls.
        if (t.gap < -0.2 && a.kind == Kind::capsule && b.kind == Kind::capsule) continue;
        worst = std::max(worst, std::fabs(dual(t.n) - t.gap));
        for (int i = 0; i < 50; ++i) beaten = std::max(beaten, dual(direction()) - t.gap);
        control = std::max(control, std::fabs(dual(direction()) - t.gap));
      }
    }
  std::printf(
      "  %d pairs: off by %.1e m   bound 2e-15; another direction gives %.1e more   bound 0 (a "
      "wrong normal: %.1e)\n",
      pairs, worst, beaten, control);
  EXPECT_EQ(pairs, 10);
  EXPECT_LE(worst, 2e-15);
  EXPECT_LE(beaten, 0);
  EXPECT_GT(control, 0.1);
}

TEST(Geometry, APlaneIsTouchedByTheLowestPoint) {
  const Shape plane = shape(Kind::plane, 0);
  double worst = 0;
  for (const Shape& b : solids)
    for (int k = 0; k < 400; ++k) {
      const auto f = pose(0.7);
      double lowest = HUGE_VAL;
      for (const auto& t : of(plane, b, f)) {
        lowest = std::min(lowest, t.gap);
        EXPECT_EQ(norm(t.n - f.A.z), 0);
      }
      worst = std::max(worst, std::fabs(lowest - (dot(f.A.z, f.d) - support(b, f.B, -f.A.z))));
    }
  std::printf("  off by %.1e m   bound 2e-15\n", worst);
  EXPECT_LE(worst, 2e-15);
}

/// Swapped sides: the same gap, the opposite normal, the same place.
TEST(Geometry, BothOrdersAgree) {
  std::vector<Shape> all = solids;
  all.push_back(shape(Kind::plane, 0));
  double worst = 0;
  for (const Shape& a : all)
    for (const Shape& b : all) {
      const auto f = pose(0.7);
      const auto t = of(a, b, f), u = of(b, a, {f.B, f.A, -f.d});
      for (size_t i = 0; i < t.size(); ++i)
        if (a.kind != b.kind)
          worst = std::max({worst, std::fabs(t[i].gap - u[i].gap), norm(t[i].n + u[i].n),
                            norm(t[i].at - f.d - u[i].at)});
    }
  EXPECT_LE(worst, 1e-15);
}

/// The rate of the gap is n · (v_B - v_A) at the place: a force along n is the gradient of U(gap).
TEST(Geometry, NormalAndPlaceAreTheDerivative) {
  std::vector<Shape> all = solids;
  all.push_back(shape(Kind::plane, 0));
  double worst = 0, of_edges = 0, control = 0;
  int pairs = 0;
  for (const Shape& a : all)
    for (const Shape& b : all) {
      const size_t n = size_t(points(a.kind, b.kind, Ends::fade));
      pairs += n > 0;
      for (int k = 0; k < 100 && n > 0; ++k) {
        const auto f = pose(0.7);
        const Vec v = direction(), w = direction();  // of B relative to A
        auto moved = converted<Dual>(f);
        const auto set = [](Vec3<Dual>& x, const Vec& rate) {
          for (int i = 0; i < 3; ++i) x[i].d = rate[i];
        };
        set(moved.d, v);
        set(moved.B.x, cross(w, f.B.x));
        set(moved.B.y, cross(w, f.B.y));
        set(moved.B.z, cross(w, f.B.z));
        std::vector<Touch<Dual>> out(n);
        touches<Dual>(a, b, moved, out);
        const auto here = of(a, b, f);
        for (size_t i = 0; i < n; ++i) {
          const double rate = dot(here[i].n, v + cross(w, here[i].at - f.d));
          const double error = std::fabs(out[i].gap.d - rate);
          // Nearly parallel edges: the rounding of where they cross grows with 1/sin². That of a
          // sphere grows with 1/distance to a cylinder's axis: 1.1e-14 without fused multiply-adds.
          double& most = have_edges(a.kind, b.kind) ? of_edges : worst;
          most = std::max(most, error);
          control = std::max(control, std::fabs(out[i].gap.d - dot(here[i].n, v)));
        }
      }
    }
  std::printf(
      "  %d pairs: off by %.1e   bound 5e-14, with edges %.1e   bound 1e-11 (force through the "
      "centre: %.1e)\n",
      pairs, worst, of_edges, control);
  EXPECT_LE(worst, 5e-14);
  EXPECT_LE(of_edges, 1e-11);
  EXPECT_GT(control, 0.1);
}

/// Of all the gaps of corners and edges the least is the distance, while the cores are apart: the
/// support functions prove it, as above. Overlaps that fade begin where the others do, or where a
/// rod lies off both planes of an edge, and grazes it, a little later. Control: corners alone.
TEST(Geometry, CornersAndEdgesHaveTheDistance) {
  const std::vector<Shape> all{
      shape(Kind::box, 0.05, 0, {0.3, 0.5, 0.4}), shape(Kind::box, 0.1, 0, {0.2, 0.2, 0.9}),
      shape(Kind::box, 0, 0, {0.3, 0.5, 0.4}), shape(Kind::capsule, 0.2, 0.5)};
  double worst = 0, beaten = 0, of_corners = 0, late = 0;
  int cases = 0, overlaps = 0, by_edges = 0;
  for (const Shape& a : all)
    for (const Shape& b : all) {
      const double radii = a.radius + b.radius;
      if (!have_edges(a.kind, b.kind) || radii == 0) continue;
      const size_t corners = a.kind == b.kind ? 16 : 10;
      for (int k = 0; k < 1000; ++k) {
        const auto f = pose(0.7);
        const auto dual = [&](const Vec& n) {
          return dot(n, f.d) - support(a, f.A, n) - support(b, f.B, -n);
        };
        std::vector<Touch<double>> out(size_t(points(a.kind, b.kind, Ends::off))), faded = out;
        touches<double>(a, b, f, out, Ends::off);
        touches<double>(a, b, f, faded, Ends::fade);
        const auto less = [](const auto& x, const auto& y) { return x.gap < y.gap; };
        const auto t = *std::min_element(out.begin(), out.end(), less);
        const double corner = std::min_element(out.begin(), out.begin() + long(corners), less)->gap,
                     fade = std::min_element(faded.begin(), faded.end(), less)->gap;
        if (t.gap < -0.9 * radii || dual(t.n) < -0.9 * radii) continue;  // the cores may overlap
        ++cases;
        overlaps += t.gap < 0;
        by_edges += corner > t.gap + 1e-6;
        worst = std::max(worst, std::fabs(dual(t.n) - t.gap));
        for (int i = 0; i < 50; ++i) beaten = std::max(beaten, dual(direction()) - t.gap);
        of_corners = std::max(of_corners, corner - t.gap);
        EXPECT_TRUE(fade >= 0 || t.gap < 0);
        if (fade >= 0) late = std::max(late, -t.gap / radii);
        EXPECT_GE(fade, t.gap - 1e-13);
      }
    }
  std::printf(
      "  %d cases, %d overlap, %d by edges: off by %.1e m   bound 1e-13; another direction gives "
      "%.1e more   bound 0 (corners alone: %.1e); late by %.1e of the radii   bound 0.02\n",
      cases, overlaps, by_edges, worst, beaten, of_corners, late);
  EXPECT_LE(late, 0.02);
  EXPECT_GT(by_edges, 1000);
  EXPECT_GT(overlaps, 500);
  EXPECT_LE(worst, 1e-13);
  EXPECT_LE(beaten, 0);
  EXPECT_GT(of_corners, 0.1);
}

/// While two boxes pass each other every depth that fades is continuous, also where edges become
/// parallel: a step of 1e-6 m or rad changes it by no more. Control: without fading it jumps.
TEST(Geometry, OverlapsThatFadeAreContinuous) {
  const Shape a = shape(Kind::box, 0.05, 0, {0.3, 0.5, 0.4}), b = a;
  double jump = 0, control = 0;
  for (int k = 0; k < 40; ++k) {
    const double side = 0.2 * normal(), yaw = 0.02 * normal();
    std::vector<Touch<double>> now(size_t(points(a.kind, b.kind, Ends::fade))),
        before = now, off = now, off_before = now;
    for (int i = 0; i < 2000; ++i) {
      const double x = 1e-6 * i;
      const Frames<double> f{Mat3<double>::identity(),
                             mechanics::rotation_from_rpy(x - 1e-3, 0, yaw + x - 1e-3),
                             {side, x - 1e-3, 0.78}};
      touches<double>(a, b, f, now, Ends::fade);
      touches<double>(a, b, f, off, Ends::off);
      for (size_t l = 0; i > 0 && l < now.size(); ++l) {
        const auto change = [&](const auto& one, const auto& other) {
          return std::fabs(std::min(one[l].gap, 0.0) - std::min(other[l].gap, 0.0));
        };
        jump = std::max(jump, change(now, before));
        control = std::max(control, change(off, off_before));
      }
      std::swap(now, before);
      std::swap(off, off_before);
    }
  }
  std::printf("  changes by %.1e   bound 4e-6 (without fading %.1e)\n", jump, control);
  EXPECT_LE(jump, 4e-6);
  EXPECT_GT(control, 1e-3);
}

TEST(Geometry, LanesHaveTheBitsOfScalars) {
  using Pack = phs::Pack8;
  std::vector<Shape> all = solids;
  all.push_back(shape(Kind::plane, 0));
  for (const Shape& a : all)
    for (const Shape& b : all) {
      const size_t n = size_t(points(a.kind, b.kind, Ends::fade));
      std::vector<Frames<double>> f;
      for (int lane = 0; lane < 8; ++lane) f.push_back(pose(0.5));
      Frames<Pack> packed;
      const auto put = [&](auto get) {
        for (int i = 0; i < 3; ++i)
          for (int lane = 0; lane < 8; ++lane) get(packed)[i].set(lane, get(f[size_t(lane)])[i]);
      };
      put([](auto& g) -> auto& { return g.d; });
      put([](auto& g) -> auto& { return g.A.x; });
      put([](auto& g) -> auto& { return g.A.y; });
      put([](auto& g) -> auto& { return g.A.z; });
      put([](auto& g) -> auto& { return g.B.x; });
      put([](auto& g) -> auto& { return g.B.y; });
      put([](auto& g) -> auto& { return g.B.z; });
      std::vector<Touch<Pack>> out(n);
      touches<Pack>(a, b, packed, out);
      for (int lane = 0; lane < 8; ++lane) {
        const auto alone = of(a, b, f[size_t(lane)]);
        for (size_t i = 0; i < n; ++i) {
          EXPECT_EQ(out[i].gap[lane], alone[i].gap);
          for (int c = 0; c < 3; ++c) EXPECT_EQ(out[i].at[c][lane], alone[i].at[c]);
        }
      }
    }
}

TEST(Geometry, WhatIsMissingHasNoPoints) {
  EXPECT_EQ(points(Kind::box, Kind::cylinder, Ends::fade), 0);
  EXPECT_EQ(points(Kind::plane, Kind::plane, Ends::fade), 0);
  EXPECT_NE(known_pairs().find("plane and box"), std::string::npos);
  EXPECT_THROW(check(shape(Kind::sphere, 0)), InvalidArgument);
  EXPECT_THROW(check(shape(Kind::box, 0.4, 0, {0.3, 0.5, 0.4})), InvalidArgument);
  EXPECT_NO_THROW(check(shape(Kind::box, 0.3, 0, {0.3, 0.5, 0.4})));
}

}  // namespace
}  // namespace porthos::contact::geometry_test
