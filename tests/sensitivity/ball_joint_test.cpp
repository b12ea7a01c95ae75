// Start values of a ball joint: turns of its attitude, rates in its own axes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/rotation.h"
#include "scene/sensitivity/end_quantities.h"
#include "scene/sensitivity/ridders.h"
#include "scene/sensitivity/sensitivity.h"
#include "tests/places.h"

namespace porthos::scene::ball_joint_test {
namespace {

TEST(SensitivityOfBallJoints, IsThatOfWholeRuns) {
  Scene s = read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/lagrange_top/scene.toml");
  s.duration = 1;
  const std::vector<std::string> of{"tip.attitude.x", "tip.attitude.z", "tip.angular_velocity.y",
                                    "energy"};
  const auto r = end_sensitivity(s, {.of = of});
  ASSERT_EQ(r.failure, "");
  double worst = 0;
  int compared = 0;
  std::vector<double> values(of.size());
  for (size_t i = 0; i < r.inputs.size(); ++i) {
    if (!r.inputs[i].start) continue;
    ++compared;
    const int axis = r.inputs[i].name.back() - 'x';
    const bool turns = r.inputs[i].name.find("attitude") != std::string::npos;
    const auto run = [&](double d) {
      Scene changed = s;
      auto& motion = *changed.joints.at("tip").motion;
      if (turns) {
        mechanics::Quaternion<double> turn{std::cos(d / 2), {0, 0, 0}};
        turn.v[axis] = std::sin(d / 2);
        const auto xi = mechanics::Quaternion<double>::load(&motion.attitude_wxyz[0]);
        (xi * turn).store(&motion.attitude_wxyz[0]);
      } else {
        motion.angular_velocity[axis] += d;
      }
      const Assembly a = assemble(changed);
      const auto method = make_integrator(a, s.method, s.step);
      phs::State state = a.initial;
      for (int k = 0; k < 64; ++k) EXPECT_EQ(method->step(state), integrators::Outcome::ok);
      const auto end = EndQuantities(changed, a).at(s.duration, state, of, {});
      for (size_t q = 0; q < of.size(); ++q) values[q] = end[q].value;
      return std::span<const double>(values);
    };
    const auto d = ridders(run, of.size(), 0.125, 1e-14);
    for (size_t q = 0; q < of.size(); ++q) {
      const double off = std::fabs(r.of[q].slopes[i] - d.slope[q]);
      EXPECT_LT(off, 2 * d.error[q]) << of[q] << " by " << r.inputs[i].name;
      worst = std::max(worst, off);
    }
  }
  std::printf("  %d start values, off by %.1e   bound 1e-9\n", compared, worst);
  EXPECT_EQ(compared, 6);
  EXPECT_LT(worst, 1e-9);
}

}  // namespace
}  // namespace porthos::scene::ball_joint_test
