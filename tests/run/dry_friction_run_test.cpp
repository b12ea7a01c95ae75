// Scenes with dry friction: rest, step controls and monitors, resumed runs, locks, sampled
// controllers, and what is refused.
#include <fmt/format.h>

#include "integrators/core/integrator.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::dry_friction_run_test {
namespace {

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
/// The arm of the example without its force, for some seconds.
scene::Scene let_go(const TemporaryFolder& folder, double duration,
                    std::vector<Change> changes = {}, const std::string& more = "") {
  changes.push_back({"3.5, -3.5, 0]", "0, 0, 0]"});
  return shipped(folder, "dry_joints", duration, changes, more);
}

/// The arm falls, rests, and stays. The angles of rest do not depend on the method, on the control
/// of its steps, or on what watches. Control: with smooth friction it creeps on.
TEST(DryFrictionRun, AnArmRestsAndHolds) {
  TemporaryFolder folder;
  const auto at_rest = run_of(let_go(folder, 8)), later = run_of(let_go(folder, 80));
  EXPECT_TRUE(at_rest.passed() && later.passed());
  ASSERT_EQ(at_rest.slips.size(), 2u);
  EXPECT_EQ(at_rest.slips[0].name, "shoulder.dry_friction");
  EXPECT_EQ(at_rest.slips[0].first_s.size(), size_t(at_rest.slips[0].count));
  fmt::print(
      "  rests at {:.4f} and {:.4f} rad after {} and {} slips; moves by {:.1e} rad   bound 0\n",
      at_rest.final_state.x[0], at_rest.final_state.x[1], at_rest.slips[0].count,
      at_rest.slips[1].count, later.final_state.x[0] - at_rest.final_state.x[0]);
  EXPECT_GT(std::fabs(at_rest.final_state.x[0]), 0.01);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(at_rest.final_state.x[i], later.final_state.x[i]);
    EXPECT_LE(std::fabs(at_rest.final_state.x[2 + i]), 1e-15);
  }
  for (const std::string more :
       {"step_control = \"time_transformed\"", "step_control = \"reversible\"",
        "[monitor]\nlimit = 1e-12\naction = \"stop\"", "[monitor]\nproject = true",
        "[monitor]\nstep_limit = 1e-12\naction = \"repeat\""}) {
    TemporaryFolder other;
    const auto r = run_of(let_go(other, 8, {{"step = 0.01 ", "step = 0.01\n" + more + "\n"}}));
    const double off = std::max(std::fabs(r.final_state.x[0] - at_rest.final_state.x[0]),
                                std::fabs(r.final_state.x[1] - at_rest.final_state.x[1]));
    fmt::print("  {:50.50} balance {:.1e}, angles off by {:.1e} rad   bound 1e-10\n",
               more.substr(0, more.find('\n', 12)), value_of(r, "balance"), off);
    EXPECT_TRUE(r.passed()) << more;
    EXPECT_LE(off, 1e-10) << more;
  }
  TemporaryFolder smooth;
  const std::vector<Change> creeps{{"\"dry_friction\"", "\"friction\"\nsmoothing = 0.05"},
                                   {"\"dry_friction\"", "\"friction\"\nsmoothing = 0.05"},
                                   {"breakaway = 1.5", ""}};
  const auto a = run_of(let_go(smooth, 8, creeps)), b = run_of(let_go(smooth, 80, creeps));
  EXPECT_TRUE(a.passed() && b.passed());
  EXPECT_GT(std::fabs(b.final_state.x[0] - a.final_state.x[0]), 1e-3);
}

/// Interrupted while it slides, while it sticks and in between, and continued: the same bits.
TEST(DryFrictionRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  const auto [whole, rest] = expect_same_bits_when_resumed(folder, shipped(folder, "dry_joints"),
                                                           {61, 255, 500, 1013, 1500});
  EXPECT_EQ(whole.slips, rest.slips);
  fmt::print("  balance {:.1e}; slips: shoulder {}, elbow {}\n", value_of(whole, "balance"),
             whole.slips[0].count, whole.slips[1].count);
  EXPECT_GT(whole.slips[0].count + whole.slips[1].count, 2);
  EXPECT_GT(entry_of(whole.losses, "elbow.dry_friction"), 0);
}

