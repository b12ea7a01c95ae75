// [[controller]] type = "null_space", and the key tank of any controller: what the tank pays for,
// its ledger, its state in checkpoints and through events, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "energy_shaping/laws/null_space.h"
#include "integrators/catalogue.h"
#include "phs/system/state.h"
#include "scene/session/extension.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::null_space_scene_test {
namespace {

/// A turning column with three links of 0.5 m that hang from one another.
std::string arm_of_four() {
  const auto rod = [](const std::string& name) {
    return "<link name='" + name +
           "'><inertial><origin xyz='0 0 -0.25'/><mass value='2'/><inertia ixx='0.05' iyy='0.05' "
           "izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link>";
  };
  const auto hinge = [](const std::string& name, const std::string& from, const std::string& to,
                        const std::string& z, const std::string& axis) {
    return "<joint name='" + name + "' type='continuous'><parent link='" + from +
           "'/><child link='" + to + "'/><origin xyz='0 0 " + z + "'/><axis xyz='" + axis +
           "'/></joint>";
  };
  return "<robot name='arm'><link name='ground'/>" + rod("column") + rod("upper") + rod("lower") +
         rod("hand") + hinge("turn", "ground", "column", "0", "0 0 1") +
         hinge("shoulder", "column", "upper", "-0.5", "0 1 0") +
         hinge("elbow", "upper", "lower", "-0.5", "0 1 0") +
         hinge("wrist", "lower", "hand", "-0.5", "0 1 0") + "</robot>";
}
/// Where the hand's point is.
std::array<double, 3> hand_at(std::span<const double> q) {
  double out = 0, z = -0.5, a = 0;
  for (int k = 1; k < 4; ++k) {
    a += q[size_t(k)];
    out -= 0.5 * std::sin(a);
    z -= 0.5 * std::cos(a);
  }
  return {out * std::cos(q[0]), out * std::sin(q[0]), z};
}
const std::vector<double> start{0.3, 0.6, 0.8, -0.5}, posture{0.3, 1.4, 0.3, 0.2};

struct Scene {
  std::string controller = {}, more = {}, base = "fixed", method = "gauss8", urdf = arm_of_four();
  double step = 0.005, duration = 10;
};
scene::Scene read(const TemporaryFolder& folder, const Scene& s) {
  write_bytes(folder / "arm.urdf", s.urdf);
  std::string joints;
  const char* names[] = {"turn", "shoulder", "elbow", "wrist"};
  for (size_t k = 0; k < 4; ++k)
    joints += fmt::format("joints.{} = {{ position = {:.17g} }}\n", names[k], start[k]);
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"arm.urdf\"\nbase = \"{}\"\n[environment]\ngravity = "
                          "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\n{}[integrator]\nmethod "
                          "= \"{}\"\nstep = {}\n[run]\nduration = {}\nrecord_every = 0.1\n"
                          "[verify]\nbalance = 1e-12\n{}{}",
                          s.base, joints, s.method, s.step, s.duration, s.controller, s.more));
  return scene::read_scene((folder / "scene.toml").string());
}
scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
/// The hand stays where it is; the posture would bend the arm otherwise.
std::string hand(const std::string& tank, const std::string& more = "",
                 const std::string& task = "") {
  const auto at = hand_at(start);
  std::string joints;
  const char* names[] = {"turn", "shoulder", "elbow", "wrist"};
  for (size_t k = 0; k < 4; ++k)
    joints += fmt::format("joints.{} = {{ target = {}, stiffness = 8, damping = 3 }}\n", names[k],
                          posture[k]);
  return fmt::format(
      "[[controller]]\ntype = \"null_space\"\nname = \"hand\"\ntask = {{ link = \"hand\", point = "
      "[0, 0, -0.5], stiffness = 300, position = [{:.17g}, {:.17g}, {:.17g}]{} }}\n{}tank = {}\n{}",
      at[0], at[1], at[2], task, joints, tank, more);
}
double off(const scene::RunReport& r) {
  const auto at = hand_at(r.final_state.x), wanted = hand_at(start);
  return std::hypot(at[0] - wanted[0], at[1] - wanted[1], at[2] - wanted[2]);
}
const std::string full = "{ level = 2, least = 0.1, most = 4 }",
                  empty = "{ level = 0.1, least = 0.1, most = 4 }";

