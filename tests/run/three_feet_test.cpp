// A lander on three feet that slide along parallel legs: legs that start at their stops, and rigid
// feet that stick. And contacts that start deep.
#include <fmt/format.h>

#include <cmath>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::three_feet_test {
namespace {

std::string lander() {
  std::string urdf =
      "<robot name='l'><link name='hull'><inertial><mass value='900'/><inertia ixx='420' iyy='430' "
      "izz='610' ixy='0' ixz='0' iyz='0'/></inertial></link>\n";
  for (int k = 0; k < 3; ++k)
    urdf += fmt::format(
        "<joint name='leg{0}' type='prismatic'><parent link='hull'/><child link='foot{0}'/>"
        "<origin xyz='{1} {2} -1.1'/><axis xyz='0 0 1'/><limit lower='0' upper='0.35' effort='1' "
        "velocity='1'/></joint><link name='foot{0}'><inertial><mass value='14'/><inertia ixx='0.2' "
        "iyy='0.2' izz='0.2' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><sphere "
        "radius='0.12'/></geometry></collision></link>\n",
        k, 1.5 * std::cos(2 * M_PI * k / 3), 1.5 * std::sin(2 * M_PI * k / 3));
  return urdf + "</robot>";
}
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& start,
                      const std::string& law, double step, double duration,
                      const std::string& leg = "") {
  write_bytes(folder / "model.urdf", lander());
  std::string text =
      "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[environment]\ngravity = \"uniform\"\n"
      "vector = [0, 0, -3.71]\n[initial]\n" +
      start + "\n[[contact]]\nname = \"ground\"\nlinks = [\"foot0\", \"foot1\", \"foot2\"]\n" + law;
  for (int k = 0; k < 3; ++k)
    text +=
        fmt::format(
            "\n[[element]]\ntype = \"spring\"\njoint = \"leg{0}\"\nstiffness = 9000\n[[element]]\n"
            "type = \"damper\"\njoint = \"leg{0}\"\ndamping = 2500\n",
            k) +
        (leg.empty() ? "" : fmt::format("[[element]]\njoint = \"leg{}\"\n{}\n", k, leg));
  text += fmt::format(
      "[integrator]\nmethod = \"gauss16\"\nstep = {}\n[run]\nduration = {}\nrecord_every = {}\n",
      step, duration, step);
  write_bytes(folder / "scene.toml", text);
  return scene::read_scene((folder / "scene.toml").string());
}
scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}

/// Legs that start at a limit leave it, or press on it, as the feet touch. Control: legs that start
/// 1 cm inside.
TEST(ThreeFeet, LegsThatStartAtTheirStopsKeepTheEnergy) {
  const std::string tilted =
      "base.position = [0, 0, 1.9]\nbase.attitude_wxyz = [0.999, 0.03, 0, 0]\n"
      "base.linear_velocity = [0.2, 0, -1.5]\n";
  const std::string soft =
      "law = \"power\"\nstiffness = 2e5\nrestitution = 0.3\nspeed = 1\nfriction = 0.6\ncreep = "
      "0.02\n";
  const std::string stop =
      "type = \"joint_stop\"\nlaw = \"power\"\nstiffness = 4e5\nrestitution = 0.3\nspeed = 0.5";
  for (const double step : {0.01, 0.005, 0.002}) {
    const auto energy = [&](const std::string& legs) {
      TemporaryFolder folder;
      return value_of(run_of(scene_of(folder, tilted + legs, soft, step, 0.6, stop)), "energy");
    };
    const double at = energy(""), inside = energy(
                                      "joints.leg0.position = 0.01\njoints.leg1.position = "
                                      "0.01\njoints.leg2.position = 0.01\n");
    std::printf("  step %g s: energy %.1e   bound 1e-10 (1 cm inside: %.1e)\n", step, at, inside);
    EXPECT_LE(at, 1e-10);
    EXPECT_LE(inside, 1e-10);
  }
}

/// Upright, straight down: three feet that stick hold each other. Nothing slips. Control: the same
/// without friction.
TEST(ThreeFeet, StandThoughTheirFrictionIsNotUnique) {
  const std::string down = "base.position = [0, 0, 1.23]\nbase.linear_velocity = [0, 0, -0.3]\n";
  const auto landed = [&](const std::string& friction) {
    TemporaryFolder folder;
    return run_of(
        scene_of(folder, down, "law = \"rigid\"\nrestitution = 0.3\n" + friction, 0.005, 2));
  };
  const auto rough = landed("friction = 0.6\n"), smooth = landed("");
  std::printf("  energy %.1e (smooth %.1e)   bound 1e-12; rubbed %.1e J   bound 1e-20\n",
              value_of(rough, "energy"), value_of(smooth, "energy"),
              entry_of(rough.losses, "ground.friction"));
  EXPECT_EQ(rough.outcome, integrators::Outcome::ok) << rough.trouble;
  EXPECT_EQ(rough.simulated_s, 2);
  EXPECT_LE(value_of(rough, "energy"), 1e-12);
  EXPECT_LE(value_of(smooth, "energy"), 1e-12);
  EXPECT_LE(entry_of(rough.losses, "ground.friction"), 1e-20);
}

/// With a drift of 5 cm/s the feet hop, slip and stick without end: the run ends soon, and says why
/// and what goes on. Control: that method.
TEST(ThreeFeet, ThatSlipAndStickWithoutEndAreTold) {
  const std::string drift =
      "base.position = [0, 0, 1.23]\nbase.linear_velocity = [0.05, 0, -0.3]\n";
  TemporaryFolder folder;
  auto s =
      scene_of(folder, drift, "law = \"rigid\"\nrestitution = 0.3\nfriction = 0.6\n", 0.005, 1);
  const auto events = run_of(s);
  s.method = "moreau";
  const auto control = run_of(s);
  std::printf("  %s: %g evaluations   bound 1e6 (moreau: %g, energy %.1e)\n",
              events.trouble.c_str(), double(events.cost.evaluations),
              double(control.cost.evaluations), value_of(control, "energy"));
  EXPECT_TRUE(says(events.trouble, "'ground' changes between slip and stick more often"));
  EXPECT_TRUE(says(events.trouble, "expected method = \"moreau\", or a soft contact"));
  EXPECT_LE(double(events.cost.evaluations), 1e6);
  EXPECT_EQ(control.simulated_s, 1);
  EXPECT_TRUE(control.passed());
}

/// Feet 0.22 m deep in the ground. Control: 1 mm deep.
TEST(ThreeFeet, AContactThatStartsDeepIsNoted) {
  const auto notes = [](double height) {
    TemporaryFolder folder;
    const auto s = scene_of(folder, fmt::format("base.position = [0, 0, {}]\n", height),
                            "law = \"power\"\nstiffness = 2e5\n", 0.005, 0.1);
    std::string all;
    for (const auto& n : scene::assemble(s).notes)
      if (n.text.find("contact '") != n.text.npos) all += n.where + ": " + n.text;
    return all;
  };
  const std::string deep = notes(1.0), light = notes(1.219);
  std::printf("  %s\n", deep.c_str());
  EXPECT_NE(deep.find("scene.toml:10:1: contact 'ground' starts 0.22 m deep"), deep.npos);
  EXPECT_NE(deep.find("stores 1.452e+04 J"), deep.npos);
  EXPECT_EQ(light, "");
}

}  // namespace
}  // namespace porthos::test::three_feet_test
