// Scenes with contacts and joint stops: run, judged, resumed, through events, in orbit and in
// ensembles, and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "integrators/core/integrator.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::contact_run_test {
namespace {

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}

constexpr const char* model =
    R"(<robot name="pair"><link name="base"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.4 0.4 0.4"/></geometry></collision></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -1"/><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="mesh"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="a.stl"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/><limit lower="-0.4" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="k" type="continuous"><parent link="base"/><child link="mesh"/><axis xyz="0 1 0"/></joint></robot>)";

/// A scene of that model; `more` after its head.
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& more,
                      const std::string& base = "fixed") {
  write_bytes(folder / "model.urdf", model);
  write_bytes(
      folder / "scene.toml",
      "[model]\nurdf = \"model.urdf\"\nbase = \"" + base +
          "\"\n[initial.joints.j]\nvelocity = 2\n[integrator]\nmethod = \"gauss16\"\nstep = "
          "0.01\n[run]\nduration = 4\n" +
          more);
  return scene::read_scene((folder / "scene.toml").string());
}
std::string refusal(const std::string& more, const std::string& base = "fixed") {
  TemporaryFolder folder;
  try {
    const auto s = scene_of(folder, more, base);
    const auto a = scene::assemble(s);
    scene::make_integrator(s, *a.model, s.step);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}
std::string contact_with(const std::string& keys) {
  return "[[contact]]\nname = \"c\"\n" + keys + "\n";
}
const std::string stiff = "law = \"power\"\nstiffness = 1e3\n";
const std::string stop = "[[element]]\ntype = \"joint_stop\"\njoint = \"j\"\n" + stiff;

TEST(ContactRun, ExamplesPassTheirVerdict) {
  for (const char* name : {"bouncing_ball", "lander"}) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, 3);
    const auto r = run_of(s);
    EXPECT_TRUE(r.passed()) << name;
    std::printf("  %-13s energy %.1e, loss %.3f J, friction %.3f J\n", name, value_of(r, "energy"),
                entry_of(r.losses, "ground.loss"), entry_of(r.losses, "ground.friction"));
    EXPECT_GT(entry_of(r.losses, "ground.loss"), 0.1);
    EXPECT_GT(entry_of(r.losses, "ground.friction"), 0.1);
    EXPECT_TRUE(std::isfinite(entry_of(r.storages, "ground")));
  }
}

/// A ball that falls with the restitution 3/4 at the speed of its first touch: the first apex is
/// (3/4)² of the height, but for the weight in the short touch.
TEST(ContactRun, TheStatedRestitutionIsThatOfTheFirstBounce) {
  TemporaryFolder folder;
  auto s = shipped(folder, "bouncing_ball", 1.0,
                   {{"linear_velocity = [1.5, 0, 0], angular_velocity = [0, -25, 0]",
                     "linear_velocity = [0, 0, 0]"},
                    {"stiffness = 20000", "stiffness = 2e6"},
                    {"speed = 4", fmt::format("speed = {:.17g}", std::sqrt(2 * 9.81 * 1.08))},
                    {"step = 0.001", "step = 0.00025"}});
  const auto a = scene::assemble(s);
  const auto by = scene::make_integrator(s, *a.model, s.step);
  phs::State x = a.initial;
  double apex = 0;
  bool rose = false;
  while (x.time(s.step) < 0.99) {
    ASSERT_EQ(by->step(x), integrators::Outcome::ok);
    rose = rose || x.x[2] < 0.12;
    if (rose) apex = std::max(apex, x.x[2] - 0.12);
  }
  std::printf("  apex %.6f of the height   bound 0.5625 ± 1e-3\n", apex / 1.08);
  EXPECT_NEAR(apex / 1.08, 0.5625, 1e-3);
}