std::string refusal(const Scene& s) {
  TemporaryFolder folder;
  try {
    (void)scene::assemble(read(folder, s));
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST(NullSpaceScene, TheHandStaysWhileThePostureSettles) {
  TemporaryFolder folder;
  const auto s = read(folder, {hand(full)});
  const auto a = scene::assemble(s);
  const auto r = scene::run_in_memory(s, a, {});
  EXPECT_TRUE(r.passed());
  keeps("balance over what was turned over", std::fabs(r.defect_J) / r.turned_over_J, 1e-12);
  const double moved = std::fabs(r.final_state.x[3] - start[3]), level = r.final_state.x[8];
  std::printf("  the hand is off by %.1e m, the wrist moved by %.3f rad, tank %.4f J\n", off(r),
              moved, level);
  EXPECT_LE(off(r), 1e-6);
  EXPECT_GT(moved, 0.5);
  // The ledger: springs supply what the arm's potential gained, dampers lose a half of what they
  // take, the tank is a part of H.
  EXPECT_NEAR(entry_of(r.storages, "hand.tank"), level - 2, 1e-13);
  EXPECT_GT(entry_of(r.losses, "hand.damping"), 0.01);
  EXPECT_GE(entry_of(r.losses, "hand.tank.valve"), 0);
  EXPECT_TRUE(std::isnan(entry_of(r.ports, "hand.projection.elbow.torque")));  // no supply

  // The same motion as that of the loop with its H_d, of which the certificate speaks.
  energy_shaping::PotentialShaping task;
  task.name = "hand";
  const auto at = hand_at(start);
  task.poses = {{"hand", {0, 0, -0.5}, 300, {at[0], at[1], at[2]}}};
  for (const char* j : {"turn", "shoulder", "elbow", "wrist"})
    task.damping.push_back({std::string(j) + ".torque", {3}});
  task.rest = start;
  const energy_shaping::NullSpaceLoop loop(a.mechanical, task, {{8}, posture, 2, 0.1, 4, 0.5});
  auto x = a.mechanical->state(start, std::vector<double>(4, 0.0));
  x.push_back(2);
  phs::State other(loop.description(), x);
  const auto method = integrators::make_integrator("gauss8", loop, s.step);
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(method->step(other), integrators::Outcome::ok);
  double apart = 0;
  for (size_t k = 0; k < 9; ++k)
    apart = std::max(apart, std::fabs(other.x[k] - r.final_state.x[k]));
  keeps("the scene's motion from that of the loop", apart, 1e-11);
}

TEST(NullSpaceScene, AnEmptyTankLeavesAPlainSpringThatPullsAtTheHand) {
  TemporaryFolder folder;
  const auto empty_one = run_of(read(folder, {hand(empty, "fill = 0.0\n")}));
  EXPECT_TRUE(empty_one.passed());
  EXPECT_EQ(empty_one.final_state.x[8], 0.1);  // nothing filled it, and nothing was taken
  breaks("the hand is off, without energy for the projection [m]", off(empty_one), 5e-3);
  // Its dampers fill it, and then it serves.
  TemporaryFolder other;
  const auto filled = run_of(read(other, {.controller = hand(empty), .duration = 40}));
  EXPECT_GT(filled.final_state.x[8], 0.1);
  breaks("filled by the dampers: how much nearer the hand is", off(empty_one) / off(filled), 2);
}

TEST(NullSpaceScene, AResumedAndAnExtendedRunHaveTheSameBits) {
  for (const std::string rate : {"", "rate = 100\n"}) {
    TemporaryFolder folder;
    const auto s = read(folder, {.controller = hand(full, rate), .duration = 4});
    const auto a = scene::assemble(s);
    const auto whole = scene::run(s, a, into(folder / "whole"));
    EXPECT_TRUE(whole.passed());
    auto half = into(folder / "half");
    for (const std::int64_t at : {203, 555}) {
      half.stop_at = at;
      EXPECT_TRUE(scene::run(s, a, half).interrupted);
      half.resume = true;
    }
    const auto rest = scene::run(s, a, into(folder / "half", true));
    EXPECT_EQ(whole.final_state, rest.final_state);
    EXPECT_EQ(whole.held, rest.held);
    auto shorter = s;
    shorter.duration = 2;
    (void)scene::run(shorter, scene::assemble(shorter), into(folder / "extended"));
    auto longer = s;
    scene::extend_to(longer, (folder / "extended").string(), 4);
    const auto again = scene::assemble(longer);
    scene::reopen((folder / "extended").string(), longer, again);
    const auto r = scene::run(longer, again, into(folder / "extended", true));
    EXPECT_EQ(r.final_state.x, whole.final_state.x);
    EXPECT_EQ(r.final_state.lo, whole.final_state.lo);
    EXPECT_EQ(read_bytes(folder / "whole/run.h5"), read_bytes(folder / "extended/run.h5"));
  }
}

TEST(NullSpaceScene, ASampledLawKeepsTheBoundsOfItsTank) {
  TemporaryFolder folder;
  const auto r = run_of(read(
      folder,
      {.controller = hand(full, "rate = 100\n"),
       .more = "[[output]]\nquantity = \"energy\"\nname = \"level\"\nrow = \"hand.tank\"\n"
               "[[stop]]\noutput = \"level\"\nbelow = 0.1\n[[stop]]\noutput = \"level\"\nabove = "
               "4\n",
       .duration = 20}));
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(r.simulated_s, 20);  // neither stop was met
  keeps("the hand is off [m]", off(r), 1e-6);
}

TEST(NullSpaceScene, ATankPaysForAnyLawWithinItsBudget) {
  // Computed torque lifts the arm: with 50 J it does, with 1 J it falls back.
  const auto lift = [](const std::string& more) {
    std::string law =
        "[[controller]]\ntype = \"tracking\"\nlaw = \"computed_torque\"\nname = "
        "\"lift\"\nover = 3.0\n" +
        more;
    const char* names[] = {"turn", "shoulder", "elbow", "wrist"};
    for (const char* j : names)
      law += fmt::format("joints.{} = {{ kp = 30, kd = 11, target = 1.2 }}\n", j);
    return law;
  };
  const auto raised = [&](const std::string& more, double& spent) {
    TemporaryFolder folder;
    const auto r = run_of(read(folder, {.controller = lift(more), .duration = 4}));
    EXPECT_TRUE(r.passed()) << more;
    spent = -entry_of(r.storages, "lift.tank");
    return std::fabs(r.final_state.x[1] - 1.2);
  };
  double free = 0, rich = 0, poor = 0, late = 0;
  EXPECT_LE(raised("", free), 1e-6);
  EXPECT_TRUE(std::isnan(free));
  EXPECT_LE(raised("tank = { level = 50, most = 60 }\n", rich), 1e-6);
  EXPECT_LE(raised("tank = { level = 50, most = 60 }\nrate = 200\ndelay = 1\n", late), 1e-2);
  EXPECT_GT(raised("tank = { level = 1 }\n", poor), 0.2);
  std::printf("  lifting takes %.3f J, sampled and late %.3f J\n", rich, late);
  EXPECT_GT(rich, 5);
  EXPECT_LE(poor, 1);
}

TEST(NullSpaceScene, ATankKeepsItsLevelThroughEvents) {
  TemporaryFolder folder;
  const std::string law =
      "[[controller]]\ntype = \"potential\"\nname = \"spring\"\ntank = { level = 5 }\n"
      "joints.shoulder = { target = 0.2, stiffness = 20, damping = 2 }\njoints.elbow = { target = "
      "0.2, stiffness = 20, damping = 2 }\njoints.wrist.damping = 1\n";
  const Scene with{.controller = law,
                   .more =
                       "[[event]]\ntype = \"lock\"\nat = 0.5\njoint = \"turn\"\n[[event]]\ntype "
                       "= \"unlock\"\nat = 1\njoint = \"turn\"\n",
                   .duration = 2};
  const auto s = read(folder, with);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(r.phases, 3);
  const double level = r.final_state.x[8];
  EXPECT_NEAR(entry_of(r.storages, "spring.tank"), level - 5, 1e-12);
  EXPECT_GT(std::fabs(level - 5), 0.01);
}

/// Its dampers act between the instants too: a law whose dampers are held needs another rate.
TEST(NullSpaceScene, ARateThatIsTooLowIsRefusedWithOneThatHolds) {
  expect_named_rate_holds(
      [](double rate) { return refusal({hand(full, fmt::format("rate = {}\n", rate))}); }, 2);
}

TEST(NullSpaceScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const Scene& s, const std::string& part) {
    const auto text = refusal(s);
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_NE(text.find("scene.toml:"), std::string::npos) << text;
  };
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = hand(full);
    text.replace(text.find(from), from.size(), to);
    return Scene{text};
  };
  says(changed("tank = " + full, ""), "the energy that pays");
  says(changed("level = 2", "level = 5"), "least <= level <= most");
  says(changed("link = \"hand\", ", ""), "the name of a link");
  says(changed("link = \"hand\"", "link = \"foot\""), "foot");
  says(changed("joints.wrist", "joints.hand"), "no joint 'hand'");
  says(changed("stiffness = 8", "stiffness = 0"), "stiffness");
  says({hand(full, "fill = 1.5\n")}, "expected a share in [0, 1]");
  says({hand(full, "rate = 100\ndelay = 1\n")}, "expected none of them");
  auto afloat = arm_of_four();
  const std::string ground = "<link name='ground'/>";
  afloat.replace(afloat.find(ground), ground.size(),
                 "<link name='ground'><inertial><mass value='9'/><inertia ixx='1' iyy='1' izz='1' "
                 "ixy='0' ixz='0' iyz='0'/></inertial></link>");
  says({.controller = hand(full), .base = "free", .urdf = afloat}, "the base is free");
  says(changed("target = 1.4", "target = -3"), "no coordinates near the start");
  // A pose is six numbers, the arm has four joints.
  says({hand(full, "", ", attitude_stiffness = [9, 9, 9]")},
       "leaves no degree of freedom to 4 joints");
  // Turned about y, the column moves the hand in the plane of the links alone.
  auto plane = arm_of_four();
  plane.replace(plane.find("0 0 1"), 5, "0 1 0");
  says({.controller = hand(full), .urdf = plane}, "in 2 of the 3 directions");
}

}  // namespace porthos::test::null_space_scene_test
