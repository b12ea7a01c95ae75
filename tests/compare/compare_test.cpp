// The comparison as a library: what it tries, what it says of it, and how long it takes.
#include "scene/compare/compare.h"

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "scene/compare/advice.h"
#include "scene/run/cpu_clock.h"
#include "tests/places.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

namespace porthos::test::compare_test {
namespace {

using scene::Comparison;

/// A pendulum that swings regularly: small enough not to be chaotic.
Case regular_pendulum(const TemporaryFolder& folder, double damping = 0) {
  Case c = pendulum(folder, damping);
  c.scene.joints["shoulder"] = {0.3, 0};
  c.scene.duration = 5;
  c.assembly = scene::assemble(c.scene);
  return c;
}

struct Compared {
  TemporaryFolder folder;
  Case c = regular_pendulum(folder);
  Comparison result = scene::compare(c.scene, c.assembly, {.budget_s = 8});
};
const Compared& compared() {
  static const Compared once;
  return once;
}

TEST(Compare, EveryMethodOfTheCatalogueIsTriedOrSkippedWithItsReason) {
  TemporaryFolder folder;
  const Case damped = regular_pendulum(folder, 0.1);
  const Comparison of_damped = scene::compare(damped.scene, damped.assembly, {.budget_s = 1});
  for (const auto* of : {&compared().result, &of_damped}) {
    const auto& d = (of == &of_damped ? damped : compared().c).assembly.model->description();
    std::map<std::string, std::string> skipped(of->skipped.begin(), of->skipped.end());
    std::set<std::string> tried;
    for (const auto& m : of->methods) {
      tried.insert(m.method.name);
      EXPECT_FALSE(m.trials.empty()) << m.method.name << " has no row";
    }
    for (const auto& method : integrators::catalogue()) {
      const auto reason = integrators::misfit(method, d);
      EXPECT_EQ(tried.count(method.name), reason ? 0u : 1u) << method.name;
      EXPECT_EQ(skipped.count(method.name), reason ? 1u : 0u) << method.name;
      if (reason) {
        EXPECT_EQ(skipped[method.name], *reason);
      }
    }
  }
  // Störmer-Verlet does not take damping: the list is not empty by accident.
  EXPECT_TRUE(says(scene::comparison_table(damped.scene, of_damped),
                   "skipped  method 'stormer_verlet' needs"));
}

TEST(Compare, ErrorsFallWithTheStepByTheOrder) {
  int judged = 0;
  for (const auto& m : compared().result.methods) {
    if (m.method.rival || m.method.order == 0) continue;
    // Between the trials that are neither coarse nor at rounding.
    const scene::Trial *first = nullptr, *last = nullptr;
    for (const auto& t : m.trials) {
      const double e = t.trajectory_error.value_or(1);
      if (!t.complete() || e > 1e-3 || e < 1e-12) continue;
      if (!first) first = &t;
      last = &t;
    }
    if (!first || last->setting.step > 0.6 * first->setting.step) continue;
    const double slope = std::log(*first->trajectory_error / *last->trajectory_error) /
                         std::log(first->setting.step / last->setting.step);
    std::printf("  %-16s order %2d, trajectory error falls with the power %.2f of the step\n",
                m.method.name.c_str(), m.method.order, slope);
    EXPECT_GT(slope, m.method.order - 0.7) << m.method.name;
    EXPECT_LT(slope, m.method.order + 2.5) << m.method.name;
    ++judged;
  }
  EXPECT_GE(judged, 4);
}

TEST(Compare, ShortSweepsKeepTheErrorForLessWork) {
  int judged = 0;
  double evaluations = 0, of_full = 0;
  for (size_t i = 1; i < compared().result.methods.size(); ++i) {
    const auto& m = compared().result.methods[i];
    if (!m.short_sweeps) continue;
    const auto& full_line = compared().result.methods[i - 1];
    ASSERT_EQ(full_line.method.name, m.method.name);
    for (const auto& t : m.trials)
      for (const auto& full : full_line.trials) {
        if (full.setting.step != t.setting.step || !t.complete()) continue;
        const double e = full.report.energy.max_rel_error, now = t.report.energy.max_rel_error;
        std::printf("  %-14s step %7.3g s, sweeps to %.0e: error %.1e -> %.1e, evaluations %.2f\n",
                    m.label().c_str(), t.setting.step, t.setting.iteration_tolerance, e, now,
                    double(t.report.cost.evaluations) / double(full.report.cost.evaluations));
        EXPECT_NEAR(t.setting.iteration_tolerance / e, 1, 0.5);
        EXPECT_LT(now, 30 * e);
        evaluations += double(t.report.cost.evaluations);
        of_full += double(full.report.cost.evaluations);
        ++judged;
      }
  }
  EXPECT_GE(judged, 4);
  EXPECT_LT(evaluations, 0.8 * of_full);
}

// With a step control the steps differ, the end does not, and the errors reach rounding.
TEST(Compare, StepControlsAreTried) {
  int controls = 0;
  for (const auto& m : compared().result.methods) {
    if (m.control == integrators::StepControl::fixed) continue;
    ++controls;
    ASSERT_FALSE(m.trials.empty()) << m.label();
    double energy = HUGE_VAL, trajectory = HUGE_VAL, most = 0;
    for (const auto& t : m.trials) {
      if (!t.complete()) continue;
      EXPECT_NEAR(t.report.simulated_s, compared().result.duration_s, 1e-9) << m.label();
      energy = std::min(energy, t.report.energy.max_rel_error);
      trajectory = std::min(trajectory, t.trajectory_error.value_or(HUGE_VAL));
      most = std::max(most, double(t.report.steps) * t.setting.step / t.report.simulated_s);
    }
    std::printf(
        "  %s: energy %.1e (1e-13)  trajectory %.1e (1e-11)  up to %.4f times the fixed steps\n",
        m.label().c_str(), energy, trajectory, most);
    EXPECT_LE(energy, 1e-13) << m.label();
    EXPECT_LE(trajectory, 1e-11) << m.label();
    EXPECT_GT(most, 1 + 1e-5) << m.label() << " has never varied a step";  // fixed: 1 to rounding
  }
  EXPECT_EQ(controls, 2);
}

/// A time transformation takes loops, but no joint that moves as told; the reversible control both.
TEST(Compare, LoopsAreTriedWithStepControls) {
  const auto path = fs::path(PORTHOS_SOURCE_DIR) / "examples/four_bar/scene.toml";
  auto s = scene::read_scene(path.string());
  scene::apply(s, {.duration = 0.5});
  using enum integrators::StepControl;
  const auto tried = [&](std::string& why) {
    const Comparison c =
        scene::compare(s, scene::assemble(s), {.methods = {"spark16"}, .budget_s = 2});
    // Also where the reference is a run of its own with the step that is tried first.
    EXPECT_GE(c.methods.at(0).trials.size(), 4u);
    std::vector<integrators::StepControl> controls;
    for (const auto& m : c.methods) controls.push_back(m.control);
    for (const auto& [name, reason] : c.skipped) why += reason;
    return controls;
  };
  std::string why;
  EXPECT_EQ(tried(why), (std::vector{fixed, time_transformed, reversible})) << why;
  s.constraints.spec.driven.push_back({"turn", "crank", phs::steady_motion(1, 3)});
  why.clear();
  EXPECT_EQ(tried(why), (std::vector{fixed, reversible}));
  EXPECT_NE(why.find("takes no constraint that moves, and 'four_bar' has 'turn'"), why.npos) << why;
}

TEST(Compare, RivalsAreTriedOverTolerances) {
  for (const auto& m : compared().result.methods) {
    if (!m.method.rival) continue;
    EXPECT_EQ(m.trials.front().setting.rtol, 1e-4) << m.method.name;
    // An explicit method of order 8 is at round-off from the start, as the step is never longer
    // than to the next output.
    const bool round_off = m.trials.back().report.energy.max_rel_error < 1e-14;
    ASSERT_GE(m.trials.size(), round_off ? 2u : 3u) << m.method.name;
    for (size_t i = 1; i < m.trials.size(); ++i)
      EXPECT_NEAR(m.trials[i].setting.rtol / m.trials[i - 1].setting.rtol, 0.1, 1e-12);
    EXPECT_LT(m.trials.back().report.energy.max_rel_error,
              std::max(1e-12, m.trials.front().report.energy.max_rel_error))
        << m.method.name;
  }
}

TEST(Compare, NumbersAreTheSameEveryTimeButTheTimes) {
  const auto& c = compared().c;
  const std::vector<std::string> methods{"gauss8", "rk4", "cvode_adams"};
  scene::CompareOptions o{.methods = methods, .budget_s = 2};
  const Comparison a = scene::compare(c.scene, c.assembly, o);
  const Comparison b = scene::compare(c.scene, c.assembly, o);
  ASSERT_EQ(a.methods.size(), methods.size() + 1) << "gauss8 has its short sweeps";
  ASSERT_EQ(b.methods.size(), a.methods.size());
  EXPECT_EQ(a.trajectory_time_s, b.trajectory_time_s);
  size_t compared = 0;
  for (size_t i = 0; i < a.methods.size(); ++i)
    for (const auto& t : a.methods[i].trials)
      for (const auto& u : b.methods[i].trials) {
        if (t.setting.step != u.setting.step || t.setting.rtol != u.setting.rtol) continue;
        if (!t.complete() || !u.complete()) continue;
        EXPECT_EQ(t.report.energy.max_rel_error, u.report.energy.max_rel_error);
        EXPECT_EQ(t.trajectory_error, u.trajectory_error);
        ++compared;
      }
  EXPECT_GE(compared, 10u);
}

TEST(Compare, FailedTrialsAreRows) {
  // It whirls: long steps do not converge.
  auto whirling = scene::read_scene(PORTHOS_SOURCE_DIR "/examples/double_pendulum/scene.toml");
  whirling.duration = 5;
  const Comparison r = scene::compare(whirling, scene::assemble(whirling),
                                      {.methods = {"gauss8", "stormer_verlet"}, .budget_s = 4});
  bool any = false;
  for (const auto& m : r.methods)
    for (const auto& t : m.trials)
      if (!t.complete()) {
        any = true;
        EXPECT_TRUE(says(scene::comparison_table(whirling, r), t.failure.substr(0, 40)));
      }
  EXPECT_TRUE(any) << "steps are coarsened until a method breaks down:\n"
                   << scene::comparison_table(whirling, r);
}

TEST(Compare, TheBudgetIsKept) {
  TemporaryFolder folder;
  Case c = pendulum(folder);
  c.scene.duration = 1e5;
  c.scene.step = 1e-3;  // far too much
  double longest = 0;
  for (const double budget : {1.0, 8.0}) {
    const double start = scene::thread_cpu_now();
    const Comparison r = scene::compare(c.scene, c.assembly, {.budget_s = budget});
    const double cpu = scene::thread_cpu_now() - start;
    std::printf("  budget %.1f s, took %.2f s, trials of %g s\n", budget, cpu, r.duration_s);
    EXPECT_LT(r.duration_s, c.scene.duration);
    EXPECT_GT(r.duration_s, longest) << "more budget, longer trials";
    longest = r.duration_s;
    EXPECT_TRUE(says(r.notes.at(0), "of the scene's 100000 s"));
    for (const auto& m : r.methods) EXPECT_FALSE(m.trials.empty()) << m.method.name;
  }
}

TEST(Compare, AStopLeavesWhatThereIs) {
  const auto& c = compared().c;
  TemporaryFolder folder;
  std::atomic<bool> stop = false;
  int told = 0;
  scene::CompareOptions o{.budget_s = 60, .stop = &stop};
  o.progress = [&](double fraction, double spent, double) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    EXPECT_GE(spent, 0);
    stop = ++told == 10;
  };
  const Comparison r = scene::compare(c.scene, c.assembly, o);
  EXPECT_TRUE(r.interrupted);
  size_t trials = 0;
  for (const auto& m : r.methods) trials += m.trials.size();
  EXPECT_GE(trials, 1u);
  scene::write_comparison((folder / "out").string(), c.scene, r);
  EXPECT_TRUE(nlohmann::json::parse(read_bytes(folder / "out" / "compare.json")).at("interrupted"));
}

TEST(Compare, TheFilesHaveTheDocumentedFields) {
  TemporaryFolder folder;
  const auto& c = compared();
  scene::write_comparison((folder / "out").string(), c.c.scene, c.result);
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "compare.json"));
  for (const char* key : {"title", "duration_s", "scene_duration_s", "first_step_s", "error",
                          "budget_s", "wall_s", "cpu_s", "interrupted", "lyapunov", "trajectory",
                          "runs", "cut_short", "skipped", "advice", "notes", "provenance"})
    EXPECT_TRUE(j.contains(key)) << key;
  for (const char* key : {"exponent_per_s", "time_s", "chaotic", "observed_s", "growth"})
    EXPECT_TRUE(j["lyapunov"].contains(key)) << key;
  for (const char* key : {"time_s", "growth_limit", "reference", "reference_error"})
    EXPECT_TRUE(j["trajectory"].contains(key)) << key;
  size_t trials = 0;
  for (const auto& m : c.result.methods) trials += m.trials.size();
  ASSERT_EQ(j["runs"].size(), trials);
  const std::string documented = read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "docs/compare.md");
  for (const auto& [key, value] : j["runs"][0].items()) EXPECT_TRUE(says(documented, "`" + key));
  for (const auto& [key, value] : j.items()) EXPECT_TRUE(says(documented, "`" + key));
  EXPECT_EQ(read_bytes(folder / "out" / "compare.txt"),
            scene::comparison_table(c.c.scene, c.result));
  const std::string svg = read_bytes(folder / "out" / "work_precision.svg");
  EXPECT_TRUE(says(svg, "</svg>"));
  for (const auto& m : c.result.methods) EXPECT_TRUE(says(svg, ">" + m.method.name));
}

