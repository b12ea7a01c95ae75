// Scenes with events: momenta and the ledger across them, resumed runs, and what is refused.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "scene/run/phase_sequence.h"
#include "scene/session/export.h"
#include "scene/session/info.h"
#include "scene/session/memory_run.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::events_test {
namespace {

std::string example() {
  return read_bytes(std::string(PORTHOS_SOURCE_DIR) + "/examples/capture/scene.toml");
}
/// The example, changed, and shorter.
scene::Scene capture_scene(const TemporaryFolder& folder, const std::string& from = "",
                           const std::string& to = "") {
  write_bytes(folder / "servicer.urdf",
              read_bytes(std::string(PORTHOS_SOURCE_DIR) + "/examples/capture/servicer.urdf"));
  std::string text = example();
  if (!from.empty()) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  write_bytes(folder / "scene.toml", text);
  auto s = scene::read_scene((folder / "scene.toml").string());
  return s;
}
double row(const scene::RunReport::Named& list, const std::string& name) {
  for (const auto& [key, joule] : list)
    if (key == name) return joule;
  return NAN;
}

TEST(Events, ACaptureKeepsMomentaAndItsLossIsARow) {
  TemporaryFolder folder;
  const auto s = capture_scene(folder);
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  ASSERT_TRUE(r.passed());
  EXPECT_LE(r.notes.size(), 2u) << "of three phases";
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  ASSERT_EQ(j["events"].size(), 4u);
  ASSERT_EQ(j["phases"].size(), 3u);
  const double lost = row(r.losses, "capture of target by hand");
  EXPECT_EQ(lost, j["events"][0]["dissipated_J"].get<double>());
  EXPECT_GT(lost, 0.01);
  // All of the target's spin is in the wheels at the end: the bus is at rest, and its momentum that
  // of the start.
  const auto rates = j["final_state"]["v"];
  double spin = 0;
  for (const double w : rates["base.attitude"]) spin = std::max(spin, std::fabs(w));
  const double wheel = rates["wheel_x"], target = j["events"][0]["angular_momentum"][0];
  std::printf(
      "  lost %.6f J; bus at %.1e rad/s (1e-6), wheel_x %.3f rad/s; defect %.1e of %.1f J\n", lost,
      spin, wheel, r.defect_J, r.turned_over_J);
  EXPECT_LT(spin, 1e-6);
  EXPECT_NEAR(target, 3.6, 1e-9);
  EXPECT_LT(std::fabs(r.defect_J), 1e-12 * r.turned_over_J);
  // The momentum table: each wheel from rest to its share, the total the same at both ends.
  const auto& table = j["momentum"];
  const double x = table["wheel_x"]["end_Nms"], y = table["wheel_y"]["end_Nms"],
               z = table["wheel_z"]["end_Nms"], total = table["total"]["start_Nms"];
  std::printf("  wheels hold %.6f %.6f %.6f N m s\n", x, y, z);
  EXPECT_EQ(table.size(), 4u);
  EXPECT_EQ(table["wheel_x"]["start_Nms"].get<double>(), 0.0);
  EXPECT_NEAR(x, 0.1 * wheel, 1e-6);  // its inertia about the axis, and the bus at rest
  EXPECT_GE(table["wheel_x"]["largest_Nms"].get<double>(), std::fabs(x));
  EXPECT_NEAR(table["total"]["end_Nms"].get<double>(), total, 1e-13 * total);
  EXPECT_EQ(r.steps, 30000);
  EXPECT_EQ(r.records, 3003);
  for (const char* phase : {"phase_1", "phase_2", "phase_3"})
    EXPECT_GT(fs::file_size(folder / "out" / phase / "run.h5"), 10000u);
}

TEST(Events, AnInterruptedRunContinuesBitForBit) {
  TemporaryFolder folder;
  auto s = capture_scene(folder);
  s.duration = 1000;
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  std::atomic<bool> stop{false};
  auto o = into(folder / "part");
  o.stop = &stop;
  int parts = 0;
  scene::RunReport r;
  do {  // stopped at any moment, each part a little longer
    stop = false;
    std::jthread clock([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(10 * (parts + 1)));
      stop = true;
    });
    r = scene::run(s, a, o);
    ++parts;
    o.resume = true;
  } while (r.interrupted && parts < 100);
  EXPECT_GT(parts, 1);
  std::printf("  in %d parts\n", parts);
  EXPECT_EQ(r.final_state.x, whole.final_state.x);
  EXPECT_EQ(r.final_state.lo, whole.final_state.lo);
  EXPECT_EQ(r.supplied_J, whole.supplied_J);
  EXPECT_EQ(r.defect_J, whole.defect_J);
  EXPECT_EQ(r.records, whole.records);
}

