// [[actuator]] in scenes: what it makes, and the sentence for each mistake.
#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "scene/assemble/assembly.h"
#include "scene/plot/actuator_plot.h"
#include "scene/plot/svg.h"
#include "tests/places.h"
#include "tests/support/bounds.h"
#include "tests/vsa/actuators.h"
#include "vsa/catalogue.h"

namespace porthos::test::scene_test {
namespace {

class Scenes : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("porthos_vsa_scenes_") + test->name());
    std::filesystem::create_directories(folder_);
    std::filesystem::copy_file(std::string(PORTHOS_SOURCE_DIR) + "/examples/qbmove_arm/arm.urdf",
                               folder_ / "arm.urdf",
                               std::filesystem::copy_options::overwrite_existing);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  scene::Assembly assembly(const std::string& actuator) {
    std::ofstream(folder_ / "scene.toml")
        << "[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[initial]\njoints.elbow = { position = "
           "0.3 }\n[[actuator]]\n"
        << actuator << "\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n[run]\nduration = 1\n";
    return scene::assemble(scene::read_scene((folder_ / "scene.toml").string()));
  }
  std::filesystem::path folder_;
};

const std::string elbow = "joint = \"elbow\"\n", qbmove = elbow + "device = \"qbmove_advanced\"\n";
const std::string fixed = "theta = { drive = \"fixed\" }\n",
                  held = "sigma = { drive = \"fixed\", start = 0.1 }\n";

TEST_F(Scenes, StartAtTheJointsAngle) {
  const auto a = assembly(qbmove + fixed + held);
  const auto& n = dynamic_cast<const phs::NetworkModel&>(*a.model);
  const size_t at = size_t(n.offset("elbow.actuator"));
  EXPECT_EQ(a.initial.x[at], 0.3);
  EXPECT_EQ(a.initial.x[at + 1], 0.3) << "the spring at rest";
  EXPECT_EQ(a.initial.x[at + 2], 0.1);
  const auto lower = assembly(elbow + "family = \"cosh\"\nparameters = { a = 6.0, k = 0.02 }\n" +
                              "theta = { drive = \"fixed\", start = 0.1 }\n" + held);
  EXPECT_EQ(lower.initial.x[at + 1], 0.1);
}

/// The picture of a spring has its energy, and of a table a curve and dots of one colour for each
/// measured setting. Controls: one of a catalogue has no energy, a device no rows.
TEST_F(Scenes, ThePictureOfATableHasItsEnergy) {
  std::ofstream(folder_ / "spring.csv") << "deflection,torque\n-0.5,-1\n0,0\n0.5,1\n";
  const auto picture = [&](const std::string& actuator) {
    (void)assembly(actuator);
    return scene::spring_plot(scene::read_scene((folder_ / "scene.toml").string()).actuators.at(0));
  };
  const std::string drawn = picture(elbow + "table = \"spring.csv\"\n" + fixed);
  EXPECT_NE(drawn.find("energy [J]"), std::string::npos);
  EXPECT_NE(drawn.find("width=\"1720\""), std::string::npos) << "a third and a fourth panel";
  EXPECT_NE(drawn.find("measured torque - curve [N m]"), std::string::npos);
  const auto dots = [](const std::string& svg) {
    size_t n = 0;
    for (size_t at = 0; (at = svg.find("<circle", at)) != svg.npos; ++at) ++n;
    return n;
  };
  EXPECT_EQ(dots(drawn), 6u) << "beside the curve, and less it";
  const std::string device = picture(qbmove + fixed + held);
  EXPECT_NE(device.find("energy [J]"), std::string::npos);
  EXPECT_EQ(dots(device), 0u);
  EXPECT_EQ(scene::datasheet_plot(vsa::device("qbmove_advanced")).find("energy [J]"),
            std::string::npos);

  std::ofstream five(folder_ / "five.csv");
  five << "deflection,sigma,torque\n";
  for (const double sigma : {0.0, 0.1, 0.3, 0.6, 1.0})
    for (const int phi : {-1, 0, 1})
      five << phi << ',' << sigma << ',' << phi * (1 + sigma) << '\n';
  five.close();
  const std::string settings = picture(elbow + "table = \"five.csv\"\n" + fixed + held);
  EXPECT_EQ(dots(settings), 30u);
  for (size_t k = 0; k < 5; ++k) {
    const std::string dot = fmt::format("r=\"2.0\" fill=\"{}\"", scene::colour::lines[k]);
    size_t n = 0;
    for (size_t at = 0; (at = settings.find(dot, at)) != settings.npos; ++at) ++n;
    EXPECT_EQ(n, 6u) << "dots of setting " << k;
  }
  EXPECT_NE(settings.find("σ = 1 "), std::string::npos);
}

