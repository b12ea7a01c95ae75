// A step control with what happens at given instants: events, switches, sampling, and steps taken
// again.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/run/checkpoint.h"
#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"

namespace porthos::test::controlled_events_test {
namespace {

using integrators::Outcome;
using scene::RunReport;

/// An arm that swings fast enough for its steps to vary, with more text.
scene::Scene swinging(const TemporaryFolder& folder, const std::string& control, double duration,
                      const std::string& more, const std::string& monitor = "") {
  write_bytes(folder / "model.urdf", arm_urdf());
  write_bytes(
      folder / "scene.toml",
      "[model]\nurdf = 'model.urdf'\nbase = 'free'\n[initial]\nbase.angular_velocity = [0.3, 0.1, "
      "-0.2]\njoints.shoulder = { position = 0.4, velocity = 2 }\njoints.elbow = { position = "
      "0.2, velocity = -3 }\n[integrator]\nmethod = 'gauss12'\nstep = 0.05\nstep_control = '" +
          control + "'\nstep_control_rate = 3\n[run]\nduration = " + std::to_string(duration) +
          "\nrecord_every = 0.1\n" + monitor + "[verify]\nbalance = 1e-11\n" + more);
  return scene::read_scene((folder / "scene.toml").string());
}
RunReport run_of(const scene::Scene& s, const fs::path& out) {
  return scene::run(s, scene::assemble(s), into(out));
}
double apart(const phs::State& a, const phs::State& b) {
  double worst = a.x.size() == b.x.size() ? 0 : HUGE_VAL;
  for (size_t i = 0; i < std::min(a.x.size(), b.x.size()); ++i)
    worst = std::max(worst, std::fabs(a.x[i] - b.x[i]));
  return worst;
}
const scene::Check& check_of(const RunReport& r, const std::string& name) {
  static const scene::Check none{"none", NAN, 0, false};
  for (const auto& c : r.checks)
    if (c.name == name) return c;
  return none;
}

const std::string lock_at =
    "[[event]]\ntype = 'lock'\nat = 1.234\njoint = 'elbow'\n"
    "[[event]]\ntype = 'unlock'\nat = 2.5\njoint = 'elbow'\n";

class ControlledEvents : public testing::TestWithParam<const char*> {};

// The events are at no whole number of steps. Before the first the run is the one that ends there,
// to the bit.
TEST_P(ControlledEvents, TheWayToAnEventIsTheRunToThatTime) {
  TemporaryFolder folder;
  const auto s = swinging(folder, GetParam(), 4, lock_at);
  const auto whole = run_of(s, folder / "out");
  EXPECT_TRUE(whole.passed());
  EXPECT_EQ(whole.simulated_s, 4);
  EXPECT_EQ(whole.phases, 3);
  scene::Scene first = s;
  first.events.clear();
  first.duration = 1.234;
  const auto plain = run_of(first, folder / "first");
  const auto met = scene::read_checkpoint(folder / "out" / "phase_1" / "end");
  EXPECT_TRUE(met.state == plain.final_state);
  EXPECT_EQ(met.state.origin, 1.234);
  const auto& across = check_of(whole, "momentum_across_events");
  EXPECT_LE(across.value, 1e-14);

  // The same phases by fixed steps of a size that meets the events.
  auto fixed = s;
  fixed.step_control = integrators::StepControl::fixed;
  fixed.step = 0.002;
  const auto f = run_of(fixed, folder / "fixed");
  const double off = apart(whole.final_state, f.final_state);
  std::printf("  %-16s %lld steps for %lld; momenta %.1e (1e-14), end %.1e from theirs (1e-12)\n",
              GetParam(), (long long)whole.steps, (long long)f.steps, across.value, off);
  EXPECT_LE(off, 1e-12);
  EXPECT_LT(whole.steps, f.steps / 4);
}

// Stopped in the second phase and continued; and an event that waits, found by steps of the plain
// method.
TEST_P(ControlledEvents, ContinuesBitForBitAndWaits) {
  TemporaryFolder folder;
  const auto s = swinging(folder, GetParam(), 4,
                          lock_at + "[[event]]\ntype = 'lock'\njoint = 'shoulder'\nabove = 2.0\n");
  const auto a = scene::assemble(s);
  const auto whole = run_of(s, folder / "whole");
  EXPECT_TRUE(whole.passed());
  auto o = into(folder / "parts");
  o.stop_at = whole.steps * 3 / 5;
  ASSERT_TRUE(scene::run(s, a, o).interrupted);
  const auto r = scene::run(s, a, into(folder / "parts", true));
  EXPECT_TRUE(r.final_state == whole.final_state);
  EXPECT_TRUE(scene::run_in_memory(s, a, {}).final_state == whole.final_state);
}

const std::string jet =
    "[[element]]\ntype = 'thruster'\nname = 'jet'\nlink = 'body'\nat = [0.3, 0.1, 0]\n"
    "direction = [0, 1, 0.2]\nthrust = 20\nswitches = [0.317, 1.414]\n";

// Thrust that switches between whole steps: its whole impulse, and the motion of fixed steps that
// meet the switches.
TEST_P(ControlledEvents, ThrustSwitchesOnTheDot) {
  TemporaryFolder folder;
  const auto s = swinging(folder, GetParam(), 2, jet);
  const auto r = run_of(s, folder / "out");
  EXPECT_TRUE(r.passed());
  for (const auto& c : r.checks) EXPECT_TRUE(c.pass) << c.name << " " << c.value;
  auto fixed = s;
  fixed.step_control = integrators::StepControl::fixed;
  fixed.step = 0.001;
  const auto f = run_of(fixed, folder / "fixed");
  const double off = apart(r.final_state, f.final_state);
  std::printf("  %-16s left of momenta %.1e (1e-12), %.1e from fixed steps (1e-12)\n", GetParam(),
              std::max(r.impulses.linear_left, r.impulses.angular_left), off);
  EXPECT_LE(r.impulses.linear_left, 1e-12);
  EXPECT_LE(off, 1e-12);
}

// A sampled controller holds between its instants, which steps of any size end at.
TEST_P(ControlledEvents, SamplingIsThatOfFixedSteps) {
  TemporaryFolder folder;
  const auto s = swinging(folder, GetParam(), 2,
                          "[[element]]\ntype = 'controller'\njoint = 'elbow'\ntarget = 0.1\n"
                          "stiffness = 3\ndamping = 0.5\nrate = 10\n");
  const auto r = run_of(s, folder / "out");
  EXPECT_TRUE(r.passed());
  auto fixed = s;
  fixed.step_control = integrators::StepControl::fixed;
  fixed.step = 0.002;
  const auto f = run_of(fixed, folder / "fixed");
  const double off = apart(r.final_state, f.final_state);
  fixed.elements[0].rate = 20;
  const double other = apart(run_of(fixed, folder / "other").final_state, f.final_state);
  std::printf("  %-16s %.1e from fixed steps (1e-12); of twice the rate %.1e\n", GetParam(), off,
              other);
  EXPECT_LE(off, 1e-12);
  EXPECT_GT(other, 1e-4) << "control: the instants matter";
}

// Steps that add too much to the defect are taken again in parts, each of them at its own size.
TEST_P(ControlledEvents, AMonitorRepeatsSteps) {
  TemporaryFolder folder;
  auto s = swinging(folder, GetParam(), 2, "energy = 1e-5\n",
                    "[monitor]\nstep_limit = 1e-10\naction = 'repeat'\n");
  s.method = "gauss4";
  const auto r = run_of(s, folder / "out");
  auto without = s;
  without.monitor.reset();
  const auto w = run_of(without, folder / "without");
  std::printf("  %-16s energy error %.1e, without %.1e\n", GetParam(), r.energy.max_rel_error,
              w.energy.max_rel_error);
  EXPECT_EQ(r.outcome, Outcome::ok);
  EXPECT_EQ(r.simulated_s, 2);
  EXPECT_LT(r.energy.max_rel_error, 0.1 * w.energy.max_rel_error);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ControlledEvents, testing::Values("time_transformed", "reversible"),
                         [](const auto& i) { return std::string(i.param); });

}  // namespace
}  // namespace porthos::test::controlled_events_test
