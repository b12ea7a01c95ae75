// Scenes with bodies that roll and joints that move as told: run, judged, resumed, through events
// and in orbit, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "scene/compare/auto_method.h"
#include "tests/run/shipped.h"
#include "tests/support/reference.h"

namespace porthos::test::rolling_run_test {
namespace {

std::string refusal(const std::string& name, const std::vector<Change>& changes,
                    const std::string& more = "") {
  TemporaryFolder folder;
  try {
    const auto s = shipped(folder, name, 10, changes, more);
    const auto a = scene::assemble(s);
    scene::make_integrator(s, *a.model, s.step);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

TEST(RollingRun, ExamplesPassTheirVerdict) {
  for (const char* name : {"rolling_disk", "rover", "slider_crank", "planned_arm"}) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, std::string(name) == "planned_arm" ? 100 : 20);
    auto o = into(folder / "out");
    o.check_symmetry = true;
    const auto r = scene::run(s, scene::assemble(s), o);
    EXPECT_TRUE(r.passed()) << name;
    std::printf("  %-12s gap %.1e, slip %.1e, energy %.1e, symmetry %.1e\n", name,
                value_of(r, "constraints"), value_of(r, "constraint_rates"), value_of(r, "energy"),
                value_of(r, "symmetry"));
  }
}

TEST(RollingRun, TheDefaultMethodFitsWhatRolls) {
  TemporaryFolder folder;
  EXPECT_EQ(shipped(folder, "rolling_disk", 1, {{"method = \"pgauss16\"\n", ""}}).method,
            "pgauss16");
  EXPECT_EQ(shipped(folder, "planned_arm", 100, {{"method = \"spark16\"\n", ""}}).method,
            "spark16");
}

/// The slider of the reference, which has another formulation and other coordinates.
TEST(RollingRun, SliderCrankFollowsItsReference) {
  const auto reference = read_json(data_file("reference/q_slider_crank.json"));
  TemporaryFolder folder;
  auto s = shipped(folder, "slider_crank", 20);
  const auto a = scene::assemble(s);
  const auto by = scene::make_integrator(s, *a.model, s.step);
  phs::State x = a.initial;
  const auto number = [](const auto& text) { return std::stod(text.template get<std::string>()); };
  double off = 0;
  for (const auto& out : reference["outputs"]) {
    const double t = number(out["t"]);
    while (x.time(s.step) < t - s.step / 2) ASSERT_EQ(by->step(x), integrators::Outcome::ok);
    const auto& listed = out["group0"];
    const auto slider = a.mechanism->coordinate("slider").q,
               crank = a.mechanism->coordinate("crank").q;
    off = std::max(
        {off, std::fabs(x.x[size_t(slider)] + 1.5 - number(listed[6])),
         std::fabs(x.x[size_t(crank)] + phs::two_pi_hi * double(x.turns[0]) - number(listed[2]))});
  }
  std::printf("  crank and slider off by %.1e (rad, m)   bound 1e-12\n", off);
  EXPECT_LT(off, 1e-12);
}

TEST(RollingRun, ResumedRunsKeepBits) {
  for (const auto& [name, duration] : {std::pair{"rover", 20.}, {"planned_arm", 100.}}) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, duration);
    const auto a = scene::assemble(s);
    const auto whole = scene::run(s, a, into(folder / "whole"));
    auto o = into(folder / "parts");
    o.stop_at = whole.steps / 2;
    EXPECT_TRUE(scene::run(s, a, o).interrupted);
    o.stop_at = -1;
    o.resume = true;
    const auto r = scene::run(s, a, o);
    EXPECT_EQ(r.final_state.x, whole.final_state.x) << name;
    EXPECT_EQ(r.final_state.lo, whole.final_state.lo) << name;
    EXPECT_EQ(r.ports, whole.ports) << name;
  }
}

/// The motors of the arm take back what they put in, because it ends at rest where all began at
/// rest; and the satellite ends turned.
TEST(RollingRun, MotorsOfThePlannedArmTakeBackWhatTheyPutIn) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "planned_arm", 100);
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  double sum = 0, most = 0;
  for (const auto& [name, joule] : r.ports) {
    sum += joule;
    most = std::max(most, std::fabs(joule));
  }
  const auto& xi = a.mechanism->coordinate("base.attitude");
  const double turned =
      2 * std::hypot(r.final_state.x[size_t(xi.q) + 1], r.final_state.x[size_t(xi.q) + 2],
                     r.final_state.x[size_t(xi.q) + 3]);
  std::printf("  works sum to %.1e J, the largest %.1e J; the base turned by %.2f mrad\n", sum,
              most, 1e3 * turned);
  EXPECT_LT(std::fabs(sum), 1e-15);
  EXPECT_GT(most, 1e-6);
  EXPECT_GT(turned, 1e-3);
}

