// Slopes by differences of whole runs: against closed forms and the adjoint; jumps as controls.
#include "scene/sensitivity/end_differences.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/assemble/assembly.h"
#include "scene/sensitivity/unknowns.h"
#include "tests/places.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene::end_differences_test {
namespace {

class EndDifferences : public SceneFiles {
 protected:
  /// A block of 4 kg that catches a body at t = 1 s, on the line through both centres.
  Scene catching(double reach = 0.1) const {
    write("block.urdf", R"(<robot name="block"><link name="bus"><inertial><mass value="4"/>
<inertia ixx="1" iyy="1.2" izz="0.9" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)");
    return read(fmt::format(R"([model]
urdf = "block.urdf"
base = "free"
[[body]]
name = "target"
mass = 1.0
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
position = [1.2, 0, 0]
linear_velocity = [-0.2, 0, 0]
[[event]]
type = "capture"
at = 1.0
body = "target"
link = "bus"
on_body = [-0.5, 0, 0]
on_link = [0.5, 0, 0]
reach = {}
speed = 1.0
rate = 1.0
[integrator]
method = "gauss8"
step = 0.1
[run]
duration = 3.0
[[output]]
quantity = "position"
name = "bus"
link = "bus"
)",
                            reach));
  }
  /// A block that slides at 1 m/s for 2 s and is locked where it passes `at`.
  Scene sliding(double at) const {
    write("slide.urdf", R"(<robot name="s"><link name="ground"/><link name="block"><inertial>
<mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lid"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
</inertial></link>
<joint name="slide" type="prismatic"><parent link="ground"/><child link="block"/><axis xyz="1 0 0"/>
</joint><joint name="hinge" type="revolute"><parent link="block"/><child link="lid"/>
<axis xyz="1 0 0"/></joint></robot>)");
    return read(fmt::format(R"([model]
urdf = "slide.urdf"
base = "fixed"
[initial]
joints.slide = {{ position = 0.0, velocity = 1.0 }}
[[event]]
type = "lock"
joint = "slide"
above = {}
[integrator]
method = "gauss4"
step = 0.125
[run]
duration = 2.0
[[output]]
quantity = "position"
name = "block"
link = "block"
)",
                            at));
  }
};

TEST_F(EndDifferences, OfACaptureAreItsClosedForm) {
  // From 1 s to 3 s the block moves at u = m v/(M + m).
  const double M = 4, m = 1, v = -0.2;
  const auto r = end_sensitivity(
      catching(), {.of = {"bus.x", "bus.x.least", "bus.x.largest", "base.position.x"},
                   .by = {"target.mass", "target.linear_velocity[0]", "target.position[0]"},
                   .uncertainty = 0.1});
  ASSERT_EQ(r.failure, "");
  EXPECT_EQ(r.runs, 1 + 3 * 24);
  ASSERT_EQ(r.inputs.size(), 3U);
  EXPECT_FALSE(r.inputs[0].start);
  EXPECT_TRUE(r.inputs[1].start && r.inputs[2].start);
  const double exact[] = {2 * v * M / ((M + m) * (M + m)), 2 * m / (M + m), 0};
  double worst = 0, told = 0;
  for (const auto& q : r.of) {
    const bool moves = q.name != "bus.x.largest";  // which is where it began
    EXPECT_NEAR(q.value, moves ? 2 * m * v / (M + m) : 0, 1e-14) << q.name;
    for (size_t i = 0; i < 3; ++i) {
      const double off = std::fabs(q.slopes[i] - (moves ? exact[i] : 0));
      worst = std::max(worst, off);
      told = std::max(told, q.errors[i]);
      // The error covers the difference, up to rounding of the numbers themselves.
      EXPECT_LE(off, q.errors[i] + 1e-14) << q.name << " by " << r.inputs[i].name;
      EXPECT_EQ(q.counts(i), moves && i < 2) << q.name << " by " << r.inputs[i].name;
    }
  }
  std::printf("  slopes off by %.1e   told %.1e, bound 1e-10\n", worst, told);
  EXPECT_LT(told, 1e-10);  // differences of numbers with 1e-13 at changes of 2e-2 and less
  EXPECT_NEAR(r.deviation(r.of[0]), 0.1 * std::fabs(exact[0]) * m, 1e-12);
}

