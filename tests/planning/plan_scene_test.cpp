// porthos plan from the scene to the replay: examples, what it writes, what it refuses.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "scene/assemble/outputs.h"
#include "scene/plan/plan.h"
#include "scene/run/columns.h"
#include "scene/session/memory_run.h"
#include "scene/session/run.h"
#include "tests/places.h"
#include "tests/support/bounds.h"

namespace porthos::planning::plan_scene_test {
namespace {

namespace fs = std::filesystem;
using scene::read_scene;
using scene::Scene;

const std::string examples = PORTHOS_SOURCE_DIR "/examples/";

class PlanScene : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("porthos_plan_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// The cart and pendulum of the examples with another text in place of one.
  Scene changed(const std::string& what, const std::string& to) {
    fs::copy(examples + "cart_pole_plan/cart_pole.urdf", folder_ / "cart_pole.urdf",
             fs::copy_options::overwrite_existing);
    std::ifstream file(examples + "cart_pole_plan/scene.toml");
    std::string text{std::istreambuf_iterator<char>(file), {}};
    const auto at = text.find(what);
    EXPECT_NE(at, text.npos) << what;
    text.replace(at, what.size(), to);
    std::ofstream(folder_ / "scene.toml") << text;
    return read_scene((folder_ / "scene.toml").string());
  }
  std::string refusal(const std::string& what, const std::string& to) {
    try {
      const Scene s = changed(what, to);
      const auto a = scene::assemble(s);
      (void)scene::plan_problem(s, a, scene::read_plan(s));
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  }
  fs::path folder_;
};

TEST_F(PlanScene, WritesASceneThatReplays) {
  const Scene s = read_scene(examples + "cart_pole_plan/scene.toml");
  const auto r = scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  EXPECT_EQ(r.plan.status, Plan::Status::optimal);
  std::printf("  J = %.9f, replay off by %.1e (bound 1e-12)\n", r.plan.cost, r.replay);
  EXPECT_LT(r.replay, 1e-12);
  EXPECT_NEAR(r.plan.cost, 57.944780307, 1e-8);

  std::ifstream file(folder_ / "out/plan.json");
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["status"], "optimal");
  EXPECT_EQ(json["goals"].size(), 4u);
  EXPECT_EQ(json["goals"][0]["name"], "hinge.position");
  EXPECT_DOUBLE_EQ(json["cost"], r.plan.cost);
  for (const std::string name : {"motion.csv", "costates.csv"}) {
    std::ifstream table(folder_ / "out" / name);
    int lines = 0;
    for (std::string line; std::getline(table, line);) ++lines;
    EXPECT_EQ(lines, 52) << name;  // names and 51 ends of steps
  }

  std::ifstream picture(folder_ / "out/plan.svg");
  const std::string svg{std::istreambuf_iterator<char>(picture), {}};
  for (const char* part : {"angle [rad]", "place [m]", "force [N]", ">hinge<", ">slide<"})
    EXPECT_NE(svg.find(part), svg.npos) << part;

  const Scene replay = read_scene(r.replay_path);
  scene::RunOptions options;
  options.out = (folder_ / "run").string();
  options.check_symmetry = true;
  const auto run = scene::run(replay, scene::assemble(replay), options);
  EXPECT_EQ(run.verdict(), scene::Verdict::pass);
  EXPECT_DOUBLE_EQ(run.energy.max_rel_error, r.replay_energy);
}

/// A second costs as much as 40 N² s: the end time is found, and the replay ends there.
TEST_F(PlanScene, EndTimeThatIsFree) {
  const std::string rest = "\n[verify]\nbalance = 1e-12\n\n[plan]\n";
  const Scene s = changed("duration = 2.0\n" + rest,
                          "duration = 2.0\nrecord_every = 0.08\n" + rest + "time_weight = 40\n");
  const auto r = scene::plan(s, scene::assemble(s), (folder_ / "free").string());
  ASSERT_EQ(r.plan.status, Plan::Status::optimal);
  std::printf("  T = %.10f s, J = %.8f\n", r.duration, r.plan.cost);
  test::keeps("slope of the cost by the duration, of its weight",
              std::fabs(r.plan.duration_slope / 40 + 1), 1e-9);
  test::breaks("control: off the duration of the scene [s]", std::fabs(r.duration - s.duration),
               0.1);
  test::keeps("the replay's end, relative", r.replay, 1e-12);
  const Scene replay = read_scene(r.replay_path);
  EXPECT_DOUBLE_EQ(replay.duration, r.duration);
  EXPECT_DOUBLE_EQ(replay.duration / replay.step, 50);
  for (const double by : {0.97, 1.03}) {  // plans of durations beside it, from its torques
    auto made = scene::plan_problem(s, scene::assemble(s), scene::read_plan(s));
    made.problem.duration = by * r.duration;
    const Plan beside = solve(made.problem, r.plan.motion);
    EXPECT_GT(beside.cost + 40 * made.problem.duration, r.plan.cost * (1 + 1e-6)) << by;
  }
}

TEST_F(PlanScene, EndTimesThatAreRefused) {
  const auto says = [&](const std::string& keys, const std::string& words) {
    const auto why = refusal("[plan]\n", "[plan]\n" + keys);
    EXPECT_NE(why.find(words), why.npos) << why;
  };
  says("longest = 3\n", "longest is given without time_weight");
  says("time_weight = 0\n", "time_weight is 0");
  says("time_weight = 1\nlongest = 1\n",
       "longest is 1 s, but the search begins at [run] duration = 2 s");
  const auto why = refusal("[plan]\n",
                           "[[element]]\ntype = 'force'\njoint = 'slide'\nconstant = 1\n"
                           "[plan]\ntime_weight = 1\n");
  EXPECT_NE(why.find("expected no element of type \"force\""), why.npos) << why;
}

/// An override of the command line is in the replay too.
TEST_F(PlanScene, ReplayHasTheMethodAndTheStepOfThePlan) {
  Scene s = read_scene(examples + "cart_pole_plan/scene.toml");
  scene::apply(s, {.method = "gauss6", .step = 0.05});
  const auto r = scene::plan(s, scene::assemble(s), folder_.string());
  ASSERT_EQ(r.plan.status, Plan::Status::optimal);
  EXPECT_LT(r.replay, 1e-12);
  const Scene replay = read_scene(r.replay_path);
  EXPECT_EQ(replay.method, "gauss6");
  EXPECT_EQ(replay.step, 0.05);
}

/// Springs, dampers and limits act in the plan as in the run; a limit of the force is kept.
TEST_F(PlanScene, ElementsAndLimits) {
  Scene s = changed("[plan]\n",
                    "[[element]]\ntype = \"damper\"\njoint = \"hinge\"\ndamping = 0.02\n"
                    "[[element]]\ntype = \"spring\"\njoint = \"slide\"\nstiffness = 1.5\n[plan]\n");
  const auto r = scene::plan(s, scene::assemble(s), (folder_ / "a").string());
  EXPECT_EQ(r.plan.status, Plan::Status::optimal);
  EXPECT_LT(r.replay, 1e-12);
  EXPECT_GT(std::fabs(r.plan.cost - 57.944780307), 1);
  s = changed(
      "slide = { position = 1.0, guess = -7.0 }",
      "slide = { position = 1.0, guess = -7.0, torque_limit = 11, upper = 1.1, lower = -0.4 }");
  const auto limited = scene::plan(s, scene::assemble(s), (folder_ / "b").string());
  EXPECT_EQ(limited.plan.status, Plan::Status::optimal);
  EXPECT_LT(limited.replay, 1e-9);
  double most = 0;
  for (const double u : limited.plan.motion.u) most = std::max(most, std::fabs(u));
  std::printf("  largest force %.9f N (limit 11), J = %.4f, %d limits reached, %d iterations\n",
              most, limited.plan.cost, limited.plan.active_limits, limited.plan.iterations);
  std::printf("  replay off by %.1e (bound 1e-9)\n", limited.replay);
  EXPECT_LE(most, 11);
}

/// The machines that laws of the energy swing up (examples/furuta_swing_up, acrobot_swing_up), with
/// less torque and in less time. From its guess the acrobot may find one optimum or another.
TEST_F(PlanScene, SwingUpsBesideThoseOfLaws) {
  struct Law {
    double time, torque, squared;
  };
  for (const auto& [name, law, replays] :
       {std::tuple{"furuta_plan", Law{5.456, 0.069, 2.8e-3}, 1e-12},
        {"acrobot_plan", Law{8.79, 56, 2620}, 1e-6}}) {
    const Scene s = read_scene(examples + name + "/scene.toml");
    const auto r = scene::plan(s, scene::assemble(s), (folder_ / name).string());
    EXPECT_EQ(r.plan.status, Plan::Status::optimal) << name;
    double most = 0;
    for (const double u : r.plan.motion.u) most = std::max(most, std::fabs(u));
    std::printf(
        "  %s: %g s (law %g), largest torque %.4g N m (law %g), integral of its square %.6g "
        "(law %g); replay off by %.1e\n",
        name, s.duration, law.time, most, law.torque, r.plan.cost, law.squared, r.replay);
    EXPECT_LT(s.duration, law.time / 2);
    EXPECT_LT(most, law.torque / 1.5);
    EXPECT_LT(r.plan.cost, law.squared / 10);
    EXPECT_LT(r.replay, replays);
  }
}

/// Steps are halved until the cost settles; the replay has the last ones. Control: a cost that does
/// not settle is noted.
TEST_F(PlanScene, MeshesAreRefined) {
  const auto planned = [&](const std::string& error) {
    Scene s = changed("[plan]\n", "[plan]\nmesh_error = " + error + "\n");
    s.method = "gauss4";
    return scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  };
  const auto r = planned("1e-6");
  ASSERT_GT(r.meshes.size(), 2u);
  std::printf("  %zu meshes, the last of %g s: cost %.9f, off by %.1e (bound 1e-6); replay %.1e\n",
              r.meshes.size(), r.step, r.plan.cost, std::fabs(r.plan.cost / 57.944780307 - 1),
              r.replay);
  EXPECT_EQ(r.step, r.meshes.back().step);
  EXPECT_LT(r.step, r.meshes.front().step);
  EXPECT_NEAR(r.plan.cost, 57.944780307, 1e-6 * 57.94);
  EXPECT_GT(std::fabs(r.meshes.front().cost - 57.944780307), 1e-6 * 57.94);
  EXPECT_LT(r.replay, 1e-9);
  EXPECT_TRUE(r.notes.empty());
  const auto never = planned("1e-14");
  ASSERT_EQ(never.notes.size(), 1u);
  EXPECT_NE(never.notes[0].find("the cost has not settled to mesh_error = 1e-14"),
            std::string::npos)
      << never.notes[0];
}

/// A joint's rate keeps its limit, and the replay ends where planned. Control: without it the slide
/// is faster.
TEST_F(PlanScene, LimitsOfRates) {
  const auto planned = [&](const std::string& slide) {
    const Scene s = changed("slide = { position = 1.0, guess = -7.0 }", slide);
    return scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  };
  const auto fastest = [](const scene::PlanReport& r) {
    double most = 0;
    for (size_t k = 1; k < r.plan.motion.x.size() / 4; ++k)
      most = std::max(most, std::fabs(r.plan.motion.x[4 * k] - r.plan.motion.x[4 * k - 4]) / 0.04);
    return most;
  };
  const auto free = planned("slide = { position = 1.0, guess = -7.0 }"),
             limited = planned("slide = { position = 1.0, guess = -7.0, rate_limit = 1.4 }");
  std::printf("  mean rate of a step up to %.6f m/s (limit 1.4), free %.6f; %d limits reached\n",
              fastest(limited), fastest(free), limited.plan.active_limits);
  EXPECT_EQ(limited.plan.status, Plan::Status::optimal);
  EXPECT_LT(fastest(limited), 1.4 * (1 + 1e-2));
  EXPECT_GT(fastest(free), 1.9);
  EXPECT_LT(limited.replay, 1e-9);
}

/// The tip of the pendulum passes a post at a distance, and the replay's outputs say the same.
/// Control: without the limit it comes nearer.
TEST_F(PlanScene, LimitsOfDistances) {
  const std::string gap =
      "[[output]]\nname = \"gap\"\nquantity = \"distance\"\nlink = \"pole\"\nat = [0, 0, -0.5]\n"
      "relative_at = [0.3, 0, -0.12]\nrelative_radius = 0.05\n"
      "[[output]]\nname = \"tip\"\nquantity = \"position\"\nlink = \"pole\"\nat = [0, 0, -0.5]\n";
  const auto least = [&](const std::string& limits, int component) {
    const Scene s = changed("[plan]\ninputs = \"polynomial\"\n", gap + "[plan]\n" + limits);
    const auto out = (folder_ / "out").string();
    const auto r = scene::plan(s, scene::assemble(s), out);
    EXPECT_EQ(r.plan.status, Plan::Status::optimal);
    EXPECT_LT(r.replay, 1e-9);
    const Scene replay = read_scene(r.replay_path);
    scene::MemoryOptions o;
    double worst = HUGE_VAL;
    const auto a = scene::assemble(replay);
    const auto columns = scene::columns_of(a.model->description(), scene::RecordLayout(replay, a));
    const auto at = std::ranges::find_if(columns, [&](const auto& c) {
      return c.name == (component < 0 ? "output/gap" : "output/tip");
    });
    o.record = [&](std::span<const double> row) {
      worst = std::min(worst, row[at->first + size_t(std::max(component, 0))]);
    };
    (void)scene::run_in_memory(replay, a, o);
    std::printf("  %-40s down to %.5f m, J = %.4f, %d limits reached, %d iterations\n",
                limits.c_str(), worst, r.plan.cost, r.plan.active_limits, r.plan.iterations);
    return worst;
  };
  EXPECT_LT(least("", -1), 0.09);
  EXPECT_GT(least("outputs.gap = { lower = 0.15 }\n", -1), 0.15 - 1e-3);
  EXPECT_LT(least("", 0), -0.085);
  EXPECT_GT(least("outputs.\"tip.x\" = { lower = -0.06, upper = 2 }\n", 0), -0.06 - 1e-3);
}

/// Numbers that are limited on the way are those of the outputs, with the centre of mass of a free
/// base under way, and their slopes those of differences.
TEST_F(PlanScene, NumbersOnTheWayAreThoseOfTheOutputs) {
  fs::copy(examples + "ets_vii/ets_vii.urdf", folder_ / "ets_vii.urdf");
  std::ofstream(folder_ / "scene.toml")
      << "[model]\nurdf = \"ets_vii.urdf\"\nbase = \"free\"\nunphysical_inertia = \"accept\"\n"
         "[initial]\nbase.linear_velocity = [0.1, -0.2, 0.3]\njoints.joint_2.position = 0.7\n"
         "joints.joint_4.velocity = 0.2\n[integrator]\nmethod = \"gauss8\"\nstep = 0.1\n"
         "[run]\nduration = 1\n"
         "[[output]]\nname = \"tip\"\nquantity = \"position\"\nlink = \"link_6\"\nat = [0, 0.1, "
         "0.2]\n"
         "[[output]]\nname = \"own\"\nquantity = \"position\"\nlink = \"link_6\"\n"
         "relative_to = \"link_1\"\n"
         "[[output]]\nname = \"gap\"\nquantity = \"distance\"\nlink = \"link_5\"\nradius = 0.1\n"
         "relative_at = [1, 2, 3]\nrelative_radius = 0.2\n";
  const Scene s = read_scene((folder_ / "scene.toml").string());
  const auto a = scene::assemble(s);
  ASSERT_TRUE(a.centre);
  std::vector<scene::PlannedOutput> planned;
  for (const char* name : {"tip.x", "tip.z", "own.y", "gap"})
    planned.push_back({.name = name, .where = "", .upper = 1e3});
  Problem problem;
  problem.start = a.initial.x;
  std::vector<std::string> goals;
  scene::add_outputs(s, a, planned, problem, goals);
  EXPECT_TRUE(goals.empty());
  const auto& limits = problem.limits.path;
  phs::State state = a.initial;
  for (size_t k = 7; k < 13; ++k) state.x[k] += 0.1 * double(k);
  const double t = 2.5;
  scene::Outputs outputs(s, a);
  const auto all = outputs.at(t, state, {});
  const double expected[] = {all[0], all[2], all[4], all[6]};
  for (size_t i = 0; i < limits.size(); ++i) {
    std::vector<double> g(state.x.size()), x = state.x;
    auto& number = *limits[i].number;
    const double off = std::fabs(number.value(t, x) - expected[i]);
    number.gradient(t, x, g);
    double slope = 0, largest = 0;
    for (size_t k = 0; k < x.size(); ++k) {
      const double at = x[k];
      x[k] = at + 1e-6;
      const double up = number.value(t, x);
      x[k] = at - 1e-6;
      slope = std::max(slope, std::fabs((up - number.value(t, x)) / 2e-6 - g[k]));
      largest = std::max(largest, std::fabs(g[k]));
      x[k] = at;
    }
    std::printf("  %-6s off by %.1e m (bound 1e-14), slopes up to %.2f off by %.1e (1e-8)\n",
                planned[i].name.c_str(), off, largest, slope);
    EXPECT_LT(off, 1e-14);
    EXPECT_LT(slope, 1e-8);
    EXPECT_GT(largest, 0.1);
    EXPECT_GT(std::fabs(number.value(0, x) - expected[i]), i == 2 ? -1 : 0.1) << "the centre moves";
  }
}

/// Limits of the model file do not act: beyond them is told. Control: wider ones.
TEST_F(PlanScene, LimitsOfTheModelFileAreTold) {
  const auto notes = [&](const std::string& limit) {
    (void)changed("[plan]\n", "[plan]\n");
    std::ifstream file(folder_ / "cart_pole.urdf");
    std::string urdf{std::istreambuf_iterator<char>(file), {}};
    const auto at = urdf.find("<limit");
    urdf.replace(at, urdf.find("/>", at) + 2 - at, limit);
    std::ofstream(folder_ / "cart_pole.urdf") << urdf;
    const Scene s = read_scene((folder_ / "scene.toml").string());
    return scene::plan(s, scene::assemble(s), (folder_ / "out").string()).notes;
  };
  const auto told = notes("<limit lower='-0.2' upper='0.9' effort='5' velocity='9'/>");
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(
      told[0].find(" m, beyond the 0.9 m of the model file: state upper in its [plan.joints]"),
      told[0].npos)
      << told[0];
  EXPECT_NE(told[1].find(" N, beyond the 5 N of the model file: state torque_limit"), told[1].npos)
      << told[1];
  const auto fast = notes("<limit lower='-9' upper='9' effort='500' velocity='0.5'/>");
  ASSERT_EQ(fast.size(), 1u);
  EXPECT_NE(fast[0].find(" m/s, beyond the 0.5 m/s of the model file: state rate_limit"),
            fast[0].npos)
      << fast[0];
  EXPECT_TRUE(notes("<limit lower='-9' upper='9' effort='500' velocity='9'/>").empty());
}

/// An unstable motion of several seconds: the replay leaves it, which is told. Control: of two.
TEST_F(PlanScene, AReplayThatRunsAwayIsTold) {
  std::ofstream(folder_ / "p.urdf")
      << "<robot name='p'><link name='w'/><link name='l'><inertial><origin xyz='0 0 0.35'/><mass "
         "value='0.4'/><inertia ixx='5e-3' iyy='5e-3' izz='1e-3' ixy='0' ixz='0' "
         "iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='w'/><child "
         "link='l'/><axis xyz='0 1 0'/></joint></robot>";
  const auto planned = [&](double duration) {
    std::ofstream(folder_ / "p.toml")
        << "[model]\nurdf = \"p.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = \"uniform\"\n"
           "vector = [0, 0, -9.81]\n[initial]\njoints.j = { position = 0.25 }\n[plan]\n"
           "[plan.joints]\nj = { position = 0, torque_limit = 0.7, lower = -0.3, upper = 0.3 }\n"
           "[integrator]\nmethod = \"gauss8\"\nstep = 0.02\n[run]\nduration = "
        << duration << "\n";
    const Scene s = read_scene((folder_ / "p.toml").string());
    return scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  };
  const auto two = planned(2), nine = planned(9);
  std::printf("  replay of 2 s off by %.1e (bound 1e-3), of 9 s by %.1e\n", two.replay,
              nine.replay);
  EXPECT_EQ(nine.plan.status, Plan::Status::optimal);
  EXPECT_TRUE(two.replays());
  EXPECT_TRUE(two.notes.empty());
  EXPECT_FALSE(nine.replays());
  ASSERT_EQ(nine.notes.size(), 1u);
  EXPECT_NE(nine.notes[0].find("without feedback do not hold it"), nine.notes[0].npos);
}

TEST_F(PlanScene, Refusals) {
  const std::string joints = "hinge = { actuated = false, position = 3.141592653589793 }",
                    height =
                        "[[output]]\nname = \"high\"\nquantity = \"position\"\n"
                        "link = \"pole\"\nat = [0, 0, -0.5]\n";
  const struct {
    std::string what, to, words;
  } cases[] = {
      {"[plan]", "[ensemble]\n[other]", "unknown key 'other'"},
      {"method = \"gauss12\"", "method = \"rk4\"",
       "[plan] is given with method = \"rk4\", expected a Gauss method: gauss2 to gauss16"},
      {"method = \"gauss12\"", "method = \"gauss12\"\nstep_control = \"reversible\"",
       "[plan] is given with a step_control, expected steps of one size"},
      {"duration = 2.0", "duration = 2.03", "expected a whole number of steps"},
      {joints, "hinge = { actuated = false, weight = 1 }",
       "joints.hinge.weight is given to a joint that is not actuated, expected neither"},
      {joints, "elbow = { position = 1 }", "[plan]: the model has no joint 'elbow'"},
      {"[plan]\n", "[plan]\noutputs.gap = { lower = 1 }\n",
       "[plan.outputs] names 'gap', expected a number of an [[output]]: there is none"},
      {"[plan]\n", height + "[plan]\noutputs.\"high.z\" = { lower = 0.5 }\n",
       "'high.z' starts at -0.5 m, which is beyond its limits in [plan.outputs]"},
      {"[plan]\n", height + "[plan]\noutputs.\"high.z\" = {}\n",
       "[plan.outputs] has none of lower, upper, value and rate for 'high.z', expected one or"},
      {"[plan]\n", height + "[plan]\noutputs.\"high.z\" = { upper = 0.5, value = 0.6 }\n",
       "value is 0.6, which is beyond its limits"},
      {"[plan]\n",
       "[[output]]\nname = \"mean\"\nquantity = \"centre_of_mass\"\n[plan]\n"
       "outputs.\"mean.z\" = { upper = 1 }\n",
       "expected an output with quantity = \"distance\" or \"position\""},
      {joints, "hinge = { rate = 1, free_rate = true }", "rate is given with free_rate"},
      {joints, "hinge = { position = 2, upper = 1 }", "position is 2, which is beyond its limits"},
      {joints, "hinge = { lower = 1 }", "joint 'hinge' starts at 0, which is beyond its limits"},
      {joints, "hinge = { rate = 2, rate_limit = 1 }",
       "rate is 2, which is beyond its rate_limit 1"},
      {"slide = { position = 1.0, guess = -7.0 }", "slide = { position = 1.0, rate_limit = 0.3 }",
       "joint 'slide' needs 3.33333 s at its rate_limit 0.3 in [plan], and has 2 s"},
      {joints, joints + "\nbase = { rate_weight = 1 }", "no joint 'base'"},
      {"slide = { position = 1.0, guess = -7.0 }", "slide = { actuated = false }",
       "[plan] has no actuated joint"},
      {"[plan]\n", "[plan]\nbase = { rate_weight = 1 }\n",
       "[plan] base is given, but the base is \"fixed\", expected [model] base = \"free\""},
      {"[plan]\n", "[[element]]\ntype = \"controller\"\njoint = \"hinge\"\nstiffness = 1\n[plan]\n",
       "[plan] cannot be combined with an element of type \"controller\""},
      {"[plan]\n", "[[event]]\ntype = \"lock\"\njoint = \"hinge\"\nat = 1.0\n[plan]\n",
       "[plan] cannot be combined with [[event]], expected a scene without"},
      {"[plan]\n", "[[coupling]]\nname = \"c\"\nfactors = { slide = 1, hinge = -1 }\n[plan]\n",
       "[plan] cannot be combined with loops or couplings"},
  };
  for (const auto& c : cases) {
    const std::string said = refusal(c.what, c.to);
    EXPECT_NE(said.find(c.words), said.npos) << c.to << "\n" << said;
  }
}

/// Another solver is asked by its name where the program has it: here one that asks ours.
TEST_F(PlanScene, AnotherSolver) {
  const std::string own = "[plan]\n", other = "[plan]\nsolver = \"ipopt\"\n";
  if (!find_solver("ipopt")) {
    const std::string words = refusal(own, other);
    EXPECT_NE(words.find("solver is \"ipopt\", which this build does not have, expected "),
              words.npos)
        << words;
  }
  static int asked = 0;
  add_solver("ipopt", [](const Problem& p, const Trajectory& guess, const PlannerOptions& o) {
    ++asked;
    EXPECT_FALSE(o.approach);
    PlannerOptions ours = o;
    ours.solver.clear();
    return solve(p, guess, ours);
  });
  const Scene s = changed(own, other);
  const auto r = scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  EXPECT_EQ(r.plan.status, Plan::Status::optimal);
  EXPECT_TRUE(r.replays());
  EXPECT_EQ(asked, 1);
  const Scene without = changed(own, own);
  (void)scene::plan(without, scene::assemble(without), (folder_ / "out").string());
  EXPECT_EQ(asked, 1) << "control";
}

/// Forces of pieces need steps that end where they do.
TEST_F(PlanScene, PiecesNeedWholeSteps) {
  const auto with = [](const std::string& pieces) {
    return "[[element]]\ntype = \"force\"\njoint = \"slide\"\npieces = { " + pieces +
           " }\n[plan]\n";
  };
  EXPECT_EQ(refusal("[plan]\n", with("period = 0.08, values = [1, 2]")), "");
  const struct {
    std::string pieces, words;
  } cases[] = {
      {"period = 0.1, values = [1]", "has pieces of 0.1 s and the step is 0.04 s"},
      {"period = 0.02, values = [1]", "has pieces of 0.02 s and the step is 0.04 s"},
      {"period = 0, values = [1]", "period is 0, expected a number of seconds above 0"},
      {"period = 0.04, nodes = 9, values = [1]", "nodes is 9, expected 1 to 8"},
      {"period = 0.04, nodes = 2, values = [1]", "there are 1 values, expected a multiple of 2"},
      {"period = 0.04, nodes = 2, values = []", "there are 0 values, expected a multiple of 2"},
  };
  for (const auto& c : cases) {
    const std::string said = refusal("[plan]\n", with(c.pieces));
    EXPECT_NE(said.find(c.words), said.npos) << said;
  }
}

}  // namespace
}  // namespace porthos::planning::plan_scene_test
