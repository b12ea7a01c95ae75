// Missions in legs: a run that starts from another one's results, in which events had joined bodies
// and locked joints.
#include <fmt/format.h>

#include <cmath>

#include "scene/session/memory_run.h"
#include "scene/session/replot.h"
#include "tests/run/shipped.h"

namespace porthos::test::carried_events_test {
namespace {

/// A free arm, a robot of two links with a spring, and a body. Events, outputs and the rest follow.
std::string craft(const std::string& initial, const std::string& target, const std::string& tug) {
  return fmt::format(
      "[model]\nurdf = \"arm.urdf\"\nbase = \"free\"\n[initial]\n{}\n"
      "[[robot]]\nname = \"target\"\nurdf = \"target.urdf\"\nbase = \"free\"\n{}"
      "[[body]]\nname = \"tug\"\nmass = 3\ninertia = [0.2, 0.3, 0.4, 0, 0, 0]\n{}"
      "[[element]]\ntype = \"spring\"\njoint = \"target.hinge\"\nstiffness = 3\n"
      "[[element]]\ntype = \"spring\"\njoint = \"shoulder\"\nstiffness = 2\n"
      "[integrator]\nmethod = \"gauss12\"\nstep = 0.01\n[run]\nlow_words = true\n",
      initial, target, tug);
}
const std::string first = craft(
    "base.linear_velocity = [0.1, 0, 0]\njoints.shoulder.velocity = 1\n"
    "joints.elbow = { position = 0.5, velocity = -2 }\n"
    "joints.\"target.hinge\" = { position = 0.4, velocity = 1.5 }\n",
    "position = [3, 0.5, 0]\nattitude_wxyz = [0.6, 0, 0.8, 0]\n"
    "linear_velocity = [-0.3, 0, 0]\nangular_velocity = [0.2, 0.1, -0.1]\n",
    "position = [3, 1.5, 0]\nlinear_velocity = [0, -0.5, 0]\n");
std::string leg(const std::string& from) { return craft("from = \"" + from + "\"\n", "", ""); }

std::string event(const std::string& type, const std::string& keys, double at) {
  return fmt::format("[[event]]\ntype = \"{}\"\n{}\nat = {}\n", type, keys, at);
}
/// The target hangs on the tug by its panel, the tug on the arm: two captures turn the trees round.
const std::string joining =
    event("capture", "body = \"target.panel\"\nlink = \"tug\"\nreach = 9", 0.5) +
    event("capture", "body = \"tug\"\nlink = \"lower\"\nreach = 9", 0.7) +
    event("lock", "joint = \"elbow\"", 0.9);
std::string parting(double later) {
  return event("unlock", "joint = \"elbow\"", 2.4 - later) +
         event("release", "body = \"tug\"", 2.6 - later);
}

scene::Scene scene_of(const TemporaryFolder& folder, const std::string& text, double duration) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "target.urdf", "<robot name='target'>" + link("bus", 8) + link("panel", 2) +
                                          joint("hinge", "bus", "panel", "0 0 1") + "</robot>");
  std::string whole = text;
  const std::string run = "[run]\n";
  whole.insert(whole.find(run) + run.size(), fmt::format("duration = {}\n", duration));
  int k = 0;
  for (const char* body : {"lower", "target.bus", "target.panel", "tug"})
    for (const char* quantity : {"position", "velocity"})
      whole += fmt::format("[[output]]\nquantity = \"{}\"\nname = \"o{}\"\nlink = \"{}\"\n",
                           quantity, k++, body);
  write_bytes(folder / "scene.toml", whole);
  return scene::read_scene((folder / "scene.toml").string());
}
scene::RunReport run_into(const scene::Scene& s, const fs::path& out) {
  return scene::run(s, scene::assemble(s), into(out));
}
/// The largest difference of the outputs at the ends.
double apart(const scene::RunReport& a, const scene::RunReport& b) {
  double most = a.outputs.size() == b.outputs.size() && !a.outputs.empty() ? 0 : HUGE_VAL;
  for (size_t i = 0; i < a.outputs.size() && std::isfinite(most); ++i)
    most = std::max(most, std::fabs(a.outputs[i].end - b.outputs[i].end));
  return most;
}

}  // namespace