/// To the end of the range of σ. Controls: springs without room there, or with a pole nearby.
TEST_F(Scenes, ThePictureOfASpringGoesToTheEndOfItsRange) {
  const auto last = [&](const std::string& device, const std::string& start) {
    (void)assembly(elbow + "device = \"" + device + "\"\n" + fixed +
                   "sigma = { drive = \"fixed\", start = " + start + " }\n");
    const auto s = scene::read_scene((folder_ / "scene.toml").string());
    const std::string svg = scene::spring_plot(s.actuators.at(0));
    const size_t at = svg.rfind("σ = ") + std::string("σ = ").size();
    return svg.substr(at, svg.find(' ', at) - at);
  };
  EXPECT_EQ(last("awas", "0.03"), "0.09");
  EXPECT_EQ(last("maccepa_vd", "1"), "3.142");
  EXPECT_EQ(last("qbmove_advanced", "0.1"), "0.6");
  EXPECT_EQ(last("awas_ii", "0.03"), "0.06375");
}

/// offset + amplitude sin(2π f t + phase), and the note on a command that begins elsewhere.
TEST_F(Scenes, CommandsByPositionBeginAtTheStart) {
  const auto of = [&](const std::string& sine, double start) {
    return qbmove + held +
           fmt::format(
               "theta = {{ drive = \"position\", start = {}, inertia = 0.01, kp = 20, kd = 1, "
               "command = {{ sine = {{ amplitude = 0.2, frequency = 0.5{} }} }} }}\n",
               start, sine);
  };
  const auto notes = [](const scene::Assembly& a) {
    std::string all;
    for (const auto& n : a.notes) all += n.where + ": " + n.text + "\n";
    return all;
  };
  const std::string jump = notes(assembly(of("", 0.3)));
  EXPECT_NE(jump.find("its theta starts at 0.3 and the command at 0, a jump: expected start = 0"),
            std::string::npos)
      << jump;
  EXPECT_NE(jump.find("scene.toml:6:1: actuator 'elbow.actuator': its theta"), std::string::npos)
      << jump;
  const std::string none = notes(assembly(of(", offset = 0.3", 0.3)));
  EXPECT_EQ(none.find("a jump"), std::string::npos) << none;
  const auto s = scene::read_scene((folder_ / "scene.toml").string());
  const auto& command = *s.actuators[0].actuator.theta.command;
  double worst = 0, wrong = 0;
  for (const double t : {0.0, 0.3, 1.7}) {
    const double mean_free = 0.2 * std::sin(M_PI * t);
    worst = std::max(worst, std::fabs(command(t) - (0.3 + mean_free)));
    wrong = std::max(wrong, std::fabs(command(t) - mean_free));
  }
  keeps("sine with an offset, off the closed form", worst, 1e-15);
  breaks("control: without its offset", wrong, 0.1);
}

TEST_F(Scenes, TablesAreReadFromTheScenesFolder) {
  std::ofstream(folder_ / "spring.csv") << "deflection,sigma,torque\n-1,0,-2\n0,0,0\n1,0,2\n";
  EXPECT_NO_THROW(assembly(elbow + "table = \"spring.csv\"\n" + fixed));
  std::ofstream(folder_ / "spring.csv") << "deflection,sigma,torque\n-1,0,-2\n0,0,3\n1,0,2\n";
  const std::string why = refusal([&] { assembly(elbow + "table = \"spring.csv\"\n" + fixed); });
  EXPECT_NE(why.find("scene.toml:6:1: tabulated: at sigma = 0 torque goes from 3 to 2 N m"),
            std::string::npos)
      << why;
}

TEST_F(Scenes, ATableIsSmoothedByTheErrorsStated) {
  std::ofstream(folder_ / "spring.csv")
      << "deflection,sigma,torque\n-2,0,-4.1\n-1,0,-1.9\n0,0,0\n1,0,2.2\n2,0,3.8\n";
  const auto spring = [&](const std::string& more) {
    return assembly(elbow + "table = \"spring.csv\"\n" + more + fixed);
  };
  EXPECT_NO_THROW(spring("smoothing = 0.1\n"));
  const std::pair<const char*, const char*> bad[] = {
      {"smoothing = -1\n", "smoothing is -1, expected a number of N m, 0 or more"},
      {"smoothing = true\n", "smoothing is a boolean, expected a number of N m"}};
  for (const auto& [keys, words] : bad) {
    const auto why = refusal([&, k = keys] { spring(k); });
    EXPECT_NE(why.find(words), std::string::npos) << why;
  }
  const auto why = refusal([&] { assembly(qbmove + "smoothing = 0.1\n" + fixed + held); });
  EXPECT_NE(why.find("smoothing is given without a table, expected both or neither"),
            std::string::npos)
      << why;
}

