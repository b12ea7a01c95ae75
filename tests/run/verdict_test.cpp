// The verdict: what is judged, what does not apply, and what would let a wrong motion pass.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "integrators/core/integrator.h"
#include "phs/system/user_model.h"
#include "scene/run/verdict.h"
#include "tests/run/shipped.h"

namespace porthos::test::verdict_test {
namespace {

using scene::Verdict;

const scene::Check* find(const scene::RunReport& r, const std::string& name) {
  for (const auto& c : r.checks)
    if (c.name == name) return &c;
  return nullptr;
}
std::string why_not(const scene::RunReport& r, const std::string& name) {
  for (const auto& n : r.not_applicable)
    if (n.name == name) return n.why;
  return "";
}
scene::RunReport verify(const Case& c, const TemporaryFolder& folder, bool all = true) {
  auto o = into(folder / "out");
  o.check_symmetry = all;
  return scene::run(c.scene, c.assembly, o);
}
/// The pendulum without limits of its own.
Case bare_pendulum(const TemporaryFolder& folder, const std::string& method, double step,
                   double duration) {
  Case c = pendulum(folder);
  c.scene.verify = {};
  c.scene.method = method;
  c.scene.step = step;
  c.scene.duration = duration;
  c.scene.record_every = step;
  return c;
}
nlohmann::json summary(const TemporaryFolder& folder) {
  return nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
}

/// Lossless, driven by a sine that is no whole number of periods in the 100 steps.
Case driven_pendulum(const TemporaryFolder& folder) {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
              "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.shoulder = { position = 1.2 "
              "}\n[[element]]\njoint = \"elbow\"\ntype = \"force\"\nsine = { amplitude = 2.0, "
              "frequency = 0.37 }\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\nduration "
              "= 20\n[verify]\nbalance = 1e-9\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  return {s, scene::assemble(s)};
}

TEST(Verdict, TheWayBackBeginsAtTheEndOfTheWayForth) {
  TemporaryFolder folder;
  const Case c = driven_pendulum(folder);
  const auto r = verify(c, folder);
  const auto* k = find(r, "symmetry");
  ASSERT_TRUE(k);
  // Control: the clock of the way back at 0, where the force is another one.
  phs::State s = c.assembly.initial;
  for (const double h : {0.01, -0.01}) {
    const auto method = scene::make_integrator(c.scene, *c.assembly.model, h);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    s.origin = 0;
    s.origin_step = s.step;
  }
  double off = 0;
  for (size_t i = 0; i < s.x.size(); ++i)
    off = std::max(off, std::fabs(s.x[i] - c.assembly.initial.x[i]));
  std::printf("  forth and back %.1e (1e-9), with the clock at 0 off by %.2f\n", k->value, off);
  EXPECT_LT(k->value, 1e-12);
  EXPECT_GT(off, 0.01);
  EXPECT_EQ(r.verdict(), Verdict::pass);
  EXPECT_TRUE(says(why_not(r, "axiom: rate"), "sources drive the system"));
}

TEST(Verdict, WhatIsDampedIsNotSteppedBackwards) {
  TemporaryFolder folder;
  Case c = pendulum(folder, 3.0);
  c.scene.verify = {.balance = 1e-9};
  const auto r = verify(c, folder);
  EXPECT_EQ(find(r, "symmetry"), nullptr);
  EXPECT_TRUE(says(why_not(r, "symmetry"), "backwards in time its losses would grow"));
  EXPECT_EQ(r.verdict(), Verdict::pass);
  const auto j = summary(folder);
  bool listed = false;
  for (const auto& n : j["not_applicable"]) listed |= n["name"] == "symmetry";
  EXPECT_TRUE(listed) << j["not_applicable"].dump();
}

TEST(Verdict, ASceneWithoutLimitsIsJudged) {
  TemporaryFolder folder;
  const auto bad = verify(bare_pendulum(folder, "rk4", 0.2, 20), folder, false);
  ASSERT_TRUE(find(bad, "energy"));
  std::printf("  rk4 at 0.2 s: energy off by %.2g of its size\n", find(bad, "energy")->value);
  EXPECT_GT(find(bad, "energy")->value, 0.02) << "0.044 of what it moves";
  EXPECT_EQ(bad.verdict(), Verdict::fail);
  // What does not apply is listed, not dropped.
  for (const char* name : {"linear_momentum", "angular_momentum", "quaternion_norm"})
    EXPECT_FALSE(why_not(bad, name).empty()) << name;
  EXPECT_EQ(verify(bare_pendulum(folder, "gauss8", 0.01, 20), folder, false).verdict(),
            Verdict::pass);
}

TEST(Verdict, LimitsThatDoNotApplyJudgeNothing) {
  TemporaryFolder folder;
  for (const auto& limits :
       {scene::Limits{.quaternion_norm = 1e-9}, {.symmetry = 1e-30}, {.orbital = 1e-9}}) {
    Case c = bare_pendulum(folder, "rk4", 0.2, 20);
    c.scene.verify = limits;
    const auto r = verify(c, folder, false);
    EXPECT_TRUE(r.checks.empty());
    EXPECT_EQ(r.not_applicable.size(), 1u);
    EXPECT_EQ(r.verdict(), Verdict::not_judged);
    EXPECT_FALSE(r.passed());
    EXPECT_EQ(summary(folder)["verdict"], "not judged");
  }
}

// Gauss methods keep momenta and norms with any step: a limit on these alone would let any motion
// pass.
TEST(Verdict, ACheckOfWhatHoldsWithAnyStepIsNotEnough) {
  TemporaryFolder folder;
  Case c = floating_arm(folder, 20, "midpoint");
  c.scene.step = 0.5;
  c.scene.verify = {.angular_momentum = 1e-12};
  const auto r = verify(c, folder, false);
  ASSERT_TRUE(find(r, "angular_momentum"));
  EXPECT_TRUE(find(r, "angular_momentum")->pass);
  EXPECT_FALSE(find(r, "angular_momentum")->telling);
  ASSERT_TRUE(find(r, "energy")) << "chosen by the verdict";
  EXPECT_EQ(r.verdict(), Verdict::fail);
  EXPECT_TRUE(says(r.notes.back(), "keeps all that [verify] asks for with any step"));
}

// A method that keeps the energy by construction is judged by half its step.
TEST(Verdict, EnergyExactMethodsAreJudgedByTheirMotion) {
  TemporaryFolder folder;
  for (const double step : {0.001, 0.1, 1.0, 10.0}) {
    const auto r = verify(bare_pendulum(folder, "gonzalez", step, 20), folder, false);
    ASSERT_TRUE(find(r, "energy"));
    const auto* half = find(r, "step_halving");
    ASSERT_TRUE(half) << step;
    std::printf("  gonzalez at %g s: energy %.1e, half the step moves it by %.1e (1e-3)\n", step,
                find(r, "energy")->value, half->value);
    EXPECT_FALSE(find(r, "energy")->telling);
    EXPECT_EQ(r.verdict(), step < 0.01 ? Verdict::pass : Verdict::fail) << step;
    EXPECT_EQ(summary(folder)["verdict"], to_string(r.verdict()));
  }
  // What fails all the same is not said to be kept. Control: a limit that holds.
  for (const double limit : {1e-30, 1e-9}) {
    Case c = bare_pendulum(folder, "gonzalez", 0.001, 20);
    c.scene.verify = {.energy = limit};
    const auto r = verify(c, folder, false);
    const bool fails = !find(r, "energy")->pass;
    EXPECT_EQ(fails, limit < 1e-20);
    EXPECT_TRUE(says(r.notes.back(), fails ? "gonzalez is declared to keep all that was checked "
                                             "with any step, and does not: the motion"
                                           : "gonzalez keeps all that was checked with any step"))
        << r.notes.back();
  }
  // Where the energy tells, nothing more is asked; a stated limit holds for any method.
  Case c = bare_pendulum(folder, "gauss8", 0.01, 20);
  EXPECT_EQ(find(verify(c, folder, false), "step_halving"), nullptr);
  c.scene.verify = {.step_halving = 1e-12};
  const auto r = verify(c, folder, false);
  ASSERT_TRUE(find(r, "step_halving"));
  EXPECT_EQ(r.verdict(), Verdict::pass);
}

/// An oscillator whose input is out of order: a run without input knows nothing of it, the axioms
/// ask.
struct Refusing {
  phs::Description description() const {
    return {.name = "refusing",
            .nx = 2,
            .nu = 1,
            .blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}},
            .ports = {{"push", phs::PortKind::effort_in, 1, 0, "N", "m/s"}},
            .invariants = {},
            .traits = {.canonical = true}};
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.25) * x[0] * x[0] * x[0] * x[0] + T(0.5) * x[1] * x[1];
  }
  template <class T>
  void input(std::span<const T>, std::span<const T>, std::span<T>) const {
    throw std::runtime_error("the input is out of order");
  }
};

