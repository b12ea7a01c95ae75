// Scenes with loops and couplings: run, judged, resumed, and what is refused.
#include <fmt/format.h>

#include "scene/compare/auto_method.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::loops_test {
namespace {

const fs::path examples = fs::path(PORTHOS_SOURCE_DIR) / "examples";

std::string refusal(const TemporaryFolder& folder, const std::vector<Change>& changes,
                    const std::string& more = "") {
  try {
    const auto s = shipped(folder, "four_bar", 1, changes, more);
    const auto a = scene::assemble(s);
    scene::make_integrator(s, *a.model, s.step);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

TEST(Loops, ExamplesPassTheirVerdict) {
  for (const char* name : {"four_bar", "bricard", "windows"}) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, 10);
    EXPECT_EQ(s.method, "spark16");  // bricard states none: the default of loops
    const auto a = scene::assemble(s);
    const auto r = scene::run(s, a, into(folder / "out"));
    EXPECT_TRUE(r.passed());
    std::printf("  %s: gap %.1e, slip %.1e, energy %.1e\n", name, value_of(r, "constraints"),
                value_of(r, "constraint_rates"), value_of(r, "energy"));
    EXPECT_LT(value_of(r, "constraints"), 2e-15);
    EXPECT_LT(value_of(r, "constraint_rates"), 2e-14);
    EXPECT_FALSE(r.ports.empty());
    for (const auto& [account, work] : r.ports) EXPECT_LT(std::fabs(work), 1e-13) << account;
    EXPECT_TRUE(says(read_bytes(folder / "out" / "summary.json"), "\"constraints\""));
  }
}

/// Control of the checks: looser iterations leave gaps, which they show.
TEST(Loops, TheChecksCanFail) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "four_bar", 2,
                         {{"step = 0.0078125", "step = 0.0078125\niteration_tolerance = 1e-8"}});
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_GT(value_of(r, "constraints"), 1e-14);
  EXPECT_FALSE(r.passed());
}

TEST(Loops, ResumedRunsKeepBits) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "four_bar", 20);
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  std::atomic<bool> stop = false;
  auto o = into(folder / "parts");
  o.stop = &stop;
  o.progress = [&](double, double, double) { stop = true; };
  scene::RunReport r;
  int parts = 0;
  for (bool on = true; on && parts < 100; ++parts, o.resume = true) {
    stop = parts == 0;
    r = scene::run(s, a, o);
    on = r.interrupted;
  }
  EXPECT_GT(parts, 1);
  EXPECT_EQ(r.final_state.x, whole.final_state.x);
  EXPECT_EQ(r.final_state.lo, whole.final_state.lo);
  EXPECT_EQ(r.constraint_gap, whole.constraint_gap);
  EXPECT_EQ(r.ports, whole.ports);
}

TEST(Loops, PilotsOfAutoKeepConstraints) {
  TemporaryFolder folder;
  auto s = shipped(folder, "four_bar", 10, {{"\"spark16\"", "\"auto\""}});
  const auto a = scene::assemble(s);
  s = scene::with_method_chosen(s, a);
  std::printf("  %s, %g s\n", s.method.c_str(), s.step);
  EXPECT_TRUE(s.method.starts_with("spark")) << s.method;
  EXPECT_TRUE(scene::run(s, a, into(folder / "out")).passed());
}

TEST(Loops, SpringsAndDampersWorkBesideLoops) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "four_bar", 10, {},
                         "[[element]]\nname = 's'\ntype = 'spring'\njoint = 'crank'\n"
                         "stiffness = 3\n[[element]]\nname = 'd'\ntype = 'damper'\n"
                         "joint = 'rocker'\ndamping = 0.3\n");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  EXPECT_GT(r.dissipated_J, 1);
  std::printf("  %.2f J lost, energy %.1e\n", r.dissipated_J, value_of(r, "energy"));
}

