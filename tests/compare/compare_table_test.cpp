// What `porthos compare` prints: of each method the trial nearest to the target, or all trials.
#include "scene/compare/advice.h"
#include "scene/read/scene.h"
#include "tests/run/scenes.h"

namespace porthos::test::compare_table_test {
namespace {

/// Trials of one method from coarse to fine, with steps of 1 s, 0.5 s, ...
scene::MethodTrials trials_of(const std::string& method, std::initializer_list<double> errors) {
  scene::MethodTrials m{integrators::declaration_of(method), {}, false, false};
  double step = 2;
  for (const double error : errors) {
    scene::Trial t;
    t.setting = {.method = method, .step = step /= 2};
    t.report.cpu_s = 1 / step;
    t.report.energy.max_rel_error = error;
    m.trials.push_back(t);
  }
  return m;
}

TEST(CompareTable, OfEachMethodTheTrialNearestToTheTargetIsPrinted) {
  scene::Comparison c;
  c.methods = {trials_of("gauss4", {1e-3, 1e-6, 2e-9, 1e-12}), trials_of("rk4", {1e-4, 1e-6})};
  EXPECT_EQ(scene::nearest_trial(c, c.methods[0], 1e-9), 2u);
  EXPECT_EQ(scene::nearest_trial(c, c.methods[0], 1e-4), 0u) << "control: another target";
  EXPECT_EQ(scene::nearest_trial(c, c.methods[1], 1e-9), 1u);
  const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  const auto nearest = scene::comparison_table({}, c, scene::TrialRows::nearest);
  const auto all = scene::comparison_table({}, c);
  EXPECT_EQ(lines(all) - lines(nearest), 4 - 1) << "4 rows less, and a note on it";
  EXPECT_TRUE(says(nearest, "2.0e-09") && !says(nearest, "1.0e-12")) << nearest;
  EXPECT_TRUE(says(all, "2.0e-09") && says(all, "1.0e-12")) << all;
  const char* const note = "of each method the trial nearest to the target 1e-09";
  EXPECT_TRUE(says(nearest, note) && !says(all, note));
  EXPECT_TRUE(nearest.ends_with(scene::advise(c, 1e-9).sentence + "\n"));
}

TEST(CompareTable, ATrialThatFailedOrMovesWronglyIsPrintedOnlyWhereThereIsNoOther) {
  scene::Comparison c;
  c.methods = {trials_of("gauss4", {1e-9, 1e-8, 1e-12})};
  auto& trials = c.methods[0].trials;
  const auto nearest = [&] { return scene::nearest_trial(c, c.methods[0], 1e-9); };
  EXPECT_EQ(nearest(), 0u) << "control";
  trials[0].trajectory_error = 0.2;
  EXPECT_EQ(nearest(), 1u);
  trials[1].failure = "did not converge";
  EXPECT_EQ(nearest(), 2u);
  trials[2].failure = trials[1].failure;
  EXPECT_EQ(nearest(), 0u);
  trials[0].failure = trials[1].failure;
  EXPECT_EQ(nearest(), 2u) << "the last one tells why";
}

TEST(CompareTable, AMethodThatKeepsAnyEnergyIsNearestByItsTrajectory) {
  scene::Comparison c;
  c.methods = {trials_of("gauss4", {1e-15, 1e-15, 1e-15})};
  auto& m = c.methods[0];
  for (size_t i = 0; i < 3; ++i) m.trials[i].trajectory_error = std::pow(10, -7 - double(i));
  EXPECT_EQ(scene::nearest_trial(c, m, 1e-9), 0u) << "control: by the energy";
  m.method.energy_exact = integrators::Claim::holds;
  EXPECT_EQ(scene::nearest_trial(c, m, 1e-9), 2u);
}

}  // namespace
}  // namespace porthos::test::compare_table_test