TEST(Compare, WithDampingTheTrajectoryIsWhatCounts) {
  TemporaryFolder folder;
  const Case c = regular_pendulum(folder, 0.1);
  const Comparison r =
      scene::compare(c.scene, c.assembly, {.methods = {"gauss8", "rk4"}, .budget_s = 2});
  EXPECT_FALSE(r.by_energy);
  EXPECT_TRUE(says(scene::advise(r, 1e-9).sentence, "for a trajectory error of 1e-09 at 5 s: "));
}

TEST(Compare, BadWishesAreRefused) {
  const auto& c = compared().c;
  const auto why = [&](scene::CompareOptions o) {
    return refusal([&] { scene::compare(c.scene, c.assembly, o); });
  };
  EXPECT_TRUE(says(why({.methods = {"gauss17"}}), "unknown method 'gauss17'"));
  EXPECT_EQ(why({.budget_s = 0}), "budget is 0, expected more than 0 s");
  EXPECT_EQ(why({.duration = -1}), "duration is -1, expected more than 0 s");
}

// --- the advice, on numbers made up --------------------------------------------------------------

scene::Trial made_up(const std::string& method, double step, double rtol, double cpu,
                     double error) {
  scene::Trial t;
  t.setting = {method, step, rtol};
  t.report.cpu_s = cpu;
  t.report.energy.max_rel_error = error;
  return t;
}

