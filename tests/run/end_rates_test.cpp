// Rates at the ends of steps that are not those of their coordinates: damping faster than a step,
// by a method that does not damp it.
#include <fmt/format.h>

#include <algorithm>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::end_rates_test {
namespace {

constexpr const char* words = "at the ends of steps are not those of its angle";

/// A rod of 0.547 kg m^2 about its hinge, with a spring and a damper, that starts at 1 rad/s.
struct Rod {
  double step, steps, stiffness = 0, damping = 0, position = 0, velocity = 1;
  std::string method = "gauss6", more = "";
};
scene::Scene scene_of(const TemporaryFolder& folder, const Rod& rod) {
  write_bytes(folder / "model.urdf", "<robot name='rod'><link name='foot'/>" + link("rod", 2) +
                                         joint("hinge", "foot", "rod", "0 1 0") + "</robot>");
  std::string text = fmt::format(
      "[model]\nurdf = \"model.urdf\"\nbase = \"fixed\"\n[initial]\njoints.hinge = {{ position = "
      "{}, velocity = {} }}\n[[element]]\ntype = \"damper\"\nname = \"d\"\njoint = "
      "\"hinge\"\ndamping = {}\n",
      rod.position, rod.velocity, rod.damping);
  if (rod.stiffness > 0)
    text += fmt::format(
        "[[element]]\ntype = \"spring\"\nname = \"s\"\njoint = \"hinge\"\n"
        "stiffness = {}\n",
        rod.stiffness);
  text += fmt::format("{}[integrator]\nmethod = \"{}\"\nstep = {}\n[run]\nduration = {}\n",
                      rod.more, rod.method, rod.step, rod.step * rod.steps);
  write_bytes(folder / "scene.toml", text);
  return scene::read_scene((folder / "scene.toml").string());
}
std::string note_in(const scene::RunReport& r) {
  for (const auto& n : r.notes)
    if (n.find(words) != n.npos) return n;
  return "";
}
std::string note_of(const Rod& rod) {
  TemporaryFolder folder;
  const auto s = scene_of(folder, rod);
  return note_in(scene::run_in_memory(s, scene::assemble(s), {}));
}

TEST(EndRates, DampingFasterThanAStepIsTold) {
  for (const char* method : {"gauss4", "gauss6", "gauss8"}) {  // the rate turns, stays, turns
    const auto note = note_of({0.1, 100, 0, 1e5, 0, 1, method});
    EXPECT_TRUE(note.starts_with("rates of 'hinge' at the ends of steps")) << method << note;
    EXPECT_TRUE(says(note, "up to 1 rad/s")) << note;
    EXPECT_LE(note.size(), 220u) << note;
  }
  EXPECT_NE(note_of({0.1, 100, 40, 1e5}), "") << "with a spring beside";
}

TEST(EndRates, WhatStepsResolveIsNot) {
  // The time constant is 2.7e-4 s.
  for (const double step : {5e-5, 2e-4, 5e-4, 1e-3})
    EXPECT_EQ(note_of({step, 100, 40, 2000}), "") << step;
  const double period = 2 * M_PI * std::sqrt(0.547 / 1e4);
  for (const double steps : {2.1, 2.5, 3.0, 4.0})
    EXPECT_EQ(note_of({period / steps, 100, 1e4, 1e-9, 0.1, 1, "gauss16"}), "") << steps;
  EXPECT_EQ(note_of({0.1, 100, 40, 1e5, 0, 0}), "") << "a joint at rest";
  EXPECT_EQ(note_of({0.1, 100, 40, 1e5, 0, 1e-9}), "") << "a joint that moves by rounding";
  EXPECT_EQ(note_of({0.1, 100, 0, 1e5, 0, 1, "radau15"}), "") << "a method that damps it";
}

TEST(EndRates, AResumedRunTellsTheSame) {
  TemporaryFolder folder;
  const auto s = scene_of(folder, {0.1, 100, 0, 1e5});
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  ASSERT_NE(note_in(whole), "");
  auto half = into(folder / "half");
  half.stop_at = 60;
  EXPECT_TRUE(scene::run(s, a, half).interrupted);
  EXPECT_EQ(note_in(scene::run(s, a, into(half.out, true))), note_in(whole));
}

TEST(EndRates, AServicerWithAStiffWrist) {
  const std::vector<Change> coarse = {
      {"gauss12", "gauss6"}, {"step = 0.1 ", "step = 1.0 "}, {"rate = 10.0", "rate = 1.0"}};
  auto turning = coarse;
  turning.push_back({"joints.elbow = {", "joints.wrist = { velocity = 0.01 }\njoints.elbow = {"});
  const auto note = [](const std::vector<Change>& changes) {
    TemporaryFolder folder;
    const auto s = shipped(folder, "slew", 100, changes);
    return note_in(scene::run_in_memory(s, scene::assemble(s), {}));
  };
  EXPECT_TRUE(note(turning).starts_with("rates of 'wrist' ")) << note(turning);
  EXPECT_EQ(note({}), "") << "the scene as it is shipped";
}

}  // namespace
}  // namespace porthos::test::end_rates_test
