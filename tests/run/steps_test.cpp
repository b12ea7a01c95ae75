// The end time asked for is the end time; numbers that are rounded, and keys without effect, are
// told.
#include "scene/assemble/steps.h"

#include "tests/run/scenes.h"

namespace porthos::test::steps_test {
namespace {

bool told(const scene::RunReport& r, const std::string& words) {
  return std::any_of(r.notes.begin(), r.notes.end(),
                     [&](const auto& n) { return n.find(words) != std::string::npos; });
}

TEST(Steps, TheEndTimeIsTheOneAskedFor) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.duration = 1;
  c.scene.step = 0.3;
  c.scene.record_every = 0.3;
  const auto r = scene::run(c.scene, c.assembly, into(folder / "odd"));
  EXPECT_EQ(r.simulated_s, 1.0);
  EXPECT_EQ(r.steps, 4);
  EXPECT_EQ(r.records, 5) << "at 0, 0.3, 0.6, 0.9 and 1 s";
  EXPECT_TRUE(told(r,
                   "duration is 1 s, 3.33333 steps of 0.3 s: the last step is 0.1 s long, the only "
                   "one of another size"));
  c.scene.step = c.scene.record_every = 0.01;
  const auto fine = scene::run(c.scene, c.assembly, into(folder / "fine"));
  EXPECT_EQ(fine.simulated_s, 1.0);
  EXPECT_FALSE(told(fine, "the last step is")) << "the control: 100 whole steps";
  double off = 0;
  for (size_t k = 0; k < r.final_state.x.size(); ++k)
    off = std::max(off, std::fabs(r.final_state.x[k] - fine.final_state.x[k]));
  std::printf("  final state off by %.1e (1e-3), the motion of the last 0.1 s is 1e-1 and more\n",
              off);
  EXPECT_LT(off, 1e-3);
}

TEST(Steps, AreWholeButForTheRoundingOfTwoTimes) {
  scene::Scene s;
  for (const auto& [duration, step, total] :
       {std::tuple{1.0, 0.1, 10}, {0.3, 0.1, 3}, {49.0, 0.07, 700}, {86400.0, 1.0 / 3, 259200}}) {
    s.duration = duration;
    s.step = step;
    EXPECT_EQ(scene::steps_of(s).total, total) << duration << " / " << step;
    EXPECT_EQ(scene::steps_of(s).last, 0) << duration << " / " << step;
  }
  s.duration = 1;
  s.step = 0.03;
  EXPECT_EQ(scene::steps_of(s).total, 34);
  EXPECT_NEAR(scene::steps_of(s).last, 0.01, 1e-16);
}

TEST(Steps, AFittingOneIsAWholeFraction) {
  scene::Scene s;
  s.duration = 50;
  s.record_every = 2.5;
  EXPECT_EQ(scene::fitting_step(s, 0.37), 50 / 136.0);
  s.record_every_given = true;
  EXPECT_EQ(scene::fitting_step(s, 0.37), 2.5 / 7);
  EXPECT_EQ(scene::fitting_step(s, 2.5), 2.5);
  s.record_every = 0.1;  // shorter than the step
  EXPECT_EQ(scene::fitting_step(s, 0.37), 50 / 136.0);
  s.record_every = 3;  // no whole number of them in the duration
  EXPECT_EQ(scene::fitting_step(s, 0.37), 50 / 136.0);
}

TEST(Steps, AnInterruptedRunEndsWithTheSameShortStep) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 2.005);  // 100.25 steps
  const auto whole = scene::run(c.scene, c.assembly, into(folder / "whole"));
  EXPECT_EQ(whole.simulated_s, 2.005);
  const std::atomic<bool> stop = true;
  auto o = into(folder / "parts");
  o.stop = &stop;
  ASSERT_TRUE(scene::run(c.scene, c.assembly, o).interrupted);
  const auto parts = scene::run(c.scene, c.assembly, into(folder / "parts", true));
  EXPECT_EQ(parts.simulated_s, 2.005);
  EXPECT_TRUE(parts.final_state == whole.final_state);
}

TEST(Steps, AMonitorRepeatsTheShortStepToo) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.method = "rk4";
  c.scene.step = 0.04;
  c.scene.duration = 1.03;
  c.scene.monitor =
      integrators::MonitorOptions{.step_limit = 1e-13, .action = integrators::OnViolation::repeat};
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  ASSERT_EQ(r.outcome, integrators::Outcome::ok);
  EXPECT_EQ(r.simulated_s, 1.03);
  EXPECT_EQ(r.steps, 26);
  EXPECT_TRUE(told(r, "26 taken again in smaller parts"));
}

TEST(Steps, WhatHasNoEffectIsTold) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.duration = 1;
  const auto quiet = scene::run(c.scene, c.assembly, into(folder / "quiet"));
  EXPECT_FALSE(told(quiet, "effect"));
  c.scene.method = "rk4";
  c.scene.rtol = 1e-6;
  c.scene.iteration_tolerance = 1e-10;
  c.scene.magnetic_field = {0, 0, 1e-5};
  c.scene.record_every = 0.015;
  c.scene.record_every_given = true;
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  EXPECT_TRUE(told(r, "rtol has no effect: rk4 does not work to a tolerance of this kind"));
  EXPECT_TRUE(told(r, "iteration_tolerance has no effect: rk4 iterates nothing"));
  EXPECT_TRUE(told(r, "magnetic_field has no effect: the scene has no torquer"));
  EXPECT_TRUE(
      told(r, "record_every is 0.015 s, 1.5 steps of 0.01 s: there is a record every 0.02 s"));
  c.scene.method = "gauss8";
  const auto iterates = scene::run(c.scene, c.assembly, into(folder / "gauss"));
  EXPECT_FALSE(told(iterates, "iteration_tolerance")) << "the control: it has an effect";
}

}  // namespace
}  // namespace porthos::test::steps_test
