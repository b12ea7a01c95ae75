// Notes on joints beyond the limits of a model file: the three worst and a count, not a paragraph.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"

namespace porthos::test::joint_limits_test {
namespace {

/// Of a chain of joints that start at 1, 1.1, 1.2 ... rad and turn as fast in rad/s: the note on
/// their limits, 0.5 rad and 0.25 rad/s, with these words.
std::string note_on(int joints, const std::string& words) {
  scene::Scene s;
  s.method = "gauss8";
  s.step = 0.001;
  s.duration = s.record_every = 0.001;
  std::string urdf = "<robot name='chain'><link name='link_0'/>";
  for (int k = 1; k <= joints; ++k) {
    const std::string n = std::to_string(k), name = "joint_" + n;
    urdf +=
        link("link_" + n, 1) + joint(name, "link_" + std::to_string(k - 1), "link_" + n, "0 1 0",
                                     "<limit lower='-9' upper='0.5' effort='0' velocity='0.25'/>");
    s.joints[name] = {0.9 + 0.1 * k, 0.9 + 0.1 * k};
  }
  for (size_t at; (at = urdf.find("continuous")) != std::string::npos;)
    urdf.replace(at, 10, "revolute");
  const TemporaryFolder folder;
  const Case c = make_case(folder, s, urdf + "</robot>");
  for (const auto& n : scene::run_in_memory(c.scene, c.assembly, {}).notes)
    if (n.find(words) != n.npos) return n;
  return "";
}

double told(const std::string& note, const std::string& words = "'joint_") {
  int names = 0;
  for (size_t at = 0; (at = note.find(words, at)) != note.npos; ++at) ++names;
  return names;
}

TEST(JointLimits, TheThreeWorstAndTheNamesOfTheOthers) {
  const std::string eleven = note_on(11, "limits of the model file do not act without");
  keeps("joints whose numbers the note on eleven has", told(eleven, "beyond its upper"), 3);
  EXPECT_EQ(told(eleven), 11) << "names";
  breaks("that of three names them all", told(note_on(3, "limits of the model file")), 2);
  EXPECT_TRUE(says(eleven,
                   "joint 'joint_11' is at 2 rad at the start, beyond its upper limit of "
                   "0.5 rad; 'joint_10' is at 1.9 rad"))
      << eleven;
  EXPECT_TRUE(says(eleven, "; less far beyond: 'joint_8', 'joint_7', ")) << eleven;
  EXPECT_FALSE(says(note_on(3, "limits of the model file"), "less far")) << "control";
}

TEST(JointLimits, TheThreeFastestAndACount) {
  const std::string six = note_on(6, "velocities of the model file's limits");
  keeps("joints that the note on six names", told(six), 3);
  EXPECT_TRUE(says(six, "joint 'joint_6' moves at ")) << six;
  EXPECT_TRUE(says(six, ", and 3 more: velocities")) << six;
  EXPECT_FALSE(says(note_on(3, "velocities of the model file's"), " more")) << "control";
}

TEST(JointLimits, ASoftLimitIsNamedWhereTheEnergyFails) {
  const auto notes = [](double limit, const std::string& keys = "\"limits\"\nstiffness = 1e4") {
    const TemporaryFolder folder;
    write_bytes(folder / "arm.urdf", arm_urdf());
    write_bytes(
        folder / "scene.toml",
        "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[initial]\njoints.elbow = { velocity "
        "= 3 }\n[[element]]\nname = \"ends\"\njoint = \"elbow\"\nlower = -1\n"
        "upper = 1\ntype = " +
            keys +
            "\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\n"
            "duration = 4\n[verify]\nenergy = " +
            std::to_string(limit) + "\n");
    const auto s = scene::read_scene((folder / "scene.toml").string());
    std::string all;
    for (const auto& n : scene::run_in_memory(s, scene::assemble(s), {}).notes) all += n + "\n";
    return all;
  };
  EXPECT_TRUE(says(notes(0), "the slope of the force of 'ends' jumps where the limit begins"));
  EXPECT_FALSE(says(notes(0.9), "the slope of the force")) << "control: the energy passes";
  // The keys that this note and the one on limits that do not act advise are those of a hard stop.
  const std::string advised = "\"joint_stop\" with law = \"rigid\" and a restitution";
  EXPECT_TRUE(says(notes(0), advised)) << notes(0);
  EXPECT_TRUE(says(note_on(1, "do not act without"), "law = \"rigid\" and a restitution"));
  const std::string hard = "\"joint_stop\"\nlaw = \"rigid\"";
  EXPECT_FALSE(says(notes(0, hard + "\nrestitution = 0.5"), "the slope of the force"));
  EXPECT_TRUE(says(refusal([&] { (void)notes(0, hard); }), "restitution")) << "control";
}

/// A lever of 0.27 kg m² that turns at 3 rad/s meets its stop. A contact lasts π √(I/k) with a
/// force k δ, and 2.804 d/v with k δ² and its depth d = (1.5 I v²/k)^(1/3).
TEST(JointLimits, ASoftStopNamesAStep) {
  const auto notes = [](const std::string& stop, double step, double speed = 3) {
    const TemporaryFolder folder;
    write_bytes(folder / "lever.urdf", "<robot name='lever'><link name='base'/>" + link("arm", 1) +
                                           joint("hinge", "base", "arm", "0 1 0") + "</robot>");
    write_bytes(folder / "scene.toml",
                fmt::format("[model]\nurdf = \"lever.urdf\"\nbase = \"fixed\"\n[initial]\n"
                            "joints.hinge = {{ velocity = {} }}\n[[element]]\nname = \"ends\"\n"
                            "joint = \"hinge\"\nlower = -1\nupper = 1\n{}\n[integrator]\n"
                            "method = \"gauss8\"\nstep = {}\n[run]\nduration = 4\n",
                            speed, stop, step));
    const auto s = scene::read_scene((folder / "scene.toml").string());
    std::string all;
    for (const auto& n : scene::run_in_memory(s, scene::assemble(s), {}).notes) all += n + "\n";
    return all;
  };
  const auto hard = [](const char* k) {
    return fmt::format("type = \"joint_stop\"\nlaw = \"power\"\nstiffness = {}", k);
  };
  const double contact = M_PI * std::sqrt(0.27 / 1e6), d = std::cbrt(1.5 * 0.27 * 9 / 1e4);
  const std::string failed = notes(hard("1e6"), 0.05);
  EXPECT_TRUE(says(failed, fmt::format("expected a smaller step than 0.05 s, to begin with {:.2g} "
                                       "s, a tenth of a contact with 'ends'",
                                       0.1 * contact)))
      << failed;
  EXPECT_FALSE(says(notes(hard("1e6"), 0.1 * contact), "the run ended")) << "control";
  const std::string kink = notes("type = \"limits\"\nstiffness = 1e4", 0.02);
  EXPECT_TRUE(says(kink, fmt::format("a shorter step, to begin with {:.2g} s, or \"joint_stop\"",
                                     0.1 * 2.804 * d / 3)))
      << kink;
  const std::string resolved = notes("type = \"limits\"\nstiffness = 1e4", 0.005);
  EXPECT_TRUE(says(resolved, "expected there a shorter step, or \"joint_stop\"")) << resolved;
}

}  // namespace
}  // namespace porthos::test::joint_limits_test
