// Sampled controllers and events together: an event between two instants leaves what is held as it
// is.
#include "tests/run/scenes.h"

namespace porthos::test::sampled_events_test {
namespace {

/// Two arms on a fixed foot that do not feel each other; `ja` is held by a controller, `jb` rests.
scene::Scene two_arms(const TemporaryFolder& folder, const std::string& rate,
                      const std::string& event) {
  write_bytes(folder / "two.urdf", two_arms_urdf());
  write_bytes(folder / "scene.toml", R"(
[model]
urdf = "two.urdf"
base = "fixed"
[initial]
joints.ja = { position = 1.0 }
[integrator]
method = "rk4"
step = 0.1
[run]
duration = 4
record_every = 0.1
[[element]]
type = "controller"
name = "servo"
joint = "ja"
stiffness = 1
damping = 0.3
)" + rate + event);
  return scene::read_scene((folder / "scene.toml").string());
}
std::string lock_at(const std::string& t) {
  return "[[event]]\ntype = \"lock\"\njoint = \"jb\"\nat = " + t + "\n";
}

/// Angle and momentum of ja at the end.
std::array<double, 2> end_of(const scene::RunReport& r) {
  return {r.final_state.x[0], r.final_state.x[r.final_state.x.size() / 2]};
}

TEST(SampledEvents, AnEventThatChangesNothingChangesNothing) {
  for (const std::string rate : {"rate = 1\n", ""}) {
    TemporaryFolder folder;
    const auto plain = two_arms(folder, rate, "");
    const auto without = end_of(scene::run(plain, scene::assemble(plain), into(folder / "plain")));
    for (const char* at : {"2.0", "1.5", "3.9"}) {
      const auto s = two_arms(folder, rate, lock_at(at));
      const auto with = end_of(scene::run(s, scene::assemble(s), into(folder / at)));
      std::printf("  %s event at %s s: %.17g and %.17g\n", rate.empty() ? "continuous" : "1 Hz", at,
                  with[0], without[0]);
      // The event makes the momenta anew from rates and masses, to rounding.
      for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(with[k], without[k], 1e-14) << at << " s " << rate;
    }
  }
}

TEST(SampledEvents, ARunResumedBetweenPhasesHoldsToo) {
  TemporaryFolder folder;
  const auto s = two_arms(folder, "rate = 1\n", lock_at("1.5"));
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "out"));
  // As if it had been killed before the second phase began.
  fs::remove(folder / "out" / "summary.json");
  fs::remove_all(folder / "out" / "phase_2");
  const auto resumed = scene::run(s, a, into(folder / "out", true));
  EXPECT_TRUE(resumed.final_state == whole.final_state);
}

// The control: what is held matters, so that a silent controller would be seen.
TEST(SampledEvents, TheHeldTorqueMatters) {
  TemporaryFolder folder;
  const auto s = two_arms(folder, "rate = 1\n", "");
  const auto a = scene::assemble(s);
  const auto method = scene::make_integrator(s, *a.model, s.step);
  phs::State held = a.initial;
  for (int i = 0; i < 15; ++i) ASSERT_EQ(method->step(held), integrators::Outcome::ok);
  phs::State silent = held;
  const auto memory = method->sampler().memory();
  for (int i = 0; i < 5; ++i) ASSERT_EQ(method->step(held), integrators::Outcome::ok);
  method->sampler().restore(std::vector<double>(memory.size(), 0.0));
  for (int i = 0; i < 5; ++i) ASSERT_EQ(method->step(silent), integrators::Outcome::ok);
  EXPECT_GT(std::fabs(held.x[0] - silent.x[0]), 1e-2);
}

// What is held stays held through a shorter last step, and past an event that waits, between two
// whole steps.
TEST(SampledEvents, ShorterStepsHoldToo) {
  TemporaryFolder folder;
  auto s = two_arms(folder, "rate = 1\n", "");
  s.method = "gauss8";
  const auto whole = end_of(scene::run(s, scene::assemble(s), into(folder / "whole")));
  s.duration = 3.95;
  const auto shorter = scene::run(s, scene::assemble(s), into(folder / "shorter"));
  EXPECT_EQ(shorter.simulated_s, 3.95);
  s.step = 0.05;  // where all steps are whole
  const auto fine = end_of(scene::run(s, scene::assemble(s), into(folder / "fine")));
  EXPECT_NEAR(end_of(shorter)[0], fine[0], 1e-13);
  auto waits = two_arms(folder, "rate = 1\n",
                        "[[event]]\ntype = \"lock\"\njoint = \"jb\"\nbelow = 1.0\nafter = 1.53\n");
  waits.method = "gauss8";
  const auto r = scene::run(waits, scene::assemble(waits), into(folder / "waits"));
  EXPECT_EQ(r.phases, 2);
  std::printf("  a lock of the other arm at 1.53 s: off by %.1e   bound 1e-13\n",
              std::fabs(end_of(r)[0] - whole[0]));
  EXPECT_NEAR(end_of(r)[0], whole[0], 1e-13);
  EXPECT_EQ(r.simulated_s, 4);
}

}  // namespace
}  // namespace porthos::test::sampled_events_test