/// A method of order 4 whose work is 1/step seconds; a rival whose error is its tolerance.
Comparison power_laws(double rival_cost) {
  Comparison c;
  c.duration_s = 100;
  c.methods = {{integrators::declaration_of("gauss4"), {}, false, false},
               {integrators::declaration_of("cvode_adams"), {}, false, false}};
  for (const double h : {0.8, 0.4, 0.2, 0.1, 0.05})
    c.methods[0].trials.push_back(made_up("gauss4", h, 0, 1 / h, std::pow(h, 4)));
  for (const double rtol : {1e-2, 1e-3, 1e-4, 1e-5})
    c.methods[1].trials.push_back(made_up("cvode_adams", 1, rtol, rival_cost, rtol));
  return c;
}

TEST(Advice, TheObservedOrderIsThePowerOfTheStep) {
  const auto trial = [](double step, double rtol, std::optional<double> error) {
    scene::Trial t = made_up("gauss4", step, rtol, 1, 0);
    t.trajectory_error = error;
    return t;
  };
  const auto order =
      scene::observed_order(trial(0.3, 0, std::pow(0.3, 4)), trial(0.2, 0, std::pow(0.2, 4)));
  ASSERT_TRUE(order.has_value());
  EXPECT_NEAR(*order, 4, 1e-13);
  EXPECT_FALSE(
      scene::observed_order(trial(0.3, 1e-3, 1e-3), trial(0.2, 1e-4, 1e-4)));  // tolerances
  EXPECT_FALSE(scene::observed_order(trial(0.3, 0, 1e-3), trial(0.2, 0, {})));
  EXPECT_FALSE(scene::observed_order(trial(0.3, 0, 1e-3), trial(0.2, 0, 0.0)));
  scene::Trial failed = trial(0.3, 0, 1e-3);
  failed.failure = "did not converge";
  EXPECT_FALSE(scene::observed_order(failed, trial(0.2, 0, 1e-4)));
}

