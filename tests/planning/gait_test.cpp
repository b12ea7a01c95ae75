// planning/gait.h: the steady gait against its closed forms, steps that make up for pushes of an
// inverted pendulum, the curve of a foot, and what is refused.
#include "planning/gait.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/bounds.h"

namespace porthos::test::gait_test {
namespace {

using planning::Gait;
using planning::GaitDesign;
using Vec3d = mechanics::Vec3d;

constexpr double g = 9.81, height = 0.8, width = 0.2;

/// Two feet beside each other that step in turn, never both on the ground.
GaitDesign walk() {
  GaitDesign d;
  d.period = 0.8;
  d.duty = 0.5;
  d.swing = {0, 0.5};
  d.velocity = {0.5, 0};
  d.reach = 2;
  d.spacing = 0;
  return d;
}
Gait of(const GaitDesign& d) { return {d, {{0, width / 2, 0}, {0, -width / 2, 0}}, height, g}; }

/// Of an inverted pendulum with point feet: ξ from a landing foot is vT/(e^{ωT} - 1) forwards and
/// w/(1 + e^{ωT}) inwards, T the time of a step.
TEST(Gait, OffsetsAreThoseOfTheInvertedPendulum) {
  const auto d = walk();
  const auto gait = of(d);
  const double T = d.period / 2, e = std::exp(std::sqrt(g / height) * T);
  double off = 0;
  for (const size_t foot : {0, 1}) {
    const Vec3d b = gait.landing_offset(foot);
    off = std::max(off, std::fabs(b.x - d.velocity[0] * T / (e - 1)));
    off = std::max(off, std::fabs(b.y - (foot == 0 ? -1 : 1) * width / (1 + e)));
  }
  std::printf("  offsets off by %.1e m (bound 1e-15)\n", off);
  EXPECT_LE(off, 1e-15);
}

/// An inverted pendulum on the feet of a gait, whose accelerations are exact between instants.
struct Walker {
  Gait gait;
  std::vector<double> memory = std::vector<double>(gait.size(), 0.0);
  Vec3d x{0, 0, height}, v{0, 0, 0};
  std::vector<Vec3d> feet{{0, width / 2, 0}, {0, -width / 2, 0}};
  double t = 0, dt = 2e-3;
  bool places = true;  ///< feet land where planned; else as far from the centre as at the start
  Gait::Plan plan = {};
  double error = 0, clearance = 0;  ///< of ξ at the last landing; the highest foot

  void go(double until) {
    for (; t < until - 1e-9; t += dt) {
      std::vector<char> closed;
      for (const Vec3d& f : feet) closed.push_back(f.z < 1e-9);
      plan = gait.plan({t, dt, x, v, feet, closed, feet}, memory);
      const double w = gait.omega(), c = std::cosh(w * dt), s = std::sinh(w * dt);
      for (int k = 0; k < 2; ++k) {
        const double from = x[k] - plan.pivot[k];
        x[k] = plan.pivot[k] + c * from + s / w * v[k];
        v[k] = w * s * from + c * v[k];
      }
      for (size_t i = 0; i < feet.size(); ++i) {
        const auto& swing = plan.feet[i];
        if (!swing.lifted) continue;
        // At the next instant it stands where the memory says that it lands.
        const double* own = memory.data() + Gait::footstep_at(i);
        feet[i] = swing.at;
        clearance = std::max(clearance, feet[i].z);
        const double phase = std::fmod(t + dt + 1e-9, 0.8);
        if (phase < dt || std::fabs(phase - 0.4) < dt / 2) {
          feet[i] = {own[0], own[1], 0};
          if (!places) feet[i] = x + Vec3d{0, i == 0 ? width / 2 : -width / 2, -x.z};
          error = mechanics::norm(x + (1 / w) * v - Vec3d{0, 0, height} - feet[i] -
                                  gait.landing_offset(i));
        }
      }
    }
  }
};

/// Pushed aside and forwards, the pendulum has its steady offset again two landings later, and its
/// mean rate is the wanted one. Control: with feet that land as far from the centre as at the start
/// it is lost.
TEST(Gait, StepsMakeUpForPushes) {
  Walker walker{of(walk())};
  walker.go(4);
  EXPECT_LE(walker.error, 1e-11);
  walker.v += Vec3d{0.4, -0.3, 0};
  walker.go(4.8 + 1e-3);
  const double pushed = walker.error;
  walker.go(8.8);
  const double from = walker.x.x;
  walker.go(16.8);
  const double rate = (walker.x.x - from) / 8;
  std::printf("  ξ off by %.1e m after the push, %.1e m later (bound 1e-11), %.6f m/s, up %.3f m\n",
              pushed, walker.error, rate, walker.clearance);
  EXPECT_LE(std::max(pushed, walker.error), 1e-11);
  EXPECT_NEAR(rate, 0.5, 1e-6);
  EXPECT_NEAR(walker.clearance, 0.05, 1e-5);
  Walker lost{of(walk())};
  lost.places = false;
  lost.go(4);
  EXPECT_GT(lost.error, 1);
}

TEST(Gait, RefusalsSayWhatAndWhatWasExpected) {
  const auto refused = [](void (*change)(GaitDesign&), const char* expected) {
    auto d = walk();
    change(d);
    const auto text = refusal([&] { of(d); });
    EXPECT_NE(text.find(expected), text.npos) << text;
  };
  refused([](GaitDesign& d) { d.period = 0; }, "period of a gait is 0, expected more than 0 s");
  refused([](GaitDesign& d) { d.duty = 1; }, "duty is 1, expected more than 0 and less than 1");
  refused([](GaitDesign& d) { d.swing = {0}; },
          "number of swings is 1, expected that of the feet, 2");
  refused([](GaitDesign& d) { d.swing = {0, 1}; }, "begin of a swing is 1, expected from 0");
  refused([](GaitDesign& d) { d.duty = 0.3; }, "none stands from");
}

}  // namespace
}  // namespace porthos::test::gait_test
