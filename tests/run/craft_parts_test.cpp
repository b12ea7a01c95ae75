// Scenes with thrusters, torquers, control-moment gyros, soft latches, panels and events that wait.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::craft_parts_test {
namespace {

using nlohmann::json;

std::string inertial(double mass, double x, double y, double z) {
  const auto n = [](double a) { return std::to_string(a); };
  return "<inertial><mass value='" + n(mass) + "'/><inertia ixx='" + n(x) + "' iyy='" + n(y) +
         "' izz='" + n(z) + "' ixy='0' ixz='0' iyz='0'/></inertial>";
}
std::string turning(const std::string& name, const std::string& parent, const std::string& axis) {
  return "<link name='" + name + "_link'>" + inertial(10, 0.1, 0.1, 0.1) + "</link><joint name='" +
         name + "' type='continuous'><parent link='" + parent + "'/><child link='" + name +
         "_link'/><axis xyz='" + axis + "'/></joint>";
}
/// A bus with three wheels.
std::string bus_urdf() {
  return "<robot name='bus'><link name='bus'>" + inertial(200, 40, 50, 60) + "</link>" +
         turning("wheel_x", "bus", "1 0 0") + turning("wheel_y", "bus", "0 1 0") +
         turning("wheel_z", "bus", "0 0 1") + "</robot>";
}
std::string head(const std::string& more = "") {
  return "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n" + more;
}
std::string tail(double step, double duration, const std::string& verify) {
  return "[integrator]\nmethod = \"gauss12\"\nstep = " + std::to_string(step) +
         "\n[run]\nduration = " + std::to_string(duration) + "\n[verify]\n" + verify;
}
std::string wheels(double gain) {
  std::string text;
  for (const char* axis : {"x", "y", "z"})
    text += std::string("[[element]]\ntype = \"wheel\"\njoint = \"wheel_") + axis +
            "\"\ngain = " + std::to_string(gain) + "\n";
  return text;
}
std::string rods(const std::string& how) {
  std::string text;
  for (const auto& [name, d] :
       {std::pair{"rod_x", "[1, 0, 0]"}, {"rod_y", "[0, 1, 0]"}, {"rod_z", "[0, 0, 1]"}})
    text += std::string("[[element]]\ntype = \"torquer\"\nname = \"") + name +
            "\"\ndirection = " + d + "\n" + how;
  return text;
}
scene::Scene made(const TemporaryFolder& folder, const std::string& urdf, const std::string& text) {
  write_bytes(folder / "model.urdf", urdf);
  write_bytes(folder / "scene.toml", text);
  return scene::read_scene((folder / "scene.toml").string());
}
json summary(const TemporaryFolder& folder) {
  return json::parse(read_bytes(folder / "out" / "summary.json"));
}
const scene::Check* check_of(const scene::RunReport& r, const std::string& name) {
  for (const auto& c : r.checks)
    if (c.name == name) return &c;
  return nullptr;
}

const std::string jet =
    "[[element]]\ntype = \"thruster\"\nname = \"jet\"\nlink = \"bus\"\nat = [0.4, 0.1, 0.0]\n"
    "direction = [0, 1, 0]\nthrust = 2.0\nspecific_impulse = 220\n";

TEST(CraftParts, ThrusterTableAndMomentaLessImpulses) {
  TemporaryFolder folder;
  const auto s =
      made(folder, bus_urdf(),
           head("[initial]\nbase.angular_velocity = [0.01, 0.02, -0.03]\n") + jet +
               "pulses = { start = 1.0, period = 2.0, width = 0.5, count = 8 }\n" + wheels(5) +
               tail(0.1, 30,
                    "balance = 1e-13\nlinear_momentum = 1e-13\n"
                    "angular_momentum = 1e-13\n"));
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  ASSERT_EQ(r.impulses.rows.size(), 1u);
  const auto& row = r.impulses.rows[0];
  const double kg = 4.0 * 2 / (220 * 9.80665);
  std::printf("  on %.12g s (4), %.6f kg (%.6f); left: linear %.1e, angular %.1e   bound 1e-13\n",
              row.on_s, row.propellant_kg, kg, r.impulses.linear_left, r.impulses.angular_left);
  EXPECT_NEAR(row.on_s, 4, 1e-12);
  EXPECT_NEAR(row.propellant_kg, kg, 1e-15);
  ASSERT_TRUE(check_of(r, "linear_momentum (less impulses)"));
  ASSERT_TRUE(check_of(r, "angular_momentum (less impulses)"));
  const auto j = summary(folder);
  EXPECT_EQ(j["impulses"]["jet"]["impulse_Ns"][1].get<double>(), row.impulse[1]);
  EXPECT_GT(std::hypot(row.impulse[0], row.impulse[1]), 7);  // of 8 N s, the bus turns a little
  // Control: the momenta alone are far from kept.
  EXPECT_GT(std::fabs(row.impulse[1]), 1);
}

// Torquers rest once all wheels they unload are locked: there is no momentum left to take.
TEST(CraftParts, TorquersRestWithTheLastWheel) {
  TemporaryFolder folder;
  std::string locks;
  for (const char* axis : {"x", "y", "z"})
    locks += std::string("[[event]]\nat = 10.0\ntype = \"lock\"\njoint = \"wheel_") + axis + "\"\n";
  const auto s = made(folder, bus_urdf(),
                      head("[environment]\nmagnetic_field = [0, 0, 3e-5]\n[initial]\n"
                           "joints.wheel_x = { velocity = 40 }\n") +
                          locks + rods("unload = 0.004\n") + wheels(500) +
                          tail(0.5, 20, "balance = 1e-12\nangular_momentum = 1e-13\n"));
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  const auto second = json::parse(read_bytes(folder / "out" / "phase_2" / "summary.json"));
  EXPECT_FALSE(second.contains("impulses"));
  const auto all = summary(folder)["impulses"]["rod_y"]["angular_impulse_Nms"];
  EXPECT_GT(std::fabs(all[0].get<double>()), 0.01) << "it has worked until then";
}

// Wheels that the torquers name count, whatever turns them: a lock of one leaves the others.
TEST(CraftParts, TorquersUnloadTheWheelsTheyName) {
  TemporaryFolder folder;
  const auto lock = [](const std::string& axis) {
    return "[[event]]\nat = 10.0\ntype = \"lock\"\njoint = \"wheel_" + axis + "\"\n";
  };
  const auto impulses_after = [&](const std::string& locks) {
    const auto s = made(
        folder, bus_urdf(),
        head("[environment]\nmagnetic_field = [0, 0, 3e-5]\n[initial]\n"
             "joints.wheel_x = { velocity = 40 }\n") +
            locks + rods("unload = 0.004\nwheels = [\"wheel_x\", \"wheel_y\", \"wheel_z\"]\n") +
            tail(0.5, 20, "balance = 1e-12\nangular_momentum = 1e-13\n"));
    fs::remove_all(folder / "out");
    EXPECT_TRUE(scene::run(s, scene::assemble(s), into(folder / "out")).passed());
    const auto second = json::parse(read_bytes(folder / "out" / "phase_2" / "summary.json"));
    if (!second.contains("impulses")) return 0.0;
    return std::fabs(second["impulses"]["rod_y"]["angular_impulse_Nms"][0].get<double>());
  };
  EXPECT_GT(impulses_after(lock("z")), 0.01);
  EXPECT_EQ(impulses_after(lock("x") + lock("y") + lock("z")), 0);
}

TEST(CraftParts, TorquersUnloadWheels) {
  // h across the field falls like exp(-k t) while the wheels hold the bus; along it nothing can be
  // done.
  TemporaryFolder folder;
  const double k = 0.004;
  const auto s = made(
      folder, bus_urdf(),
      head("[environment]\nmagnetic_field = [0, 0, 3e-5]\n[initial]\njoints.wheel_x = { velocity = "
           "40 }\njoints.wheel_z = { velocity = 30 }\n") +
          rods("unload = 0.004\n") + wheels(500) +
          tail(0.5, 500, "balance = 1e-12\nangular_momentum = 1e-13\n"));
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  const auto table = summary(folder)["momentum"];
  const double x0 = table["wheel_x"]["start_Nms"], x1 = table["wheel_x"]["end_Nms"],
               z0 = table["wheel_z"]["start_Nms"], z1 = table["wheel_z"]["end_Nms"];
  const double fell = x1 / x0, expected = std::exp(-k * 500);
  std::printf(
      "  wheel_x fell to %.4f, exp(-kt) %.4f   bound 1 %%; wheel_z %.4f (stays); left %.1e\n", fell,
      expected, z1 / z0, r.impulses.angular_left);
  EXPECT_NEAR(fell / expected, 1, 0.01);
  EXPECT_NEAR(z1 / z0, 1, 0.01);
}

std::string orbit(const std::string& more = "") {
  return "[planet]\nrotation_rate = 7.292115e-5\nmagnetic = { equator = 3.12e-5, tilt = 0.19, "
         "longitude = -1.27 }\n[orbit]\naltitude = 550e3\ninclination = 1.2\n" +
         more;
}

TEST(CraftParts, TorquersUnloadWheelsInOrbit) {
  TemporaryFolder folder;
  const std::string start =
      "[initial]\njoints.wheel_x = { velocity = 40 }\njoints.wheel_y = { velocity = -30 }\n"
      "joints.wheel_z = { velocity = 30 }\n";
  const auto run = [&](const std::string& with) {
    const auto s = made(folder, bus_urdf(),
                        head(start) + orbit() + with + wheels(50) +
                            tail(2, 11500,
                                 "energy = 1e-12\norbital = 1e-15\nangular_momentum = "
                                 "1e-13\n"));
    auto o = into(folder / "out");
    fs::remove_all(folder / "out");
    return scene::run(s, scene::assemble(s), o);
  };
  const auto size = [&] {
    double sum = 0;
    const auto t = summary(folder)["momentum"];
    for (const char* w : {"wheel_x", "wheel_y", "wheel_z"})
      sum += std::pow(t[w]["end_Nms"].get<double>(), 2);
    return std::sqrt(sum);
  };
  const auto r = run(rods("unload = 0.001\nlimit = 200\n"));
  const double with = size();
  EXPECT_TRUE(r.passed());
  for (const auto& c : r.checks)
    std::printf("  %s %.2g   bound %.2g\n", c.name.c_str(), c.value, c.limit);
  run("");
  const double without = size();
  std::printf("  two orbits: wheels hold %.4f N m s, without torquers %.4f\n", with, without);
  EXPECT_LT(with, 0.1 * without);
  EXPECT_GT(without, 4);
}

TEST(CraftParts, ThrusterInOrbitAgainstPlainIntegration) {
  // A body that does not turn, pushed along y through its centre from 100 s to 200 s.
  TemporaryFolder folder;
  const double I = 50, F = 20, mass = 200;
  const auto s = made(
      folder, "<robot name='bus'><link name='bus'>" + inertial(mass, I, I, I) + "</link></robot>",
      head() +
          "[orbit]\naltitude = 550e3\n[[element]]\ntype = \"thruster\"\nname = \"jet\"\nlink = "
          "\"bus\"\ndirection = [0, 1, 0]\nthrust = 20.0\nswitches = [100.0, 200.0]\n" +
          tail(10, 1000, "orbital = 1e-15\nangular_momentum = 1e-13\n"));
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  EXPECT_TRUE(r.passed());
  using Real = long double;
  const size_t at = a.initial.x.size() - 6;
  std::array<Real, 6> x;
  for (size_t i = 0; i < 6; ++i) x[i] = a.initial.x[at + i];
  const Real mu = s.orbit->environment.planet.mu;
  const auto field = [&](const std::array<Real, 6>& y, bool on) {
    const Real r2 = y[0] * y[0] + y[1] * y[1] + y[2] * y[2], k = -mu / (r2 * sqrtl(r2));
    return std::array<Real, 6>{y[3],    y[4], y[5], k * y[0], k * y[1] + (on ? Real(F) / mass : 0),
                               k * y[2]};
  };
  const int per = 20;  // rk4 steps of 0.05 s: error 1e-12 of the orbit
  for (int n = 0; n < 1000 * per; ++n) {
    const bool on = n >= 100 * per && n < 200 * per;
    const Real h = Real(1) / per;
    const auto step = [&](const std::array<Real, 6>& k, Real c) {
      auto y = x;
      for (size_t i = 0; i < 6; ++i) y[i] += c * h * k[i];
      return field(y, on);
    };
    const auto k1 = field(x, on), k2 = step(k1, 0.5L), k3 = step(k2, 0.5L), k4 = step(k3, 1);
    for (size_t i = 0; i < 6; ++i) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  double off = 0;
  for (size_t i = 0; i < 3; ++i)
    off = std::max(off, std::fabs(double(r.final_state.x[at + i] - x[i])));
  const auto& row = r.impulses.rows.at(0);
  const double work = [&] {
    for (const auto& [name, joule] : r.space->orbital.works)
      if (name == "thrust") return joule;
    return 0.0;
  }();
  std::printf(
      "  position off by %.1e m   bound 1e-3; impulse - F dt %.1e N s   bound 1e-11; work on "
      "the orbit %.6g J of a change of %.6g J\n",
      off, row.impulse[1] - F * 100, work, r.space->orbital.change);
  EXPECT_LE(off, 1e-3);
  EXPECT_NEAR(row.impulse[1], F * 100, 1e-11);
  EXPECT_NEAR(work, r.space->orbital.change, 1e-3 * work);
}

std::string gyro_urdf(double off = 0) {
  return "<robot name='bus'><link name='bus'>" + inertial(200, 40, 50, 60) + "</link>" +
         turning("gimbal", "bus", "0 0 1") + "<link name='rotor'>" +
         inertial(15, 0.12, 0.07, 0.07 + off) +
         "</link><joint name='spin' type='continuous'><parent link='gimbal_link'/><child "
         "link='rotor'/><axis xyz='1 0 0'/></joint></robot>";
}
std::string gyro() {
  return head("[initial]\njoints.spin = { velocity = 628.3 }\n") +
         "[[element]]\ntype = \"cmg\"\nname = \"gyro\"\njoint = \"gimbal\"\nwheel = \"spin\"\ngain "
         "= "
         "300.0\nprofile = { times = [0, 5, 10, 15, 20], values = [0, 0.04, 0.06, 0.02, 0] }\n";
}

// An event does not count a burn twice: each phase has its own seconds, in orbit as in free space.
TEST(CraftParts, ABurnBeforeAnEventIsCountedOnce) {
  for (const char* place : {"[orbit]\naltitude = 550e3\n", ""}) {
    TemporaryFolder folder;
    const auto s = made(folder, bus_urdf(),
                        head() + place + jet + "switches = [100.0, 200.0]\n" +
                            "[[event]]\nat = 300.0\ntype = \"lock\"\njoint = \"wheel_x\"\n" +
                            tail(1, 400, "quaternion_norm = 1e-12\n"));
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    EXPECT_EQ(r.phases, 2);
    ASSERT_EQ(r.impulses.rows.size(), 1u);
    EXPECT_NEAR(r.impulses.rows[0].on_s, 100, 1e-9) << place;
    EXPECT_NEAR(r.impulses.rows[0].propellant_kg, 100 * 2 / (220 * 9.80665), 1e-12);
  }
}

TEST(CraftParts, ControlMomentGyroKeepsItsWheelAndTheTotal) {
  TemporaryFolder folder;
  const auto s = made(folder, gyro_urdf(),
                      gyro() + tail(0.2, 40, "balance = 1e-12\nangular_momentum = 1e-13\n"));
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  EXPECT_TRUE(r.passed());
  const auto j = summary(folder);
  const auto spin = j["momentum"]["spin"];
  const double start = spin["start_Nms"], end = spin["end_Nms"];
  const double gimbal = j["final_state"]["q"]["gimbal"];
  std::printf("  gimbal at %.3f rad, wheel holds %.4f N m s, changed by %.1e   bound 1e-15\n",
              gimbal, end, end / start - 1);
  EXPECT_NEAR(end / start, 1, 1e-15);
  EXPECT_GT(gimbal, 0.4);
  EXPECT_NEAR(j["momentum"]["total"]["end_Nms"].get<double>(),
              j["momentum"]["total"]["start_Nms"].get<double>(), 1e-12);
}

std::string example(const std::string& folder, const std::string& file) {
  return read_bytes(std::string(PORTHOS_SOURCE_DIR) + "/examples/" + folder + "/" + file);
}

TEST(CraftParts, SoftLatchTakesThePlaceOfTheWeld) {
  TemporaryFolder folder;
  write_bytes(folder / "servicer.urdf", example("capture", "servicer.urdf"));
  write_bytes(folder / "soft.toml", example("capture", "soft.toml"));
  auto s = scene::read_scene((folder / "soft.toml").string());
  s.duration = 150;
  std::erase_if(s.events, [](const auto& e) { return e.type == scene::Event::Type::lock; });
  scene::Event off;
  off.type = scene::Event::Type::disengage;
  off.name = "soft_latch";
  off.at = 100;
  s.events.push_back(off);
  const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
  for (const auto& c : r.checks)
    std::printf("  %-32s %.2g   bound %.2g\n", c.name.c_str(), c.value, c.limit);
  EXPECT_TRUE(r.passed());
  const auto j = summary(folder);
  ASSERT_EQ(j["events"].size(), 2u);
  EXPECT_EQ(j["events"][0]["dissipated_J"].get<double>(), 0);
  EXPECT_GE(j["events"][0]["at_s"].get<double>(), 10);
  double damped = 0, given_up = 0;
  for (const auto& [name, joule] : r.losses) {
    if (name == "soft_latch.damping") damped = joule;
    if (name == "disengagement of soft_latch") given_up = joule;
  }
  std::printf("  engaged at %.1f s; dampers took %.4f J, the springs gave up %.1e J at release\n",
              j["events"][0]["at_s"].get<double>(), damped, given_up);
  EXPECT_GT(damped, 0.01);
  EXPECT_GE(given_up, 0);
}

TEST(CraftParts, DeploymentLocksAtItsStop) {
  TemporaryFolder folder;
  write_bytes(folder / "satellite.urdf", example("deployment", "satellite.urdf"));
  write_bytes(folder / "scene.toml", example("deployment", "scene.toml"));
  auto s = scene::read_scene((folder / "scene.toml").string());
  s.duration = 60;
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  for (const auto& c : r.checks)
    std::printf("  %-32s %.2g   bound %.2g\n", c.name.c_str(), c.value, c.limit);
  EXPECT_TRUE(r.passed());
  const auto j = summary(folder);
  ASSERT_EQ(j["events"].size(), 1u);
  const auto before = json::parse(read_bytes(folder / "out" / "phase_1" / "summary.json"));
  const double angle = before["final_state"]["q"]["hinge"],
               rate = before["final_state"]["v"]["hinge"];
  const double over = angle - 1.5707963, lost = j["events"][0]["dissipated_J"],
               at = j["events"][0]["at_s"];
  // Of a step, the hinge turns far more: whole steps alone would lock it there.
  std::printf(
      "  locked %.1e rad from the stop   bound 1e-15 (%.1e in a step), %.3f steps in; "
      "%.4f J lost\n",
      over, rate * s.step, at / s.step, lost);
  EXPECT_LE(std::fabs(over), 1e-15);
  EXPECT_GT(rate * s.step, 1e-3);
  EXPECT_GT(std::fabs(at / s.step - std::round(at / s.step)), 0.01) << "between two steps";
  EXPECT_LT(j["events"][0]["angular_momentum_jump"].get<double>(), 1e-15);
  EXPECT_GT(lost, 1e-4);
  // The second phase goes back to whole steps: its end is that of the run, its records at whole
  // times.
  EXPECT_EQ(r.final_state.step, 3000);
  EXPECT_EQ(r.final_state.origin_step, 0);
  EXPECT_EQ(r.simulated_s, 60);
  // Killed at any moment it ends with the same bits, the event at the same step.
  std::atomic<bool> stop{false};
  auto o = into(folder / "part");
  o.stop = &stop;
  int calls = 0;
  o.progress = [&](double, double, double) { stop = ++calls % 2 == 1; };
  scene::RunReport again;
  int parts = 0;
  do {
    stop = parts == 0;
    again = scene::run(s, a, o);
    ++parts;
    o.resume = true;
  } while (again.interrupted && parts < 50);
  EXPECT_GT(parts, 1);
  EXPECT_EQ(again.final_state.x, r.final_state.x);
  EXPECT_EQ(again.final_state.lo, r.final_state.lo);
  // A lock that never comes fails the run.
  s.events[0].above = 6.0;
  s.duration = 40;
  const auto never = scene::run(s, a, into(folder / "never"));
  EXPECT_FALSE(never.passed());
  ASSERT_TRUE(check_of(never, "missed_events"));
  EXPECT_TRUE(std::any_of(never.notes.begin(), never.notes.end(), [](const std::string& note) {
    return note.starts_with("it never happened: lock of ") &&
           note.find("; at the end of the run the angle is ") != note.npos &&
           note.find("; nearest to all its limits at 21.2") != note.npos &&
           note.find("expected above 6 rad") != note.npos;
  })) << never.notes.back();
}

TEST(CraftParts, WhatCannotBeIsRefusedWithItsLine) {
  const std::string end = tail(0.1, 10, "balance = 1e-9\n");
  struct Case {
    std::string urdf, text, says;
  };
  const std::string rod =
      "[[element]]\ntype = \"torquer\"\nname = \"rod\"\ndirection = [1, 0, 0]\n";
  const std::string latch =
      "[[element]]\ntype = \"soft_latch\"\nname = \"l\"\nlink = \"bus\"\nbody = \"wheel_x_link\"\n";
  const Case cases[] = {
      {bus_urdf(), head() + jet + "switches = [1.0, 2.05]\n" + end,
       "switches at 2.05 s, 20.5 steps of 0.1 s, expected a whole number of steps"},
      {bus_urdf(), head() + jet + "switches = [2.0, 1.0]\n" + end,
       "the switching instant 1 s follows 2 s, expected rising times"},
      {bus_urdf(), head() + jet + "joint = \"wheel_x\"\n" + end, "unknown key 'joint'"},
      {bus_urdf(), head() + rod + "constant = 1.0\n" + end, "there is no magnetic field"},
      {bus_urdf(), head() + rod + "unload = 1.0\n" + end, "unloads wheels and the scene has none"},
      {bus_urdf(), head() + rod + end, "has 0 of the keys constant, sine, profile and file"},
      {bus_urdf(), head() + "[orbit]\naltitude = 550e3\n" + rod + "constant = 1.0\n" + end,
       "planet 'earth' has no magnetic field"},
      {bus_urdf(),
       head() + "[planet]\nmagnetic = { equator = 3e-5, tilt = 0.2 }\n[orbit]\naltitude = 550e3\n" +
           end,
       "whose rotation is not given"},
      {bus_urdf(),
       head("[environment]\nmagnetic_field = [0, 0, 3e-5]\n") + "[orbit]\naltitude = 550e3\n" + end,
       "expected that of the [planet]"},
      {bus_urdf(), head() + latch + end, "does nothing, expected a stiffness or a damping"},
      {bus_urdf(), head() + latch + "stiffness = [1, -1, 0]\n" + end, "is -1, expected 0 or more"},
      {bus_urdf(),
       head() + latch +
           "stiffness = 1.0\n[[event]]\ntype = \"engage\"\nlatch = \"m\"\nat = 1\nreach = 1\n" +
           end,
       "there is no soft latch 'm'"},
      {bus_urdf(),
       head() + latch +
           "stiffness = 1.0\n[[event]]\ntype = \"disengage\"\nlatch = \"l\"\nat = "
           "1\n[[event]]\ntype "
           "= \"disengage\"\nlatch = \"l\"\nat = 2\n" +
           end,
       "soft latch 'l' is not engaged"},
      {bus_urdf(),
       head() + "[[event]]\ntype = \"lock\"\njoint = \"wheel_x\"\nat = 1\nabove = 2\n" + end,
       "has 2 of the keys at, above and below, expected one"},
      {bus_urdf(), head() + "[[event]]\ntype = \"lock\"\njoint = \"wheel\"\nabove = 2\n" + end,
       "waits for 'wheel', expected a coordinate of one number: wheel_x"},
      {gyro_urdf(0.01), gyro() + end, "is not balanced about its axis"},
      {gyro_urdf(),
       head() +
           "[[panel]]\nname = \"p\"\nlink = \"bus\"\nlength = 1\nmass = 1\n"
           "bending_stiffness = 1\nalong = [1, 0.1, 0]\n" +
           end,
       "is not at right angles to the other axis"},
      {gyro_urdf(),
       head() +
           "[[panel]]\nname = \"p\"\nlink = \"bus\"\nlength = 1\nmass = 1\n"
           "bending_stiffness = 1\nsegments = 4294967298\n" +
           end,
       "segments is 4294967298, expected 1 to 1000"}};
  for (const Case& c : cases) {
    TemporaryFolder folder;
    const auto refused = refusal([&] {
      const auto s = made(folder, c.urdf, c.text);
      scene::run(s, scene::assemble(s), into(folder / "out"));
    });
    EXPECT_TRUE(says(refused, c.says)) << refused;
    EXPECT_TRUE(says(refused, "scene.toml:")) << refused;
  }
}

}  // namespace
}  // namespace porthos::test::craft_parts_test