/// A sampled controller whose torque jumps pushes a joint out of rest and lets it rest again; a
/// joint with dry friction is locked and unlocked.
TEST(DryFrictionRun, JumpsOfTheLoadAndLocks) {
  TemporaryFolder folder;
  const auto r = run_of(let_go(folder, 12, {},
                               "[[element]]\ntype = \"controller\"\njoint = \"elbow\"\ntarget = 1\n"
                               "stiffness = 4\ndamping = 0.5\nrate = 20\n"
                               "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 7\n"
                               "[[event]]\ntype = \"unlock\"\njoint = \"shoulder\"\nat = 9\n"));
  fmt::print("  balance {:.1e}; slips {} and {}; rests at {:.4f}, {:.4f} rad\n",
             value_of(r, "balance"), r.slips[0].count, r.slips[1].count, r.final_state.x[0],
             r.final_state.x[1]);
  EXPECT_TRUE(r.passed());
  // It rests where the controller's pull is less than what holds: 1.5 N m and the load.
  EXPECT_NEAR(r.final_state.x[1], 1, 2);
  EXPECT_LE(std::fabs(r.final_state.x[3]), 1e-15);
}

/// <dynamics friction> of the model file is Coulomb's dry friction where the scene asks for it; an
/// element of the scene goes before. Control: without use_friction the joint has none.
TEST(DryFrictionRun, TheModelFileMayStateIt) {
  const auto end = [](const std::vector<Change>& changes) {
    TemporaryFolder folder;
    auto s = let_go(folder, 2, changes);
    return std::pair{run_of(s), s.elements.size()};
  };
  const std::string elbow =
      "[[element]]\ntype = \"dry_friction\"\njoint = \"elbow\"\n"
      "coulomb = 1.0\nbreakaway = 1.5\n";
  const Change from_file{"base = \"fixed\"", "base = \"fixed\"\nuse_friction = true"},
      states{"<joint name=\"elbow\" type=\"continuous\">",
             "<joint name=\"elbow\" type=\"continuous\"><dynamics friction=\"1.0\"/>"};
  const auto [file, of_file] = end({{elbow, ""}, from_file, states});
  const auto [element, of_scene] = end({{"breakaway = 1.5", ""}});
  const auto [none, of_none] = end({{elbow, ""}, states});
  const auto [both, of_both] = end({{"breakaway = 1.5", ""}, from_file, states});
  EXPECT_TRUE(file.final_state == element.final_state);
  EXPECT_TRUE(both.final_state == element.final_state);
  EXPECT_FALSE(none.final_state == element.final_state);
  EXPECT_EQ(of_file, of_scene);
  EXPECT_EQ(of_both, of_scene);
  EXPECT_EQ(of_none, of_scene - 1);
}

TEST(DryFrictionRun, RefusalsSayWhereAndWhat) {
  const auto refusal = [](const std::vector<Change>& changes, const std::string& more = "") {
    return refusal_of_scene(
        [&](const TemporaryFolder& folder) { return let_go(folder, 1, changes, more); });
  };
  const auto refused = [](const std::string& text, const std::string& expected) {
    EXPECT_TRUE(text.starts_with("scene.toml:") && says(text, expected)) << text;
  };
  refused(refusal({{"coulomb = 4 ", "coulomb = 0 "}}),
          "coulomb is 0, expected a number of N m or N above 0");
  refused(refusal({{"breakaway = 6 ", "breakaway = 2 "}}),
          "breakaway is 2, expected coulomb, 4, or more");
  refused(refusal({{"stribeck = 0.2 ", "smoothing = 0.2 "}}), "unknown key 'smoothing'");
  refused(refusal({{"joint = \"shoulder\"\ncoulomb", "joint = \"hip\"\ncoulomb"}}), "hip");
  refused(
      refusal({{"joint = \"shoulder\"\ncoulomb", "joint = \"elbow\"\nname = \"more\"\ncoulomb"}}),
      "joint 'elbow' has dry friction already, expected it once");
  refused(refusal({},
                  "[[element]]\ntype = \"joint_stop\"\njoint = \"elbow\"\nlower = -1\nlaw = "
                  "\"rigid\"\nrestitution = 1\n"),
          "'elbow.joint_stop' is rigid, expected soft contacts and stops beside dry friction");
  refused(refusal({}, "[[motion]]\nname = \"m\"\njoint = \"elbow\"\nsteady = { rate = 1 }\n"),
          "sticks and 'm' is a constraint, expected smooth friction in a mechanism with any");
  refused(refusal({}, "[[output]]\nname = \"t\"\nquantity = \"joint_torque\"\njoint = \"elbow\"\n"),
          "joint_torque does not know what dry friction 'elbow.dry_friction' holds");
}

}  // namespace
}  // namespace porthos::test::dry_friction_run_test
