// Commanded attitudes of a base that wheels turn.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "scene/files/hdf5_reader.h"
#include "tests/run/scenes.h"

namespace porthos::test::pointing_test {
namespace {

std::string bus() {
  const auto wheel = [](const std::string& name, const std::string& axis) {
    return "<link name='" + name +
           "_link'><inertial><mass value='5'/><inertia ixx='0.05' iyy='0.05' izz='0.05' ixy='0' "
           "ixz='0' iyz='0'/></inertial></link><joint name='" +
           name + "' type='continuous'><parent link='bus'/><child link='" + name +
           "_link'/><axis xyz='" + axis + "'/></joint>";
  };
  return "<robot name='bus'><link name='bus'><inertial><mass value='100'/><inertia ixx='20' "
         "iyy='25' izz='30' ixy='0' ixz='0' iyz='0'/></inertial></link>" +
         wheel("wheel_x", "1 0 0") + wheel("wheel_y", "0 1 0") + wheel("wheel_z", "0 0 1") +
         "</robot>";
}
std::string scene_of(const std::string& initial, const std::string& keys, double duration) {
  return "[model]\nurdf = 'model.urdf'\nbase = 'free'\n[initial]\n" + initial +
         "[[controller]]\ntype = 'wheel_attitude'\nname = 'attitude'\nlink = 'bus'\nwheels = "
         "['wheel_x', 'wheel_y', 'wheel_z']\nstiffness = [2, 2, 2]\ndamping = [15, 15, 15]\n" +
         keys + "[integrator]\nmethod = 'gauss8'\nstep = 0.25\n[run]\nduration = " +
         std::to_string(duration) + "\nlow_words = true\n";
}
std::vector<double> end_of(const TemporaryFolder& folder, const std::string& out,
                           const std::string& text) {
  write_bytes(folder / "model.urdf", bus());
  write_bytes(folder / "scene.toml", text);
  const auto s = scene::read_scene((folder / "scene.toml").string());
  return scene::run(s, scene::assemble(s), into(folder / out)).final_state.x;
}

const std::string start = "base.angular_velocity = [0.02, -0.01, 0.03]\n";

/// A run whose attitude is commanded at 20 s is a run to 20 s, and from its last record another one
/// with the new attitude, to the rounding of its implicit equations, whose first guesses differ.
TEST(Pointing, ACommandIsAnotherLawFromItsTimeOn) {
  TemporaryFolder folder;
  const std::string rate = "rate = 2\n", other = "[0.6, 0, 0.8, 0]";
  const auto commanded =
      end_of(folder, "whole", scene_of(start, rate + "commands = [[20, 0.6, 0, 0.8, 0]]\n", 40));
  end_of(folder, "first", scene_of(start, rate, 20));
  const auto resumed = end_of(
      folder, "second", scene_of("from = 'first'\n", rate + "attitude_wxyz = " + other + "\n", 20));
  double off = 0;
  for (size_t i = 0; i < resumed.size(); ++i)
    off = std::max(off, std::fabs(commanded[i] - resumed[i]));
  std::printf("  off by %.1e   bound 1e-13\n", off);
  EXPECT_LT(off, 1e-13);
  const auto without = end_of(folder, "without", scene_of(start, rate, 40));
  EXPECT_GT(std::fabs(commanded[5] - without[5]), 0.1) << "control";
  EXPECT_LT(std::fabs(std::fabs(commanded[5]) - 0.8), 0.3) << "it turns to the new attitude";
}

/// Deviations of the three wheels' torques at rest in the wanted attitude.
std::vector<double> deviations(const TemporaryFolder& folder, const std::string& noise) {
  write_bytes(folder / "model.urdf", bus());
  write_bytes(folder / "scene.toml", scene_of("", "rate = 2\n" + noise, 20));
  const auto a = scene::assemble(scene::read_scene((folder / "scene.toml").string()));
  const auto system = a.model->instantiate<double>();
  std::vector<double> squares;
  constexpr int count = 5000;
  for (size_t h = 0; h < a.model->holds().size(); ++h) {  // one behind sensors, else one a wheel
    auto memory = a.model->holds()[h]->fresh;
    squares.resize(squares.size() + memory.size());
    for (int k = 0; k < count; ++k) {
      system->sample(h, k / 2.0, a.initial.x, memory);
      for (size_t i = 0; i < memory.size(); ++i)
        squares[squares.size() - memory.size() + i] += memory[i] * memory[i] / count;
    }
  }
  if (squares.size() != 3)
    throw std::logic_error("expected one held value of each of the three wheels");
  for (double& each : squares) each = std::sqrt(each);
  return squares;
}

/// A star tracker and gyros: (k_j + k_k) δ and d δω of axis i, by stiffness k and damping d.
TEST(Pointing, SeesTheBaseThroughNoise) {
  TemporaryFolder folder;
  const auto tracker = deviations(folder, "noise = { attitude = 1e-3, seed = 3 }\n"),
             gyro = deviations(folder, "noise = { angular_velocity = 1e-4 }\n"),
             none = deviations(folder, "noise = { rate = 0 }\n");
  for (size_t i = 0; i < 3; ++i) {
    std::printf("  axis %zu: %.4f and %.4f of the stated deviation   bound 0.04\n", i,
                tracker[i] / 4e-3, gyro[i] / 15e-4);
    EXPECT_NEAR(tracker[i] / 4e-3, 1, 0.04);  // 1/√(2 · 5000) is 0.01
    EXPECT_NEAR(gyro[i] / 15e-4, 1, 0.04);
    EXPECT_LT(none[i], 1e-15) << "control";
  }
  // In a run it points to the noise, and goes on with the same bits.
  const auto noisy = [&](const std::string& out, double duration) {
    return end_of(
        folder, out,
        scene_of(start, "rate = 2\nnoise = { attitude = 1e-3, angular_velocity = 1e-4 }\n",
                 duration));
  };
  const auto end = noisy("noisy", 200), again = noisy("again", 200);
  EXPECT_EQ(end, again);
  const double off = 2 * std::hypot(end[4], end[5], end[6]);
  std::printf("  off by %.1e rad after 200 s, of noise of 1e-3 rad\n", off);
  EXPECT_LT(off, 5e-3);
  EXPECT_GT(off, 1e-6) << "control: without noise it comes to rest";
}

/// A wheel that is full keeps its momentum, to rounding; the base goes on turning about its axis.
TEST(Pointing, AFullWheelTakesUpNoMore) {
  TemporaryFolder folder;
  const auto largest = [&](const std::string& out, const std::string& keys) {
    end_of(folder, out, scene_of(start, "rate = 2\n" + keys, 60));
    const scene::Hdf5Reader file(folder / out / "run.h5");
    std::vector<double> p(size_t(file.dataset("momentum/wheel_z").size()));
    file.read("momentum/wheel_z", p.data());
    double most = 0;
    for (const double each : p) most = std::max(most, std::fabs(each));
    return most;
  };
  const double limited = largest("limited", "momentum_limit = 0.25\n"), free = largest("free", "");
  std::printf("  limit 0.25 N m s: exceeded by %.1e   bound 1e-15;  without limit %.2f N m s\n",
              limited - 0.25, free);
  EXPECT_NEAR(limited, 0.25, 1e-15);
  EXPECT_GT(free, 0.3) << "control";
  EXPECT_TRUE(says(read_bytes(folder / "limited/summary.json"),
                   "controller 'attitude' at wheel_z.torque has a full wheel at "));
}

/// At a half turn the trace potential has its rest that is no minimum.
TEST(Pointing, AHalfTurnWhereTheLawHasNoTorqueIsTold) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf", bus());
  const auto told = [&](const std::string& text) {
    write_bytes(folder / "scene.toml", text);
    const auto a = scene::assemble(scene::read_scene((folder / "scene.toml").string()));
    std::string all;
    for (const auto& remark : a.remarks) all += remark;
    return all;
  };
  const auto about_z = [](double degrees) {
    const double half = degrees * M_PI / 360;
    return fmt::format("{:.17g}, 0, 0, {:.17g}", std::cos(half), std::sin(half));
  };
  const auto to = [&](double degrees) { return "attitude_wxyz = [" + about_z(degrees) + "]\n"; };
  const std::string note =
                        "scene.toml:5:1: 'attitude' is to make a half turn at the start, where its "
                        "torque is zero: it begins late or never; state a waypoint (commands) on "
                        "the way",
                    rate = "rate = 2\n";
  for (const double degrees : {180.0, 176.0, -176.0}) {
    EXPECT_TRUE(says(told(scene_of("", to(degrees), 60)), note)) << degrees;
    EXPECT_TRUE(says(told(scene_of("base." + to(degrees), rate, 60)), "at the start")) << degrees;
  }
  for (const double degrees : {170.0, 174.0, 0.0})
    EXPECT_EQ(told(scene_of("", to(degrees), 60)), "") << degrees << ", control";
  EXPECT_EQ(told(scene_of("base." + to(100), to(-90), 60)), "") << "control: 170 degrees apart";
  const auto commands = fmt::format("commands = [[20, {}], [40, {}], [50, {}]]\n", about_z(180),
                                    about_z(10), about_z(-170));
  EXPECT_TRUE(says(told(scene_of("", rate + commands, 60)), "a half turn at 20 s, at 50 s, where"));
  EXPECT_EQ(
      told(scene_of("", rate + fmt::format("commands = [[0, {}]]\n", about_z(90)) + to(180), 60)),
      "")
      << "control: the command at 0 is the first";
  // Of unequal stiffness a half turn about no axis of it is no rest.
  const auto oblique = scene_of("", "attitude_wxyz = [0, 1, 1, 0]\n", 60);
  auto unequal = oblique;
  unequal.replace(unequal.find("[2, 2, 2]"), 9, "[1, 4, 2]");
  EXPECT_TRUE(says(told(oblique), "at the start"));
  EXPECT_EQ(told(unequal), "") << "control";
  // It is true, and a note of the run.
  const auto turned = [&](const std::string& out, double degrees) {
    const auto x = end_of(folder, out, scene_of("", to(degrees), 60));
    return 2 * std::hypot(x[4], x[5], x[6]);
  };
  keeps("a half turn: turned after 60 s [rad]", turned("half", 180), 1e-9);
  breaks("170 degrees", turned("less", 170), 0.5);
  EXPECT_TRUE(says(read_bytes(folder / "half/summary.json"), note));
  EXPECT_FALSE(says(read_bytes(folder / "less/summary.json"), "half turn")) << "control";
}

TEST(Pointing, WrongCommandsAreTold) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf", bus());
  const auto said = [&](const std::string& keys) -> std::string {
    write_bytes(folder / "scene.toml", scene_of(start, keys, 20));
    try {
      (void)scene::read_scene((folder / "scene.toml").string());
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  const std::string rate = "rate = 2\n";
  EXPECT_TRUE(says(said("commands = [[20, 0.6, 0, 0.8, 0]]\n"),
                   "the law is continuous, expected the rate of a sampled one"));
  EXPECT_TRUE(says(said(rate + "commands = [[20, 1, 0, 0, 0], [20, 0, 1, 0, 0]]\n"),
                   "has 20 s after 20 s, expected times that rise"));
  EXPECT_TRUE(
      says(said(rate + "commands = [[20, 0, 0, 0, 0]]\n"), "has a quaternion of length 0 at 20 s"));
  EXPECT_TRUE(says(said(rate + "commands = [[20, 1, 0, 0]]\n"), "commands[0] is"));
  EXPECT_TRUE(says(said("momentum_limit = 1\n"),
                   "momentum_limit ends a torque and the law is continuous, expected the rate"));
}

}  // namespace
}  // namespace porthos::test::pointing_test
