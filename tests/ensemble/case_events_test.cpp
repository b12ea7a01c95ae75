// Cases that lanes cannot take: events, monitors, step control, a shorter last step. Each is the
// run of its scene, and the files are the same bytes however they were run.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/compare/auto_method.h"
#include "scene/ensemble/ensemble.h"
#include "scene/files/hdf5_reader.h"
#include "scene/session/memory_run.h"
#include "tests/ensemble/rows.h"
#include "tests/run/scenes.h"

namespace porthos::test::case_events_test {
namespace {

using scene::Ensemble, scene::EnsembleOptions, scene::EnsembleReport;

/// Two arms on a foot; `jb` locks when it has come to a stop that not all reach.
std::string arms(const std::string& more, const std::string& duration = "4.0") {
  return R"(title = "Two arms"
[model]
urdf = "two.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.ja = { position = 1.0 }
joints.jb = { position = 0.2 }
[integrator]
method = "gauss8"
step = 0.02
[run]
duration = )" +
         duration + R"(
record_every = 0.5
[verify]
energy = 1e-6
)" + more;
}
const std::string stop = "[[event]]\ntype = \"lock\"\njoint = \"jb\"\nabove = 0.9\n";
const std::string vary = R"([ensemble]
cases = 24
seed = 5
[ensemble.vary]
"initial.joints.ja.position" = { uniform = [-2, 2] }
"initial.joints.jb.velocity" = { uniform = [2, 5] }
)";

/// A bus with a hand, and a target that turns, which the hand takes if it turns slowly enough.
std::string capture(const std::string& more = "") {
  return R"(title = "Capture"
[model]
urdf = "bus.urdf"
base = "free"
[[body]]
name = "target"
mass = 5.0
inertia = [1.0, 1.1, 1.2, 0, 0, 0]
position = [0.1, 0.05, -2.0]
angular_velocity = [0.02, 0.0, 0.0]
[integrator]
method = "gauss8"
step = 0.05
[run]
duration = 2.0
record_every = 0.5
[verify]
energy = 1e-9
angular_momentum = 1e-10
[[event]]
at = 1.0
type = "capture"
body = "target"
link = "hand"
reach = 5.0
speed = 5.0
rate = 0.1
)" + more;
}

class CaseEvents : public testing::Test {
 protected:
  void SetUp() override {
    write_bytes(folder_ / "two.urdf", two_arms_urdf());
    write_bytes(folder_ / "bus.urdf", "<robot name='bus'>" + link("bus", 20) + link("hand", 1) +
                                          joint("wrist", "bus", "hand", "0 1 0") + "</robot>");
  }
  std::string put(const std::string& text) const {
    write_bytes(folder_ / "scene.toml", text);
    return (folder_ / "scene.toml").string();
  }
  EnsembleReport run(const std::string& text, const std::string& out,
                     EnsembleOptions o = {}) const {
    o.out = (folder_ / out).string();
    return run_ensemble(Ensemble(scene::read_scene(put(text))), o);
  }
  std::string result(const std::string& out) const {
    return read_bytes(folder_ / out / "ensemble.h5") + read_bytes(folder_ / out / "ensemble.json") +
           read_bytes(folder_ / out / "ensemble.svg");
  }
  /// The scene of one case, run into a folder.
  scene::RunReport alone(const Ensemble& e, std::int64_t index, const std::string& out) const {
    const auto s =
        scene::read_variation(e.scene(), e.sampler().replacements(e.sampler().values(index)));
    return scene::run(s, scene::assemble(s), {.out = (folder_ / out).string()});
  }
  TemporaryFolder folder_;
};