// A sequence that cannot be is refused before the first phase has run.
TEST(Events, AllPhasesAreAssembledBeforeTheFirstRuns) {
  struct Case {
    const char *from, *to, *says;
  };
  // With the release of a body its joint is gone, and what acts there has no place.
  const Case cases[] = {
      {"[[element]]                       # the arm",
       "[[event]]\nat = 300.0\ntype = \"release\"\nbody = \"hand\"\n[[element]] # the arm",
       "after the release of hand: "},
      {"[[element]]                       # the arm",
       "[[event]]\nat = 300.0\ntype = \"lock\"\njoint = \"elbow\"\n[[element]] # the arm",
       "at 300 s: lock: the joint 'elbow' is locked already"}};
  for (const Case& c : cases) {
    TemporaryFolder folder;
    const auto s = capture_scene(folder, c.from, c.to);
    const auto a = scene::assemble(s);
    EXPECT_TRUE(says(refusal([&] { scene::run(s, a, into(folder / "out")); }), c.says));
    EXPECT_FALSE(fs::exists(folder / "out" / "phase_1")) << "nothing has run";
  }
}

TEST(Events, ATableHasThePhasesBelowEachOther) {
  TemporaryFolder folder;
  const auto s = capture_scene(folder);
  scene::run(s, scene::assemble(s), into(folder / "out"));
  scene::export_csv(folder / "out", folder / "all.csv");
  std::istringstream table(read_bytes(folder / "all.csv"));
  std::string line, last;
  std::getline(table, line);
  EXPECT_TRUE(line.starts_with("phase,time [s],")) << line;
  const auto commas = std::ranges::count(line, ',');
  size_t rows = 0, empty = 0;
  double before = 0;
  for (; std::getline(table, line); ++rows, last = line) {
    EXPECT_EQ(std::ranges::count(line, ','), commas);
    EXPECT_GE(line[0], rows == 0 ? '1' : last[0]);
    const double t = std::stod(line.substr(2));
    EXPECT_GE(t, before);
    before = t;
    empty += line.find(",,") != std::string::npos;
  }
  EXPECT_EQ(last[0], '3');
  EXPECT_EQ(before, s.duration);
  EXPECT_GT(empty, 0u);  // a captured body has no coordinates of its own
  EXPECT_LT(empty, rows);
}

TEST(Events, ACaptureThatMissesFailsTheVerdictAndSaysWhy) {
  TemporaryFolder folder;
  for (const auto& [from, to, why] :
       {std::tuple{"reach = 0.05", "reach = 0.001",
                   "scene.toml:22:1: at 20 s: capture of 'target' by 'hand': the distance is"},
        {"reach = 0.05", "reach = 0.001", "by the latch; from link to body ("},
        {"reach = 0.05                      # m, what the fingers can close\n"
         "speed = 0.02                      # m/s\nrate = 0.1",
         "reach = 0.001\nspeed = 0.02\nrate = 0.01",
         "expected at most 0.01 rad/s, by the latch; from link to body ("},
        {"rate = 0.1", "rate = 0.01", "the relative rate is 0.05"}}) {
    const auto s = capture_scene(folder, from, to);
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    EXPECT_FALSE(r.passed());
    EXPECT_EQ(r.simulated_s, 20);
    EXPECT_TRUE(
        std::ranges::any_of(r.notes, [words = why](const auto& n) { return says(n, words); }));
    const auto j = nlohmann::json::parse(read_bytes(folder / "out/summary.json"));
    EXPECT_EQ(j["verdict"], "fail");
    EXPECT_EQ(j["phases"].size(), 1u);
  }
  // The folder takes the corrected scene.
  auto s = capture_scene(folder);
  s.duration = 201;
  EXPECT_EQ(scene::run(s, scene::assemble(s), into(folder / "out")).phases, 3);
}

