// method = "auto": what it chooses keeps the target when it is run, and a resumed run keeps the
// choice.
#include "scene/assemble/steps.h"
#include "scene/compare/auto_method.h"

#include <nlohmann/json.hpp>

#include "tests/run/scenes.h"

namespace porthos::test::auto_test {
namespace {

/// A case that leaves its method to auto.
Case left_to_auto(Case c, double target) {
  c.scene.method = scene::auto_method;
  c.scene.step = 0;
  c.scene.record_every = 0;
  c.scene.record_every_given = false;
  c.scene.target_energy_error = target;
  return c;
}

Case wild_pendulum(const TemporaryFolder& folder, double duration) {
  Case c = pendulum(folder);
  c.scene.joints["shoulder"] = {2.5, 0};
  c.scene.duration = duration;
  c.assembly = scene::assemble(c.scene);
  return c;
}

TEST(Auto, ReachesItsTargetWhenRun) {
  TemporaryFolder folder;
  int n = 0;
  const Case cases[] = {wild_pendulum(folder, 1000), floating_arm(folder, 200)};
  for (const Case& of : cases)
    for (const double target : {1e-4, 1e-8, 1e-12}) {
      const Case c = left_to_auto(of, target);
      const auto r = scene::run(c.scene, c.assembly, into(folder / std::to_string(n++)));
      std::printf("  %-16s %6g s  target %.0e  measured %.1e  %s, step %g s\n", r.title.c_str(),
                  r.simulated_s, target, r.energy.max_rel_error, r.method.c_str(), r.step_s);
      EXPECT_EQ(r.outcome, integrators::Outcome::ok);
      EXPECT_DOUBLE_EQ(r.simulated_s, of.scene.duration) << "the end time asked for";
      EXPECT_LE(r.energy.max_rel_error, target) << r.title;
      EXPECT_GT(r.energy.max_rel_error, 1e-6 * target) << "far too good: the step is wasted";
      EXPECT_NE(r.method, "auto");
      ASSERT_FALSE(r.notes.empty());
      EXPECT_TRUE(says(r.notes[0], "auto chose --method " + r.method + " --step "));
    }
}

// Negative control: the target is no triviality.
TEST(Auto, AnotherMethodOrATwiceAsLongStepMissesTheTarget) {
  TemporaryFolder folder;
  const Case c = left_to_auto(wild_pendulum(folder, 100), 1e-10);
  scene::Scene chosen = scene::with_method_chosen(c.scene, c.assembly);
  const std::string method = chosen.method;
  chosen.step *= 4;
  const auto long_steps = scene::run(chosen, c.assembly, into(folder / "long"));
  chosen.step /= 4;
  chosen.method = "rk4";
  const auto rk4 = scene::run(chosen, c.assembly, into(folder / "rk4"));
  std::printf("  target 1e-10: %s with steps four times as long %.1e, rk4 with the step %.1e\n",
              method.c_str(), long_steps.energy.max_rel_error, rk4.energy.max_rel_error);
  EXPECT_TRUE(long_steps.outcome != integrators::Outcome::ok ||
              long_steps.energy.max_rel_error > 1e-10);
  EXPECT_GT(rk4.energy.max_rel_error, 1e-10);
}

TEST(Auto, ATargetBelowRoundingIsRefusedWithWhatIsInReach) {
  TemporaryFolder folder;
  const Case c = left_to_auto(wild_pendulum(folder, 100), 1e-18);
  const std::string why = refusal([&] { scene::run(c.scene, c.assembly, into(folder / "out")); });
  EXPECT_TRUE(
      says(why, "target_energy_error is 1e-18: no method is expected to keep it over 100 s; "));
  EXPECT_FALSE(fs::exists(folder / "out"));
  // What it says is in reach, is.
  const auto at = why.find("about ");
  ASSERT_NE(at, std::string::npos);
  const double reachable = std::stod(why.substr(at + 6));
  EXPECT_GT(reachable, 1e-17);
  EXPECT_LT(reachable, 1e-12);
  const Case again = left_to_auto(c, 10 * reachable);
  const auto r = scene::run(again.scene, again.assembly, into(folder / "out"));
  std::printf("  %s\n  asked for ten times that: %.1e\n", why.c_str(), r.energy.max_rel_error);
  EXPECT_LE(r.energy.max_rel_error, 10 * reachable);
}

/// A mass that slides on a turning rod, held by a spring: an ellipse, 5 times as long as it is wide
/// or `narrow` times that. The closer it passes the hub the faster it turns.
Case sling(const TemporaryFolder& folder, double narrow) {
  write_bytes(folder / "sling.urdf",
              "<robot name='sling'><link name='hub'/>"
              "<link name='rod'><inertial><mass value='1e-9'/><inertia ixx='1e-9' iyy='1e-9' "
              "izz='1e-9' ixy='0' ixz='0' iyz='0'/></inertial></link>"
              "<link name='mass'><inertial><mass value='1'/><inertia ixx='1e-9' iyy='1e-9' "
              "izz='1e-9' ixy='0' ixz='0' iyz='0'/></inertial></link>"
              "<joint name='turn' type='continuous'><parent link='hub'/><child link='rod'/>"
              "<axis xyz='0 0 1'/></joint>"
              "<joint name='slide' type='prismatic'><parent link='rod'/><child link='mass'/>"
              "<axis xyz='1 0 0'/><limit lower='-2' upper='2' effort='1' velocity='1'/></joint>"
              "</robot>");
  write_bytes(
      folder / "sling.toml",
      "[model]\nurdf = 'sling.urdf'\nbase = 'fixed'\n[initial.joints]\nturn = { velocity = " +
          std::to_string(0.2 / narrow) +
          " }\nslide = { position = 1.0 }\n[[element]]\ntype = 'spring'\njoint = 'slide'\n"
          "stiffness = 1.0\n[integrator]\nmethod = 'gauss8'\nstep = 0.5\n[run]\n"
          "duration = 200.0\n");
  const scene::Scene s = scene::read_scene((folder / "sling.toml").string());
  return {s, scene::assemble(s)};
}

/// It names a step control where one takes clearly less time, and what it names keeps the target.
/// Timings decide what is named; a disturbed machine may name nothing.
TEST(Auto, NamesAStepControlThatPays) {
  TemporaryFolder folder;
  const Case c = left_to_auto(sling(folder, 100), 1e-9);
  scene::Scene s = scene::with_method_chosen(c.scene, c.assembly);
  std::printf("  %s\n", s.choice.c_str());
  EXPECT_EQ(s.step_control, integrators::StepControl::fixed) << "it is named, not taken";
  const auto fixed = scene::run(s, c.assembly, into(folder / "fixed"));
  const auto at = s.choice.find("with step = ");
  char kind[32] = "reversible";
  if (at == std::string::npos) {
    s.step = 0.016;
    s.control_rate = 6.4;
  } else {
    ASSERT_EQ(
        std::sscanf(s.choice.c_str() + at,
                    "with step = %lf, step_control = \"%31[a-z_]\" and step_control_rate = %lf",
                    &s.step, kind, &s.control_rate),
        3);
  }
  s.step_control = integrators::step_control_of(kind);
  const auto varied = scene::run(s, c.assembly, into(folder / "varied"));
  std::printf("  energy error %.1e with it (1e-9), %.2f of the evaluations (0.5)\n",
              varied.energy.max_rel_error,
              double(varied.cost.evaluations) / double(fixed.cost.evaluations));
  EXPECT_LE(varied.energy.max_rel_error, 1e-9);
  EXPECT_LE(double(varied.cost.evaluations), 0.5 * double(fixed.cost.evaluations));
}

/// Its ledger may close over a motion that is wrong: the choice is one that half the step does not
/// move.
TEST(Auto, ADampedSystemIsResolvedToo) {
  TemporaryFolder folder;
  const Case c = left_to_auto(pendulum(folder, 0.1), 1e-9);
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  std::printf("  %s, step %g s: energy error %.1e of 1e-9\n", r.method.c_str(), r.step_s,
              r.energy.max_rel_error);
  EXPECT_LE(r.energy.max_rel_error, 1e-9);
  scene::Scene halved = c.scene;
  halved.method = r.method;
  halved.step = halved.record_every = r.step_s;
  halved.verify = {.step_halving = 1e-3};
  const auto judged = scene::run(halved, c.assembly, into(folder / "halved"));
  EXPECT_EQ(judged.verdict(), scene::Verdict::pass);
}

/// Steps end where events happen, thrusters switch and controllers sample.
TEST(Auto, ItsStepGoesIntoEveryInstant) {
  scene::Scene s;
  s.duration = 0.6;
  s.record_every = 0.6;
  EXPECT_NEAR(scene::fitting_step(s, 0.07), 0.6 / 9, 1e-15);
  scene::Event event;
  event.at = 0.25;
  s.events.push_back(event);
  EXPECT_NEAR(scene::fitting_step(s, 0.07), 0.05, 1e-12);
  scene::Element sampled;
  sampled.rate = 30;
  s.elements.push_back(sampled);
  EXPECT_NEAR(scene::fitting_step(s, 0.07), 0.1 / 6, 1e-12);
}

/// A stiff spring at rest, which the sudden lock of the joint before it wakes: the start tells
/// nothing of the step.
TEST(Auto, EventsArePilotedToo) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", "<robot name='arm'>" + link("body", 20) + link("upper", 3) +
                                       link("lower", 2) +
                                       joint("shoulder", "body", "upper", "0 1 0") +
                                       joint("elbow", "upper", "lower", "0 1 0") + "</robot>");
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[environment]\ngravity = 'uniform'\n"
              "vector = [0, 0, -9.81]\n[initial]\njoints.shoulder = { position = 0.4 }\n"
              "[[element]]\ntype = 'spring'\njoint = 'elbow'\nstiffness = 500\n"
              "[[event]]\ntype = 'lock'\njoint = 'shoulder'\nat = 2\n"
              "[[event]]\ntype = 'unlock'\njoint = 'shoulder'\nat = 20\n"
              "[integrator]\nmethod = 'auto'\ntarget_energy_error = 1e-9\n[run]\nduration = 40\n");
  const auto s = scene::read_scene((folder / "scene.toml").string());
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  std::printf("  with events: %s, step %g s, %.1e (1e-9)\n", r.method.c_str(), r.step_s,
              r.energy.max_rel_error);
  EXPECT_LE(r.energy.max_rel_error, 1e-9);
  const auto told = [&](const char* words) {
    return std::ranges::any_of(r.notes, [&](const auto& n) { return bool(says(n, words)); });
  };
  EXPECT_TRUE(told("; with its events "));
  // Control: the choice of the same scene without its events misses the target with them.
  auto blind = s;
  blind.events.clear();
  const auto chosen = scene::with_method_chosen(blind, scene::assemble(blind));
  auto stated = s;
  stated.method = chosen.method;
  stated.step = scene::fitting_step(s, chosen.step);
  stated.record_every = 10 * stated.step;
  const auto missed = scene::run(stated, scene::assemble(stated), into(folder / "blind"));
  std::printf("  blind to them: %s, step %g s, %.1e\n", missed.method.c_str(), missed.step_s,
              missed.energy.max_rel_error);
  EXPECT_GT(missed.energy.max_rel_error, 1e-9);
}