TEST(Advice, AnOrderBelowTheDeclaredOneIsTold) {
  Comparison c;
  const auto told = [&](int shown, double error) {
    scene::MethodTrials m;
    m.method.order = 3;
    for (double h = 0.1; h > 0.01; h /= 2) {
      m.trials.push_back(made_up("gauss4", h, 0, 1, 0));
      m.trials.back().trajectory_error = error * std::pow(h, shown);
    }
    return c.order_below_declared(m);
  };
  EXPECT_FALSE(told(2, 0.1)) << "without a reference";
  c.reference.emplace().error = 1e-12;
  ASSERT_TRUE(told(2, 0.1));
  EXPECT_NEAR(*told(2, 0.1), 2, 1e-12);
  EXPECT_FALSE(told(3, 0.1)) << "control";
  EXPECT_FALSE(told(2, 1e9)) << "no convergence yet";
  EXPECT_FALSE(told(2, 1e-9)) << "rounding";
}

TEST(Advice, AnOrderThatStillRisesIsNotTold) {
  Comparison c;
  c.reference.emplace().error = 1e-14;
  const auto told = [&](int declared, std::vector<double> errors) {
    scene::MethodTrials m;
    m.method.order = declared;
    double h = 0.04;
    for (const double error : errors) {
      m.trials.push_back(made_up("gauss4", h /= 2, 0, 1, 0));
      m.trials.back().trajectory_error = error;
    }
    return c.order_below_declared(m);
  };
  // Of order 2, with a short budget: 1.4, 1.6, 2.0, 2.0.
  const std::vector<double> second = {1.7, 0.63, 0.203, 0.0519, 0.01302};
  EXPECT_NEAR(told(4, second).value_or(0), 2, 0.01);
  EXPECT_FALSE(told(2, second)) << "control: the order it has";
  EXPECT_FALSE(told(4, {1.7, 0.63, 0.203, 0.0519})) << "one row of order 2 says little";
  // gauss8 on a double pendulum: 7.0, 7.2; and 7.2, 7.2 by chance before 7.8.
  EXPECT_FALSE(told(8, {4.1e-7, 3.2e-9, 2.2e-11}));
  EXPECT_FALSE(told(8, {1e-3, 6.8e-6, 4.57e-8, 2.05e-10}));
  EXPECT_TRUE(told(8, {1e-3, 6.8e-6, 4.6e-8, 3.13e-10})) << "control: 7.2 that stays";
}