/// With the reversible step control positions and rates stay closed, and a run can be continued.
/// Spark.ReversibleStepsFollowTheConstrainedMotion looks at the steps.
TEST(Loops, StepsFollowTheMotionReversibly) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "four_bar", 20,
                         {{"step = 0.0078125", "step = 0.0078125\nstep_control = \"reversible\""}});
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  std::printf("  %lld steps, fixed 2560; gap %.1e, energy %.1e\n", (long long)r.steps,
              r.constraint_gap, value_of(r, "energy"));
  EXPECT_NE(r.steps, 2560);
  EXPECT_LT(r.constraint_gap, 2e-15);
  EXPECT_LT(value_of(r, "energy"), 1e-14);
  auto o = into(folder / "parts");
  o.stop_at = 1000;
  EXPECT_TRUE(scene::run(s, scene::assemble(s), o).interrupted);
  const auto again = scene::run(s, scene::assemble(s), into(folder / "parts", true));
  EXPECT_EQ(again.final_state.x, r.final_state.x);
}

/// Steps of transformed time stay on the loop, and so does the monitor's projection, which keeps
/// the energy of a method that does not.
TEST(Loops, TransformedTimeAndProjection) {
  TemporaryFolder one, two;
  const auto timed =
      shipped(one, "four_bar", 5,
              {{"step = 0.0078125", "step = 0.0078125\nstep_control = \"time_transformed\""}});
  const auto a = scene::run(timed, scene::assemble(timed), into(one / "out"));
  const auto projected =
      shipped(two, "four_bar", 5, {{"spark16", "spark4"}}, "[monitor]\nproject = true\n");
  const auto b = scene::run(projected, scene::assemble(projected), into(two / "out"));
  for (const auto* r : {&a, &b}) {
    EXPECT_TRUE(r->passed());
    std::printf("  %lld steps; gap %.1e, energy %.1e\n", (long long)r->steps, r->constraint_gap,
                value_of(*r, "energy"));
    EXPECT_LT(r->constraint_gap, 2e-15);
    EXPECT_LT(value_of(*r, "energy"), 1e-14);
  }
  EXPECT_NE(a.steps, 640);
}

/// The lock of a geared joint by an event: the other one stands, and turns on when it is unlocked.
TEST(Loops, AnEventLocksAJointOfACoupling) {
  const std::string text = read_bytes(examples / "four_bar" / "scene.toml");
  const size_t from = text.find("[[loop]]"), to = text.find("[integrator]");
  TemporaryFolder folder;
  const auto s = shipped(folder, "four_bar", 3, {{text.substr(from, to - from), ""}},
                         "[[coupling]]\nname = 'gear'\noffset = 0.5\n"
                         "factors = { crank = 2, rocker = 1 }\n"
                         "[[event]]\ntype = 'lock'\njoint = 'crank'\nat = 1\n"
                         "[[event]]\ntype = 'unlock'\njoint = 'crank'\nat = 2\n");
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  std::printf("  gap %.1e, energy %.1e\n", r.constraint_gap, value_of(r, "energy"));
  const auto angle = [&](size_t k) {
    return r.final_state.x[k] + r.final_state.lo[k] +
           phs::two_pi_hi * double(r.final_state.turns[k]);
  };
  EXPECT_NEAR(2 * angle(0) + angle(2), 0.5, 1e-13);
}