TEST(Auto, WithoutATargetItIsTheLimitOfTheVerdict) {
  scene::Scene s = {};
  EXPECT_EQ(s.target(), 1e-9);
  s.verify.energy = 1e-7;
  EXPECT_EQ(s.target(), 1e-7);
  s.target_energy_error = 1e-5;
  EXPECT_EQ(s.target(), 1e-5);
}

TEST(Auto, AStatedMethodIsLeftAlone) {
  TemporaryFolder folder;
  const Case c = wild_pendulum(folder, 10);
  const auto s = scene::with_method_chosen(c.scene, c.assembly);
  EXPECT_EQ(s.method, c.scene.method);
  EXPECT_EQ(s.step, c.scene.step);
  EXPECT_EQ(s.choice, "");
}

/// Runs up to a step, where it is interrupted.
scene::RunReport run_until(std::int64_t step, const Case& c, const fs::path& out, bool resume,
                           std::string& said) {
  auto options = into(out, resume);
  options.stop_at = step;
  options.say = [&](const std::string& text) { said = text; };
  return scene::run(c.scene, c.assembly, options);
}

TEST(Auto, AResumedRunKeepsTheChoiceAndGivesTheSameBits) {
  TemporaryFolder folder;
  const Case c = left_to_auto(wild_pendulum(folder, 5000), 1e-9);
  std::string first, said;
  auto parts = run_until(100, c, folder / "parts", false, first);
  ASSERT_TRUE(parts.interrupted);
  for (const std::int64_t step : {1000, -1}) {  // -1: to the end
    parts = run_until(step, c, folder / "parts", true, said);
    EXPECT_EQ(parts.interrupted, step > 0);
    EXPECT_EQ(said, first);  // timings in it would differ if the pilots had been run again
  }
  scene::Scene same = c.scene;
  same.method = parts.method;
  same.step = parts.step_s;
  const double every = 5;  // a thousandth of the run, in whole steps
  same.record_every = std::max(1.0, std::round(every / parts.step_s)) * parts.step_s;
  const auto whole = scene::run(same, c.assembly, into(folder / "whole"));
  EXPECT_TRUE(whole.final_state == parts.final_state);
  EXPECT_EQ(whole.records, parts.records);
  EXPECT_TRUE(read_bytes(folder / "whole" / "run.h5") == read_bytes(folder / "parts" / "run.h5"));
  const auto summary = nlohmann::json::parse(read_bytes(folder / "parts" / "summary.json"));
  EXPECT_EQ(summary.at("notes").at(0), first);
}