TEST(Verdict, ACheckThatThrowsHasFailedAndCostsNoResults) {
  TemporaryFolder folder;
  scene::Scene s;
  s.title = "refusing";
  s.method = "gauss8";
  s.step = 0.1;
  s.duration = 10;
  s.record_every = 1;
  s.verify.energy = 1e-9;
  const double start[] = {1.0, 0.0};
  const auto a = scene::assembly_of(std::make_shared<phs::UserModel<Refusing>>(Refusing{}), start);
  auto o = into(folder / "out");
  EXPECT_EQ(scene::run(s, a, o).verdict(), Verdict::pass);
  o.check_symmetry = true;
  const auto r = scene::run(s, a, o);
  ASSERT_TRUE(find(r, "axioms"));
  EXPECT_FALSE(find(r, "axioms")->pass);
  EXPECT_EQ(r.verdict(), Verdict::fail);
  bool said = false;
  for (const auto& n : r.notes)
    said |= bool(says(n, "axioms could not be checked: the input is out"));
  EXPECT_TRUE(said);
  EXPECT_EQ(summary(folder)["verdict"], "fail");
  EXPECT_TRUE(fs::exists(folder / "out" / "run.h5"));
}

// The ground takes a part of the momentum: across a lock on a fixed base it is no invariant.
TEST(Verdict, MomentumAcrossEventsIsJudgedWhereItIsAnInvariant) {
  TemporaryFolder folder;
  for (const char* base : {"fixed", "free"}) {
    write_bytes(folder / "arm.urdf", arm_urdf());
    write_bytes(folder / "scene.toml",
                std::string("[model]\nurdf = \"arm.urdf\"\nbase = \"") + base +
                    "\"\n[initial]\njoints.shoulder = { velocity = 0.5 }\n[[element]]\njoint = "
                    "\"elbow\"\ntype = \"spring\"\nstiffness = 1.0\nrest = 0.3\n"
                    "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1.0\n"
                    "[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\nduration = 2\n"
                    "[verify]\nenergy = 1e-9\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    const Case c{s, scene::assemble(s)};
    const auto r = verify(c, folder);
    for (const auto& k : r.checks) EXPECT_TRUE(k.pass) << base << ": " << k.name << " " << k.value;
    EXPECT_EQ(r.verdict(), Verdict::pass) << base;
    const bool fixed = std::string(base) == "fixed";
    EXPECT_EQ(find(r, "momentum_across_events") == nullptr, fixed);
    EXPECT_EQ(!why_not(r, "momentum_across_events").empty(), fixed);
    fs::remove_all(folder / "out");
  }
}

TEST(Verdict, TheEndOfADivergedRunSaysWhatHelps) {
  TemporaryFolder folder;
  Case c = bare_pendulum(folder, "gauss8", 0.3, 60);
  c.scene.joints["shoulder"] = {3.0, 600.0};
  c.scene.joints["elbow"] = {2.0, -1200.0};
  c.assembly = scene::assemble(c.scene);
  const auto r = verify(c, folder, false);
  ASSERT_NE(r.outcome, integrators::Outcome::ok) << "the step is meant to be too long";
  for (const double x : r.final_state.x) EXPECT_TRUE(std::isfinite(x));
  std::printf("  %s\n", scene::ending(r).c_str());
  EXPECT_TRUE(says(scene::ending(r), "expected a smaller step than 0.3 s"));
  EXPECT_FALSE(says(scene::ending(r), "state became infinite"));
  EXPECT_EQ(r.verdict(), Verdict::fail);
}

/// An arm that rests at its equilibrium has no energy of motion that its roundings could be
/// relative to, and its energy tells nothing. Control: one that swings by a thousandth of a radian.
TEST(Verdict, AnArmAtRestIsNotJudgedByItsRoundings) {
  const auto run = [](double angle) {
    TemporaryFolder folder;
    write_bytes(
        folder / "rod.urdf",
        "<robot name='rod'><link name='world_'/><link name='rod'><inertial><origin xyz='0 0 "
        "-0.5'/><mass value='2'/><inertia ixx='0.1' iyy='0.1' izz='0.01' ixy='0' ixz='0' "
        "iyz='0'/></inertial></link><joint name='hinge' type='continuous'><parent "
        "link='world_'/><child link='rod'/><axis xyz='0 1 0'/></joint></robot>");
    write_bytes(folder / "scene.toml",
                "[model]\nurdf = 'rod.urdf'\nbase = 'fixed'\n[environment]\ngravity = 'uniform'\n"
                "vector = [0, 0, -9.81]\n[initial]\njoints.hinge.position = " +
                    std::to_string(angle) +
                    "\n[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n"
                    "[verify]\nenergy = 1e-9\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    return scene::run(s, scene::assemble(s), into(folder / "out"));
  };
  const auto still = run(0), swings = run(1e-3);
  EXPECT_TRUE(scene::next_to_nothing_moves(still.energy));
  EXPECT_LT(still.energy.max_rel_error, 1e-15);
  EXPECT_NE(still.verdict(), scene::Verdict::fail);
  EXPECT_FALSE(scene::next_to_nothing_moves(swings.energy));
  EXPECT_TRUE(swings.passed());
}

// What an ensemble tells of a check that fails in some of its cases is the limit of each run.
TEST(Verdict, TheLimitOfACheckIsThatOfEachRun) {
  std::set<std::string> names;
  const auto compare = [&](const scene::Scene& s, const scene::RunReport& r) {
    for (const scene::Check& c : r.checks) {
      names.insert(c.name);
      EXPECT_EQ(scene::limit_of_check(s, c.name), std::optional(c.limit)) << c.name;
    }
  };
  for (const auto& [name, duration] :
       {std::pair{"capture", 201.0}, {"ets_vii_orbit", 200.0}, {"four_bar", 0.5}}) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, duration);
    compare(s, scene::run(s, scene::assemble(s), into(folder / "out")));
  }
  TemporaryFolder folder;
  Case bare = bare_pendulum(folder, "gauss8", 0.01, 1);
  compare(bare.scene, verify(bare, folder, false));
  bare.scene.verify.step_halving = 1e-2;
  compare(bare.scene, verify(bare, folder, false));
  std::printf("  %zu checks\n", names.size());
  for (const char* name : {"energy", "constraints", "constraint_rates", "orbital", "coupling",
                           "momentum_across_events", "step_halving"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_FALSE(scene::limit_of_check(bare.scene, "symmetry")) << "control: no check of a case";
}

}  // namespace
}  // namespace porthos::test::verdict_test