TEST(Advice, ReadsStepsOffBetweenTrials) {
  const Comparison c = power_laws(50);
  const auto a = scene::advise(c, 2e-4);
  ASSERT_EQ(a.reaching.size(), 2u);
  const double step = std::pow(2e-4, 0.25);  // a power law is a line: interpolation is exact
  EXPECT_NEAR(a.reaching[0].step_s, step, 1e-12);
  EXPECT_NEAR(a.reaching[0].cpu_s, 1 / step, 1e-10);
  EXPECT_NEAR(a.reaching[1].rtol, 2e-4, 1e-15);
  EXPECT_EQ(a.sentence,
            "for an energy error of 0.0002 over 100 s: gauss4, step 0.11 s, 8.4 s of CPU; "
            "cvode_adams (rtol 0.0002) needs 5.9 x that");
}

TEST(Advice, SaysWhenARivalIsFasterOrDrifts) {
  Comparison c = power_laws(1);
  for (auto& t : c.methods[1].trials) {
    t.report.energy.drift_is_significant = true;
    t.report.energy.growth_exponent = 1;
  }
  EXPECT_TRUE(says(scene::advise(c, 2e-4).sentence, "needs 0.12 x that and drifts"));
}

TEST(Advice, SaysWhenNobodyGetsThere) {
  const Comparison c = power_laws(50);
  EXPECT_EQ(scene::advise(c, 1e-9).sentence,
            "no method of ours reached an energy error of 1e-09 over 100 s, the smallest error was "
            "6.3e-06 (gauss4, step 0.05 s, 20 s of CPU); no reference solver reached it, the "
            "smallest error "
            "was 1e-05 (cvode_adams, rtol 1e-05, 50 s of CPU)");
  EXPECT_TRUE(scene::advise(c, 1e-9).reaching.empty());
}