TEST(CarriedEvents, LegsOfAMissionAreTheMissionInOne) {
  TemporaryFolder folder;
  const auto whole = run_into(scene_of(folder, first + joining + parting(0), 3), folder / "whole");
  ASSERT_TRUE(whole.passed());
  run_into(scene_of(folder, first + joining, 1.5), folder / "first");
  const auto second = run_into(scene_of(folder, leg("first"), 0.5), folder / "second");
  EXPECT_TRUE(second.passed());
  const auto s = scene_of(folder, leg("second") + parting(2), 1);
  EXPECT_TRUE(says(scene::assemble(s).notes.back().text, "the capture of tug by lower holds"));
  const auto third = run_into(s, folder / "third");
  EXPECT_TRUE(third.passed());
  const double off = apart(whole, third);
  std::printf("  three legs against one run: %.1e m, m/s (1e-12); impacts at the start %.1e J\n",
              off, std::fabs(second.dissipated_J));
  EXPECT_LE(off, 1e-12);                             // measured 4e-15
  EXPECT_LE(std::fabs(second.dissipated_J), 1e-24);  // nothing strikes: what was joined stays so
  EXPECT_GT(whole.dissipated_J, 0.01) << "the captures themselves are plastic";
  // Controls: the same moment of another mission, and the start of the leg itself.
  EXPECT_GT(apart(whole, second), 0.01);
  // A record in the middle, of the phase that holds it.
  const auto early =
      scene_of(folder,
               craft("from = \"first\"\nat = 0.6\n", "", "") +
                   event("capture", "body = \"tug\"\nlink = \"lower\"\nreach = 9", 0.1) +
                   event("lock", "joint = \"elbow\"", 0.3) + parting(0.6),
               2.4);
  EXPECT_EQ(early.events.front().name, "target.panel");
  EXPECT_LE(apart(whole, run_into(early, folder / "early")), 1e-12);
  // The results need the other run no more, and show the mechanism as it was.
  fs::remove_all(folder / "second");
  const auto shown = scene::moved_in(folder / "third").mechanisms;
  ASSERT_EQ(shown.size(), 3u);
  EXPECT_LT(shown[0]->nq(), shown[1]->nq()) << "the elbow is free again";
  EXPECT_LT(shown[1]->nq(), shown[2]->nq()) << "the tug floats again";
}

TEST(CarriedEvents, InOrbitInMemoryAndResumed) {
  TemporaryFolder folder;
  const std::string orbit = "[orbit]\naltitude = 5e5\n";
  const auto at_rest = [](std::string text) {
    const std::string moves = "base.linear_velocity = [0.1, 0, 0]\n";
    return text.erase(text.find(moves), moves.size());
  };
  const auto whole =
      run_into(scene_of(folder, at_rest(first) + joining + orbit, 2), folder / "whole");
  run_into(scene_of(folder, at_rest(first) + joining + orbit, 1.5), folder / "first");
  const auto s = scene_of(folder, leg("first") + orbit, 0.5);
  const auto a = scene::assemble(s);
  auto o = into(folder / "second");
  o.stop_at = 20;
  EXPECT_TRUE(scene::run(s, a, o).interrupted);
  const auto r = scene::run(s, a, into(folder / "second", true));
  const double off = apart(whole, r);
  std::printf("  in orbit %.1e m, m/s (1e-12)\n", off);
  EXPECT_LE(off, 1e-12);  // measured 1e-15
  EXPECT_EQ(r.final_state.x, scene::run_in_memory(s, a, {}).final_state.x);
}

/// A capture that waits and holds at the first instant is in the first record: read again, the
/// results have it once.
TEST(CarriedEvents, ResultsWhoseEventHappenedAtTheirStartAreReadAgain) {
  TemporaryFolder folder;
  run_into(scene_of(folder, first, 0.2), folder / "first");
  const std::string caught =
      "[[event]]\ntype = \"capture\"\nbody = \"tug\"\nlink = \"lower\"\nreach = 9\n"
      "when = \"within_reach\"\n";
  const auto r = run_into(scene_of(folder, leg("first") + caught, 0.1), folder / "second");
  EXPECT_EQ(r.phases, 1);
  const auto moved = scene::moved_in(folder / "second");
  ASSERT_EQ(moved.mechanisms.size(), 1U);
  EXPECT_EQ(moved.mechanisms[0]->nv(), 6 + 2 + 6 + 1);  // the tug has no freedom of its own
}

TEST(CarriedEvents, WhatCannotGoOnIsSaid) {
  TemporaryFolder folder;
  run_into(scene_of(folder, first + joining, 1.5), folder / "first");
  auto without = leg("first");
  const auto body = without.find("[[body]]"), end = without.find("[[element]]");
  auto text = without.erase(body, end - body);
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "lonely.toml", text.insert(text.find("[run]\n") + 6, "duration = 1\n"));
  const std::string why =
      refusal([&] { (void)scene::assemble(scene::read_scene((folder / "lonely.toml").string())); });
  EXPECT_TRUE(says(why, "lonely.toml:5:")) << why;
  EXPECT_TRUE(says(why, "'tug' holds 'target.panel', and this scene has no 'tug'")) << why;
  // A damaged text is a sentence too.
  EXPECT_THROW((void)scene::joined_of("{\"holds\": [{\"body\": 3}]"), InvalidArgument);
  EXPECT_THROW((void)scene::joined_of("[]"), InvalidArgument);
}

}  // namespace porthos::test::carried_events_test