TEST(Auto, ARunThatWasNotLeftToAutoIsNotResumedByIt) {
  TemporaryFolder folder;
  const Case c = wild_pendulum(folder, 2000);
  std::string said;
  ASSERT_TRUE(run_until(100, c, folder / "out", false, said).interrupted);
  EXPECT_EQ(said, "");
  const Case asked = left_to_auto(c, 1e-9);
  EXPECT_TRUE(
      says(refusal([&] { scene::run(asked.scene, asked.assembly, into(folder / "out", true)); }),
           "the choice was  and is left to auto now"));
  EXPECT_TRUE(says(refusal([&] { scene::run(asked.scene, asked.assembly, into(folder / "out")); }),
                   "holds an unfinished run"));
}

// --- the keys ------------------------------------------------------------------------------------

class Keys : public ::testing::Test {
 protected:
  scene::Scene read(const std::string& integrator) {
    write_bytes(folder_ / "arm.urdf", arm_urdf());
    write_bytes(folder_ / "s.toml",
                "[model]\nurdf = \"arm.urdf\"\nbase = \"free\"\n[integrator]\n" + integrator +
                    "\n[run]\nduration = 10\n");
    return scene::read_scene((folder_ / "s.toml").string());
  }
  TemporaryFolder folder_;
};

TEST_F(Keys, AutoNeedsNoStep) {
  const auto s = read("method = \"auto\"\ntarget_energy_error = 1e-7");
  EXPECT_EQ(s.method, "auto");
  EXPECT_EQ(s.step, 0);
  EXPECT_EQ(s.target(), 1e-7);
  EXPECT_EQ(read("method = \"auto\"\nstep = 0.5").step, 0.5);
  EXPECT_TRUE(says(refusal([&] { read("method = \"gauss8\""); }), "lacks the key 'step'"));
}