TEST(Advice, FailedTrialsCountForNothing) {
  Comparison c = power_laws(50);
  auto wrong = made_up("gauss4", 5, 0, 0.01, 1e-12);  // cheap and exact, had it not failed
  wrong.failure = "broken off";
  c.methods[0].trials.insert(c.methods[0].trials.begin(), wrong);
  EXPECT_EQ(scene::advise(c, 2e-4).sentence, scene::advise(power_laws(50), 2e-4).sentence);
  c.methods[0]
      .trials.front()
      .failure.clear();  // negative control: now it counts, if its neighbour agreed
  c.methods[0].trials[1].report.energy.max_rel_error = 1e-12;
  EXPECT_TRUE(says(scene::advise(c, 2e-4).sentence, "gauss4, step 5 s or coarser"));
}

TEST(Advice, AMethodThatKeepsAnyEnergyIsNotJudgedByIt) {
  Comparison c = power_laws(50);
  c.methods.push_back(c.methods[0]);
  auto& exact = c.methods.back();
  exact.method.name = "exact";
  exact.method.energy_exact = integrators::Claim::holds;
  exact.trials = {made_up("exact", 10, 0, 1e-3, 1e-16)};
  EXPECT_EQ(scene::advise(c, 2e-4).sentence, scene::advise(power_laws(50), 2e-4).sentence);
  EXPECT_TRUE(says(scene::comparison_table({}, c), "judge them by the trajectory): exact"));
  c.by_energy = false;  // by the trajectory it is one like the others
  for (auto& m : c.methods)
    for (auto& t : m.trials) t.trajectory_error = t.report.energy.max_rel_error;
  EXPECT_TRUE(says(scene::advise(c, 2e-4).sentence, ": exact, step 10 s or coarser"));
}

// The energy of a coarse step may be right where its motion is wrong.
TEST(Advice, TrialsWithAWrongMotionAreLeftOut) {
  Comparison c = power_laws(50);
  c.methods.resize(1);
  for (auto& t : c.methods[0].trials) t.report.energy.max_rel_error = 1e-13;
  const auto step = [&] { return scene::advise(c, 1e-9).reaching.at(0).step_s; };
  breaks("step advised by the energy alone [s]", step(), 0.7);
  const double errors[] = {0.56, 0.11, 0.099, 1e-2, 1e-3};
  for (size_t i = 0; i < 5; ++i) c.methods[0].trials[i].trajectory_error = errors[i];
  keeps("step advised where coarser ones move wrongly [s]", step(), 0.2);
  EXPECT_FALSE(says(scene::advise(c, 1e-9).sentence, "or coarser"));
  for (auto& t : c.methods[0].trials) t.trajectory_error = 0.5;
  EXPECT_EQ(
      scene::advise(c, 1e-9).sentence,
      "no method of ours came to the end with a trajectory error of at most 0.1 for an energy "
      "error of 1e-09 over 100 s");
  c.by_energy = false;  // then the target is one of the trajectory
  EXPECT_EQ(scene::advise(c, 0.6).reaching.size(), 1u);
}

TEST(Advice, OfAComparisonFitsItsRows) {
  const auto& r = compared().result;
  const auto a = scene::advise(r, 1e-9);
  ASSERT_FALSE(a.reaching.empty());
  double worst = 0;
  for (const auto& reach : a.reaching) {
    const scene::Trial *above = nullptr, *below = nullptr;  // around the step or tolerance
    for (const auto& t : reach.of->trials) {
      if (!t.complete()) continue;
      const bool coarser = reach.rtol > 0 ? t.setting.rtol > reach.rtol * (1 + 1e-9)
                                          : t.setting.step > reach.step_s * (1 + 1e-9);
      if (coarser)
        above = &t;
      else if (!below)
        below = &t;
    }
    ASSERT_TRUE(below) << reach.of->method.name;
    EXPECT_LE(r.error_of(*below), 1e-9) << reach.of->method.name;
    worst = std::max(worst, below->trajectory_error.value_or(0));
    if (!reach.at_most) {
      ASSERT_TRUE(above) << reach.of->method.name;
      EXPECT_TRUE(r.error_of(*above) > 1e-9 ||
                  above->trajectory_error.value_or(0) > scene::most_trajectory_error)
          << reach.of->method.name;
    }
  }
  keeps("largest trajectory error of the trials advised", worst, scene::most_trajectory_error);
}

}  // namespace
}  // namespace porthos::test::compare_test