TEST(ContactRun, StopsTakeTheLimitsOfTheModelFile) {
  TemporaryFolder folder;
  const auto r = run_of(scene_of(folder, stop + "loss = 0.2\n[verify]\nenergy = 1e-13\n"));
  EXPECT_TRUE(r.passed());
  EXPECT_GT(entry_of(r.losses, "j.joint_stop.loss"), 0.01);
  const auto s = scene_of(folder, stop);
  const auto a = scene::assemble(s);
  const auto by = scene::make_integrator(s, *a.model, s.step);
  phs::State x = a.initial;
  double lowest = 0, highest = 0;
  for (int i = 0; i < 400; ++i) {
    ASSERT_EQ(by->step(x), integrators::Outcome::ok);
    lowest = std::min(lowest, x.x[0]);
    highest = std::max(highest, x.x[0]);
  }
  EXPECT_NEAR(lowest, -0.4, 0.06);
  EXPECT_NEAR(highest, 0.5, 0.06);
}

/// Interrupted and continued: the same bits, also where the interruption is inside a touch.
TEST(ContactRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  const auto [whole, rest] =
      expect_same_bits_when_resumed(folder, shipped(folder, "bouncing_ball", 2), {236, 239, 700});
  EXPECT_EQ(entry_of(whole.losses, "ground.friction"), entry_of(rest.losses, "ground.friction"));
}

/// Events between phases keep contacts: a locked joint has no stop, and again one when it is free.
TEST(ContactRun, StopsGoThroughEvents) {
  TemporaryFolder folder;
  const auto r = run_of(
      scene_of(folder, stop + contact_with("links = [\"rod\"]\nagainst = [\"world\"]\n" + stiff) +
                           "[[event]]\ntype = \"lock\"\nat = 1.0\njoint = \"j\"\n"
                           "[[event]]\ntype = \"unlock\"\nat = 2.0\njoint = \"j\"\n"));
  EXPECT_EQ(r.phases, 3);
  EXPECT_TRUE(r.passed());
}

TEST(ContactRun, LinksMayTouchInOrbit) {
  TemporaryFolder folder;
  const auto r = run_of(scene_of(
      folder,
      contact_with("links = [\"rod\"]\nagainst = [\"base\"]\nagainst_shape = { kind = \"sphere\", "
                   "radius = 0.5, at = [0.6, 0, -0.8] }\nstiffness = 50\nwidth = 0.05") +
          "[orbit]\naltitude = 5e5\n",
      "free"));
  EXPECT_TRUE(r.passed());
  EXPECT_GT(std::fabs(entry_of(r.storages, "c")), 0);
}

/// Steps end at the stop inside the splitting of an orbit and under a control of the steps too.
TEST(ContactRun, StopsInOrbitAndUnderAStepControl) {
  for (const char* more : {"[orbit]\naltitude = 5e5\n", ""})
    for (const char* control : {"fixed", "reversible", "time_transformed"}) {
      const bool orbit = *more != 0, fixed = std::string(control) == "fixed";
      if (orbit && !fixed) continue;
      TemporaryFolder folder;
      auto s = scene_of(folder, stop + more, "free");
      s.step_control = integrators::step_control_of(control);
      s.step = 0.02;
      s.verify.energy = 1e-12;
      const auto r = run_of(s);
      std::printf("  %-17s energy %.1e   bound 1e-12\n", orbit ? "orbit" : control,
                  value_of(r, "energy"));
      EXPECT_TRUE(r.passed()) << control;
    }
}

/// Feet far from the centre of a light hub feel some per cent of its mass. Control: a shorter step.
TEST(ContactRun, AStepThatFrictionDoesNotAllowIsNamed) {
  TemporaryFolder folder;
  write_bytes(
      folder / "disc.urdf",
      R"(<robot name="disc"><link name="hub"><inertial><origin xyz="0 0 0.3"/><mass value="5"/>
<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)");
  std::string text =
      "[model]\nurdf = \"disc.urdf\"\nbase = \"free\"\n[environment]\ngravity = \"uniform\"\n"
      "vector = [0, 0, -1.62]\n[initial]\nbase = { position = [0, 0, 0.15], linear_velocity = "
      "[0.05, 0, -0.3] }\n[integrator]\nmethod = \"gauss8\"\nstep = 0.002\n[run]\nduration = 0.3\n";
  for (int k = 0; k < 3; ++k)
    text += fmt::format(
        "[[contact]]\nname = \"f{}\"\nlinks = [\"hub\"]\nshape = {{ kind = \"sphere\", radius = "
        "0.03, at = [{}, {}, -0.05] }}\nlaw = \"power\"\nstiffness = 8000\nrestitution = "
        "0.3\nspeed "
        "= 0.5\nfriction = 0.6\ncreep = 0.01\n",
        k, 0.35 * std::cos(2.0944 * k), 0.35 * std::sin(2.0944 * k));
  write_bytes(folder / "scene.toml", text);
  auto s = scene::read_scene((folder / "scene.toml").string());
  const auto told = [](const scene::RunReport& r) {
    return std::ranges::any_of(r.notes, [](const auto& n) {
      return says(n, "the friction of 'f0', 'f1', 'f2' asks for steps of at most one or two");
    });
  };
  const auto failed = run_of(s);
  EXPECT_EQ(failed.outcome, integrators::Outcome::not_converged);
  EXPECT_TRUE(told(failed));
  scene::apply(s, {.step = 0.0002});
  const auto good = run_of(s);
  EXPECT_EQ(good.outcome, integrators::Outcome::ok);
  EXPECT_FALSE(told(good));
}