TEST_F(Keys, BadOnesAreRefused) {
  const std::pair<std::string, std::string> cases[] = {
      {"method = \"gauss8\"\nstep = 1\ntarget_energy_error = 1e-7",
       "target_energy_error is given without method = \"auto\", expected both or neither"},
      {"method = \"auto\"\ntarget_energy_error = 0",
       "target_energy_error is 0, expected a number between 0 and 1"},
      {"method = \"auto\"\ntarget_energy_error = \"small\"",
       "target_energy_error is a string, expected a number"},
      {"method = \"autp\"\nstep = 1", "method is 'autp', expected 'auto' or another"}};
  for (const auto& [keys, why] : cases)
    EXPECT_TRUE(says(refusal([&, &k = keys] { read(k); }), why));
}

TEST_F(Keys, TheCommandLineCanTakeTheChoiceBack) {
  auto s = read("method = \"auto\"");
  EXPECT_TRUE(says(refusal([&] { scene::apply(s, {.method = "gauss8"}); }),
                   "the scene states no step for gauss8, expected --step too"));
  EXPECT_EQ(s.method, "auto");
  scene::apply(s, {.method = "gauss8", .step = 0.5});
  EXPECT_EQ(s.step, 0.5);
  EXPECT_GT(s.record_every, 0);
}

}  // namespace
}  // namespace porthos::test::auto_test