TEST_F(EndDifferences, AreThoseOfTheAdjoint) {
  Scene s = read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/ets_vii/scene.toml");
  s.duration = 20;
  const std::vector<std::string> of = {"base.attitude.z", "base.position.x", "energy"};
  const auto whole = end_sensitivity(s, {.of = of});
  const auto r =
      end_sensitivity(s, {.of = of, .by = {"link_3", "base.inertia.zz", "joint_3.velocity"}});
  ASSERT_EQ(r.failure + whole.failure, "");
  ASSERT_EQ(r.inputs.size(), 12U);
  double worst = 0;  // in errors
  for (size_t i = 0; i < r.inputs.size(); ++i) {
    const auto at = std::ranges::find(whole.inputs, r.inputs[i].name, &Input::name);
    ASSERT_NE(at, whole.inputs.end()) << r.inputs[i].name;
    EXPECT_DOUBLE_EQ(at->value, r.inputs[i].value) << at->name;
    for (size_t k = 0; k < of.size(); ++k) {
      const double exact = whole.of[k].slopes[size_t(at - whole.inputs.begin())];
      const double off = std::fabs(r.of[k].slopes[i] - exact);
      EXPECT_LE(off, 3 * r.of[k].errors[i] + 1e-14) << of[k] << " by " << at->name;
      worst = std::max(worst, off / r.of[k].errors[i]);
    }
  }
  std::printf("  off by %.2g times the error told at most\n", worst);
}

/// A controller that holds its force, by its gains too.
TEST_F(EndDifferences, OfASampledControllerAreThoseOfTheAdjoint) {
  const Scene plain = sliding(100);
  std::string text = plain.text;
  const auto from = text.find("[[event]]"), to = text.find("[integrator]");
  text.replace(from, to - from, R"([[element]]
type = "controller"
name = "servo"
joint = "slide"
stiffness = 30
damping = 4
target = 0.3
rate = 8
[[element]]
type = "controller"
name = "lid"
joint = "hinge"
stiffness = 3
target = 1
rate = 4
output = "mean"
)");
  const Scene s = read(text);
  const std::vector<std::string> of = {"block.x", "hinge.position", "energy"},
                                 by = {"block.mass",    "slide.velocity", "servo.stiffness",
                                       "servo.damping", "servo.target",   "lid.stiffness"};
  const auto whole = end_sensitivity(s, {.of = of}), r = end_sensitivity(s, {.of = of, .by = by});
  ASSERT_EQ(r.failure + whole.failure, "");
  for (size_t i = 0; i < by.size(); ++i) {
    const auto at = std::ranges::find(whole.inputs, by[i], &Input::name);
    ASSERT_NE(at, whole.inputs.end()) << by[i];
    EXPECT_DOUBLE_EQ(at->value, r.inputs[i].value) << by[i];
    EXPECT_EQ(at->unit, r.inputs[i].unit) << by[i];
    for (size_t k = 0; k < of.size(); ++k) {
      const double exact = whole.of[k].slopes[size_t(at - whole.inputs.begin())];
      EXPECT_NEAR(r.of[k].slopes[i], exact, 3 * r.of[k].errors[i] + 1e-14) << of[k] << " " << by[i];
    }
  }
  EXPECT_GT(std::fabs(r.of[0].slopes[2]), 1e-3);
}

/// Locked at 0.55 m it ends there, whatever its speed. Controls: at 2 m, where it just arrives, a
/// slower block is not locked, so that the two sides have the slopes 2 s and 0.
TEST_F(EndDifferences, OfALockAreExactAndTellAKink) {
  const SensitivityRequest ask{.of = {"block.x"}, .by = {"slide.velocity", "event[0].above"}};
  const auto smooth = end_sensitivity(sliding(0.55), ask);
  ASSERT_EQ(smooth.failure, "");
  EXPECT_FALSE(smooth.of[0].counts(0));
  EXPECT_NEAR(smooth.of[0].slopes[1], 1, 1e-10);
  EXPECT_LT(smooth.of[0].errors[1], 1e-10);
  EXPECT_TRUE(smooth.notes.empty()) << smooth.notes.front();
  const auto kink = end_sensitivity(sliding(2.0), ask);
  ASSERT_EQ(kink.failure, "");
  std::printf("  slope %.3g +- %.3g at a kink, %.3g +- %.1e beside it\n", kink.of[0].slopes[0],
              kink.of[0].errors[0], smooth.of[0].slopes[0], smooth.of[0].errors[0]);
  EXPECT_NEAR(kink.of[0].errors[0], 1, 0.01) << "half of what the two sides are apart";
  ASSERT_EQ(kink.notes.size(), 1U);
  EXPECT_NE(kink.notes[0].find("slopes known to worse than one percent"), std::string::npos)
      << kink.notes[0];
}

