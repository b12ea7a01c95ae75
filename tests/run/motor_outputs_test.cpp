// [[output]]s of the motors of actuators, against the scene's numbers and the rows of the ledger.
#include <fmt/format.h>

#include <cmath>

#include "scene/plot/motion.h"
#include "tests/places.h"
#include "tests/run/series.h"

namespace porthos::test::motor_outputs_test {
namespace {

/// The arm of two qbmoves for 2 s; outputs of the shoulder's motors.
scene::Scene arm(const TemporaryFolder& folder, const std::string& more) {
  const auto example = fs::path(PORTHOS_SOURCE_DIR) / "examples" / "qbmove_arm";
  fs::copy_file(example / "arm.urdf", folder / "arm.urdf", fs::copy_options::overwrite_existing);
  std::string text = read_bytes(example / "scene.toml");
  const std::string whole = "duration = 20.0";
  text.replace(text.find(whole), whole.size(), "duration = 2");
  write_bytes(folder / "scene.toml", text + "\n" + more);
  return scene::read_scene((folder / "scene.toml").string());
}

std::string motor(const char* name, const char* quantity, const char* more = "") {
  return fmt::format(
      "[[output]]\nquantity = \"{}\"\nname = \"{}\"\nactuator = \"shoulder_vsa\"\n{}", quantity,
      name, more);
}
std::string row(const char* name, const char* quantity, const char* of) {
  return fmt::format("[[output]]\nquantity = \"{}\"\nname = \"{}\"\nrow = \"shoulder_vsa.{}\"\n",
                     quantity, name, of);
}

double largest(const std::vector<double>& x, const std::function<double(size_t)>& exact) {
  double most = x.empty() ? HUGE_VAL : 0;
  for (size_t i = 0; i < x.size(); ++i)
    if (const double off = std::fabs(x[i] - exact(i)); !(off <= most)) most = off;
  return most;
}

// The torque is found from p', from which spring and losses of up to 5 N m are taken: roundings of
// 1e-15 of them. The ledger's powers follow from the same state by other formulas.
TEST(MotorOutputs, AreThoseOfTheScenesNumbersAndOfTheLedger) {
  TemporaryFolder folder;
  const auto sigma = "motor = \"sigma\"\n";
  const auto scene =
      arm(folder,
          motor("torque", "motor_torque") + motor("rate", "motor_rate") +
              motor("phi", "deflection") + motor("held", "motor_torque", sigma) +
              motor("winding", "motor_rate", sigma) + row("rotor", "energy", "rotor") +
              row("given", "power", "theta.controller") + row("wound", "power", "sigma.rate") +
              "[[output]]\nquantity = \"joint_position\"\nname = \"q\"\njoint = \"shoulder\"\n");
  const Series s(scene);
  const auto of = [&](const char* name) { return s(std::string("output/") + name); };
  const auto t = s("time"), torque = of("torque"), rate = of("rate"), held = of("held"),
             winding = of("winding"), q = of("q"), phi = of("phi"), rotor = of("rotor");
  ASSERT_GT(t.size(), 50u);
  const auto wish = [&](size_t i, double limit) {  // numbers of the scene
    const double turn = 2 * M_PI;
    const double command = 0.6 * std::sin(turn * 0.25 * t[i] + 0.34);
    const double u = 15 * (command - (q[i] - phi[i])) - 0.3 * rate[i];
    return limit * std::tanh(u / limit);
  };
  keeps("torque [N m]", largest(torque, [&](size_t i) { return wish(i, 5.5); }), 1e-12);
  breaks("control: without its limit", largest(torque, [&](size_t i) { return wish(i, 1e9); }),
         1e-4);
  keeps("rate against the rotor's energy [J]",
        largest(rotor, [&](size_t i) { return 0.0015 * rate[i] * rate[i]; }), 1e-15);
  keeps("power [W]", largest(of("given"), [&](size_t i) { return torque[i] * rate[i]; }), 1e-12);
  keeps("rate of sigma [rad/s]",
        largest(winding, [&](size_t i) { return 0.1 * std::sin(2 * M_PI * 0.1 * t[i]); }), 1e-15);
  keeps("power of sigma [W]", largest(of("wound"), [&](size_t i) { return held[i] * winding[i]; }),
        1e-15);
  const auto columns = scene::output_columns(scene, s.assembly);
  EXPECT_EQ(columns[0].unit, "N m");
  EXPECT_EQ(columns[4].unit, "rad/s");
}

// The panels have the closed form of the drives; the outputs are found from p'.
TEST(MotorOutputs, TheMotionShowsTheSame) {
  TemporaryFolder folder;
  auto scene = arm(folder, motor("torque", "motor_torque") + motor("phi", "deflection") +
                               row("given", "power", "theta.controller") +
                               row("wound", "power", "sigma.rate") +
                               motor("held", "motor_torque", "motor = \"sigma\"\n") +
                               "[[output]]\nquantity = \"joint_position\"\nname = \"q\"\n"
                               "joint = \"shoulder\"\n");
  const Series s(scene);
  const auto torque = s("output/torque"), q = s("output/q"), phi = s("output/phi");
  const auto line = [&](const char* what,
                        const std::string& of = "shoulder_vsa") -> std::vector<double> {
    scene::MotionRecords records{s("time"), {}, [&](const std::string& n) { return s(n); }};
    records.springs = scene::springs_of(scene);
    for (const auto& p : scene::motion_panels(*s.assembly.mechanism, records))
      for (const auto& l : p.lines)
        if (p.what == what && l.name == of) return l.value;
    return {};
  };
  keeps("theta [rad]", largest(line("motors [rad]"), [&](size_t i) { return q[i] - phi[i]; }),
        1e-14);
  keeps("torque [N m]",
        largest(line("torques of motors [N m]"), [&](size_t i) { return torque[i]; }), 1e-12);
  const auto held = s("output/held");
  const auto winder = [&] { return line("torques of motors [N m]", "shoulder_vsa, sigma"); };
  keeps("torque of sigma [N m]", largest(winder(), [&](size_t i) { return held[i]; }), 1e-12);
  breaks("control: that of theta", largest(winder(), [&](size_t i) { return torque[i]; }), 1e-3);
  const auto given = s("output/given"), wound = s("output/wound");
  keeps("power of theta [W]",
        largest(line("powers of motors [W]"), [&](size_t i) { return given[i]; }), 1e-12);
  keeps("power of sigma [W]",
        largest(line("powers of motors [W]", "shoulder_vsa, sigma"),
                [&](size_t i) { return wound[i]; }),
        1e-12);
  breaks("control: its sign",
         largest(line("powers of motors [W]"), [&](size_t i) { return -given[i]; }), 1e-3);
  scene.actuators[0].actuator.theta.kp = 14;
  breaks("control: another gain",
         largest(line("torques of motors [N m]"), [&](size_t i) { return torque[i]; }), 1e-3);
  auto& drive = scene.actuators[0].actuator.theta;
  drive.kind = vsa::Drive::Kind::torque;
  EXPECT_EQ(line("torques of motors [N m]").size(), q.size());
  scene.controllers.emplace_back();
  EXPECT_TRUE(line("torques of motors [N m]").empty()) << "a controller may add to the torque";
  EXPECT_TRUE(line("powers of motors [W]").empty()) << "so its power is not known";
  EXPECT_FALSE(line("motors [rad]").empty());
  drive.kind = vsa::Drive::Kind::fixed;
  EXPECT_TRUE(line("motors [rad]").empty());
}

TEST(MotorOutputs, MomentaOfMotorsAndJointsHaveOneUnit) {
  TemporaryFolder folder;
  const Series s(arm(folder, ""));
  size_t momenta = 0;
  for (const auto& block : s.assembly.model->description().blocks) {
    if (block.momentum < 0) continue;
    EXPECT_EQ(block.momentum_unit, "kg m^2/s") << block.name;
    ++momenta;
  }
  EXPECT_EQ(momenta, 4u);  // control: two joints, two motors
}

TEST(MotorOutputs, NothingSetsTheStiffnessOfAPlainSpring) {
  TemporaryFolder folder;
  auto text = read_bytes(fs::path(PORTHOS_SOURCE_DIR) / "examples/qbmove_arm/scene.toml");
  const size_t elbow = text.rfind("[[actuator]]");
  const size_t sigma = text.find("[actuator.sigma]", elbow), end = text.find("[[element]]");
  text.erase(sigma, end - sigma);
  const std::string device = "device = \"qbmove_advanced\"";
  text.replace(text.find(device, elbow), device.size(), "device = \"sea_100\"");
  fs::copy_file(fs::path(PORTHOS_SOURCE_DIR) / "examples/qbmove_arm/arm.urdf", folder / "arm.urdf");
  write_bytes(folder / "scene.toml", text +
                                         "\n[[output]]\nquantity = \"motor_rate\"\nname = \"o\"\n"
                                         "actuator = \"elbow_vsa\"\nmotor = \"sigma\"\n");
  EXPECT_TRUE(
      says(refusal([&] { (void)Series(scene::read_scene((folder / "scene.toml").string())); }),
           "output 'o': the energy of actuator 'elbow_vsa' ('series_elastic') does not "
           "depend on sigma, expected another quantity"));
}

/// A row of work has a power, one that is stored an energy.
TEST(MotorOutputs, ARowOfTheOtherQuantityIsToldWhich) {
  TemporaryFolder folder;
  const auto refused = [&](const std::string& more) {
    const auto scene = arm(folder, more);
    return refusal([&] { (void)Series(scene); });
  };
  EXPECT_TRUE(says(refused(row("e", "energy", "sigma.rate")),
                   "'shoulder_vsa.sigma.rate' is a row of work, not of energy that is stored, "
                   "expected quantity = \"power\""));
  EXPECT_TRUE(says(refused(row("p", "power", "rotor")),
                   "is a row of stored energy, expected quantity = \"energy\""));
  EXPECT_TRUE(says(refused(row("p", "power", "rate")), "the ledger has no row"));  // the control
}

/// A command through sharp bends swings beyond its values, as the profile of a force does. Control:
/// a sine.
TEST(MotorCommands, AProfileThatSwingsBeyondItsValuesIsNoted) {
  TemporaryFolder folder;
  const auto of = [&](const std::string& command) {
    (void)arm(folder, "");
    std::string text = read_bytes(folder / "scene.toml");
    const std::string sine = "sine = { amplitude = 0.1, frequency = 0.1 }";
    text.replace(text.find(sine), sine.size(), command);
    write_bytes(folder / "scene.toml", text);
    return scene::read_scene((folder / "scene.toml").string()).actuators[0].remark;
  };
  const std::string odd =
      of("profile = { times = [0, 2, 4, 6, 8, 10], values = [0.3, 0.3, 2, 2, 0.3, 0.3] }");
  EXPECT_NE(odd.find("sigma.command: the profile reaches 2."), odd.npos) << odd;
  EXPECT_TRUE(odd.ends_with("expected more points")) << odd;
  EXPECT_EQ(of("sine = { amplitude = 0.1, frequency = 0.2 }"), "");
}

}  // namespace
}  // namespace porthos::test::motor_outputs_test
