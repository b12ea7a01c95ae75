// Sampled controllers and the energy monitor in scenes: rows, notes, restart, exit, and what is
// refused.
#include <gtest/gtest.h>

#include "tests/run/scenes.h"

namespace porthos::test::monitor_test {
namespace {

/// A scene of the arm with some more tables; the elbow begins at 0.5 rad.
scene::Scene scene_with(const TemporaryFolder& folder, const std::string& tables,
                        const std::string& method = "gauss8", double duration = 10) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
              "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder = { position = 1.2 "
              "}\njoints.elbow = { position = 0.5 }\n[integrator]\nmethod = \"" +
                  method + "\"\nstep = 0.01\n[run]\nduration = " + std::to_string(duration) +
                  "\nrecord_every = 0.1\n[verify]\nbalance = 1e-12\n" + tables);
  return scene::read_scene((folder / "scene.toml").string());
}
std::string controller(const std::string& keys) {
  return "[[element]]\njoint = \"elbow\"\ntype = \"controller\"\nstiffness = 8.0\ndamping = "
         "0.6\ntarget = 0.2\n" +
         keys;
}
std::string notes(const scene::RunReport& r) {
  std::string all;
  for (const auto& n : r.notes) all += n + "\n";
  return all;
}
double row(const scene::RunReport& r, const std::string& name) {
  for (const auto& [key, joule] : r.ports)
    if (key == name) return joule;
  return NAN;
}

TEST(Controllers, TheHoldIsARowAndTheBalanceCloses) {
  double hold[3];
  int at = 0;
  for (const char* keys : {"", "rate = 50.0\n", "rate = 10.0\noutput = \"mean\"\n"}) {
    TemporaryFolder folder;
    const auto s = scene_with(folder, controller(keys));
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    ASSERT_TRUE(r.passed()) << notes(r);
    hold[at] = *keys ? row(r, "elbow.controller.hold") : 0;
    std::printf("  %-32s controller %+8.4f J, hold %+8.4f J, defect %.1e J of %.0f J (1e-12)\n",
                at == 0   ? "continuous"
                : at == 1 ? "50 Hz"
                          : "10 Hz, mean rate",
                row(r, "elbow.controller"), hold[at], r.defect_J, r.turned_over_J);
    EXPECT_TRUE(std::isfinite(row(r, "elbow.controller"))) << at;
    EXPECT_NE(notes(r).find("net energy delivered by controllers: 'elbow.controller' up to"),
              std::string::npos)
        << "a spring with a target gives what it was never given";
    ++at;
  }
  EXPECT_GT(std::fabs(hold[2]), 2 * std::fabs(hold[1])) << "a slower rate injects more";
}

TEST(Controllers, AResumedRunHoldsTheSameValue) {
  TemporaryFolder folder;
  const auto s = scene_with(
      folder, controller("rate = 5.0\noutput = \"mean\"\n") + "[monitor]\nproject = true\n",
      "gauss8", 100);
  const auto whole = scene::run(s, scene::assemble(s), into(folder / "whole"));
  std::atomic<bool> stop{false};
  auto o = into(folder / "part");
  o.stop = &stop;
  o.progress = [&](double done, double, double) { stop = done > 0.1; };
  auto r = scene::run(s, scene::assemble(s), o);
  stop = false;
  o.progress = nullptr;
  o.resume = true;
  if (r.interrupted) r = scene::run(s, scene::assemble(s), o);
  EXPECT_EQ(r.final_state.x, whole.final_state.x);
  EXPECT_EQ(r.supplied_J, whole.supplied_J);
  EXPECT_EQ(row(r, "elbow.controller.hold"), row(whole, "elbow.controller.hold"));
}

TEST(Monitor, StopsARunAndSaysWhy) {
  TemporaryFolder folder;
  const auto s =
      scene_with(folder, "[monitor]\nlimit = 1e-9\naction = \"stop\"\n", "semi_implicit_euler");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_EQ(r.outcome, integrators::Outcome::failed);
  EXPECT_FALSE(r.passed());
  EXPECT_NE(notes(r).find("energy monitor"), std::string::npos) << notes(r);
  std::printf("  %s", notes(r).c_str());
}

TEST(Monitor, RepeatsAndProjectsInAScene) {
  double error[3];
  int at = 0;
  for (const char* tables : {"", "[monitor]\nstep_limit = 1e-11\naction = \"repeat\"\n",
                             "[monitor]\nproject = true\n"}) {
    TemporaryFolder folder;
    const auto s = scene_with(folder, tables, "rk4");
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    ASSERT_EQ(r.outcome, integrators::Outcome::ok);
    error[at++] = r.energy.max_rel_error;
    std::printf("  energy error %.1e %s", r.energy.max_rel_error, notes(r).c_str());
    std::printf("\n");
  }
  EXPECT_LT(error[1], 0.1 * error[0]);
  EXPECT_LT(error[2], 1e-14);
}

TEST(Monitor, BadKeysAreRefusedWithTheirLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"[monitor]\n", "[monitor] has nothing to watch, expected limit, step_limit or project"},
      {"[monitor]\nlimit = 1e-17\n", "limit is 1e-17, expected 1e-14 or more"},
      {"[monitor]\nlimit = 1e-9\naction = \"repeat\"\n",
       "action is \"repeat\" without a step_limit, expected both"},
      {"[monitor]\nlimit = 1e-9\naction = \"halt\"\n",
       "action is \"halt\", expected \"warn\" or \"stop\" or \"repeat\""},
      {"[[element]]\njoint = \"elbow\"\ntype = \"controller\"\n",
       "does nothing, expected a stiffness or a damping"},
      {"[[element]]\njoint = \"elbow\"\ntype = \"controller\"\ndamping = 1.0\noutput = "
       "\"mean\"\n",
       "output is \"mean\" without a rate, expected both or neither"}};
  for (const auto& [tables, text] : cases) {
    TemporaryFolder folder;
    EXPECT_TRUE(says(refusal([&, &t = tables] { scene_with(folder, t); }), text)) << tables;
  }
  TemporaryFolder folder;
  const auto off = scene_with(folder, controller("rate = 30.0\n"));
  EXPECT_TRUE(says(refusal([&] { scene::run(off, scene::assemble(off), into(folder / "out")); }),
                   "the controller 'elbow.controller' is sampled every 0.0333333333 s"));
}

}  // namespace
}  // namespace porthos::test::monitor_test