TEST_F(CaseEvents, ACaseIsTheRunOfItsScene) {
  const Ensemble e(scene::read_scene(put(arms(stop + vary))));
  EXPECT_FALSE(e.in_lanes());
  const auto rows = rows_of(e, 2);
  const auto& l = e.layout();
  const auto& names = e.state_columns().numbers();
  ASSERT_EQ(names, (std::vector<std::string>{"ja", "jb", "p(ja)", "p(jb)"}));
  int locked = 0;
  for (const std::int64_t i : {0, 1, 2, 3, 4, 5}) {
    const auto& row = rows[size_t(i)];
    const std::string out = "alone" + std::to_string(i);
    const auto r = alone(e, i, out);
    EXPECT_EQ(row[l.energy], r.energy.max_rel_error);
    EXPECT_EQ(row[l.energy_scale], r.energy.scale_J);
    EXPECT_EQ(scene::integer(row[l.steps]), r.steps);
    EXPECT_EQ(scene::integer(row[l.passed]) == 1, r.passed());
    const auto events = nlohmann::json::parse(read_bytes(folder_ / out / "summary.json"))["events"];
    const bool happened = !events.empty();
    locked += happened;
    EXPECT_EQ(r.final_state.x.size(), happened ? 2u : 4u);
    EXPECT_EQ(row[l.x()], r.final_state.x[0]);
    EXPECT_EQ(row[l.x() + 2], r.final_state.x[happened ? 1 : 2]);
    EXPECT_EQ(std::isnan(row[l.x() + 3]), happened) << "a locked joint has no momentum";
    if (happened) {
      EXPECT_EQ(row[l.event_time()], events[0]["at_s"].get<double>());
      EXPECT_EQ(row[l.event_loss()], events[0]["dissipated_J"].get<double>());
      EXPECT_NEAR(row[l.x() + 1] + row[l.low() + 1], 0.9, 1e-12) << "where it was locked";
    } else {
      EXPECT_EQ(row[l.x() + 1], r.final_state.x[1]);
      EXPECT_TRUE(std::isnan(row[l.event_time()]));
    }
  }
  EXPECT_GT(locked, 0);
  EXPECT_LT(locked, 6) << "control: the event is one of some cases";
  EXPECT_NE(rows[0][l.x()], rows[1][l.x()]) << "control: another case";
}

TEST_F(CaseEvents, APartIsWrittenByOneProcess) {
  const std::string text = arms(vary);
  const auto first = [&](bool resume) {
    return run(text, "out", {.part = {1, 2}, .resume = resume, .threads = 1});
  };
  first(false);
  const fs::path log = folder_ / "out/parts/1_of_2.bin";
  const int other = open(log.c_str(), O_RDWR);
  ASSERT_EQ(flock(other, LOCK_EX | LOCK_NB), 0);
  EXPECT_EQ(refusal([&] { first(true); }), "another process is writing into " + log.string());
  close(other);
  EXPECT_EQ(first(true).run_here, 0);
}

TEST_F(CaseEvents, SameBytesForAnyThreadsPartsAndInterruptions) {
  const std::map<std::string, std::string> scenes = {
      {"event", arms(stop + vary)},
      {"monitor", arms("[monitor]\nstep_limit = 1e-11\naction = \"repeat\"\n" + vary)},
      {"shorter", arms(vary, "4.013")},
      {"capture", capture("[ensemble]\ncases = 24\n[ensemble.vary]\n"
                          "\"body[0].angular_velocity[0]\" = { uniform = [0, 0.2] }\n")}};
  for (const auto& [name, text] : scenes) {
    const auto r = run(text, name + "_one", {.threads = 1});
    EXPECT_TRUE(r.complete);
    const std::string one = result(name + "_one");
    run(text, name + "_two", {.threads = 2});
    EXPECT_TRUE(result(name + "_two") == one) << name << ": threads";
    for (const int k : {2, 1}) run(text, name + "_parts", {.part = {k, 2}, .threads = 1});
    run(text, name + "_parts", {.join = true});
    EXPECT_TRUE(result(name + "_parts") == one) << name << ": parts";
    std::atomic<bool> stopped = false;
    EnsembleReport report;
    int times = 0;
    do {
      stopped = false;
      EnsembleOptions o{.resume = times > 0, .threads = 1, .stop = &stopped};
      o.progress = [&](double, double, double) { stopped = times < 2; };
      report = run(text, name + "_stopped", o);
    } while (++times < 10 && report.interrupted);
    EXPECT_EQ(times, 3) << name;
    EXPECT_TRUE(result(name + "_stopped") == one) << name << ": interruptions";
  }
  std::string other = arms(stop + vary);
  run(other.replace(other.find("seed = 5"), 8, "seed = 6"), "event_other");
  EXPECT_FALSE(result("event_other") == result("event_one")) << "control: another seed";
}

