// Scenes by the method "moreau": the example, resumed runs, events and monitors, and what is
// refused.
#include <fmt/format.h>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::time_stepping_run_test {
namespace {

scene::RunReport report_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
scene::Scene pile(const TemporaryFolder& folder, double duration,
                  const std::vector<Change>& changes = {}, const std::string& more = "") {
  return shipped(folder, "pile", duration, changes, more);
}

/// The balls come to rest, apart from rolling, and the box stops where mu says. The ledger closes
/// whatever watches. Control: another mu of the box.
TEST(TimeSteppingRun, APile) {
  TemporaryFolder folder;
  const auto r = report_of(pile(folder, 1));
  const double stops = -1 + 1.2 * 1.2 / (2 * 0.4 * 9.81), box = r.final_state.x[35];
  fmt::print("  energy {:.1e}   bound 1e-11; box {:.1e} m off   bound 5e-6; {} impacts\n",
             value_of(r, "energy"), box - stops, r.impacts[0].count);
  EXPECT_TRUE(r.passed());
  EXPECT_LE(std::fabs(box - stops), 0.4 * 9.81 * 0.002 * 0.002 / 8 + 1e-9);
  EXPECT_GT(r.impacts[0].count, 3);
  TemporaryFolder other;
  const auto control = report_of(pile(other, 1, {{"friction = 0.4", "friction = 0.41"}}));
  EXPECT_GT(std::fabs(control.final_state.x[35] - stops), 1e-3);
  TemporaryFolder watched;
  const auto s = report_of(pile(watched, 1, {}, "[monitor]\nlimit = 1e-11\naction = \"stop\"\n"));
  EXPECT_TRUE(s.passed());
  EXPECT_EQ(s.final_state, r.final_state);
}

/// Time stepping keeps energy and |ξ| with any step, so without [verify] a halved step judges the
/// motion. Control: a method for which |ξ| tells.
TEST(TimeSteppingRun, WithoutLimitsAHalvedStepJudges) {
  const auto halved = [](const std::string& name, const std::vector<Change>& changes) {
    TemporaryFolder folder;
    auto s = shipped(folder, name, 1, changes);
    s.verify = {};
    return !std::isnan(
        value_of(scene::run(s, scene::assemble(s), into(folder / "out")), "step_halving"));
  };
  EXPECT_TRUE(halved("pile", {}));
  EXPECT_FALSE(halved("ets_vii", {{"method = \"gauss16\"", "method = \"rk4\""}}));
}

TEST(TimeSteppingRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  expect_same_bits_when_resumed(folder, pile(folder, 0.6), {13, 150, 201, 250});
}

/// An ensemble has the same bits with one thread and with two.
TEST(TimeSteppingRun, AnEnsembleHasTheSameBitsWithThreads) {
  TemporaryFolder folder;
  const auto s = pile(folder, 0.4, {},
                      "[ensemble]\ncases = 4\n[ensemble.vary]\n"
                      "\"initial.base.linear_velocity[0]\" = { uniform = [-0.2, 0.2] }\n");
  expect_same_bits_with_threads(folder, s);
}

TEST(TimeSteppingRun, RefusalsSayWhereAndWhat) {
  const auto refusal = [](const std::vector<Change>& changes, const std::string& more = "") {
    return refusal_of_scene(
        [&](const TemporaryFolder& folder) { return pile(folder, 1, changes, more); });
  };
  const auto refused = [](const std::string& text, const std::string& expected) {
    EXPECT_TRUE(text.starts_with("scene.toml:") && says(text, expected)) << text;
  };
  refused(refusal({{"step = 0.002", "step = 0.002\nstep_control = \"reversible\""}}),
          "the impacts of moreau have no size of step that a control could choose");
  refused(refusal({{"\"moreau\"", "\"gauss16\""}}), "or method = \"moreau\"");
}

}  // namespace
}  // namespace porthos::test::time_stepping_run_test
