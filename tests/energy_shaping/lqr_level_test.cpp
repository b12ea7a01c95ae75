// From which levels of its cost-to-go a regulator brings a wheel back whose turns have hardly a
// weight: V jumps at each half turn of it, and is no measure of the way back.
#include <numbers>

#include "energy_shaping/laws/handover.h"
#include "energy_shaping/laws/lqr.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::lqr_level_test {
namespace {

constexpr double pi = std::numbers::pi;

/// A rod of 0.17 kg on a pivot, with a wheel of 0.2 kg and its motor at the end.
test::ModelPtr wheel_pendulum() {
  mechanics::MechanismBuilder b("wheel");
  b.gravity({0, 0, -9.81});
  mechanics::BodySpec rod, wheel;
  rod.name = "rod";
  rod.parent = "world";
  rod.joint.name = "pivot";
  rod.mass = {0.17, {0, 0, -0.125}, {0.0068, 0, 0, 0.0068, 0, 4e-5}};
  wheel.name = "wheel";
  wheel.parent = "rod";
  wheel.joint.name = "motor";
  wheel.placement.r = {0, 0, -0.25};
  wheel.mass = {0.2, {}, {2.25e-4, 0, 0, 4.5e-4, 0, 2.25e-4}};
  for (auto* body : {&rod, &wheel}) {
    body->joint.type = "revolute";
    body->joint.axis = {0, 1, 0};
    b.add(*body);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

TEST(LqrLevel, AWheelWhoseTurnsHardlyCountComesBack) {
  const Lqr lqr(wheel_pendulum(), {"motor.torque"}, {pi, 0}, {{10, 1e-6}, {1, 1e-4}, {1}},
                {true, true});
  const double period = 1 / 250.0, falling = lqr.falling_level({0.5});
  // V jumps where the wheel has made half a turn, so no level beyond is known to fall.
  const auto V = [&](double turn) { return lqr.cost_to_go(std::vector<double>{pi, turn, 0, 0}); };
  EXPECT_LT(falling, V(3.1));
  EXPECT_NEAR(V(3.1), V(2 * pi - 3.1), 1e-12);
  // But the law holds far beyond it, and from higher up it loses some as its limit is too low.
  for (const double level : {1e-3, 0.1})
    EXPECT_EQ(lqr.lost(level, falling, {0.5}, period), 0) << level;
  const int high = lqr.lost(20, falling, {0.5}, period);
  std::printf("  falling up to %.3g; of 100 from V = 20 lost %d\n", falling, high);
  EXPECT_GT(high, LevelSet::most_lost);
  // Control: a limit that hardly moves the wheel.
  EXPECT_GT(lqr.lost(0.1, falling, {0.01}, period), LevelSet::most_lost);
}

}  // namespace
}  // namespace porthos::energy_shaping::lqr_level_test
