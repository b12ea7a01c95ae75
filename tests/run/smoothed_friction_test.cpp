// A note on steps that are too long for the slope of smoothed friction.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"
#include "tests/run/shipped.h"

namespace porthos::test::smoothed_friction_test {
namespace {

constexpr double inertia = 0.3 + 3 * 0.4 * 0.4, coulomb = 2;  // about the shoulder

/// A pendulum that rubs, for 3 s.
scene::RunReport rubbing(const std::string& method, double step, double smoothing) {
  const TemporaryFolder folder;
  write_bytes(folder / "arm.urdf",
              "<robot name='arm'><link name='foot'/><link name='upper'><inertial><origin xyz='0 0 "
              "-0.4'/><mass value='3'/><inertia ixx='0.3' iyy='0.3' izz='0.3' ixy='0' ixz='0' "
              "iyz='0'/></inertial></link><joint name='shoulder' type='continuous'><parent "
              "link='foot'/><child link='upper'/><axis xyz='0 1 0'/></joint></robot>");
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\n"
                          "gravity = \"uniform\"\nvector = [0, 0, -9.81]\n[initial]\n"
                          "joints.shoulder = {{ position = 1.2 }}\n[integrator]\nmethod = \"{}\"\n"
                          "step = {}\n[run]\nduration = 3\n[[element]]\ntype = \"friction\"\n"
                          "name = \"rub\"\njoint = \"shoulder\"\ncoulomb = {}\nsmoothing = {}\n"
                          "[verify]\nbalance = 1e-9\n",
                          method, step, coulomb, smoothing));
  const auto s = scene::read_scene((folder / "scene.toml").string());
  return scene::run_in_memory(s, scene::assemble(s), {});
}

/// The step that the note names, 0: there is none.
double named_step(const scene::RunReport& r, const std::string& whose) {
  for (const auto& note : r.notes)
    if (const auto at = note.find("expected steps of at most ");
        note.starts_with("the smoothed friction of " + whose) && at != note.npos) {
      EXPECT_LE(note.size(), 220u) << note;
      return std::strtod(note.c_str() + at + 26, nullptr);
    }
  return 0;
}

TEST(SmoothedFriction, ARunThatFailsByItNamesAStepThatWouldDo) {
  for (const char* method : {"gauss4", "midpoint", "gonzalez"}) {
    const auto failed = rubbing(method, 0.01, 1e-3);
    EXPECT_NE(failed.outcome, integrators::Outcome::ok) << method;
    const double step = named_step(failed, "element 'rub'");
    std::printf("  %s: at most %g s   closed form %.4g s\n", method, step,
                2 * inertia * 1e-3 / coulomb);
    EXPECT_NEAR(step, 2 * inertia * 1e-3 / coulomb, 1e-5);
    EXPECT_EQ(rubbing(method, step, 1e-3).outcome, integrators::Outcome::ok) << method;
  }
  const auto soft = rubbing("gauss4", 0.01, 0.1);
  EXPECT_TRUE(soft.passed()) << "control";
  EXPECT_EQ(named_step(soft, "element 'rub'"), 0);
}

TEST(SmoothedFriction, AnEnergyThatFailsByItNamesIt) {
  EXPECT_GT(named_step(rubbing("rk4", 0.01, 1e-3), "element 'rub'"), 0);
  const auto other = rubbing("midpoint", 0.01, 0.01);
  EXPECT_FALSE(other.passed()) << "by the truncation of the method";
  EXPECT_EQ(named_step(other, "element 'rub'"), 0) << "control: a longer step than twice its time";
}

/// In the gear of a motor: of its inertia at the output.
TEST(SmoothedFriction, OfAnActuatorIsNamed) {
  const auto named = [](const std::string& smoothing) {
    const TemporaryFolder folder;
    auto s = shipped(folder, "qbmove_arm",
                     {{"smoothing = 0.2                  # rad/s", "smoothing = " + smoothing},
                      {"coulomb = 0.02                   # N m", "coulomb = 0.5"}});
    s.method = "rk4";
    s.duration = 2;
    s.verify.energy = 1e-9;
    s.verify.balance = 1e-9;
    return named_step(scene::run_in_memory(s, scene::assemble(s), {}), "actuator 'shoulder_vsa'");
  };
  EXPECT_NEAR(named("1e-4"), 2 * 0.003 * 1e-4 / 0.5, 1e-8);
  EXPECT_EQ(named("1.0"), 0) << "control";
}

}  // namespace
}  // namespace porthos::test::smoothed_friction_test
