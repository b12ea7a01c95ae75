// [[controller]] type = "whole_body": the biped that stands and is pushed, what is told, resumed
// runs and ensembles, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "mechanics/mechanical_model.h"
#include "planning/whole_body_law.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::whole_body_scene_test {
namespace {

scene::RunReport report_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
scene::Scene biped(const TemporaryFolder& folder, double duration,
                   const std::vector<Change>& changes = {}, const std::string& more = "") {
  return shipped(folder, "biped_stands", duration, changes, more);
}
/// How far the base is from where it began, and how far it leans.
std::pair<double, double> away(const scene::RunReport& r, const scene::Scene& s) {
  const auto start = scene::assemble(s).initial;
  double moved = 0;
  for (size_t k = 0; k < 3; ++k)
    moved = std::max(moved, std::fabs(r.final_state.x[k] - start.x[k]));
  return {moved, 2 * std::hypot(r.final_state.x[4], r.final_state.x[5], r.final_state.x[6])};
}

/// Pushed forwards and aside it comes back, the ledger closes, and the controller has a row in it.
/// Control: with weak knees it falls, or the law ends the run.
TEST(WholeBodyScene, ABipedIsPushedAndComesBack) {
  TemporaryFolder folder, other;
  const auto s = biped(folder, 5);
  const auto r = report_of(s);
  const auto [moved, leans] = away(r, s);
  fmt::print("  {:.1e} m from the start (bound 1e-3), leans by {:.1e} (1e-3); energy {:.1e}\n",
             moved, leans, value_of(r, "energy"));
  EXPECT_TRUE(r.passed());
  EXPECT_TRUE(says(scene::assemble(s).certificates.at(0).item("sampled").text, "not checked: "));
  EXPECT_LE(moved, 1e-3);
  EXPECT_LE(leans, 1e-3);
  EXPECT_FALSE(std::isnan(entry_of(r.ports, "balance")));
  const auto weak = biped(other, 5,
                          {{"rate = 500",
                            "rate = 500\nlimits.left_knee = { torque = 5 }\nlimits.right_knee = { "
                            "torque = 5 }"}});
  double fallen = HUGE_VAL;
  try {
    fallen = away(report_of(weak), weak).first;
  } catch (const phs::LawFailure&) {
  }
  EXPECT_GT(fallen, 0.1);
}

/// The least and the largest value of an output over the records.
std::pair<double, double> range_of(const scene::RunReport& r, const std::string& name) {
  for (const auto& row : r.outputs)
    if (row.name == name) return {row.least, row.largest};
  return {NAN, NAN};
}

/// A minute of pushes, recorded at every sampling instant: no torque is beyond its limit, no force
/// beyond its cone, and the second and third task, which are missed, do not disturb the first.
/// Controls: the knee comes to its limit, and the lower tasks are missed.
TEST(WholeBodyScene, NothingIsBeyondItsLimitForAMinute) {
  TemporaryFolder folder;
  std::string more, pushes, shoves;
  for (int k = 0; k < 12; ++k) {
    pushes += fmt::format("{}{}, {}", k ? ", " : "", 5 * k + 0.05, 5 * k + 0.25);
    shoves += fmt::format("{}{}, {}", k ? ", " : "", 5 * k + 2.5, 5 * k + 2.7);
  }
  for (const char* side : {"left", "right"})
    more += fmt::format(
        "[[output]]\nquantity = \"formula\"\nname = \"{0}_cone\"\nformula = \"sqrt({0}_force.x^2 "
        "+ {0}_force.y^2) - 0.6 * {0}_force.z\"\nunit = \"N\"\n",
        side);
  more +=
      "[[output]]\nquantity = \"task_error\"\nname = \"trunk_missed\"\ncontroller = "
      "\"balance\"\ntask = \"attitude\"\n";
  const auto r = report_of(biped(folder, 60,
                                 {{"record_every = 0.02", "record_every = 0.002"},
                                  {"switches = [0.05, 0.25]", "switches = [" + pushes + "]"},
                                  {"switches = [2.5, 2.7]", "switches = [" + shoves + "]"},
                                  {"rate = 500", "rate = 500\nlimits.left_knee = { torque = 24 }"}},
                                 more));
  EXPECT_TRUE(r.passed());
  const auto [knee_least, knee_most] = range_of(r, "left_knee_torque");
  const double cone = std::max(range_of(r, "left_cone").second, range_of(r, "right_cone").second);
  const double least =
      std::min(range_of(r, "left_force.z").first, range_of(r, "right_force.z").first);
  const double first = range_of(r, "com_missed").second, lower = range_of(r, "trunk_missed").second;
  fmt::print(
      "  knee {} to {} N m (bound 24 + 1e-9), beyond a cone {:.1e} N (1e-9), least force {:.1e} N "
      "(-1e-9), first task missed by {:.1e} m/s² (1e-9), second by {:.2f} rad/s²\n",
      knee_least, knee_most, cone, least, first, lower);
  EXPECT_LE(std::max(-knee_least, knee_most), 24 + 1e-9);
  EXPECT_GE(std::max(-knee_least, knee_most), 24 - 1e-6);
  EXPECT_LE(cone, 1e-9);
  EXPECT_GE(least, -1e-9);
  EXPECT_LE(first, 1e-9);
  EXPECT_GE(lower, 1);
}

/// A biped that squats and shall rise by 10 cm, 40 J, from a tank.
scene::Scene rising(const TemporaryFolder& folder, const std::string& tank) {
  return biped(folder, 2.4,
               {{"rate = 500", "rate = 500\n" + tank},
                {"bandwidth = 6",
                 "bandwidth = 6\naxes = \"xy\"\n[[controller.task]]\nname = "
                 "\"height\"\nquantity = \"centre_of_mass\"\naxes = \"z\"\nbandwidth = "
                 "6\nmoves = [[0.3, 0.7, 0, 0, 0.6], [1.2, 0.7, 0, 0, 0.7]]"}},
               "[[output]]\nquantity = \"energy\"\nname = \"level\"\nrow = "
               "\"balance.tank\"\n");
}

/// What the tank does not hold it does not rise by, and it stands on. Control: a full tank.
TEST(WholeBodyScene, ATankPaysForWhatItHolds) {
  TemporaryFolder full_folder, poor_folder;
  const auto full = report_of(rising(full_folder, "tank = { level = 60, most = 62 }"));
  const auto s = rising(poor_folder, "tank = { level = 12, most = 13 }");
  const auto poor = report_of(s);
  EXPECT_TRUE(full.passed() && poor.passed());
  const auto told = [](const scene::RunReport& r) {
    return std::ranges::any_of(r.notes, [](const std::string& note) {
      return says(note, "'balance': the tank held less than the tasks would have taken at ");
    });
  };
  EXPECT_TRUE(told(poor));
  EXPECT_FALSE(told(full));
  const double spent = -entry_of(full.storages, "balance.tank");
  const double left = range_of(poor, "level").first, leans = away(poor, s).second;
  const auto end = [](const scene::RunReport& r) { return r.final_state.x[2]; };
  fmt::print(
      "  the rise takes {:.2f} J; with 12 J it ends {:.3f} m lower (bound 0.04), {:.3f} J are left "
      "(1.3 +- 0.1: from there on the tank pays in part), leans by {:.3f} (0.1); energy {:.1e}\n",
      spent, end(full) - end(poor), left, leans, value_of(poor, "energy"));
  EXPECT_GE(spent, 30);
  EXPECT_GE(end(full) - end(poor), 0.04);
  EXPECT_NEAR(left, 1.3, 0.1);
  EXPECT_LE(leans, 0.1);
  EXPECT_LE(value_of(poor, "energy"), 1e-14);
}

TEST(WholeBodyScene, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  expect_same_bits_when_resumed(folder, biped(folder, 0.8), {13, 290, 301});
}

/// Cases run in threads have the same bits as one after another.
TEST(WholeBodyScene, AnEnsembleHasTheSameBitsWithThreads) {
  TemporaryFolder folder;
  const auto s = biped(folder, 0.3, {},
                       "[ensemble]\ncases = 3\n[ensemble.vary]\n"
                       "\"initial.base.linear_velocity[0]\" = { uniform = [-0.05, 0.05] }\n");
  expect_same_bits_with_threads(folder, s);
}

TEST(WholeBodyScene, RefusalsSayWhereAndWhat) {
  const auto refused = [](const std::vector<Change>& changes, const std::string& expected) {
    const auto text =
        refusal_of_scene([&](const TemporaryFolder& folder) { return biped(folder, 1, changes); });
    EXPECT_TRUE(text.starts_with("scene.toml:") && says(text, expected)) << text;
  };
  refused({{"[\"left_sole\", \"right_sole\"]", "[\"left_sole\", \"heel\"]"}},
          "contact 'heel' does not exist, expected one of: left_sole, right_sole");
  refused({{"[\"left_sole\", \"right_sole\"]", "[\"left_sole\", \"left_sole\"]"}},
          "names \"left_sole\" twice, expected each once");
  refused({{"friction = 0.6", "edges = 2"}}, "edges is 2, expected 3 to 64");
  refused({{"friction = 0.6", "limits.knee = { torque = 5 }"}}, "'knee'");
  refused({{"friction = 0.6", "lifted.heel = { when = [[0, 1]] }"}},
          "'heel' is lifted, expected one of contacts");
  refused({{"friction = 0.6", "lifted.left_sole = { when = [[1, 1]] }"}},
          "has a row that ends before it begins");
  refused({{"bandwidth = 6", ""}}, "lacks the key 'bandwidth'");
  refused({{"bandwidth = 6", "bandwidth = 6\nmoves = [[1, 2, 0, 0, 0.7], [2, 1, 0, 0, 0.7]]"}},
          "task 'centre_of_mass'");
  refused({{"quantity = \"posture\"", "quantity = \"pose\""}}, "quantity is \"pose\"");
  refused({{"link = \"trunk\"\nbandwidth", "link = \"world\"\nbandwidth"}},
          "there is no body 'world', expected one of trunk");
  refused({{"task = \"centre_of_mass\"", "task = \"balance\""}},
          "there is no error balance of a controller 'balance', expected centre_of_mass");
  refused({{"rate = 500", ""}}, "rate");
}

}  // namespace
}  // namespace porthos::test::whole_body_scene_test
