// Wrenches of time on links, and signals from files.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/session/replot.h"
#include "tests/run/scenes.h"

namespace porthos::test::wrench_test {
namespace {

constexpr double pi = std::numbers::pi;

std::string ball(double mass, double inertia) {
  const auto m = std::to_string(mass), i = std::to_string(inertia);
  return "<robot name='ball'><link name='ball'><inertial><mass value='" + m + "'/><inertia ixx='" +
         i + "' iyy='" + i + "' izz='" + i +
         "' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
}
std::string craft(const std::string& more, double step = 0.125, double duration = 4) {
  return "[model]\nurdf = 'model.urdf'\nbase = 'free'\n" + more +
         "[integrator]\nmethod = 'gauss12'\nstep = " + std::to_string(step) +
         "\n[run]\nduration = " + std::to_string(duration) + "\n[verify]\nenergy = 1e-12\n";
}
std::string wrench(const std::string& more) {
  return "[[element]]\ntype = 'wrench'\nname = 'push'\nlink = 'ball'\n" + more;
}
struct Ran {
  scene::RunReport report;
  std::vector<double> x;
};
Ran ran(const TemporaryFolder& folder, const std::string& urdf, const std::string& text) {
  write_bytes(folder / "model.urdf", urdf);
  write_bytes(folder / "scene.toml", text);
  const auto s = scene::read_scene((folder / "scene.toml").string());
  const auto a = scene::assemble(s);
  auto r = scene::run(s, a, into(folder / "out"));
  auto x = r.final_state.x;
  return {std::move(r), std::move(x)};
}
std::string why_not(const TemporaryFolder& folder, const std::string& text) {
  write_bytes(folder / "model.urdf", ball(3, 0.4));
  write_bytes(folder / "scene.toml", text);
  try {
    (void)scene::assemble(scene::read_scene((folder / "scene.toml").string()));
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

/// A force along world axes through the centre of a spinning ball: P(t) = ∫ F dt, whatever it does;
/// W = P²/2m. In the link's axes the same signal gives another momentum.
TEST(Wrench, InWorldAxesGivesTheIntegralOfItsForce) {
  TemporaryFolder folder;
  const double mass = 3, A = 2, f = 0.2, t = 4;
  const std::string spin = "[initial.base]\nangular_velocity = [0.3, -0.5, 0.7]\n";
  const std::string force =
      "force = { direction = [0, 3, 4], sine = { amplitude = 2, frequency = 0.2 } }\n";
  const double P = A * (1 - std::cos(2 * pi * f * t)) / (2 * pi * f);
  const auto world = ran(folder, ball(mass, 0.4), craft(spin + wrench("axes = 'world'\n" + force)));
  const size_t p = 7;  // position, quaternion, then the momenta
  const double y = world.x[p + 1], z = world.x[p + 2],
               off = std::hypot(world.x[p], y - 0.6 * P, z - 0.8 * P);
  std::printf("  momentum off by %.1e of %.3f N s   bound 1e-13\n", off, P);
  EXPECT_LT(off, 1e-13);
  EXPECT_TRUE(world.report.passed());
  double work = NAN, impulse = NAN;
  for (const auto& [name, joules] : world.report.ports)
    if (name == "push") work = joules;
  for (const auto& row : world.report.impulses.rows)
    if (row.name == "push") impulse = row.impulse[2];
  std::printf("  work off by %.1e J, impulse by %.1e N s   bound 1e-13\n",
              work - P * P / (2 * mass), impulse - 0.8 * P);
  EXPECT_NEAR(work, P * P / (2 * mass), 1e-13);
  EXPECT_NEAR(impulse, 0.8 * P, 1e-13);
  TemporaryFolder other;
  const auto link = ran(other, ball(mass, 0.4), craft(spin + wrench(force)));
  EXPECT_GT(std::fabs(link.x[p] - world.x[p]), 0.1) << "control: axes of the link";
}

/// A moment on a ball at rest: ω(t) = ∫ M dt / I, and the angle its integral.
TEST(Wrench, AMomentTurnsABody) {
  TemporaryFolder folder;
  const double I = 0.4, M = 0.1, t = 4;
  const auto r = ran(folder, ball(3, I),
                     craft(wrench("moment = { direction = [0, 0, 1], constant = 0.1 }\n")));
  const double half = 0.5 * M * t * t / (2 * I);
  std::printf("  attitude off by %.1e   bound 1e-14\n", r.x[6] - std::sin(half));
  EXPECT_NEAR(r.x[3], std::cos(half), 1e-14);
  EXPECT_NEAR(r.x[6], std::sin(half), 1e-14);
  EXPECT_TRUE(r.report.passed());
}

/// A constant force in the link's axes is a thruster that is always on: the same bits, also in
/// orbit, where it is a kick of the splitting.
TEST(Wrench, ConstantIsAThruster) {
  for (const bool orbit : {false, true}) {
    TemporaryFolder a, b;
    const std::string where = orbit ? "[orbit]\naltitude = 500e3\n" : "";
    const std::string spin = "[initial.base]\nangular_velocity = [0.3, -0.5, 0.7]\n";
    const auto w = ran(
        a, ball(3, 0.4),
        craft(where + spin +
              wrench("at = [0.3, 0.1, 0]\nforce = { direction = [0, 3, 4], constant = 0.5 }\n")));
    const auto t = ran(b, ball(3, 0.4),
                       craft(where + spin +
                             "[[element]]\ntype = 'thruster'\nname = 'push'\nlink = 'ball'\nat = "
                             "[0.3, 0.1, 0]\ndirection = [0, 3, 4]\nthrust = 0.5\n"));
    EXPECT_EQ(w.x, t.x) << orbit;
    EXPECT_TRUE(w.report.passed()) << orbit;
  }
}

/// In orbit a force along inertial axes moves the centre of mass, and a moment leaves it: both
/// converge with the order of the splitting to the motion with small steps.
TEST(Wrench, InOrbitConvergesWithTheSplitting) {
  const auto end = [](double step) {
    TemporaryFolder folder;
    return ran(folder, ball(3, 0.4),
               craft(
                   "[orbit]\naltitude = 500e3\n" +
                       wrench("axes = 'world'\nat = [0.2, 0, 0]\nforce = { direction = [0, 1, 0], "
                              "sine = { amplitude = 0.5, frequency = 0.05 } }\n"
                              "moment = { direction = [1, 0, 0], constant = 0.01 }\n"),
                   step, 32))
        .x;
  };
  const auto fine = end(1.0 / 16), middle = end(0.5), coarse = end(1);
  const auto off = [&](const std::vector<double>& x) {
    double sum = 0;  // attitude and spin
    for (size_t i = 3; i < 7; ++i) sum += std::fabs(x[i] - fine[i]);
    return sum;
  };
  const double order = std::log2(off(coarse) / off(middle));
  std::printf("  attitude off by %.1e and %.1e: order %.2f   expected 2 or more\n", off(coarse),
              off(middle), order);
  EXPECT_GT(order, 1.8);
  EXPECT_GT(off(coarse), 1e-9) << "control: there is an error to see";
}

std::string arm(const std::string& element) {
  return "[model]\nurdf = 'model.urdf'\nbase = 'free'\n[initial.joints.shoulder]\nvelocity = "
         "0.5\n" +
         element + "[integrator]\nmethod = 'gauss8'\nstep = 0.05\n[run]\nduration = 2\n";
}
std::string force(const std::string& more) {
  return "[[element]]\ntype = 'force'\njoint = 'shoulder'\n" + more;
}

/// A smooth signal from a file is the profile of its columns, a held one the pieces of its values.
TEST(Wrench, SignalsFromAFile) {
  TemporaryFolder folder;
  write_bytes(folder / "t.csv", "# of a test stand\ntime;tau\n0;1\n0.5;-2\n1;0.5\n1.5;3\n2;0\n");
  const auto bits = [&](const std::string& more) {
    fs::remove_all(folder / "out");
    return ran(folder, arm_urdf(), arm(force(more))).x;
  };
  const auto smooth =
      bits("profile = { times = [0, 0.5, 1, 1.5, 2], values = [1, -2, 0.5, 3, 0] }\n");
  const auto held = bits("pieces = { period = 0.5, values = [1, -2, 0.5, 3, 0] }\n");
  EXPECT_EQ(bits("file = { path = 't.csv', time = 'time', value = 'tau' }\n"), smooth);
  EXPECT_EQ(bits("file = { path = 't.csv', time = 'time', value = 'tau', between = 'held' }\n"),
            held);
  EXPECT_NE(smooth, held) << "control";
}

/// Results keep the file: they are read again without it, and a resumed run with another is told.
TEST(Wrench, ResultsKeepTheFile) {
  TemporaryFolder folder;
  write_bytes(folder / "t.csv", "t,tau\n0,1\n1,2\n2,0\n");
  const auto text = arm(force("file = { path = 't.csv', value = 'tau' }\n"));
  ran(folder, arm_urdf(), text);
  fs::remove(folder / "t.csv");
  EXPECT_EQ(scene::moved_in(folder / "out").mechanisms.size(), 1u);
  fs::remove_all(folder / "out");
  write_bytes(folder / "t.csv", "t,tau\n0,1\n1,2\n2,0\n");
  const auto path = (folder / "scene.toml").string();
  auto s = scene::read_scene(path);
  auto options = into(folder / "out");
  options.stop_at = 10;
  (void)scene::run(s, scene::assemble(s), options);
  EXPECT_TRUE(fs::exists(folder / "out" / "checkpoint" / "files.json"));
  write_bytes(folder / "t.csv", "t,tau\n0,1\n1,2.5\n2,0\n");
  s = scene::read_scene(path);
  options.resume = true;
  std::string said;
  try {
    (void)scene::run(s, scene::assemble(s), options);
  } catch (const InvalidArgument& e) {
    said = e.what();
  }
  EXPECT_TRUE(says(said, "of another run: the file t.csv has changed")) << said;
}

TEST(Wrench, WhatIsWrongIsTold) {
  TemporaryFolder folder;
  write_bytes(folder / "w.csv", "t,x\n0,1\n1,2\n1,3\n");
  write_bytes(folder / "u.csv", "t,x\n0,1\n1,2\n3,4\n");
  const auto said = [&](const std::string& more) { return why_not(folder, craft(wrench(more))); };
  EXPECT_TRUE(says(said(""), "wrench 'push' has no force and no moment, expected one or both"));
  EXPECT_TRUE(says(said("force = { direction = [0, 0, 1] }\n"),
                   "of the keys constant, sine, profile and file, expected one"));
  EXPECT_TRUE(
      says(said("force = { direction = [0, 0, 0], constant = 1 }\n"), "expected a direction"));
  EXPECT_TRUE(says(said("force = { components = { path = 'w.csv' } }\n"),
                   "names no column, expected x, y or z"));
  EXPECT_TRUE(says(said("force = { components = { path = 'w.csv', y = 'fy' } }\n"),
                   "w.csv:1: there is no column 'fy', the nearest one is"));
  EXPECT_TRUE(says(said("force = { components = { path = 'none.csv', y = 'x' } }\n"), "none.csv"));
  EXPECT_TRUE(
      says(said("force = { direction = [0, 0, 1], file = { path = 'w.csv', value = 'x' } }\n"),
           "w.csv:4: the time is 1 s after 1 s, expected a later one"));
  EXPECT_TRUE(says(said("force = { direction = [0, 0, 1], file = { path = 'u.csv', value = 'x', "
                        "between = 'held' } }\n"),
                   "between is \"held\", which an element of type \"force\" can be"));
  EXPECT_TRUE(says(said("link2 = 'x'\n"), "unknown key 'link2'"));
  write_bytes(folder / "model.urdf", arm_urdf());
  write_bytes(folder / "scene.toml",
              arm(force("file = { path = 'u.csv', value = 'x', between = 'held' }\n")));
  try {
    (void)scene::read_scene((folder / "scene.toml").string());
    ADD_FAILURE();
  } catch (const InvalidArgument& e) {
    EXPECT_TRUE(says(e.what(), "u.csv:4: the time is 3 s, expected even steps of 1 s"));
  }
}

}  // namespace
}  // namespace porthos::test::wrench_test