/// A capture while a joint is driven: the plastic loss and what the motor puts in add up.
TEST(RollingRun, ACaptureOfADrivenArmBalances) {
  TemporaryFolder folder;
  const auto s = shipped(
      folder, "planned_arm", 100,
      {{"[integrator]",
        "[[body]]\nname = \"target\"\nmass = 50\ninertia = [2, 3, 4, 0, 0, 0]\nposition = [3, 1, "
        "2]\nlinear_velocity = [0.01, -0.02, 0.01]\nangular_velocity = [0.01, 0.02, 0]\n"
        "[[event]]\ntype = \"capture\"\nat = 25\nbody = \"target\"\nlink = \"link_6\"\nreach = "
        "100\n"
        "[integrator]"},
       {"[verify]", "[verify]\n"}});
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  const double motor = entry_of(r.ports, "capture of target by link_6, motions");
  std::printf(
      "  the motors put in %.2e J at the capture, the balance is off by %.1e J   bound "
      "1e-14\n",
      motor, r.defect_J);
  EXPECT_GT(std::fabs(motor), 1e-6);
  EXPECT_LT(std::fabs(r.defect_J), 1e-14);
}

TEST(RollingRun, AutoEndsStepsWhereMovesBegin) {
  TemporaryFolder folder;
  auto s = shipped(folder, "planned_arm", 100, {{"\"spark16\"", "\"auto\""}});
  const auto a = scene::assemble(s);
  s = scene::with_method_chosen(s, a);
  EXPECT_TRUE(s.method.starts_with("spark")) << s.method;
  for (const double t : {5., 20., 45., 50., 60., 65.})
    EXPECT_NEAR(std::remainder(t, s.step), 0, 1e-9) << t;
  TemporaryFolder other;
  auto disk = shipped(other, "rolling_disk", 10, {{"\"pgauss16\"", "\"auto\""}});
  disk = scene::with_method_chosen(disk, scene::assemble(disk));
  EXPECT_TRUE(disk.method.starts_with("pgauss")) << disk.method;
}

TEST(RollingRun, WhatCannotBeIsRefusedWithItsLine) {
  const auto expect = [&](const char* name, const std::vector<Change>& changes, const char* part,
                          const std::string& more = "") {
    const std::string text = refusal(name, changes, more);
    EXPECT_TRUE(says(text, part));
  };
  expect("rolling_disk", {{"pgauss16", "spark16"}},
         "keeps no constraints on rates alone, and 'wheel' rolls");
  expect("rolling_disk", {{"\"disk\"\nwheel", "\"hoop\"\nwheel"}}, "type is \"hoop\", expected");
  expect("rolling_disk", {{"radius = 0.5", ""}},
         "lacks the key 'radius', expected one, because it rolls");
  expect("rolling_disk", {{"\"disk\"\nwheel", "\"blade\"\nwheel"}},
         "radius means nothing to a blade");
  expect("rolling_disk", {{"step = 0.015625", "step = 0.015625\nstep_control = 'reversible'"}},
         "pgauss16 is not symmetric");
  expect("rover", {{"joint = \"steering\"", "joint = \"steer\""}},
         "constraint 'steering_motor': the mechanism has no coordinate 'steer', expected one of");
  expect("rover", {{"swing = {", "steady = { rate = 1 }\nswing = {"}},
         "has 2 of the keys moves, steady and swing, expected one");
  expect("rover", {{"frequency = 0.1", "frequency = 0"}}, "frequency is 0");
  expect("rover", {{"[[rolling]]", "[initial.joints.steering]\nposition = 0.2\n[[rolling]]"}},
         "its motion 'steering_motor' starts at 0 with the rate");
  expect("planned_arm",
         {{"at = [5, 60], duration = [40, 30]", "at = [5, 30], duration = [40, 30]"}},
         "motion 'shoulder_plan': a move begins at 30 s, expected 45 s");
  expect("planned_arm", {{"to = [1.5, 0.3]", "to = [1.5]"}}, "expected as many of each");
  expect("planned_arm", {{"joint = \"joint_2\"", "joint = \"joint_1\""}},
         "another motion drives 'joint_1', expected one");
  EXPECT_EQ(refusal("planned_arm", {{"step = 0.25", "step = 0.2"}}), "");
  expect("rolling_disk",
         {{"attitude_wxyz = [0.8109631195052179, 0.5850972794540462, 0, 0]",
           "attitude_wxyz = [1, 0, 0, 0]"}},
         "constraint 'wheel' (disk) between 'the world' and 'disk' lies flat");
  expect("planned_arm", {{"step = 0.25", "step = 0.3"}},
         "scene.toml:12:1: a move of motion 'shoulder_plan' begins or ends at 5 s");
}

}  // namespace
}  // namespace porthos::test::rolling_run_test