/// A gear between crank and rocker, on the tree without its loop; also as <mimic>.
TEST(Loops, CouplingsAndMimicsHold) {
  const std::string text = read_bytes(examples / "four_bar" / "scene.toml");
  const size_t from = text.find("[[loop]]"), to = text.find("[integrator]");
  const Change no_loop{text.substr(from, to - from), ""};
  const std::string gear =
      "[[coupling]]\nname = 'gear'\noffset = 0.5\n"
      "factors = { crank = 2, rocker = 1 }\n";
  const Change mimic{"<child link=\"rocker_rod\"/>",
                     "<child link=\"rocker_rod\"/><mimic joint=\"crank\" multiplier=\"-2\" "
                     "offset=\"0.5\"/>"};
  TemporaryFolder one, two;
  const auto geared = shipped(one, "four_bar", 10, {no_loop}, gear);
  const auto mimicked =
      shipped(two, "four_bar", 10,
              {no_loop, mimic, {"base = \"fixed\"", "base = \"fixed\"\nmimic = \"couple\""}});
  const auto a = scene::run(geared, scene::assemble(geared), into(one / "out"));
  const auto b = scene::run(mimicked, scene::assemble(mimicked), into(two / "out"));
  EXPECT_TRUE(a.passed() && b.passed());
  const auto angle = [](const phs::State& s, size_t k) {
    return s.x[k] + s.lo[k] + phs::two_pi_hi * double(s.turns[k]);
  };
  EXPECT_NEAR(2 * angle(a.final_state, 0) + angle(a.final_state, 2), 0.5, 1e-13);
  EXPECT_NEAR(2 * angle(b.final_state, 0) + angle(b.final_state, 2), 0.5, 1e-13);
  EXPECT_GT(std::fabs(angle(a.final_state, 0)), 7);  // it has turned
}

/// A pin on a circle of the rocker's length about its pivot moves as on a rod, with another row.
/// Four points at equal angles give the circle to rounding.
TEST(Loops, APinOnACircleMovesAsOnARod) {
  const auto end = [](const std::string& type) {
    TemporaryFolder folder;
    const auto s = shipped(folder, "four_bar", 10,
                           {{"\"revolute\"", type},
                            {"link = \"coupler_rod\"", "link = \"world\""},
                            {"link = \"rocker_rod\", position = [1.25",
                             "link = \"coupler_rod\", "
                             "position = [1.5"}});
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    EXPECT_TRUE(r.passed()) << type;
    EXPECT_LT(value_of(r, "constraints"), 2e-15);
    return r.final_state.x;
  };
  const auto off = [](const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0;
    for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
    return most;
  };
  const auto circle = [&](const char* right) {
    return end(
        fmt::format("\"on_curve\"\nclosed = true\npoints = [[{}, 0], [0, 1.25], [-1.25, 0], "
                    "[0, -1.25]]",
                    right));
  };
  const auto rod = end("\"rod\"\nlength = 1.25");
  const double error = off(circle("1.25"), rod), control = off(circle("1.2501"), rod);
  std::printf("  on a circle against a rod: %.1e rad, 1e-12 allowed; control %.1e\n", error,
              control);
  EXPECT_LT(error, 1e-12);
  EXPECT_GT(control, 1e-5);
}