TEST_F(Scenes, MistakesAreRefusedWithTheirLine) {
  const std::pair<std::string, const char*> bad[] = {
      {qbmove + "theta = { drive = \"torque\", inertia = 0.01, gyroscopics = \"body\" }\n" + held,
       "gyroscopics is not \"neglected\", and a scene offers nothing else"},
      {qbmove + "theta = { drive = \"fixed\", start = -0.5 }\n" + held,
       "scene.toml:6:1: actuator 'elbow.actuator': starts with a spring deflected by 0.9 rad"},
      {qbmove + fixed + "sigma = { drive = \"fixed\", start = 1.0 }",
       "sigma starts at 1 rad, expected -0.8 to 0.8 rad"},
      {qbmove + "theta = { drive = \"torque\", inertia = 0, command = { constant = 1 } }\n" + held,
       "theta inertia is 0, expected more than 0 kg m^2: a torque on no inertia has no rate"},
      {qbmove + fixed,
       "[[actuator]] lacks the key 'sigma', expected a table with the keys start [rad] (half the "
       "angle between the motors) and drive"},
      {qbmove + held, "[[actuator]] lacks the key 'theta'"},
      {qbmove + fixed + held +
           "[[element]]\ntype = \"dc_motor\"\nname = \"m\"\njoint = \"elbow\"\nresistance = "
           "1\ninductance = 0.1\nconstant = 0.1\nvoltage = { constant = 1 }\n",
       "scene.toml:6:1: actuator 'elbow.actuator' and dc_motor 'm' both drive joint 'elbow'"},
      {elbow + fixed, "has 0 of the keys device, family and table, expected one"},
      {elbow + "device = \"qbmove\"\n" + fixed + held,
       "unknown device 'qbmove', expected one of qbmove_advanced"},
      {elbow + "device = \"vsa_cube\"\n" + fixed + held,
       "has no model: its parameters are not public"},
      {elbow + "family = \"cosh\"\nparameters = { a = 6.0, c = 1 }\n" + fixed + held,
       "unknown key 'c' in parameters, the nearest known one is 'a'"},
      {elbow + "device = \"sea_100\"\n" + fixed + held,
       "the energy of 'series_elastic' does not depend on sigma, expected none"},
      {elbow + "device = \"edinburgh\"\n" + fixed + "sigma = { drive = \"fixed\", start = 1 }",
       "theta lacks the key 'start', expected a number of rad: this spring is at rest at no one "
       "angle"},
      {qbmove + "theta = { drive = \"rate\", command = { constant = 1 }, inertia = 1 }\n" + held,
       "theta.inertia is given with drive = \"rate\", expected command, rate_limit"},
      {qbmove + "theta = { drive = \"fixed\", viscous = 0.1 }\n" + held,
       "theta.viscous is given with drive = \"fixed\", expected none: losses of the joint are an "
       "[[element]] of type damper or friction"},
      {qbmove + "theta = { drive = \"fixed\", gear = 2 }\n" + held,
       "theta.gear is given with drive = \"fixed\", expected no more keys"},
      {qbmove + "theta = { drive = \"torque\", inertia = 1 }\n" + held,
       "theta lacks the key 'command', expected a table"},
      {qbmove + fixed + held + "joints = 1",
       "unknown key 'joints' in [[actuator]], the nearest known one is 'joint'"},
      {"joint = \"wrist\"\ndevice = \"qbmove_advanced\"\n" + fixed + held,
       "actuator 'wrist.actuator': the model has no joint 'wrist' of one degree of freedom, "
       "expected one of: "
       "shoulder, elbow"},
      {qbmove + fixed + held + "[[actuator]]\nname = \"again\"\n" + qbmove + fixed + held,
       "port 'mechanism.elbow.torque' is joined by"}};
  for (const auto& [text, says] : bad) {
    const std::string why = refusal([&, t = text] { assembly(t); });
    EXPECT_NE(why.find(says), std::string::npos) << why << "\n  instead of: " << says;
    EXPECT_NE(why.find("scene.toml:"), std::string::npos) << why;
  }
  // The energies are of angles.
  std::ofstream(folder_ / "arm.urdf")
      << R"(<robot name="slide"><link name="world"/><link name="leg"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="prismatic"><parent link="world"/><child link="leg"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)";
  const std::string why = refusal([&] { assembly(qbmove + fixed + held); });
  EXPECT_NE(why.find("actuator 'elbow.actuator': 'elbow' slides, expected a joint that turns"),
            std::string::npos)
      << why;
}

}  // namespace
}  // namespace porthos::test::scene_test
