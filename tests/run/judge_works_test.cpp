// `porthos judge`: works of torques and dampers between rows. What the rows leave unknown of them
// is no drift.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "scene/judge/judge_file.h"
#include "scene/session/replot.h"
#include "tests/run/scenes.h"

namespace porthos::test::judge_works_test {
namespace {

constexpr double inertia = 0.7, duration = 12;

/// A rotor that turns by 2 t + sin(3 t)/2 under the torque that this takes, in closed form.
class JudgeWorks : public ::testing::Test {
 protected:
  void SetUp() override {
    write_bytes(folder_ / "rotor.urdf",
                "<robot name='rotor'><link name='ground'/><link name='disk'><inertial><mass "
                "value='1'/><inertia ixx='0.7' iyy='0.7' izz='0.7' ixy='0' ixz='0' "
                "iyz='0'/></inertial></link><joint name='hinge' type='continuous'><parent "
                "link='ground'/><child link='disk'/><axis xyz='0 0 1'/></joint></robot>");
  }
  /// @param drift  energy that the rotor has more at the end than its torque gave [J]
  scene::RunReport judged(const std::string& between, double h, double drift = 0,
                          const std::string& element = "", double damping = 0, int missing = 0) {
    std::string text = "t,hinge,v.hinge,tau\n";
    for (int i = 0; i <= std::lround(duration / h); ++i) {
      if (i >= 200 && i < 200 + missing) continue;
      const double t = h * i, v = 2 + 1.5 * std::cos(3 * t);
      text += fmt::format("{},{},{},{}\n", t, 2 * t + 0.5 * std::sin(3 * t),
                          std::sqrt(v * v + 2 * drift * t / duration / inertia),
                          -4.5 * inertia * std::sin(3 * t) + damping * v);
    }
    write_bytes(folder_ / "rotor.csv", text);
    write_bytes(folder_ / "map.toml", "[model]\nbase = \"fixed\"\n" + element +
                                          "[columns]\ntorque_between = \"" + between +
                                          "\"\n[columns.torque]\nhinge = \"tau\"\n" +
                                          "[verify]\nenergy = 1e-9\n");
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "rotor.csv").string(), (folder_ / "rotor.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  }
  TemporaryFolder folder_;
};

bool notes_say(const scene::RunReport& r, const std::string& part) {
  return std::ranges::any_of(r.notes, [&](const auto& n) { return says(n, part); });
}

TEST_F(JudgeWorks, WhatLinesThroughATorqueLeaveIsNoDrift) {
  for (const double h : {0.01, 0.005}) {
    const auto right = judged("linear", h);
    const double left = right.energy.max_abs_error_J;
    EXPECT_FALSE(right.energy.drift_is_significant);
    EXPECT_EQ(right.verdict(), scene::Verdict::not_judged);
    EXPECT_TRUE(notes_say(right, "within 3 times that and tells no drift"));
    EXPECT_TRUE(std::ranges::any_of(right.not_applicable, [](const auto& n) {
      return n.name == "energy" &&
             says(n.why, "expected more rows, or torque_between = \"smooth\"");
    }));
    const auto wrong = judged("linear", h, 10 * left);
    breaks(fmt::format("drift of ten times what rows of {} s leave [J]", h),
           wrong.energy.max_abs_error_J, 3 * left);
    EXPECT_TRUE(wrong.energy.drift_is_significant);
    EXPECT_EQ(wrong.verdict(), scene::Verdict::fail);
    EXPECT_FALSE(notes_say(wrong, "tells no drift"));
  }
}

TEST_F(JudgeWorks, SmoothTorquesHaveOrderFour) {
  const double coarse = judged("smooth", 0.02).energy.max_rel_error;
  const auto fine = judged("smooth", 0.01), finest = judged("smooth", 0.0025);
  keeps("smooth torque, rows of 10 ms", fine.energy.max_rel_error, 1e-7);
  keeps("its order is 4: log2 of the ratio, off by",
        std::fabs(std::log2(coarse / fine.energy.max_rel_error) - 4), 0.3);
  EXPECT_TRUE(finest.passed()) << finest.energy.max_rel_error;
  breaks("the same by lines", judged("linear", 0.01).energy.max_rel_error, 1e-7);
}

TEST_F(JudgeWorks, AnotherWayBetweenRowsThatFitsIsTold) {
  const auto held = judged("held", 0.005);
  EXPECT_EQ(held.verdict(), scene::Verdict::fail) << "a held torque is taken at its word";
  EXPECT_TRUE(notes_say(held, "with torque_between = \"smooth\" the error of the energy is"));
  EXPECT_FALSE(notes_say(judged("smooth", 0.0025), "with torque_between")) << "control";
}

/// Two seconds of rows are missing. Control: energy from nowhere in the others.
TEST_F(JudgeWorks, WorksInAHoleAreNotJudged) {
  for (const char* between : {"smooth", "linear"}) {
    const auto r = judged(between, 0.01, 0, "", 0, 200);
    keeps("energy beside a hole", r.energy.max_rel_error, 2e-4);
    EXPECT_NE(r.verdict(), scene::Verdict::fail);
    EXPECT_EQ(judged(between, 0.01, 0.1, "", 0, 200).verdict(), scene::Verdict::fail);
  }
  breaks("energy from nowhere", judged("smooth", 0.01, 0.1, "", 0, 200).energy.max_rel_error, 2e-4);
}

TEST_F(JudgeWorks, DampersOfTheModelLikewise) {
  const std::string damper = "[[element]]\ntype = \"damper\"\njoint = \"hinge\"\ndamping = 0.2\n";
  const auto right = judged("smooth", 0.01, 0, damper, 0.2);
  EXPECT_FALSE(right.energy.drift_is_significant);
  EXPECT_NE(right.verdict(), scene::Verdict::fail);
  EXPECT_EQ(judged("smooth", 0.01, 0.1, damper, 0.2).verdict(), scene::Verdict::fail) << "control";
}

/// A rotor that brakes by e^(-r t), with its torque as a column, in closed form: rows that do not
/// resolve the start leave the works unknown, by more than the order of the rule would say.
TEST_F(JudgeWorks, AStartThatRowsDoNotResolveIsNoError) {
  const double h = 0.005;
  const auto braked = [&](const std::string& between, double r, double lost) {
    std::string text = "t,hinge,v.hinge,tau\n";
    for (int i = 0; i <= 400; ++i) {
      const double t = h * i, v = 3 * std::exp(-r * t);
      text += fmt::format("{},{},{},{}\n", t, 3 / r * (1 - std::exp(-r * t)),
                          v * std::sqrt(1 - lost), -r * inertia * v);
    }
    write_bytes(folder_ / "rotor.csv", text);
    write_bytes(folder_ / "map.toml",
                "[model]\nbase = \"fixed\"\n[columns]\ntorque_between = \"" + between +
                    "\"\n[columns.torque]\nhinge = \"tau\"\n[verify]\nenergy = 1e-3\n");
    fs::remove_all(folder_ / "out");
    return scene::judge_file({(folder_ / "rotor.csv").string(), (folder_ / "rotor.urdf").string(),
                              (folder_ / "map.toml").string(), (folder_ / "out").string()});
  };
  for (const char* between : {"smooth", "linear"})
    for (const double rh : {0.5, 1.0, 2.0, 5.0}) {
      const auto r = braked(between, rh / h, 0);
      const auto energy = [](const auto& c) { return c.name == "energy"; };
      breaks(fmt::format("{}, r h = {}: works that rows leave unknown", between, rh),
             r.energy.max_rel_error, 1e-3);
      EXPECT_FALSE(std::ranges::any_of(r.checks, energy)) << between << " " << rh;
      EXPECT_TRUE(std::ranges::any_of(r.not_applicable, energy)) << between << " " << rh;
    }
  // Control: resolved rows judge.
  EXPECT_TRUE(braked("smooth", 10, 0).energy.max_rel_error < 1e-5);
  EXPECT_EQ(braked("smooth", 10, 0.1).verdict(), scene::Verdict::fail);
}

/// A damped arm that floats keeps its momenta, which pass; what rows leave of the damper's work
/// exceeds the limit of the energy and is undecided. Controls: close rows, no damper, a failure.
TEST(JudgeWorksOfAFreeBase, AnExceededLimitThatRowsDoNotDecideIsNotJudged) {
  TemporaryFolder folder;
  const auto judged = [&](double every, double damping, const std::string& limits = "") {
    Case c = floating_arm(folder, 3);
    c = make_case(folder, c.scene, arm_urdf(fmt::format("<dynamics damping='{}'/>", damping)));
    c.scene.step = c.scene.record_every = every;
    fs::remove_all(folder / "out");
    (void)scene::run(c.scene, c.assembly, into(folder / "out"));
    write_bytes(folder / "map.toml",
                "[model]\nbase = \"free\"\n[verify]\nenergy = 1e-5\n" + limits);
    return scene::judge_file({(folder / "out" / "run.h5").string(),
                              (folder / "model.urdf").string(), (folder / "map.toml").string(),
                              (folder / "judged").string()});
  };
  const auto few = judged(0.06, 0.5);
  const auto energy = std::ranges::find(few.not_applicable, "energy", &scene::NotApplicable::name);
  ASSERT_NE(energy, few.not_applicable.end());
  EXPECT_TRUE(energy->undecided && says(energy->why, "exceeds 1e-05, but the rows tell the works"));
  EXPECT_TRUE(std::ranges::all_of(few.checks, &scene::Check::pass));
  EXPECT_EQ(few.verdict(), scene::Verdict::not_judged);
  EXPECT_TRUE(says(read_bytes(folder / "judged" / "summary.json"), "\"undecided\": true"));
  (void)scene::replot(folder / "judged");
  EXPECT_TRUE(says(read_bytes(folder / "judged" / "energy_error.svg"), "verdict: not judged"));
  EXPECT_EQ(judged(0.002, 0.5).verdict(), scene::Verdict::pass);
  EXPECT_EQ(judged(0.06, 0).verdict(), scene::Verdict::pass);
  EXPECT_EQ(judged(0.06, 0.5, "angular_momentum = 1e-30\n").verdict(), scene::Verdict::fail);
}

}  // namespace
}  // namespace porthos::test::judge_works_test