TEST_F(CaseEvents, AStartBeyondAStopIsRefusedAlone) {
  const std::string text = arms(
      "[[output]]\nquantity = \"joint_position\"\nname = \"a\"\njoint = \"ja\"\n"
      "[[stop]]\noutput = \"a\"\nabove = 1.5\n" +
          vary,
      "0.2");
  const auto r = run(text, "out");
  const Ensemble e(scene::read_scene(put(text)));
  const auto& l = e.layout();
  std::int64_t refused = 0;
  for (const auto& row : rows_of(e)) {
    const bool beyond = row[l.inputs] > 1.5;
    refused += beyond;
    EXPECT_EQ(scene::integer(row[l.status]), beyond ? scene::case_refused : 0);
  }
  EXPECT_GT(refused, 1);
  EXPECT_LT(refused, 12);
  EXPECT_EQ(scene::find_kind(r.failures, "refused")->count, refused);
}

TEST_F(CaseEvents, AnEventThatCannotBeIsCounted) {
  const std::string text = capture(
      "[ensemble]\ncases = 24\n[ensemble.vary]\n"
      "\"body[0].angular_velocity[0]\" = { uniform = [0, 0.2] }\n");
  const auto r = run(text, "out");
  const Ensemble e(scene::read_scene(put(text)));
  const auto& l = e.layout();
  std::int64_t refused = 0;
  for (const auto& row : rows_of(e)) {
    const bool fast = row[l.inputs] > 0.1;  // the latch's rate
    refused += fast;
    EXPECT_EQ(scene::integer(row[l.status]), fast ? scene::case_event_refused : 0);
    EXPECT_EQ(scene::integer(row[l.passed]), fast ? 0 : 1);
    EXPECT_EQ(scene::integer(row[l.steps]), fast ? 20 : 40);
    EXPECT_EQ(std::isnan(row[l.event_time()]), fast);
    // The target's own columns are there until it is caught.
    const auto& names = e.state_columns().numbers();
    const auto at =
        size_t(std::find(names.begin(), names.end(), "target.position[0]") - names.begin());
    ASSERT_LT(at, names.size());
    EXPECT_EQ(std::isnan(row[l.x() + at]), !fast);
  }
  EXPECT_GT(refused, 3);
  EXPECT_LT(refused, 21);
  EXPECT_EQ(scene::find_kind(r.failures, "an event could not happen")->count, refused);
  EXPECT_EQ(r.passed, 24 - refused);
  ASSERT_EQ(r.events.size(), 1u);
  EXPECT_EQ(r.events[0].happened, 24 - refused);
  EXPECT_EQ(r.events[0].time.quantiles[3], 1.0);
  const auto json = nlohmann::json::parse(read_bytes(folder_ / "out" / "ensemble.json"));
  EXPECT_EQ(json["events"][0]["event"], "capture of target by hand");
  EXPECT_EQ(json["first_not_passed"][0]["never_happened"][0], "capture of target by hand");
}

// The monitor of a case acts as that of a run: it repeats steps, or ends the case.
TEST_F(CaseEvents, MonitorsAct) {
  const auto largest = [&](const std::string& monitor) {
    std::string text = arms(monitor + vary);
    text.replace(text.find("gauss8"), 6, "rk4");
    return run(text, "monitor" + std::to_string(monitor.size()));
  };
  const double without = largest("").energy.quantiles[6];
  const auto repeats = largest("[monitor]\nstep_limit = 1e-11\naction = \"repeat\"\n");
  std::printf("  largest error %.1e; repeated %.1e (bound: a tenth)\n", without,
              repeats.energy.quantiles[6]);
  EXPECT_LT(repeats.energy.quantiles[6], 0.1 * without);
  const auto stops = largest("[monitor]\nstep_limit = 1e-11\naction = \"stop\"\n");
  EXPECT_GT(scene::find_kind(stops.failures, "the method gave up")->count, 0);
  EXPECT_EQ(stops.passed + scene::find_kind(stops.failures, "the method gave up")->count, 24);
  EXPECT_TRUE(largest("").failures.empty()) << "control";
}

