// Scenes whose steps vary: they end on the dot, keep what fixed steps keep, and continue bit for
// bit.
#include <nlohmann/json.hpp>

#include "tests/run/scenes.h"

namespace porthos::test::step_control_run_test {
namespace {

using integrators::StepControl;
using scene::RunReport;

Case controlled(Case c, StepControl kind) {
  c.scene.step_control = kind;
  c.scene.step = 0.1;
  c.scene.control_rate = 3;
  c.scene.record_every = 0.25;
  c.scene.duration = 50.1;  // no multiple of anything
  return c;
}

class StepControlRun : public ::testing::TestWithParam<StepControl> {};

TEST_P(StepControlRun, EndsOnTheDotAndKeepsTheInvariants) {
  TemporaryFolder folder;
  const Case c = controlled(floating_arm(folder, 50, "gauss16"), GetParam());
  auto options = into(folder / "out");
  options.check_symmetry = true;
  const RunReport r = scene::run(c.scene, c.assembly, options);
  EXPECT_TRUE(r.passed());
  for (const auto& check : r.checks)
    EXPECT_TRUE(check.pass) << check.name << " " << check.value << " > " << check.limit;
  EXPECT_EQ(r.simulated_s, c.scene.duration);
  EXPECT_EQ(r.final_state.origin, c.scene.duration);
  EXPECT_EQ(r.records, 202) << "the start, 200 record times, the end";
  EXPECT_GT(r.steps, 501) << "0.1 s is the longest step";
  const auto summary = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  EXPECT_EQ(summary["step_control"], to_string(GetParam()));
  EXPECT_EQ(summary["simulated_s"], c.scene.duration);
  std::printf("  %-16s %lld steps in %.1f s, energy error %.1e\n", to_string(GetParam()),
              (long long)r.steps, r.simulated_s, r.energy.max_rel_error);

  // The same motion by fixed steps, for as long as it is not chaotic.
  Case early = c, fixed = floating_arm(folder, 10.1, "gauss16");
  early.scene.duration = 10.1;
  fixed.scene.step = 10.1 / 1000;
  const RunReport e = scene::run(early.scene, early.assembly, into(folder / "early")),
                  f = scene::run(fixed.scene, fixed.assembly, into(folder / "fixed"));
  double worst = 0;
  for (size_t i = 0; i < f.final_state.x.size(); ++i)
    worst = std::max(worst, std::fabs(e.final_state.x[i] - f.final_state.x[i]));
  std::printf("  %-16s after 10.1 s %.1e from fixed steps   bound 1e-10\n", to_string(GetParam()),
              worst);
  EXPECT_LE(worst, 1e-10);
}

TEST_P(StepControlRun, ContinuesBitForBit) {
  TemporaryFolder folder;
  Case c = controlled(floating_arm(folder), GetParam());
  c.scene.duration = GetParam() == StepControl::reversible ? 1600.1 : 500.1;
  const auto whole = scene::run(c.scene, c.assembly, into(folder / "whole"));
  std::atomic<bool> stop = true;
  RunReport report;
  int parts = 0;
  do {
    auto options = into(folder / "parts", parts > 0);
    options.stop = &stop;
    options.progress = [&](double, double, double) { stop = true; };
    report = scene::run(c.scene, c.assembly, options);
    stop = false;
    ++parts;
  } while (report.interrupted && parts < 200);
  ASSERT_FALSE(report.interrupted);
  EXPECT_GE(parts, 2);
  EXPECT_TRUE(whole.final_state == report.final_state);
  EXPECT_EQ(whole.records, report.records);
  EXPECT_TRUE(read_bytes(folder / "whole" / "run.h5") == read_bytes(folder / "parts" / "run.h5"));

  c.scene.control_rate = 4;
  stop = true;
  auto options = into(folder / "other");
  options.stop = &stop;
  (void)scene::run(controlled(floating_arm(folder), GetParam()).scene, c.assembly, options);
  EXPECT_TRUE(says(refusal([&] { scene::run(c.scene, c.assembly, into(folder / "other", true)); }),
                   "the step_control was"));
}

// What damping takes is measured like that of fixed steps.
TEST_P(StepControlRun, DampedSystems) {
  TemporaryFolder folder;
  Case c = pendulum(folder, 0.5);
  const RunReport f = scene::run(c.scene, c.assembly, into(folder / "fixed"));
  c.scene.step_control = GetParam();
  c.scene.step = 0.05;
  c.scene.control_rate = 4;
  const RunReport r = scene::run(c.scene, c.assembly, into(folder / "out"));
  EXPECT_EQ(r.outcome, integrators::Outcome::ok);
  EXPECT_EQ(r.simulated_s, 10);
  for (size_t i = 0; i < f.final_state.x.size(); ++i)
    EXPECT_NEAR(r.final_state.x[i], f.final_state.x[i], 1e-9) << i;
}

INSTANTIATE_TEST_SUITE_P(Kinds, StepControlRun,
                         ::testing::Values(StepControl::time_transformed, StepControl::reversible),
                         [](const auto& i) { return std::string(to_string(i.param)); });

}  // namespace
}  // namespace porthos::test::step_control_run_test