TEST(ContactRun, RefusalsSayWhereAndWhat) {
  const auto c = [](const std::string& keys) { return refusal(contact_with(keys)); };
  EXPECT_TRUE(says(c("links = [\"rod\"]\n" + stiff), ""));
  EXPECT_TRUE(
      says(c("links = [\"rod\"]\nagainst = [\"rod\"]\n" + stiff),
           "contact 'c': 'rod' is on both sides, expected against = [\"each other\"] for links "
           "among themselves"));
  EXPECT_TRUE(says(c("links = [\"mesh\"]\n" + stiff),
                   "model.urdf:6: the shape is a <mesh>, expected a sphere, box, cylinder or "
                   "capsule for contact"));
  EXPECT_TRUE(
      says(c("links = [\"nothing\"]\n" + stiff), "there is no link 'nothing' with a <collision>"));
  EXPECT_TRUE(
      says(c("links = [\"rod\"]\nagainst = [\"base\", \"mesh\"]\nshape = { kind = \"box\", "
             "size = [1, 1, 1] }\nagainst_shape = { kind = \"cylinder\", radius = 1, length "
             "= 1 }\n" +
             stiff),
           "between a box on 'rod' and a cylinder on 'base', expected one of the pairs"));
  EXPECT_TRUE(says(c("links = [\"rod\"]\nlaw = \"hertz\"\n"), "lacks the key 'stiffness'"));
  EXPECT_TRUE(says(c("links = [\"rod\"]\nagainst = [\"base\"]\nlaw = \"hertz\"\nmodulus = 1e9\n"),
                   "a modulus is given for a box on 'base', expected spheres and planes"));
  EXPECT_TRUE(says(
      c("links = [\"rod\"]\nstiffness = 1\n"),
      "lacks the key 'width', expected one, as law is \"smooth\" by default; of a hard contact "
      "or stop law is \"rigid\""));
  EXPECT_TRUE(says(c("links = [\"rod\"]\nfriction = 0.1\n" + stiff), "lacks the key 'creep'"));
  EXPECT_TRUE(says(c("links = [\"rod\"]\nrestitution = 1.2\nspeed = 1\n" + stiff),
                   "restitution is 1.2, expected more than 0, at most 1"));
  EXPECT_TRUE(says(c("links = [\"rod\"]\nshape = { kind = \"plane\", radius = 1 }\n" + stiff),
                   "radius is given for a plane"));
  EXPECT_TRUE(says(c("links = [\"world\"]\n" + stiff), "expected it in against"));
  EXPECT_TRUE(says(refusal(contact_with("links = [\"rod\"]\nstiffness = 1\nwidth = 1") +
                               "[orbit]\naltitude = 5e5\n",
                           "free"),
                   "contact 'c' touches the world, expected a link or [[body]] in orbit"));
  EXPECT_TRUE(says(refusal("[[element]]\ntype = \"joint_stop\"\njoint = \"k\"\n" + stiff),
                   "gives a limit of joint 'k', expected lower or upper"));
  EXPECT_TRUE(
      says(refusal(stop + "lower = 1\nupper = 0\n"), "lower is 1, expected less than upper"));
}

}  // namespace
}  // namespace porthos::test::contact_run_test
