// Scenes with rigid contacts and joint stops: run, judged, resumed, with step controls, monitors,
// events and ensembles, and what is refused.
#include <cmath>

#include "integrators/core/integrator.h"
#include "scene/ensemble/ensemble.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::rigid_run_test {
namespace {

constexpr const char* model =
    R"(<robot name="pair"><link name="base"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.4 0.4 0.4"/></geometry></collision></link>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -1"/><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/><limit lower="-0.4" upper="0.5" effort="1" velocity="1"/></joint></robot>)";

const std::string stop = "[[element]]\ntype = \"joint_stop\"\njoint = \"j\"\nlaw = \"rigid\"\n";

/// A scene of that model; `more` after its head.
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& more,
                      const std::string& base = "fixed") {
  write_bytes(folder / "model.urdf", model);
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"model.urdf\"\nbase = \"" + base + "\"\n" +
                  "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n" +
                  "[initial.joints.j]\nvelocity = 2\n[integrator]\nmethod = \"gauss16\"\n" +
                  "step = 0.01\n" + more);
  return scene::read_scene((folder / "scene.toml").string());
}
const std::string four = "[run]\nduration = 4\n";

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
std::string refusal(const std::string& more, const std::string& base = "fixed") {
  TemporaryFolder folder;
  try {
    const auto s = scene_of(folder, four + more, base);
    const auto a = scene::assemble(s);
    scene::make_integrator(s, *a.model, s.step);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

/// With every step control and monitor: the ledger closes, impacts are counted, and the loss is
/// (1 - e²) of the energy before each.
TEST(RigidRun, StopsOfTheModelFile) {
  for (const std::string more :
       {"", "step_control = \"time_transformed\"\n", "step_control = \"reversible\"\n",
        "[monitor]\nlimit = 1e-12\naction = \"stop\"\n", "[monitor]\nproject = true\n",
        "[monitor]\nstep_limit = 1e-12\naction = \"repeat\"\n"}) {
    TemporaryFolder folder;
    const auto r = run_of(
        scene_of(folder, more + four + stop + "restitution = 0.8\n[verify]\nenergy = 1e-13\n"));
    ASSERT_EQ(r.impacts.size(), 1u);
    std::printf("  %-42.42s energy %.1e   bound 1e-13; %ld impacts, lost %.6f J\n",
                more.substr(0, more.find('\n', 12)).c_str(), value_of(r, "energy"),
                r.impacts[0].count, entry_of(r.losses, "j.joint_stop.impact"));
    EXPECT_TRUE(r.passed()) << more;
    EXPECT_EQ(r.impacts[0].name, "j.joint_stop");
    EXPECT_GE(r.impacts[0].count, 4);
    EXPECT_GT(entry_of(r.losses, "j.joint_stop.impact"), 0.1);
  }
}

/// The example: two balls in, two balls out; no energy is lost and those in between hang still.
TEST(RigidRun, NewtonsCradle) {
  TemporaryFolder folder;
  const auto s = shipped(folder, "newton_cradle", 1);
  const auto r = run_of(s);
  EXPECT_TRUE(r.passed());
  const auto& q = r.final_state.x;
  std::printf(
      "  after %.0f s: angles %.3f %.3f %.1e %.3f %.3f; energy %.1e; %ld impacts in the middle\n",
      r.simulated_s, q[0], q[1], q[2], q[3], q[4], value_of(r, "energy"), r.impacts[1].count);
  EXPECT_EQ(r.impacts.size(), 4u);
  EXPECT_EQ(r.impacts[1].count, 1);
  EXPECT_LE(std::fabs(q[0]) + std::fabs(q[1]) + std::fabs(q[2]), 1e-12);
  EXPECT_GT(q[3], 0.1);
  EXPECT_NEAR(q[3], q[4], 1e-12);
}

/// Interrupted and continued: the same bits, also while a contact is closed.
TEST(RigidRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  const auto s = scene_of(folder,
                          "[run]\nduration = 4\nrecord_every = 0.1\n"
                          "[[contact]]\nname = \"floor\"\nlinks = [\"base\"]\nlaw = \"rigid\"\n"
                          "restitution = 0.4\n" +
                              stop + "restitution = 0.9\n[initial.base]\nposition = [0, 0, 1]\n",
                          "free");
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  auto o = into(folder / "parts");
  for (const std::int64_t at : {47, 150, 299}) {
    o.stop_at = at;
    EXPECT_TRUE(scene::run(s, a, o).interrupted);
    o.resume = true;
  }
  const auto rest = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(whole.final_state, rest.final_state);
  EXPECT_EQ(whole.impacts, rest.impacts);
  EXPECT_EQ(read_bytes(folder / "whole" / "run.h5"), read_bytes(folder / "parts" / "run.h5"));
  std::printf("  energy %.1e; impacts: floor %ld, stop %ld\n", value_of(whole, "energy"),
              whole.impacts[0].count, whole.impacts[1].count);
  EXPECT_GT(whole.impacts[0].count, 100);
  ASSERT_EQ(whole.impacts[0].first_s.size(), 100u);
  EXPECT_NEAR(whole.impacts[0].first_s[0], std::sqrt(2 * 0.8 / 9.81), 1e-2);
}

TEST(RigidRun, RefusalsSayWhereAndWhat) {
  const auto c = [](const std::string& keys) {
    return refusal("[[contact]]\nname = \"c\"\nlinks = [\"rod\"]\nlaw = \"rigid\"\n" + keys);
  };
  EXPECT_TRUE(says(c(""), "lacks the key 'restitution'"));
  EXPECT_TRUE(says(c("restitution = 1.1\n"), "restitution is 1.1, expected 0 to 1"));
  EXPECT_TRUE(
      says(c("restitution = 1\nstiffness = 3\n"), "stiffness is given with law = \"rigid\""));
  EXPECT_TRUE(says(c("restitution = 1\nfriction = 0.3\ncreep = 1\n"),
                   "creep is given with law = \"rigid\""));
  EXPECT_TRUE(says(c("restitution = 1\n"), "'c' is rigid and overlaps by 1.1 at the start"));
  EXPECT_TRUE(says(refusal(stop + "restitution = 1\nlower = 0.1\n"),
                   "joint 'j' starts 0.1 outside the limits of its rigid stop 'j.joint_stop'"));
  EXPECT_TRUE(says(refusal(stop + "restitution = 1\nsimultaneous = \"both\"\n"), "expected"));
  EXPECT_TRUE(says(refusal(stop + "restitution = 1\n[[motion]]\nname = \"m\"\njoint = \"j\"\n"
                                  "steady = { rate = 1 }\n"),
                   "is rigid and 'm' is a constraint, expected a soft law"));
}

}  // namespace
}  // namespace porthos::test::rigid_run_test
