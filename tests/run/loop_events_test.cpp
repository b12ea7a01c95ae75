// Scenes whose loops close and open at events: the ledger, resumed runs, waiting, what is refused.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "scene/compare/auto_method.h"
#include "scene/files/hdf5_reader.h"
#include "scene/run/phase_sequence.h"
#include "tests/run/shipped.h"

namespace porthos::test::loop_events_test {
namespace {

TEST(LoopEvents, TwoArmsTakeHoldOfALoadAndLetGo) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "two_arms");
  EXPECT_TRUE(s.constraints.spec.empty());  // open until the event
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  ASSERT_TRUE(r.passed());
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  ASSERT_EQ(j["events"].size(), 3u);
  EXPECT_EQ(j["phases"].size(), 4u);
  EXPECT_EQ(j["events"][1]["event"], "closing of right_grip");
  const double lost = j["events"][1]["dissipated_J"], by_opening = j["events"][2]["dissipated_J"];
  std::printf("  the closing takes %.3e J, the opening %.1e; gap %.1e m; defect %.1e of %.1e J\n",
              lost, by_opening, r.constraint_gap, r.defect_J, r.energy.scale_J);
  EXPECT_GT(lost, 1e-4 * r.energy.scale_J);
  EXPECT_LT(by_opening, 1e-20);
  EXPECT_LT(r.constraint_gap, 5e-15);
  EXPECT_LT(std::fabs(r.defect_J), 1e-15 * r.energy.scale_J);
  for (int phase = 1; phase <= 4; ++phase) {
    const scene::Hdf5Reader file(folder / "out" / fmt::format("phase_{}", phase) / "run.h5");
    const bool has = file.datasets().count("reactions/right_grip") > 0;
    EXPECT_EQ(has, phase == 3) << phase;
  }
}

TEST(LoopEvents, AnInterruptedRunContinuesBitForBit) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "two_arms");
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  auto o = into(folder / "parts");
  o.stop_at = 100;  // while the loop is closed
  ASSERT_TRUE(scene::run(s, a, o).interrupted);
  const auto r = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(r.final_state.x, whole.final_state.x);
  EXPECT_EQ(r.final_state.lo, whole.final_state.lo);
}

/// The right hand comes within reach at an instant between steps.
TEST(LoopEvents, AClosingWaitsUntilItsFramesAreWithinReach) {
  TemporaryFolder folder;
  const auto run = [&](const std::string& reach) {
    const auto s =
        shipped(folder, "two_arms",
                {{"at = 4.0\nloop = \"right_grip\"\nreach = 0.2",
                  "when = \"within_reach\"\nafter = 2.5\nloop = \"right_grip\"\nreach = " + reach},
                 {"[[event]]\ntype = \"open\"\nat = 80.0\nloop = \"right_grip\"\n", ""},
                 {"joints.right_elbow = { position = 1.0 }",
                  "joints.right_elbow = { position = 0.7, velocity = 0.05 }"}});
    const auto a = scene::assemble(s);
    return scene::run(s, a, into(folder / ("out" + reach)));
  };
  const auto r = run("0.1");
  const auto j = nlohmann::json::parse(read_bytes(folder / "out0.1" / "summary.json"));
  ASSERT_EQ(j["events"].size(), 2u);
  const double at = j["events"][1]["at_s"];
  std::printf("  closed at %.6f s\n", at);
  EXPECT_NEAR(at, 2.685, 0.001);
  EXPECT_TRUE(r.passed());
  EXPECT_FALSE(run("0.0001").passed());  // control: it never comes as near as that
}

/// A clutch between two pendulums: it slips to a common rate at once, loses what that takes, and
/// they turn as one until it opens.
TEST(LoopEvents, AClutchClosesAndOpens) {
  TemporaryFolder folder;
  const std::string text =
      read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "examples/four_bar/scene.toml");
  const size_t from = text.find("[[loop]]"), to = text.find("[integrator]");
  const auto s = shipped(folder, "four_bar",
                         {{text.substr(from, to - from), ""},
                          {"duration = 1000.0", "duration = 4.0"},
                          {"record_every = 1.0", "record_every = 0.25"}},
                         "[[coupling]]\nname = 'clutch'\nfactors = { crank = 1, rocker = -2 }\n"
                         "[[event]]\ntype = 'close'\nat = 1.0\nloop = 'clutch'\n"
                         "[[event]]\ntype = 'open'\nat = 3.0\nloop = 'clutch'\n");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  ASSERT_TRUE(r.passed());
  const auto relation = [&](const fs::path& run, size_t row) {
    const scene::Hdf5Reader file(run);
    const size_t n = size_t(file.dataset("time").shape[0]);
    std::vector<double> crank(n), rocker(n);
    std::vector<std::int64_t> turns(3 * n);
    file.read("state/crank", crank.data());
    file.read("state/rocker", rocker.data());
    file.read("turns", turns.data());
    row = std::min(row, n - 1);
    const auto of = [&](double angle, size_t k) {
      return angle + 2 * M_PI * double(turns[3 * row + k]);
    };
    return of(crank[row], 0) - 2 * of(rocker[row], 2);
  };
  const fs::path closed = folder / "out" / "phase_2" / "run.h5",
                 open = folder / "out" / "phase_3" / "run.h5";
  const double kept = relation(closed, 1000) - relation(closed, 0),
               slipped = relation(open, 1000) - relation(open, 0);
  std::printf("  crank - 2 rocker changes by %.1e rad while it is closed, %.2f after\n", kept,
              slipped);
  EXPECT_LT(std::fabs(kept), 2e-14);
  EXPECT_GT(std::fabs(slipped), 0.1);
  double lost = 0;
  for (const auto& [what, joule] : r.losses)
    if (what == "closing of clutch") lost = joule;
  EXPECT_GT(lost, 0.1);
}

