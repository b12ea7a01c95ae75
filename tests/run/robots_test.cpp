// Scenes with several robots: each moves as it does alone, an articulated target is captured by its
// root and any two links are joined by a loop; in orbit, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "scene/read/changed_scene.h"
#include "scene/read/scene_texts.h"
#include "scene/sensitivity/unknowns.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::robots_test {
namespace {

/// A bus with a panel on a hinge.
std::string target_urdf() {
  return "<robot name='target'><material name='grey'><color rgba='1 1 1 1'/></material>" +
         link("bus", 8) + link("panel", 2) + joint("hinge", "bus", "panel", "0 0 1") + "</robot>";
}
const std::string moving_arm =
    "[initial]\nbase.linear_velocity = [0.1, 0, 0]\njoints.shoulder.velocity = 1\n"
    "joints.elbow = { position = 0.5, velocity = -2 }\n";
const std::string target =
    "[[robot]]\nname = \"target\"\nurdf = \"target.urdf\"\nbase = \"free\"\n"
    "position = [3, 0.5, 0]\nattitude_wxyz = [0.6, 0, 0.8, 0]\nlinear_velocity = [-0.3, 0, 0]\n"
    "angular_velocity = [0.2, 0.1, -0.1]\n";
const std::string swinging = "joints.\"target.hinge\" = { position = 0.4, velocity = 1.5 }\n";

scene::Scene scene_of(const TemporaryFolder& folder, const std::string& more,
                      const std::string& urdf = "model.urdf", const char* base = "free",
                      double duration = 2) {
  write_bytes(folder / "model.urdf", arm_urdf());
  write_bytes(folder / "target.urdf", target_urdf());
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"{}\"\nbase = \"{}\"\n{}[integrator]\nmethod = "
                          "\"gauss8\"\nstep = 0.01\n[run]\nduration = {}\n",
                          urdf, base, more, duration));
  return scene::read_scene((folder / "scene.toml").string());
}
struct Ran {
  scene::Assembly assembly;
  scene::RunReport report;
  phs::State end;  ///< in the world
};
Ran run(const scene::Scene& s) {
  auto a = scene::assemble(s);
  auto r = scene::run_in_memory(s, a, {});
  scene::WorldView view(a);
  phs::State end = view(r.simulated_s, r.final_state);
  return {std::move(a), std::move(r), std::move(end)};
}
/// Coordinates of a block at the end.
std::vector<double> at_end(const Ran& r, const std::string& name) {
  for (const auto& c : r.assembly.mechanism->coordinates())
    if (c.name == name) return {r.end.x.begin() + c.q, r.end.x.begin() + c.q + c.nq};
  return {};
}
double far_apart(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || a.size() != b.size()) return HUGE_VAL;
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}
std::string refusal(const std::string& more, const char* base = "free") {
  TemporaryFolder folder;
  try {
    (void)scene::assemble(scene_of(folder, more, "model.urdf", base));
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST(Robots, TwoThatDoNotTouchMoveAsEachDoesAlone) {
  TemporaryFolder folder;
  const auto both = run(scene_of(folder, moving_arm + swinging + target));
  EXPECT_TRUE(both.report.passed());
  const auto one = run(scene_of(folder, moving_arm));
  const std::string start =
      "[initial]\nbase.position = [3, 0.5, 0]\nbase.attitude_wxyz = [0.6, 0, 0.8, 0]\n"
      "base.linear_velocity = [-0.3, 0, 0]\nbase.angular_velocity = [0.2, 0.1, -0.1]\n"
      "joints.hinge = { position = 0.4, velocity = 1.5 }\n";
  const auto other = run(scene_of(folder, start, "target.urdf"));
  for (const char* name : {"base.position", "base.attitude", "shoulder", "elbow"})
    EXPECT_LE(far_apart(at_end(both, name), at_end(one, name)), 1e-13) << name;  // 1e-15
  for (const char* name : {"position", "attitude"})
    EXPECT_LE(far_apart(at_end(both, std::string("target.") + name),
                        at_end(other, std::string("base.") + name)),
              1e-13)
        << name;
  EXPECT_LE(far_apart(at_end(both, "target.hinge"), at_end(other, "hinge")), 1e-13);
  // Negative control: it has moved.
  EXPECT_GT(far_apart(at_end(both, "target.position"), {3, 0.5, 0}), 0.1);
}

TEST(Robots, AnArticulatedTargetIsCapturedAndReleasedWithItsPanelMoving) {
  TemporaryFolder folder;
  const auto event = [](const std::string& type, const std::string& keys) {
    return "[[event]]\ntype = \"" + type + "\"\nbody = \"target.bus\"\n" + keys + "\n";
  };
  const auto s = scene_of(folder, moving_arm + swinging + target +
                                      event("capture", "link = \"lower\"\nat = 0.5\nreach = 9") +
                                      event("release", "at = 1.5"));
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  EXPECT_TRUE(r.passed()) << r.checks.size();
  EXPECT_EQ(r.phases, 3);
  double across = HUGE_VAL;
  for (const auto& c : r.checks)
    if (c.name == "momentum_across_events") across = c.value;
  EXPECT_LE(across, 1e-14);  // 3e-16
  EXPECT_GT(r.dissipated_J, 0.1) << "the impact is plastic";
}

/// By its panel: the bus hangs on the panel then, with the hinge turned round.
TEST(Robots, AnyLinkIsCapturedAndTheRobotGivenBack) {
  TemporaryFolder folder;
  const std::string keys =
      moving_arm + swinging + target +
      "[[element]]\ntype = \"spring\"\njoint = \"target.hinge\"\nstiffness = 3\n"
      "[[element]]\ntype = \"damper\"\njoint = \"target.hinge\"\ndamping = 0.2\n"
      "[[output]]\nquantity = \"joint_position\"\nname = \"angle\"\njoint = \"target.hinge\"\n"
      "[[event]]\ntype = \"capture\"\nbody = \"target.panel\"\nlink = \"lower\"\nat = "
      "0.5\nreach = 9\n[[event]]\ntype = \"release\"\nbody = \"target.panel\"\nat = 1.5\n";
  const auto s = scene_of(folder, keys);
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  EXPECT_TRUE(r.passed());
  EXPECT_EQ(r.phases, 3);
  EXPECT_LE(value_of(r, "momentum_across_events"), 1e-14);  // 4e-16
  EXPECT_GT(r.dissipated_J, 0.1) << "the impact is plastic";
  EXPECT_LE(std::fabs(r.defect_J), 1e-12);
  EXPECT_EQ(r.final_state.x.size(), a.initial.x.size()) << "the robot floats again";
  EXPECT_EQ(r.final_state.x, scene::run_in_memory(s, a, {}).final_state.x);
  // In orbit, and with a step control.
  EXPECT_TRUE(run(scene_of(folder, moving_arm.substr(0, 10) + keys.substr(moving_arm.size()) +
                                       "[orbit]\naltitude = 5e5\n"))
                  .report.passed());
  auto controlled = s;
  controlled.step_control = integrators::StepControl::time_transformed;
  EXPECT_TRUE(run(controlled).report.passed());
}

/// A body takes hold of the panel, or the panel of the body: one weld, two trees, one motion.
TEST(Robots, ItDoesNotMatterWhichSideCaptures) {
  TemporaryFolder folder;
  const auto weld = [&](const std::string& body, const std::string& link) {
    const auto s = scene_of(
        folder,
        moving_arm + swinging + target +
            "[[body]]\nname = \"tug\"\nmass = 3\ninertia = [0.2, 0.3, 0.4, 0, 0, 0]\n"
            "position = [3, 1.5, 0]\nlinear_velocity = [0, -0.5, 0]\n"
            "[[event]]\ntype = \"capture\"\nbody = \"" +
            body + "\"\nlink = \"" + link +
            "\"\nat = 0.5\nreach = 9\n"
            "[[output]]\nquantity = \"joint_wrench\"\nname = \"wrench\"\njoint = "
            "\"target.hinge\"\n[[output]]\nquantity = \"position\"\nname = \"bus\"\nlink = "
            "\"target.bus\"\n[[element]]\ntype = \"spring\"\njoint = \"target.hinge\"\nstiffness = "
            "30\n");
    return scene::run_in_memory(s, scene::assemble(s), {});
  };
  const auto turned = weld("target.panel", "tug"), other = weld("tug", "target.panel");
  ASSERT_EQ(turned.outputs.size(), 9u);
  double worst = 0, size = 0;
  for (size_t i = 0; i < 9; ++i) {
    const double end = other.outputs[i].end;
    worst = std::max(worst, std::fabs(turned.outputs[i].end - end));
    size = std::max(size, std::fabs(end));
  }
  std::printf("  wrench of the hinge and place of the bus differ by %.1e of %.2g (1e-11)\n", worst,
              size);
  EXPECT_LE(worst, 1e-11 * size);
  EXPECT_GT(size, 1);
  EXPECT_NEAR(turned.dissipated_J, other.dissipated_J, 1e-12);
}

TEST(Robots, ALoopJoinsAnyTwoLinksOfTwoRobots) {
  TemporaryFolder folder;
  const std::string more =
      moving_arm + swinging + target +
      "[[loop]]\nname = \"grip\"\ntype = \"fixed\"\na = { link = \"lower\" }\nb = { link = "
      "\"target.panel\" }\n[[event]]\ntype = \"close\"\nloop = \"grip\"\nat = 0.5\nreach = 9\n";
  auto s = scene_of(folder, more);
  s.method = "spark8";
  const auto r = scene::run_in_memory(s, scene::assemble(s), {});
  EXPECT_TRUE(r.passed());
  EXPECT_LE(r.constraint_gap, 1e-14);
  EXPECT_LE(r.angular_momentum_error, 1e-13);
}

TEST(Robots, OneThatStandsHasItsPlace) {
  TemporaryFolder folder;
  const std::string standing =
      "[[robot]]\nname = \"second\"\nurdf = \"model.urdf\"\nbase = \"fixed\"\nposition = [1, 2, "
      "3]\nrpy = [0, 0, 1.5707963267948966]\n";
  const std::string gravity = "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n";
  const std::string start =
      "[initial]\njoints.shoulder.position = 1\njoints.\"second.shoulder\" = { position = 1 }\n";
  const auto both = run(scene_of(folder, gravity + start + standing, "model.urdf", "fixed"));
  // Turned about the vertical and shifted, it swings like the first, bit for bit.
  EXPECT_EQ(at_end(both, "second.shoulder"), at_end(both, "shoulder"));
  EXPECT_NE(at_end(both, "shoulder").at(0), 1);
  const auto& m = *both.assembly.mechanism;
  EXPECT_NEAR(m.body("second.body").pose.r.y, 2, 1e-15);
  // Beside a free base: the centre of mass stays in the equations, with the reason.
  const auto s = scene_of(folder, standing);
  EXPECT_TRUE(says(scene::why_centre_stays(s), "robot 'second' is fixed to the world"));
  EXPECT_TRUE(run(s).report.passed());
}

TEST(Robots, ResultsKeepTheWholeModel) {
  TemporaryFolder folder;
  const auto s = scene_of(folder, moving_arm + swinging + target);
  const auto again = scene::read_scene_again("elsewhere/scene.toml", {s.text, s.urdf_text});
  EXPECT_EQ(scene::assemble(again).initial.x, scene::assemble(s).initial.x);
  EXPECT_EQ(again.urdf_text, s.urdf_text);
}

TEST(Robots, InOrbit) {
  TemporaryFolder folder;
  const auto s =
      scene_of(folder, moving_arm.substr(0, 10) + swinging + target + "[orbit]\naltitude = 5e5\n");
  const auto r = run(s);
  EXPECT_TRUE(r.report.passed());
  EXPECT_EQ(r.assembly.mechanism->body_count(), 5);
}

TEST(Robots, WhatCannotBeIsRefusedWithItsPlace) {
  EXPECT_TRUE(says(refusal("[[robot]]\nname = \"r\"\nurdf = \"no.urdf\"\nbase = \"free\"\n"),
                   "scene.toml:6:"));
  EXPECT_TRUE(says(refusal(target + target), "is that of another robot"));
  EXPECT_TRUE(says(refusal("[[robot]]\nname = \"base\"\nurdf = \"target.urdf\"\nbase = "
                           "\"free\"\n"),
                   "expected another one"));
  EXPECT_TRUE(says(refusal(target + "rpy = [0, 0, 1]\n"), "expected attitude_wxyz"));
  EXPECT_TRUE(says(refusal("[[robot]]\nname = \"r\"\nurdf = \"target.urdf\"\nbase = \"fixed\"\n"
                           "angular_velocity = [0, 0, 1]\n"),
                   "is of a free base"));
  EXPECT_TRUE(says(refusal("[[robot]]\nname = \"r\"\nurdf = \"target.urdf\"\nbase = \"fixed\"\n"
                           "[orbit]\naltitude = 5e5\n"),
                   "is fixed to the world and the scene has an [orbit]"));
  EXPECT_TRUE(says(refusal("[initial]\njoints.target.velocity = 1\n" + target),
                   "expected its start in its [[robot]]"));
}

TEST(Robots, StartsOfATargetDifferFromCaseToCase) {
  TemporaryFolder folder;
  const auto vary = [](const std::string& key) {
    return "[ensemble]\ncases = 3\n[ensemble.vary]\n\"" + key + "\" = { uniform = [0.1, 0.9] }\n";
  };
  for (const char* key : {"robot[0].angular_velocity[0]", "robot[0].position[1]",
                          "robot[0].linear_velocity[2]", "initial.joints.target.hinge.velocity"}) {
    const auto s = scene_of(folder, moving_arm + swinging + target + vary(key));
    const scene::Ensemble e(s);
    scene::EnsembleOptions o;
    o.out = (folder / key).string();
    o.threads = 1;
    EXPECT_EQ(scene::run_ensemble(e, o).passed, 3) << key;
    double apart = 0, changed = 0;
    for (std::int64_t i = 0; i < 3; ++i) {
      const auto values = e.sampler().values(i);
      const auto of_case = run(scene::read_variation(s, e.sampler().replacements(values)));
      // The same from a file that states the number.
      const std::string name = key;
      const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = moving_arm + swinging + target;
        text.replace(text.find(from), from.size(), to);
        return text;
      };
      const double x = values[0];
      const auto text =
          name.find("angular") != name.npos
              ? with("velocity = [0.2, 0.1, -0.1]", fmt::format("velocity = [{}, 0.1, -0.1]", x))
          : name.find("position") != name.npos
              ? with("position = [3, 0.5, 0]", fmt::format("position = [3, {}, 0]", x))
          : name.find("linear") != name.npos
              ? with("velocity = [-0.3, 0, 0]", fmt::format("velocity = [-0.3, 0, {}]", x))
              : with("velocity = 1.5", fmt::format("velocity = {}", x));
      const auto alone = run(scene_of(folder, text));
      apart = std::max(apart, far_apart(of_case.end.x, alone.end.x));
      changed = std::max(changed, far_apart(of_case.end.x, run(s).end.x));
    }
    keeps(std::string(key) + ", off a scene that states it", apart, 1e-14);
    breaks("it moves the target otherwise", changed, 1e-3);
  }
  const std::string fixed = "[[robot]]\nname = \"r\"\nurdf = \"target.urdf\"\nbase = \"fixed\"\n";
  const std::string why = test::refusal(
      [&] { const scene::Ensemble e(scene_of(folder, fixed + vary("robot[0].position[1]"))); });
  EXPECT_TRUE(says(why, "scene.toml:")) << "with file and line";
  EXPECT_TRUE(says(why,
                   "robot 'r' is fixed to the world, a part of the model that stays as it is: "
                   "expected a robot with base = \"free\", or another scene"));
}

// Where names are the keys of a table their dots belong to them.
TEST(Robots, NumbersByTheNamesOfATargetsLinks) {
  TemporaryFolder folder;
  const std::string keys = moving_arm + swinging + target;
  const auto s = scene_of(folder, "mass_factor.\"target.bus\" = 1.5\n" + keys);
  const auto mass_of = [](const scene::Scene& of) {
    return scene::assemble(of).mechanism->total_mass();
  };
  const double mass = mass_of(s), bus = 8;
  for (const char* key : {"model.mass_factor.target.bus", "model.mass_factor.\"target.bus\"",
                          "model.mass_factor.'target.bus'"}) {
    const scene::Replacement r{key, {2}};
    keeps(key, std::fabs(mass_of(scene::read_variation(s, {&r, 1})) - mass - 0.5 * bus), 1e-13);
    keeps(std::string(key) + ", changed",
          std::fabs(mass_of(scene::read_changed(s.path, {&r, 1})) - mass - 0.5 * bus), 1e-13);
  }
  const scene::Replacement panel{"model.mass_factor.target.panel", {3}};  // not in the file
  keeps("panel", std::fabs(mass_of(scene::read_variation(s, {&panel, 1})) - mass - 2 * 2), 1e-13);
  const scene::Replacement own{"model.inertia.target.bus.mass", {1}};
  EXPECT_TRUE(scene::read_variation(s, {&own, 1}).urdf.link_inertia.contains("target.bus"));
  for (const char* key : {"model.mass_factor.\"target.bus", "model.\"mass_factor\"x.y"}) {
    const scene::Replacement r{key, {2}};
    EXPECT_TRUE(says(test::refusal([&] {
                       (void)scene::read_variation(s, {&r, 1});
                     }),
                     "quote"))
        << key;
  }
  const scene::Ensemble e(scene_of(
      folder, keys + "[ensemble]\ncases = 3\n[ensemble.vary]\n\"model.mass_factor.target.bus\" = "
                     "{ uniform = [0.8, 1.5] }\n"));
  scene::EnsembleOptions o;
  o.out = (folder / "masses").string();
  o.threads = 1;
  EXPECT_EQ(scene::run_ensemble(e, o).passed, 3);
  const scene::Unknowns u(s, scene::assemble(s), {"model.mass_factor.target.bus"});
  EXPECT_EQ(u.list().at(0).start, 1.5);
}

}  // namespace porthos::test::robots_test