TEST(Loops, WhatCannotBeIsRefusedWithItsLine) {
  TemporaryFolder folder;
  const auto expect = [&](const std::vector<Change>& changes, const std::string& more,
                          const char* part) {
    EXPECT_TRUE(says(refusal(folder, changes, more), part));
  };
  expect({{"spark16", "gauss16"}}, "",
         "method 'gauss16' keeps no constraints, and 'four_bar' has 'pin'");
  expect({{"rocker_rod\", position", "rocker\", position"}}, "",
         "scene.toml:16:1: constraint 'pin': there is no link 'rocker', expected one of");
  expect({{"[1.25, 0, 0]", "[7, 0, 0]"}}, "",
         "scene.toml:16:1: constraint 'pin' (revolute) between 'coupler_rod' and 'rocker_rod' "
         "cannot be closed from the given start: a gap of");
  expect({{"\"revolute\"", "\"hinge\""}}, "", "type is \"hinge\", expected \"revolute\" or");
  expect({{"\"revolute\"", "\"rod\""}}, "", "lacks the key 'length', expected one, because");
  expect({{"\"revolute\"", "\"on_curve\""}}, "",
         "lacks the key 'points', expected some, because the loop is on_curve");
  expect({{"\"revolute\"", "\"on_curve\"\npoints = [[0, 0], [1, 2, 3]]"}}, "",
         "points[1] is an array, expected 2 numbers");
  expect({{"\"revolute\"", "\"on_curve\"\npoints = [[0, 0], [0, 0]]"}}, "",
         "scene.toml:16:1: constraint 'pin': point 2 lies where the one before it does");
  expect({{"\"revolute\"", "\"on_line\"\nclosed = true"}}, "",
         "closed means nothing to a loop of type on_line");
  expect({{"\"revolute\"", "\"revolute\"\npitch = 1"}}, "",
         "pitch means nothing to a loop of type revolute");
  expect({{"step = 0.0078125", "step = 0.0078125\nstep_control = 'time_transformed'"}},
         "[[motion]]\nname = 'turn'\njoint = 'crank'\nsteady = { from = 1, rate = 3 }\n",
         "step_control = \"time_transformed\" cannot be combined with the motion 'turn'");
  expect({}, "[[coupling]]\nname = 'gear'\nfactors = { crank = 1, elbow = 2 }\n",
         "constraint 'gear': the mechanism has no coordinate 'elbow', expected one of");
  expect({}, "[[coupling]]\nname = 'pin'\nfactors = { crank = 1 }\n",
         "name is 'pin', as another constraint is called");
  expect({}, "", "");
}

TEST(Loops, AnEndAtASingularPositionIsTold) {
  TemporaryFolder folder;
  const auto coupling = [](int i) {
    return Change{fmt::format("[[coupling]]\nname = \"parallel{}\"\nfactors = {{ upright{} = 1, "
                              "upright{} = -1 }}\n",
                              i, i, i + 1),
                  ""};
  };
  const auto s = shipped(folder, "windows", 2, {coupling(0), coupling(1)});
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_EQ(r.outcome, integrators::Outcome::singular);
  EXPECT_NEAR(r.simulated_s, 0.71, 0.05);
  EXPECT_TRUE(says(r.trouble, "the loops lose rank at a singular position"));
  EXPECT_TRUE(says(r.trouble, "smallest pivot"));
  EXPECT_FALSE(r.passed());
}

TEST(Loops, TheStartIsMovedWithANote) {
  TemporaryFolder folder;
  const auto a = scene::assemble(shipped(folder, "four_bar", 1));
  ASSERT_FALSE(a.notes.empty());
  EXPECT_TRUE(says(
      a.notes.back().text,
      "the start was moved onto the constraints: the largest gap was 2.31 m or rad, of 'pin'"));
  EXPECT_FALSE(says(a.notes.back().text, "is stated"));
}

