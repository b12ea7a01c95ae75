#include "mechanics/euler_angles.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <string>

#include "mechanics/builder.h"
#include "mechanics/kinematics.h"
#include "tests/support/bounds.h"

/// Angles are put together to a rotation, and found again.
namespace porthos::mechanics {
namespace {

using test::keeps;

constexpr double pi = std::numbers::pi;
const std::string sequences[] = {"xyz", "yzx", "zxy", "zyx", "xzy", "yxz"};

Quaternion<double> about(char axis, double angle) {
  Quaternion<double> q{std::cos(angle / 2), {0, 0, 0}};
  q.v[axis - 'x'] = std::sin(angle / 2);
  return q;
}
/// The rotation of angles in the order of the sequence.
Quaternion<double> turned(const std::string& sequence, const std::array<double, 3>& a) {
  return about(sequence[0], a[0]) * about(sequence[1], a[1]) * about(sequence[2], a[2]);
}
/// The angle between two rotations, to first order.
double apart(const Quaternion<double>& a, const Quaternion<double>& b) {
  const auto d = a * b.conj();
  return 2 * norm(d.v);
}
std::array<double, 3> found(const Quaternion<double>& q, const std::string& sequence) {
  const auto a = euler_angles(q, sequence);
  return {a[sequence[0] - 'x'], a[sequence[1] - 'x'], a[sequence[2] - 'x']};
}

TEST(EulerAngles, AreThoseOfWhichTheRotationIsMade) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-pi, pi), length(0.1, 10);
  double worst = 0;
  for (const auto& sequence : sequences)
    for (int times = 0; times < 1000; ++times) {
      const std::array<double, 3> a{any(random), 0.49 * any(random), any(random)};
      auto q = turned(sequence, a);
      const double scale = (times % 2 ? 1 : -1) * length(random);  // any length, either sign
      q = {scale * q.w, scale * q.v};
      const auto b = found(q, sequence);
      for (size_t k = 0; k < 3; ++k) worst = std::max(worst, std::fabs(b[k] - a[k]));
    }
  keeps("largest difference [rad]", worst, 2e-14);  // 1 / cos of 88.2 degrees, times rounding
}

TEST(EulerAngles, OfZyxAreRollPitchYaw) {
  const double roll = 0.3, pitch = -0.4, yaw = 2.5;
  const auto xi = quaternion_of(rotation_from_rpy(roll, pitch, yaw));
  const auto a = euler_angles(Quaternion<double>::load(xi.data()), "zyx");
  EXPECT_NEAR(a.x, roll, 4e-16);
  EXPECT_NEAR(a.y, pitch, 4e-16);
  EXPECT_NEAR(a.z, yaw, 1e-15);
  // Control: the sequence matters.
  EXPECT_GT(std::fabs(euler_angles(Quaternion<double>::load(xi.data()), "xyz").x - roll), 0.1);
}

TEST(EulerAngles, WhereOnlyASumMattersTheLastIsZero) {
  for (const auto& sequence : sequences)
    for (const double middle : {pi / 2, -pi / 2}) {
      const auto q = turned(sequence, {0.7, middle, -1.9});
      const auto a = found(q, sequence);
      EXPECT_EQ(a[2], 0) << sequence;
      EXPECT_NEAR(std::fabs(a[1]), pi / 2, 1e-15) << sequence;
      EXPECT_LT(apart(turned(sequence, a), q), 1e-15) << sequence;
    }
}

}  // namespace
}  // namespace porthos::mechanics