TEST_F(EndDifferences, HaveTheSameBitsForAnyThreads) {
  const Scene s = catching();
  const std::vector<std::string> by = {"target.mass", "target.linear_velocity[0]", "bus.mass"};
  const auto one = end_sensitivity(s, {.by = by, .threads = 1});
  const auto three = end_sensitivity(s, {.by = by, .threads = 3});
  ASSERT_EQ(one.of.size(), 3U) << "the outputs at the end";
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(one.of[k].slopes, three.of[k].slopes);
    EXPECT_EQ(one.of[k].errors, three.of[k].errors);
  }
}

TEST_F(EndDifferences, OfExamplesThatHaveNoAdjoint) {
  struct Case {
    const char *example, *by, *of;
    double duration;
  };
  for (const Case& c : {Case{"esp_arm", "motor.parameters.k", "hinge.position", 0.5},
                        {"bouncing_ball", "ground.restitution", "base.position.z", 2.5},
                        {"slew", "attitude.stiffness[0]", "pointing_error", 20},
                        {"mission", "shoulder.position", "tumble.z", 30}}) {
    Scene s = read_scene(fmt::format("{}/examples/{}/scene.toml", PORTHOS_SOURCE_DIR, c.example));
    s.duration = c.duration;
    SensitivityRequest request{.by = {c.by}};
    if (*c.of) request.of = {c.of};
    const auto r = end_sensitivity(s, request);
    ASSERT_EQ(r.failure, "") << c.example;
    const auto& q = r.of.front();
    std::printf("  %-14s %s by %s: %.3e +- %.0e\n", c.example, q.name.c_str(), c.by, q.slopes[0],
                q.errors[0]);
    EXPECT_TRUE(q.counts(0)) << c.example;
    EXPECT_LT(q.errors[0], 1e-4 * std::fabs(q.slopes[0])) << c.example;
  }
}

TEST_F(EndDifferences, NumbersOfActuatorsHaveTheirUnits) {
  const Scene s = read_scene(fmt::format("{}/examples/esp_arm/scene.toml", PORTHOS_SOURCE_DIR));
  const Unknowns known(s, assemble(s),
                       {"motor.parameters.k", "motor.theta.inertia", "law.joints.hinge.target"},
                       NumbersOf::run);
  EXPECT_EQ(known.list()[0].unit, "N m/rad");
  EXPECT_EQ(known.list()[1].unit, "kg m²");
  EXPECT_EQ(known.list()[2].unit, "") << "the control: of a controller's table";
}

TEST_F(EndDifferences, RefuseWhatIsNotThere) {
  const Scene s = catching();
  const auto refused = [&](const SensitivityRequest& request) {
    return refusal([&] { (void)end_sensitivity(s, request); });
  };
  EXPECT_EQ(
      refused({.of = {"bus.y.lest"}, .by = {"target.mass"}}),
      "scene.toml: there is no 'bus.y.lest' at the end of a run, the nearest is 'bus.y.least'");
  EXPECT_NE(refused({.by = {"target.speed"}}).find("the parameter 'target.speed' is no number"),
            std::string::npos)
      << refused({.by = {"target.speed"}});
  const std::atomic<bool> stop = true;
  EXPECT_EQ(end_sensitivity(s, {.by = {"target.mass"}, .stop = &stop}).failure, "interrupted");
  // With a reach of 1e-9 m every neighbour misses the body: no slope, and why.
  const auto r = end_sensitivity(catching(1e-9), {.of = {"bus.x"}, .by = {"target.position[0]"}});
  ASSERT_EQ(r.failure, "");
  EXPECT_TRUE(std::isnan(r.of[0].slopes[0]));
  ASSERT_EQ(r.notes.size(), 1U);
  EXPECT_NE(r.notes[0].find("no slope of bus.x by target.position[0]: beside it "),
            std::string::npos)
      << r.notes[0];
}

}  // namespace
}  // namespace porthos::scene::end_differences_test