// "auto" chooses once for all parts: who comes later goes by the choice that is kept.
TEST_F(CaseEvents, AutoChoosesOnceForAllParts) {
  std::string text = arms(vary);
  text.replace(text.find("gauss8"), 6, "auto");
  const auto s = scene::read_scene(put(text));
  EXPECT_TRUE(says(refusal([&] { Ensemble{s}; }), "which chooses once for all cases"));
  const fs::path out = folder_ / "auto";
  const auto first = scene::with_method_kept(s, out), second = scene::with_method_kept(s, out);
  EXPECT_NE(first.method, "auto");
  EXPECT_FALSE(first.choice.empty());
  EXPECT_EQ(first.choice, second.choice);  // it tells CPU seconds: another choice is another text
  EXPECT_EQ(Ensemble(first).identity(), Ensemble(second).identity());
  for (const int k : {1, 2})
    (void)run_ensemble(Ensemble(scene::with_method_kept(s, out)),
                       {.out = out.string(), .part = {k, 2}, .threads = 1});
  const auto r =
      run_ensemble(Ensemble(scene::with_method_kept(s, out)), {.out = out.string(), .join = true});
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.passed, 24);
  EXPECT_FALSE(fs::exists(out / "parts")) << "the choice goes with the logs";
  // Control: another scene is another choice.
  (void)scene::with_method_kept(s, out);
  const auto other = scene::read_scene(put("# edited\n" + text));
  EXPECT_TRUE(says(refusal([&] { scene::with_method_kept(other, out); }),
                   "was chosen for another ensemble: the scene file has changed"));
}

// Other numbers than the file's are those of every case, in lanes and alone, and of the ensemble's
// identity.
TEST_F(CaseEvents, NumbersOfTheCommandLine) {
  for (const std::string& more : {std::string(), stop}) {
    auto s = scene::read_scene(put(arms(more + vary)));
    const Ensemble as_written(s);
    scene::apply(s, {.step = 0.01, .duration = 2.0});
    const Ensemble e(s);
    EXPECT_EQ(e.in_lanes(), more.empty());
    EXPECT_NE(e.identity(), as_written.identity());
    auto alone = scene::read_variation(s, e.sampler().replacements(e.sampler().values(7)));
    scene::apply(alone, {.step = 0.01, .duration = 2.0});
    const auto r = scene::run_in_memory(alone, scene::assemble(alone), {});
    const auto row = rows_of(e)[7], other = rows_of(as_written)[7];
    EXPECT_EQ(scene::integer(row[e.layout().steps]), 200);
    EXPECT_EQ(row[e.layout().x()], r.final_state.x[0]);
    EXPECT_NE(row[e.layout().x()], other[e.layout().x()]) << "control";
  }
}

// The duration asked for is that of every case.
TEST_F(CaseEvents, ErrorsBetweenTheRecordsOfLanesAreSeen) {
  std::string text = arms(vary, "20.0");
  text.replace(text.find("gauss8"), 6, "midpoint");
  text.replace(text.find("record_every = 0.5"), 18, "record_every = 20.0");
  text.replace(text.find("energy = 1e-6"), 13, "energy = 1.0");
  text.replace(text.find("cases = 24"), 10, "cases = 8");
  const Ensemble e(scene::read_scene(put(text)));
  const auto& l = e.layout();
  double least = HUGE_VAL, at_records = HUGE_VAL;
  for (const auto& row : rows_of(e)) {
    const double whole = alone(e, scene::integer(row[0]), "alone").energy.max_rel_error;
    least = std::min(least, row[l.energy] / whole);
    at_records = std::min(at_records, row[l.energy_rms] / row[l.energy]);
  }
  std::printf("  largest error, of that a run sees: %.2f  bound 0.3\n", least);
  std::printf("  at records alone (rms): %.2f  control, must be below 0.3\n", at_records);
  EXPECT_GT(least, 0.3);
  EXPECT_LT(at_records, 0.3);
}

TEST_F(CaseEvents, AShorterLastStepAndAStepControl) {
  const Ensemble shorter(scene::read_scene(put(arms(vary, "4.013"))));
  const auto rows = rows_of(shorter);
  const auto r = alone(shorter, 3, "alone");
  EXPECT_EQ(r.simulated_s, 4.013);
  EXPECT_EQ(rows[3][shorter.layout().x()], r.final_state.x[0]);
  EXPECT_EQ(scene::integer(rows[3][shorter.layout().steps]), 201);
  std::string text = arms(vary);
  text.replace(text.find("step = 0.02"), 11, "step = 0.02\nstep_control = \"reversible\"");
  const Ensemble controlled(scene::read_scene(put(text)));
  const auto c = rows_of(controlled);
  const auto one = alone(controlled, 3, "controlled");
  EXPECT_EQ(c[3][controlled.layout().x()], one.final_state.x[0]);
  EXPECT_EQ(c[3][controlled.layout().energy], one.energy.max_rel_error);
  EXPECT_NE(c[3][controlled.layout().x()], rows[3][shorter.layout().x()]) << "control";
}

}  // namespace
}  // namespace porthos::test::case_events_test