/// In orbit with all that pushes there: the ledgers close, the loop stays closed through the kicks.
/// The records have no reactions, as the field of the whole system has none of the kicks.
TEST(LoopEvents, LoopsCloseInOrbitBesideDragAndAThruster) {
  TemporaryFolder folder;
  const auto s = shipped(
      folder, "two_arms", {},
      "[orbit]\naltitude = 4e5\nsplitting = \"lobatto4c\"\n[orbit.drag]\ndensity = 1e-12\naltitude "
      "= "
      "4e5\nscale_height = 6e4\narea_coefficient = 4\n[planet]\nrotation_rate = 7.29e-5\n"
      "[[element]]\ntype = \"thruster\"\nname = \"jet\"\nlink = \"bus\"\ndirection = [0, 1, 0]\n"
      "thrust = 0.1\nswitches = [10, 20]\n");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  for (const auto& c : r.checks) EXPECT_TRUE(c.pass) << c.name << " " << c.value;
  EXPECT_TRUE(r.passed()) << r.trouble;
  EXPECT_LT(r.constraint_gap, 5e-15);
  const scene::Hdf5Reader file(folder / "out" / "phase_3" / "run.h5");
  EXPECT_EQ(file.datasets().count("reactions/right_grip"), 0u);
}

/// The pilots of auto take methods that keep the loops that are still open.
TEST(LoopEvents, AutoChoosesForTheLoopsThatClose) {
  TemporaryFolder folder;
  auto s = shipped(folder, "two_arms", {{"\"spark16\"", "\"auto\""}});
  const auto a = scene::assemble(s);
  s = scene::with_method_chosen(s, a);
  EXPECT_TRUE(s.method.starts_with("spark")) << s.method;
  EXPECT_TRUE(scene::run(s, a, into(folder / "out")).passed());
}

/// A thruster beside a tether to the world: its impulse alone does not explain the momentum, and
/// the verdict does not ask that.
TEST(LoopEvents, ATetherToTheWorldTakesMomentum) {
  TemporaryFolder folder;
  const std::string text =
      read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "examples/two_arms/scene.toml");
  const size_t from = text.find("[[loop]]"), to = text.find("[integrator]"),
               verify = text.find("[verify]");
  const auto s =
      shipped(folder, "two_arms", {{text.substr(from, to - from), ""}, {text.substr(verify), ""}},
              "[[element]]\ntype = \"line_spring\"\nname = \"tether\"\nlink = \"bus\"\n"
              "stiffness = 5\ndamping = 1\n[[element]]\ntype = \"thruster\"\nname = "
              "\"jet\"\nlink = \"bus\"\ndirection = [0, 1, 0]\nthrust = 0.5\nswitches = "
              "[10, 60]\n");
  const auto a = scene::assemble(s);
  const auto r =
      scene::run(s, a, into(folder / "out"));  // both ends of the tether meet at the start
  EXPECT_TRUE(r.passed()) << r.trouble;
  EXPECT_GT(r.dissipated_J, 1e-4);
}

TEST(LoopEvents, WhatCannotBeIsRefusedBeforeTheRun) {
  TemporaryFolder folder;
  const auto why = [&](const std::vector<Change>& changes, const std::string& more = "") {
    try {
      const auto s = shipped(folder, "two_arms", changes, more);
      scene::rehearse(s, scene::assemble(s));
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(why({}), "");
  EXPECT_TRUE(says(why({{"at = 4.0\nloop = \"right_grip\"", "at = 4.0\nloop = \"grip\""}}),
                   "there is no [[loop]] or [[coupling]] 'grip', expected one of: right_grip"));
  EXPECT_TRUE(says(why({{"loop = \"right_grip\"\nreach = 0.2", "loop = \"right_grip\""}}),
                   "the closing of 'right_grip' lacks the key 'reach', expected the largest gap"));
  EXPECT_TRUE(says(why({{"\"spark16\"", "\"gauss16\""}}),
                   "after the closing of right_grip: method 'gauss16' keeps no constraints"));
  EXPECT_TRUE(says(why({{"at = 80.0", "at = 3.0"}}),
                   "at 3 s: open: the loop 'right_grip' is not closed, expected one that is"));
  EXPECT_TRUE(says(why({}, "[[event]]\ntype = 'close'\nat = 5.0\nloop = 'right_grip'\nreach = 1\n"),
                   "at 5 s: closing of right_grip: it is closed already, expected an open one"));
  EXPECT_TRUE(says(why({},
                       "[[coupling]]\nname = 'c'\nfactors = { left_elbow = 1 }\n[[event]]\n"
                       "type = 'close'\nat = 5.0\nloop = 'c'\nreach = 1\n"),
                   "coupling 'c' joins no two frames, expected a time and no limits"));
  const std::string text =
      read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "examples/two_arms/scene.toml");
  const size_t from = text.find("type = ", text.find("[[loop]]"));
  EXPECT_TRUE(
      says(why({{text.substr(from, text.find('\n', from) - from),
                 "type = \"on_curve\"\npoints = [[0, 0], [1, 0]]"}}),
           "'right_grip' holds a point on a curve and cannot close as the mechanism stands"));
  TemporaryFolder far;
  const auto s = shipped(far, "two_arms",
                         {{"at = 4.0\nloop = \"right_grip\"\nreach = 0.2",
                           "at = 4.0\nloop = \"right_grip\"\nreach = 0.001"}});
  const auto missed = scene::run(s, scene::assemble(s), into(far / "out"));
  EXPECT_FALSE(missed.passed());
  EXPECT_TRUE(says(missed.notes.back(), "closing of right_grip: the distance is 0."))
      << missed.notes.back();
}

}  // namespace
}  // namespace porthos::test::loop_events_test