/// A joint that states a position alone leaves its rate to the loops. Stated rates that contradict
/// them are refused.
TEST(Loops, AStatedRateIsKept) {
  const auto rates = [](const std::string& stated) {
    TemporaryFolder folder;
    write_bytes(folder / "arm.urdf", arm_urdf());
    write_bytes(folder / "scene.toml",
                "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[initial]\n" + stated +
                    "[[coupling]]\nname = 'mesh'\nfactors = { shoulder = 1, elbow = 2.5 }\n"
                    "[integrator]\nmethod = 'spark8'\nstep = 0.01\n[run]\nduration = 1\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    const auto a = scene::assemble(s);
    return a.mechanical->rates(a.initial.x, a.initial.turns);
  };
  for (const std::string& more :
       {std::string(), std::string("joints.elbow = { position = 0 }\n")}) {
    const auto v = rates("joints.shoulder = { velocity = 2.0 }\n" + more);
    EXPECT_NEAR(v[0], 2, 1e-14) << more;
    EXPECT_NEAR(v[1], -0.8, 1e-14) << more;
  }
  const auto both = [&](double elbow) {
    return rates(
        fmt::format("joints.shoulder = {{ velocity = 2.0 }}\njoints.elbow = {{ position = "
                    "0, velocity = {} }}\n",
                    elbow));
  };
  EXPECT_NEAR(both(-0.8004)[0], 2, 0.002) << "rounded by the user";
  try {
    (void)both(0.8);
    ADD_FAILURE() << "not refused";
  } catch (const InvalidArgument& e) {
    EXPECT_TRUE(says(e.what(),
                     "the stated velocities contradict the constraints, which would "
                     "change 'shoulder' 2 to "))
        << e.what();
  }
}

/// From rest at 0 nothing tells the size of a slide until its momentum has moved: Atwood's machine.
TEST(Loops, SlidesAtRestAtZeroTakeTheirFirstStep) {
  TemporaryFolder folder;
  std::string urdf = "<robot name='two'><link name='f'/>";
  for (const auto& [name, mass] : {std::pair{"a", "1.6"}, {"b", "1"}})
    urdf += fmt::format(
        "<link name='{0}'><inertial><mass value='{1}'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
        "ixz='0' iyz='0'/></inertial></link><joint name='j{0}' type='prismatic'><parent link='f'/>"
        "<child link='{0}'/><axis xyz='0 0 1'/><limit lower='-9' upper='9' effort='1' "
        "velocity='1'/></joint>",
        name, mass);
  write_bytes(folder / "two.urdf", urdf + "</robot>");
  for (const std::string method : {"spark2", "spark16", "pgauss8"}) {
    write_bytes(
        folder / "scene.toml",
        "[model]\nurdf = 'two.urdf'\nbase = 'fixed'\n[environment]\ngravity = 'uniform'\n"
        "vector = [0, 0, -9.81]\n[[coupling]]\nname = 'rope'\nfactors = { ja = 1, jb = 1 }\n"
        "[integrator]\nmethod = '" +
            method + "'\nstep = 0.01\n[run]\nduration = 0.5\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    const auto r = scene::run_in_memory(s, scene::assemble(s), {});
    ASSERT_EQ(r.outcome, integrators::Outcome::ok) << method;
    EXPECT_NEAR(r.final_state.x[0], -0.5 * 9.81 * (0.6 / 2.6) * 0.25, 1e-14) << method;
  }
}

/// Two couplings of two joints hold both. Control: one of them.
TEST(Loops, ConstraintsThatLeaveNoFreedomAreTold) {
  const auto told = [](const std::string& couplings) {
    TemporaryFolder folder;
    write_bytes(folder / "arm.urdf", arm_urdf());
    write_bytes(folder / "scene.toml", "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n" + couplings +
                                           "[integrator]\nmethod = 'spark8'\nstep = 0.01\n"
                                           "[run]\nduration = 1\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    return scene::start_of(s, scene::assemble(s)).note;
  };
  const std::string one = "[[coupling]]\nname = 'one'\nfactors = { shoulder = 1, elbow = 1 }\n",
                    two = "[[coupling]]\nname = 'two'\nfactors = { shoulder = 2, elbow = 1 }\n";
  EXPECT_EQ(told(one + two),
            "the constraints leave no degree of freedom, 2 independent rows for 2 rates: nothing "
            "can move");
  EXPECT_EQ(told(one), "");
}

/// A crank and a guess of the rocker that no pin closes: both move, and the note says so.
TEST(Loops, AStatedStartThatMovesIsNamed) {
  TemporaryFolder folder;
  const std::string crank = "joints.crank = { position = 1.0, velocity = 3.0 }";
  const auto a = scene::assemble(
      shipped(folder, "four_bar", 1, {{crank, crank + "\njoints.rocker = { position = -2.2 }"}}));
  ASSERT_FALSE(a.notes.empty());
  std::printf("  %s\n", a.notes.back().text.c_str());
  EXPECT_TRUE(
      says(a.notes.back().text, "; of the joints whose start is stated, also 'crank' from 1 to "));
  EXPECT_TRUE(says(a.notes.back().text, "'rocker' from -2.2 to "));
}

}  // namespace
}  // namespace porthos::test::loops_test
