// Runs without a folder, and the sequence of phases by itself.
#include "scene/session/memory_run.h"

#include "scene/assemble/assembly.h"
#include "tests/run/scenes.h"

namespace porthos::test::memory_run_test {
namespace {

/// Two arms on a fixed foot that do not feel each other; `servo` holds `ja`.
scene::Scene two_arms(const TemporaryFolder& folder, const std::string& more,
                      const std::string& duration = "4") {
  write_bytes(folder / "two.urdf", two_arms_urdf());
  write_bytes(folder / "scene.toml", R"(
[model]
urdf = "two.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.ja = { position = 1.0 }
joints.jb = { position = 0.2, velocity = 2.0 }
[integrator]
method = "gauss8"
step = 0.05
[run]
duration = )" + duration + R"(
record_every = 0.2
[[element]]
type = "controller"
name = "servo"
joint = "ja"
stiffness = 1
damping = 0.3
rate = 10
)" + more);
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string events = R"([[event]]
type = "lock"
joint = "jb"
above = 0.5
[[event]]
type = "unlock"
joint = "jb"
at = 2.0
)";

void expect_same(const scene::RunReport& a, const scene::RunReport& b) {
  EXPECT_TRUE(a.final_state == b.final_state);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.records, b.records);
  EXPECT_EQ(a.looks, b.looks);
  EXPECT_EQ(a.phases, b.phases);
  EXPECT_EQ(a.simulated_s, b.simulated_s);
  EXPECT_EQ(a.energy.max_rel_error, b.energy.max_rel_error);
  EXPECT_EQ(a.energy.scale_J, b.energy.scale_J);
  EXPECT_EQ(a.dissipated_J, b.dissipated_J);
  EXPECT_EQ(a.losses, b.losses);
  EXPECT_EQ(a.held, b.held);
  ASSERT_EQ(a.checks.size(), b.checks.size());
  for (size_t i = 0; i < a.checks.size(); ++i) {
    EXPECT_EQ(a.checks[i].name, b.checks[i].name);
    EXPECT_EQ(a.checks[i].value, b.checks[i].value) << a.checks[i].name;
  }
  EXPECT_EQ(a.notes, b.notes);
}

TEST(MemoryRun, IsTheRunIntoAFolder) {
  TemporaryFolder folder;
  const std::string monitor = "[monitor]\nstep_limit = 1e-12\naction = \"repeat\"\n";
  int k = 0;
  for (const std::string& more : {std::string(), events, monitor}) {
    const auto s = two_arms(folder, more, k == 0 ? "3.97" : "4");
    const auto a = scene::assemble(s);
    const auto there = scene::run(s, a, into(folder / ("out" + std::to_string(k++))));
    const auto here = scene::run_in_memory(s, a, {});
    SCOPED_TRACE(more);
    expect_same(here, there);
    auto coarse = s;
    coarse.step = 0.1;
    EXPECT_FALSE(scene::run_in_memory(coarse, a, {}).final_state == there.final_state) << "control";
  }
}

// One choice for all phases, whose steps are counted from time 0; a continued run goes on by it.
TEST(MemoryRun, AutoWithEvents) {
  TemporaryFolder folder;
  auto s = two_arms(folder, events);
  s.elements.clear();  // a controller that damps is none for pilots
  s.method = "auto";
  s.step = 0;
  s.record_every = 0.5;
  s.record_every_given = true;  // the step is a whole fraction of it, and the event at whole steps
  const auto a = scene::assemble(s);
  std::string said;
  auto o = into(folder / "out");
  o.say = [&](const std::string& choice) { said = choice; };
  const auto r = scene::run(s, a, o);
  EXPECT_TRUE(says(said, "auto chose"));
  EXPECT_EQ(r.phases, 3);
  EXPECT_EQ(r.simulated_s, 4);
  EXPECT_NE(r.method, "auto");
  EXPECT_NEAR(double(r.steps) * r.step_s, 4, 1e-12);
  EXPECT_TRUE(r.passed());
  // As if it had been killed before the last phase began.
  fs::remove(folder / "out" / "summary.json");
  fs::remove_all(folder / "out" / "phase_3");
  o.resume = true;
  const auto resumed = scene::run(s, a, o);
  EXPECT_TRUE(resumed.final_state == r.final_state);
  EXPECT_EQ(resumed.method, r.method);
  const auto here = scene::run_in_memory(s, a, {});
  EXPECT_EQ(here.phases, 3);
  EXPECT_EQ(here.simulated_s, 4);
}

TEST(MemoryRun, RecordsAreTheRowsOfTheLog) {
  TemporaryFolder folder;
  const auto s = two_arms(folder, "");
  const auto a = scene::assemble(s);
  const scene::RecordLayout layout(a.model->description(), s.extrema);
  std::vector<double> times;
  const auto r = scene::run_in_memory(s, a, {.record = [&](std::span<const double> row) {
                                        ASSERT_EQ(row.size(), layout.size());
                                        times.push_back(row[layout.time()]);
                                      }});
  ASSERT_EQ(times.size(), 21u);
  EXPECT_EQ(std::int64_t(times.size()), r.records);
  EXPECT_EQ(times.front(), 0);
  EXPECT_EQ(times.back(), 4);
}

TEST(MemoryRun, StopsWhereItIsTold) {
  TemporaryFolder folder;
  const auto s = two_arms(folder, events);
  const auto a = scene::assemble(s);
  std::atomic<bool> stop{true};
  const auto r = scene::run_in_memory(s, a, {.stop = &stop});
  EXPECT_TRUE(r.interrupted);
  EXPECT_EQ(r.phases, 1);
  EXPECT_EQ(r.steps, 0);
}

TEST(MemoryRun, RefusesNumbersThatAreNone) {
  TemporaryFolder folder;
  auto s = two_arms(folder, "");
  const auto a = scene::assemble(s);
  s.step = -1;
  EXPECT_EQ(refusal([&] { scene::run_in_memory(s, a, {}); }),
            "step is -1, expected a positive number of seconds");
}

// An event that waits and can happen at the end of the last step leaves another mechanism than the
// one that ran: state and assembly are of that, and no phase of no length follows.
TEST(PhaseSequence, AnEventAtTheLastInstantIsOfTheLastState) {
  TemporaryFolder folder;
  const auto s = two_arms(folder, "[[event]]\ntype = \"lock\"\njoint = \"jb\"\nabove = 3.0\n");
  const auto a = scene::assemble(s);
  for (const double jb : {3.0, 2.9}) {  // the second is the control
    const bool happens = jb == 3.0;
    scene::PhaseSequence phases(s, a);
    const scene::Phase* p = phases.next();
    ASSERT_NE(p, nullptr);
    scene::RunReport r;  // of a phase that met nothing on its way, and ends there
    r.final_state = a.initial;
    r.final_state.x[1] = jb;
    r.final_state.step = 80;
    r.simulated_s = 4;
    r.held = std::vector<double>(p->assembly.model->holds()[0]->fresh.size(), 0.0);
    phases.done(r);
    EXPECT_EQ(phases.next(), nullptr);
    const auto whole = phases.finish();
    EXPECT_EQ(phases.happened().size(), happens ? 1u : 0u);
    EXPECT_EQ(whole.phases, 1);
    EXPECT_EQ(whole.final_state.x.size(), happens ? 2u : 4u);
    EXPECT_EQ(size_t(phases.last().model->description().nx), whole.final_state.x.size());
    EXPECT_EQ(phases.last().mechanism->nq(), happens ? 1 : 2);
  }
}

// The same by a run: the event comes by the clock, with the last step.
TEST(PhaseSequence, ARunWithAnEventAtItsEnd) {
  TemporaryFolder folder;
  const auto s =
      two_arms(folder, "[[event]]\ntype = \"lock\"\njoint = \"jb\"\nbelow = 1e3\nafter = 4.0\n");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_EQ(r.phases, 1);
  EXPECT_EQ(r.simulated_s, 4);
  EXPECT_EQ(r.final_state.x.size(), 2u);
  EXPECT_FALSE(fs::exists(folder / "out" / "phase_2"));
  const auto text = read_bytes(folder / "out" / "summary.json");
  EXPECT_EQ(text.find("\"jb\"", text.find("\"final_state\"")), std::string::npos);
}

}  // namespace
}  // namespace porthos::test::memory_run_test