/// A capture that waits and does not happen was nearest in the first of three phases, not in the
/// last. Control: without the locks there is one phase.
TEST(Events, TheNearestInstantIsOfAllPhases) {
  TemporaryFolder folder;
  std::string told[2];
  for (const bool locks : {true, false}) {
    auto s = capture_scene(folder, "position = [3.74347, 0.05646,", "position = [3.9, 0.2,");
    s.duration = 300;
    s.events[0].at = 0;
    s.events[0].within_reach = true;
    if (!locks) s.events.resize(1);
    const auto r = scene::run(s, scene::assemble(s), into(folder / (locks ? "a" : "b")));
    EXPECT_EQ(r.phases, locks ? 2 : 1);
    for (const auto& note : r.notes)
      if (const auto at = note.find("nearest to all its limits at "); at != note.npos)
        told[locks] = note.substr(at, note.find(", when") - at);
  }
  std::printf("  %s\n", told[1].c_str());
  EXPECT_NE(told[1], "");
  EXPECT_EQ(told[1], told[0]);
  EXPECT_LT(std::strtod(told[1].c_str() + 17, nullptr), 200);
}

/// The target is never caught, so that its release is impossible: the capture is told with it,
/// on file and in memory. Control: without a release the run reaches its end.
TEST(Events, AMissedOneIsToldBesideTheImpossibleOneAfterIt) {
  TemporaryFolder folder;
  auto s = capture_scene(folder, "position = [3.74347, 0.05646,", "position = [3.9, 0.2,");
  s.duration = 60;
  s.events.resize(1);
  s.events[0].at = 0;
  s.events[0].within_reach = true;
  const auto run = [&](const char* out) {
    return scene::run(s, scene::assemble(s), into(folder / out));
  };
  const auto missed = [](const scene::RunReport& r) {
    return std::ranges::count_if(r.notes, [](const auto& n) {
      return n.starts_with("it never happened: capture of target by hand; at the end of the run");
    });
  };
  const auto missed_events = [](const scene::RunReport& r) {
    const auto c = std::ranges::find(r.checks, "missed_events", &scene::Check::name);
    return c == r.checks.end() ? NAN : c->value;
  };
  const auto whole = run("whole");
  EXPECT_EQ(missed(whole), 1);
  EXPECT_EQ(whole.simulated_s, 60);
  EXPECT_EQ(missed_events(whole), 1);
  scene::Event release = s.events[0];
  release.type = scene::Event::Type::release;
  release.within_reach = false;
  release.at = 40;
  s.events.push_back(release);
  const auto ended = run("ended");
  EXPECT_EQ(missed(ended), 1);
  EXPECT_EQ(ended.simulated_s, 40);
  EXPECT_EQ(missed_events(ended), 2);
  EXPECT_TRUE(ended.notes.back().starts_with("the run ended before an event")) << "the last";
  const auto refused =
      refusal([&] { (void)scene::run_in_memory(s, scene::assemble(s), {.judge = false}); });
  EXPECT_TRUE(says(refused, "; before that it never happened: capture of target")) << refused;
  // One that waits for later has not been nearest to anything.
  s.events[0].after = 50;
  s.events.resize(1);
  const auto assembly = scene::assemble(s);
  EXPECT_EQ(scene::PhaseSequence(s, assembly).missed(),
            std::vector<std::string>{
                "it never happened: capture of target by hand; it waits from 50 s on"});
  const auto late = run("late");
  for (const auto& n : late.notes) {
    const auto at = n.find("nearest to all its limits at ");
    if (at != n.npos) {
      EXPECT_GE(std::strtod(n.c_str() + at + 29, nullptr), 50) << n;
    }
  }
}

