// Frames of bodies: exact where they can be, rounded once where not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "mechanics/builder.h"
#include "tests/mechanics/same.h"

namespace porthos::mechanics::frames_test {
namespace {

const Mat3<double> I3 = Mat3<double>::identity();

/// A sound body of 2 kg on a revolute joint about z.
BodySpec arm() {
  BodySpec b;
  b.name = "arm";
  b.parent = "world";
  b.joint.type = "revolute";
  b.mass = {2, {0.1, 0.2, 0.3}, {0.3, 0, 0, 0.4, 0, 0.5}};
  return b;
}
Mechanism build(const BodySpec& body) {
  MechanismBuilder b("test");
  b.add(body);
  return b.build();
}
TEST(RotationFromRpy, ExactAtRightAngles) {
  const double quarter = std::acos(-1.0) / 2;
  const int sine[] = {0, 1, 0, -1}, cosine[] = {1, 0, -1, 0};
  for (int r = -4; r <= 4; ++r)
    for (int p = -4; p <= 4; ++p)
      for (int y = -4; y <= 4; ++y) {
        const double sr = sine[r & 3], cr = cosine[r & 3], sp = sine[p & 3], cp = cosine[p & 3],
                     sy = sine[y & 3], cy = cosine[y & 3];
        const Mat3<double> X{{1, 0, 0}, {0, cr, sr}, {0, -sr, cr}},
            Y{{cp, 0, -sp}, {0, 1, 0}, {sp, 0, cp}}, Z{{cy, sy, 0}, {-sy, cy, 0}, {0, 0, 1}};
        expect_same(rotation_from_rpy(r * quarter, p * quarter, y * quarter), Z * Y * X, "rpy");
      }
  expect_same(rotation_from_rpy(0, 0, 1.570796326794897), {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}},
              "16 digits of pi/2");
  const auto off = rotation_from_rpy(0, 0, 1.5708);  // not meant to be exact
  EXPECT_NEAR(off.x.x, -3.673205e-6, 1e-12);
}

TEST(RotationFromRpy, RoundedOnce) {
  using phs::Quad;
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const double r = 0.37 * i, p = 0.11 * i - 3, y = 1 - 0.53 * i;
    const auto R = rotation_from_rpy(r, p, y);
    Quad sr, cr, sp, cp, sy, cy;
    phs::sincosq(r, &sr, &cr);
    phs::sincosq(p, &sp, &cp);
    phs::sincosq(y, &sy, &cy);
    const Quad exact[] = {cy * cp,
                          sy * cp,
                          -sp,
                          cy * sp * sr - sy * cr,
                          sy * sp * sr + cy * cr,
                          cp * sr,
                          cy * sp * cr + sy * sr,
                          sy * sp * cr - cy * sr,
                          cp * cr};
    const double got[] = {R.x.x, R.x.y, R.x.z, R.y.x, R.y.y, R.y.z, R.z.x, R.z.y, R.z.z};
    for (int k = 0; k < 9; ++k) worst = std::max(worst, double(phs::abs(Quad(got[k]) - exact[k])));
  }
  std::printf(
      "  entries off by %.2e   bound 5.6e-17: half an ulp below 1 and some long double rounding\n",
      worst);
  EXPECT_LE(worst, 5.6e-17);
}

TEST(Frames, AxisAlignedFramesAreExact) {
  for (const double length : {1.0, 2.0, 0.3, 49.0, 1e-3, 1e100})  // (1/49)·49 is not 1
    for (int k = 0; k < 3; ++k)
      for (const double sign : {1.0, -1.0}) {
        BodySpec b = arm();
        Vec3d unit{0, 0, 0};
        unit[k] = sign;
        b.joint.axis = length * unit;
        b.placement.r = {1, 2, 3};
        const auto m = build(b);
        const Mat3<double>& Z = m.nodes()[0].placement.R;
        const std::string what =
            "axis " + std::to_string(k) + " of " + std::to_string(length * sign);
        expect_same(Z.z, unit, what);
        expect_same(cross(Z.x, Z.y), unit, what + ", right-handed");
        expect_same(Z.transposed() * Z, I3, what + ", orthonormal");
        expect_same((m.nodes()[0].placement * m.body("arm").pose).R, I3,
                    what + ", the user's frame at q = 0");
        expect_same((m.nodes()[0].placement * m.body("arm").pose).r, {1, 2, 3}, what);
      }
}

TEST(Frames, OtherFramesAreRoundedOnce) {
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    BodySpec b = arm();
    b.joint.axis = {std::sin(1.0 * i), std::cos(2.3 * i), std::sin(0.7 * i + 1)};
    const auto Z = build(b).nodes()[0].placement.R;
    const Vec3<phs::Quad> a(b.joint.axis), z = (1 / norm(a)) * a, d = Vec3<phs::Quad>(Z.z) - z;
    worst = std::max({worst, double(norm(d)), norm(cross(Z.x, Z.y) - Z.z),
                      std::fabs(dot(Z.x, Z.x) - 1), std::fabs(dot(Z.x, Z.y))});
  }
  std::printf("  axis, right hand and orthonormality off by %.1e   bound 5e-16\n", worst);
  EXPECT_LE(worst, 5e-16);
}

}  // namespace
}  // namespace porthos::mechanics::frames_test
