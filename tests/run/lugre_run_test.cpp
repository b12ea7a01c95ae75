// Scenes with LuGre friction: rest, resumed runs, locks, motors at the same joint, what is refused.
#include <fmt/format.h>

#include "integrators/core/integrator.h"
#include "scene/assemble/outputs.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::lugre_run_test {
namespace {

const std::string bristles =
    "bristle_stiffness = 2000\nbristle_damping = 10\nstribeck = 0.2\nviscous = 5.5\n";

/// The arm of examples/dry_joints with bristles in its joints, let go for some seconds.
scene::Scene let_go(const TemporaryFolder& folder, double duration,
                    const std::vector<Change>& changes = {}, const std::string& more = "") {
  std::vector<Change> all{{"\"dry_friction\"", "\"lugre\""},
                          {"\"dry_friction\"", "\"lugre\""},
                          {"stribeck = 0.2 ", "bristle_stiffness = 2000\nstribeck = 0.2 "},
                          {"viscous = 0.05 ", "bristle_damping = 10\nviscous = 5.5 "},
                          {"breakaway = 1.5", "breakaway = 1.5\n" + bristles},
                          {"3.5, -3.5, 0]", "0, 0, 0]"}};
  all.insert(all.end(), changes.begin(), changes.end());
  return shipped(folder, "dry_joints", duration, all, more);
}
scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}

/// The arm falls, its bristles bend and hold: after half a minute it stays. Stored energy and loss
/// are rows of the ledger, which closes.
TEST(LuGreRun, AnArmBendsAndHolds) {
  TemporaryFolder folder;
  const auto s = let_go(folder, 60, {},
                        "[[output]]\nname = \"held\"\nquantity = \"joint_torque\"\njoint = "
                        "\"shoulder\"\n");
  const auto early = run_of(let_go(folder, 30)), later = run_of(s);
  EXPECT_TRUE(early.passed() && later.passed());
  const double moved = std::max(std::fabs(later.final_state.x[0] - early.final_state.x[0]),
                                std::fabs(later.final_state.x[1] - early.final_state.x[1]));
  const double stored = entry_of(later.storages, "shoulder.lugre.energy"),
               lost = entry_of(later.losses, "shoulder.lugre.loss");
  fmt::print(
      "  at {:.4f} and {:.4f} rad, moves by {:.1e} rad in 30 s (1e-12); holds {:.3e} J, "
      "lost {:.3f} J; balance {:.1e}\n",
      later.final_state.x[0], later.final_state.x[1], moved, stored, lost,
      value_of(later, "balance"));
  EXPECT_GT(std::fabs(later.final_state.x[0]), 1e-3) << "gravity alone would let it hang";
  EXPECT_LE(moved, 1e-12);
  EXPECT_GT(stored, 0);
  EXPECT_GT(lost, 1);
  // What holds it is known, unlike that of dry friction.
  const auto whole = scene::assemble(s);
  scene::Outputs outputs(s, whole);
  const double held = outputs.at(60, later.final_state, {})[0];
  EXPECT_NEAR(held, -2000 * later.final_state.x[4], 1e-9);
  EXPECT_GT(std::fabs(held), 0.1);
}

TEST(LuGreRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  const auto [whole, rest] =
      expect_same_bits_when_resumed(folder, let_go(folder, 3), {61, 150, 255});
  EXPECT_EQ(entry_of(whole.losses, "elbow.lugre.loss"), entry_of(rest.losses, "elbow.lugre.loss"));
}

/// A locked joint keeps the bend of its bristle, which holds the joint as before when it is let go.
/// A motor may drive the same joint.
TEST(LuGreRun, LocksAndMotors) {
  TemporaryFolder folder;
  const auto locks = [](const char* at, const char* until) {
    return fmt::format(
        "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = {}\n"
        "[[event]]\ntype = \"unlock\"\njoint = \"shoulder\"\nat = {}\n",
        at, until);
  };
  const auto plain = run_of(let_go(folder, 40)),
             locked = run_of(let_go(folder, 40, {}, locks("30", "35")));
  EXPECT_TRUE(locked.passed());
  EXPECT_NEAR(locked.final_state.x[0], plain.final_state.x[0], 1e-10);
  EXPECT_NEAR(locked.final_state.x[4], plain.final_state.x[4], 1e-10);
  EXPECT_GT(std::fabs(plain.final_state.x[4]), 1e-5) << "there is a bend";
  const auto motor =
      run_of(let_go(folder, 5, {},
                    "[[element]]\ntype = \"dc_motor\"\njoint = \"elbow\"\ninductance = 0.05\n"
                    "resistance = 1\nconstant = 0.1\ngear = 20\nvoltage = { constant = 6 }\n"));
  fmt::print("  balance with locks {:.1e}, with a motor {:.1e}\n", value_of(locked, "balance"),
             value_of(motor, "balance"));
  EXPECT_TRUE(motor.passed());
}

TEST(LuGreRun, RefusalsSayWhereAndWhat) {
  const auto refusal = [](const std::vector<Change>& changes, const std::string& more = "") {
    return refusal_of_scene(
        [&](const TemporaryFolder& folder) { return let_go(folder, 1, changes, more); });
  };
  const auto refused = [](const std::string& text, const std::string& expected) {
    EXPECT_TRUE(text.starts_with("scene.toml:") && says(text, expected)) << text;
  };
  EXPECT_EQ(refusal({}), "");
  refused(refusal({{"viscous = 5.5 ", "viscous = 4.9 "}}),
          "viscous is 4.9, expected bristle_damping (breakaway - coulomb) / coulomb = 5 or more");
  refused(refusal({{"coulomb = 4 ", "coulomb = 0 "}}), "coulomb is 0, expected more than 0");
  refused(refusal({{"coulomb = 4 ", "smoothing = 4 "}}), "unknown key 'smoothing'");
  refused(refusal({{"joint = \"shoulder\"\ncoulomb", "joint = \"hip\"\ncoulomb"}}), "hip");
}

}  // namespace
}  // namespace porthos::test::lugre_run_test