TEST(Events, WhatCannotBeIsRefusedWithItsLine) {
  struct Case {
    const char *from, *to, *says;
    bool at_reading;
  };
  const Case cases[] = {
      {"reach = 0.05", "",
       "scene.toml:22:1: [[event]] lacks the key 'reach', expected a number of metres", true},
      {"link = \"hand\"", "link = \"hnad\"", "there is no body 'hnad', expected one of bus", false},
      {"type = \"lock\"", "type = \"unlock\"", "the joint 'shoulder' is not locked", false},
      {"at = 20.0", "at = 20.03", "200.3 steps of 0.1 s, expected a whole number of steps", false},
      {"at = 20.0", "at = 4000.0", "expected a time inside the run, between 0 and 3000 s", false},
      {"type = \"capture\"", "type = \"catch\"",
       "type is \"catch\", expected \"capture\", \"release\", \"lock\", \"unlock\", \"engage\", "
       "\"disengage\", \"close\" or \"open\"",
       true},
      {"gain = 20.0", "gain = -1.0", "gain is -1, expected a number of N m s/rad above 0", true},
      {"joint = \"wheel_x\"", "joint = \"elbow\"",
       "joint 'elbow' does not turn on a free base, expected a wheel that does", false}};
  for (const Case& c : cases) {
    TemporaryFolder folder;
    const auto refused = refusal([&] {
      const auto s = capture_scene(folder, c.from, c.to);
      if (!c.at_reading) scene::run(s, scene::assemble(s), into(folder / "out"));
    });
    EXPECT_TRUE(says(refused, c.says)) << refused;
  }
  // A scene that was edited is another run.
  TemporaryFolder folder;
  auto s = capture_scene(folder);
  std::atomic<bool> stop{true};
  auto o = into(folder / "out");
  o.stop = &stop;
  ASSERT_TRUE(scene::run(s, scene::assemble(s), o).interrupted);
  EXPECT_TRUE(says(refusal([&] { scene::run(s, scene::assemble(s), into(folder / "out")); }),
                   "holds an unfinished run: use --resume"));
  s = capture_scene(folder, "mass = 300.0", "mass = 301.0");
  o.resume = true;
  EXPECT_TRUE(says(refusal([&] { scene::run(s, scene::assemble(s), o); }), "is of another run"));
}

TEST(Events, InfoListsThemWithTheDistanceOfACapture) {
  std::vector<double> square;
  for (const char* handle : {"[-0.6, ", "[0.4, ", "[1.4, "}) {  // each a metre further on
    TemporaryFolder folder;
    const auto s = capture_scene(folder, "on_body = [-0.6, ", std::string("on_body = ") + handle);
    const auto a = scene::assemble(s);
    const auto j = nlohmann::json::parse(scene::info_json(s, a)).at("events");
    ASSERT_EQ(j.size(), 4u);
    EXPECT_EQ(j[0].at("event"), "capture of target by hand");
    EXPECT_EQ(j[0].at("when"), "at 20 s");
    EXPECT_EQ(j[0].at("reach_m"), 0.05);
    EXPECT_FALSE(j[1].contains("apart_at_start_m")) << "a lock";
    const double apart = j[0].at("apart_at_start_m");
    square.push_back(apart * apart);
    const auto text = scene::info_text(s, a);
    EXPECT_TRUE(says(text, fmt::format("{:.4g} m apart at the start, reach 0.05 m", apart)))
        << text;
  }
  EXPECT_LT(square[0], 0.1) << "they meet at 20 s";
  EXPECT_NEAR(square[2] - 2 * square[1] + square[0], 2, 1e-12) << "of points on a line";
}

}  // namespace
}  // namespace porthos::test::events_test
