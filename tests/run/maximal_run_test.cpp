// Scenes in maximal coordinates: each example that can be run in them moves as in reduced ones, and
// so does what acts on bodies; the others are refused.
#include <fmt/format.h>

#include "scene/assemble/assembly.h"
#include "scene/session/info.h"
#include "tests/run/shipped.h"
#include "tests/support/linkages.h"
#include "tests/support/poses.h"

namespace porthos::test::maximal_run_test {
namespace {

const Change maximal{"[model]\n", "[model]\ncoordinates = \"maximal\"\n"};

/// After steps of the default method, each a sixteenth of the scene's: fast bodies need small ones.
phs::State after_steps(const scene::Scene& s, const scene::Assembly& a, int steps) {
  auto state = a.initial;
  const auto method = scene::make_integrator(a, s.rolls() ? "pgauss16" : "spark16", s.step / 16);
  for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(state), integrators::Outcome::ok) << i;
  return state;
}

TEST(MaximalRun, ExamplesMoveAsInReducedCoordinates) {
  int taken = 0, refused = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(PORTHOS_SOURCE_DIR) / "examples")) {
    if (!fs::exists(entry.path() / "scene.toml")) continue;
    const std::string name = entry.path().filename().string();
    TemporaryFolder folder, other;
    const auto s = shipped(folder, name);
    if (s.step <= 0 || s.orbit) continue;  // orbits have a test of their own
    try {
      const auto m = shipped(other, name, {maximal});
      const auto b = scene::assemble(m);
      const auto a = scene::assemble(s);
      ASSERT_TRUE(b.reduced) << name;
      const double start = apart(*a.mechanical, a.initial, *b.mechanical, b.initial);
      const double off =
          apart(*a.mechanical, after_steps(s, a, 16), *b.mechanical, after_steps(m, b, 16));
      std::printf("  %-18s start %.1e, after 16 steps %.1e\n", name.c_str(), start, off);
      EXPECT_LT(start, 1e-14) << name;
      EXPECT_LT(off, 1e-12) << name;  // measured 5e-14, of the governor; 5e-16 of the others
      ++taken;
    } catch (const InvalidArgument& e) {
      EXPECT_TRUE(says(e.what(), "coordinates = ")) << name << ": " << e.what();
      ++refused;
    }
  }
  std::printf("  %d examples taken, %d refused\n", taken, refused);
  EXPECT_GE(taken, 6);
  EXPECT_GE(refused, 6);
}

TEST(MaximalRun, ARunPassesItsVerdictAndSaysWhatItIs) {
  TemporaryFolder folder;
  auto s = shipped(folder, "four_bar", 0.5, {maximal});
  EXPECT_EQ(s.method, "spark16");
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  EXPECT_TRUE(r.passed());
  EXPECT_LT(value_of(r, "constraints"), 2e-15);
  EXPECT_TRUE(says(scene::info_text(s, a), "maximal"));
}

/// Two points, to compare runs by.
std::string points(const std::string& a, const std::string& b) {
  std::string text;
  for (const auto& link : {a, b})
    text += "\n[[output]]\nquantity = \"position\"\nname = \"at_" + link + "\"\nlink = \"" + link +
            "\"\nat = [0.3, 0.1, 0.2]\n";
  return text;
}
/// How far apart the outputs of two runs end.
double apart_at_end(const scene::RunReport& a, const scene::RunReport& b) {
  EXPECT_EQ(a.outputs.size(), b.outputs.size());
  double most = 0;
  for (size_t i = 0; i < a.outputs.size(); ++i)
    most = std::max(most, std::fabs(a.outputs[i].end - b.outputs[i].end));
  return most;
}
/// An example with additions in both coordinates, and, as a control, in maximal ones with one more
/// change.
struct Both {
  double off, control;
};
Both both(const std::string& name, std::vector<Change> changes, const std::string& more,
          const Change& control) {
  const auto run = [&](std::vector<Change> with, const std::string& text) {
    TemporaryFolder folder;
    const auto s = shipped(folder, name, with, text);
    const auto r = scene::run(s, scene::assemble(s), into(folder / "out"));
    EXPECT_TRUE(r.passed()) << r.trouble;
    for (const auto& c : r.checks) EXPECT_TRUE(c.pass) << c.name << " " << c.value;
    return r;
  };
  const auto reduced = run(changes, more);
  changes.push_back(maximal);
  const double off = apart_at_end(reduced, run(changes, more));
  std::string other = more;
  const size_t at = other.find(control.from);
  other.replace(at, control.from.size(), control.to);
  return {off, apart_at_end(reduced, run(changes, other))};
}

/// A step that is fine enough for the bodies' places.
std::vector<Change> shortly(const std::string& step) {
  return {{"duration = 1000.0", "duration = 1.0"},
          {"step = 0.0078125", "step = " + step},
          {"record_every = 1.0", "record_every = 0.25"}};
}
/// Springs between links and to the world, and a thruster.
TEST(MaximalRun, ElementsOnLinksActAsInReducedCoordinates) {
  const auto e =
      both("four_bar", shortly("0.00048828125"), points("coupler_rod", "rocker_rod") + R"(
[[element]]
type = "line_spring"
name = "tie"
link = "coupler_rod"
on_link = [0.7, 0.1, 0]
on_body = [0.5, 2, 0.25]
stiffness = 20
damping = 2
[[element]]
type = "line_spring"
name = "stay"
link = "crank_rod"
body = "rocker_rod"
on_link = [0.2, 0, 0]
on_body = [0.9, 0, 0]
stiffness = 10
rest = 1
[[element]]
type = "thruster"
name = "jet"
link = "rocker_rod"
at = [1, 0, 0]
direction = [0, 1, 0]
thrust = 3
switches = [0.25, 0.5]
)",
           {"stiffness = 20", "stiffness = 20.000001"});
  std::printf("  apart %.1e m; with a spring stiffer by 5e-8 %.1e m\n", e.off, e.control);
  EXPECT_LT(e.off, 1e-14);  // measured 1.1e-16
  EXPECT_GT(e.control, 1e-8);
}
/// The pin falls onto a soft floor.
TEST(MaximalRun, SoftContactsActAsInReducedCoordinates) {
  const auto e = both("four_bar", shortly("0.001953125"), points("coupler_rod", "rocker_rod") + R"(
[[contact]]
name = "floor"
links = ["coupler_rod"]
shape = { kind = "sphere", radius = 0.2, at = [1.5, 0, 0] }
against_shape = { kind = "plane", rpy = [-1.5707963267948966, 0, 0], at = [0, 0.9, 0] }
law = "smooth"
stiffness = 200
width = 0.05
)",
                      {"stiffness = 200", "stiffness = 200.00001"});
  std::printf("  apart %.1e m; with a floor stiffer by 5e-8 %.1e m\n", e.off, e.control);
  EXPECT_LT(e.off, 1e-14);  // measured 5.3e-16
  EXPECT_GT(e.control, 1e-9);
}
TEST(MaximalRun, AnInterruptedRunContinuesBitForBit) {
  TemporaryFolder folder;
  auto all = shortly("0.001953125");
  all.push_back(maximal);
  const auto s = shipped(folder, "four_bar", all,
                         "[[element]]\ntype = \"line_spring\"\nname = \"tie\"\nlink = "
                         "\"coupler_rod\"\non_body = [0, 2, 0]\nstiffness = 5\ndamping = 1\n");
  expect_same_bits_when_resumed(folder, s, {100, 300});
}
/// A capture, a loop that closes and one that opens.
TEST(MaximalRun, EventsActAsInReducedCoordinates) {
  const auto e = both("two_arms", {{"step = 0.5", "step = 0.125"}}, points("load", "right_hand"),
                      {"at = [0.3", "at = [0.3000001"});
  std::printf("  apart %.1e m; a point that is 1e-7 m off %.1e m\n", e.off, e.control);
  EXPECT_LT(e.off, 1e-13);  // measured 2.9e-15
  EXPECT_GT(e.control, 1e-8);
}
/// A soft latch that engages and disengages, in the place of the loop.
TEST(MaximalRun, SoftLatchesActAsInReducedCoordinates) {
  const auto e = both("two_arms",
                      {{"step = 0.5", "step = 0.125"},
                       {R"([[loop]]
name = "right_grip"
type = "spherical"
a = { link = "right_hand" }
b = { link = "load", position = [0, -0.5, 0] }
)",
                        ""},
                       {R"(type = "close"
at = 4.0
loop = "right_grip"
reach = 0.2
)",
                        "type = \"engage\"\nat = 4.0\nlatch = \"mouth\"\nreach = 0.3\n"},
                       {"type = \"open\"\nat = 80.0\nloop = \"right_grip\"\n",
                        "type = \"disengage\"\nat = 40.0\nlatch = \"mouth\"\n"}},
                      points("load", "right_hand") + R"(
[[element]]
type = "soft_latch"
name = "mouth"
link = "right_hand"
body = "load"
on_body = [0, -0.5, 0]
stiffness = 5
damping = 5
)",
                      {"stiffness = 5", "stiffness = 5.000001"});
  std::printf("  apart %.1e m; with a latch stiffer by 2e-7 %.1e m\n", e.off, e.control);
  EXPECT_LT(e.off, 5e-13);  // measured 1.1e-14
  EXPECT_GT(e.control, 1e-10);
}
/// The same events in orbit, with drag and a thruster. The start of an orbit is one of doubles.
TEST(MaximalRun, OrbitsActAsInReducedCoordinates) {
  const auto e = both("two_arms", {}, points("load", "right_hand") + R"(
[orbit]
altitude = 4e5
splitting = "lobatto4c"
[orbit.drag]
density = 1e-12
altitude = 4e5
scale_height = 6e4
area_coefficient = 4
[planet]
rotation_rate = 7.29e-5
[[element]]
type = "thruster"
name = "jet"
link = "bus"
direction = [0, 1, 0]
thrust = 0.1
switches = [10, 20]
)",
                      {"thrust = 0.1", "thrust = 0.1000001"});
  std::printf("  apart %.1e m; with a thrust larger by 1e-6 %.1e m\n", e.off, e.control);
  EXPECT_LT(e.off, 5e-13);  // measured 2.6e-14
  EXPECT_GT(e.control, 1e-8);
}

TEST(MaximalRun, WhatItCannotTakeIsRefused) {
  const auto refusal = [](const std::string& more) -> std::string {
    TemporaryFolder folder;
    try {
      scene::assemble(shipped(folder, "four_bar", {maximal}, more));
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(""), "");
  const auto spring = refusal(
      "\n[[element]]\ntype = \"spring\"\nname = \"s\"\njoint = \"crank\"\nstiffness = 1.0\n");
  EXPECT_TRUE(says(spring, "[[element]] 's'")) << spring;
  EXPECT_TRUE(says(spring, "coordinates = \"reduced\"")) << spring;
  const auto lock = refusal("\n[[event]]\ntype = \"lock\"\nat = 1.0\njoint = \"crank\"\n");
  EXPECT_TRUE(says(lock, "the [[event]] of 'crank'")) << lock;
  const auto rigid = refusal(
      "\n[[contact]]\nname = \"floor\"\nlinks = [\"rocker_rod\"]\nshape = { kind = \"sphere\", "
      "radius = 0.1 }\nlaw = \"rigid\"\nrestitution = 0\n");
  EXPECT_TRUE(says(rigid, "the rigid [[contact]] 'floor'")) << rigid;
  const auto gear =
      refusal("\n[[coupling]]\nname = \"gear\"\nfactors = { crank = 1, rocker = 1 }\n");
  EXPECT_TRUE(says(gear, "'gear': a coupling")) << gear;
}

/// test::lattice as files of a scene.
scene::Scene lattice_scene(const TemporaryFolder& folder, int n, const std::string& coordinates) {
  const auto l = lattice(n);
  std::string urdf = "<robot name=\"lattice\">\n<link name=\"ground\"/>\n";
  for (const auto& b : l.parts.bodies()) {
    urdf += fmt::format(
        "<link name=\"{0}\"><inertial><origin xyz=\"0.5 0 0\"/><mass value=\"1\"/><inertia "
        "ixx=\"{1}\" iyy=\"{2}\" izz=\"{2}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n"
        "<joint name=\"{0}_joint\" type=\"continuous\"><parent link=\"{3}\"/><child link=\"{0}\"/>"
        "<origin xyz=\"{4} 0 0\"/><axis xyz=\"0 0 1\"/></joint>\n",
        b.name, 1. / 48, 1. / 12, b.parent == "world" ? "ground" : b.parent, b.placement.r.x);
  }
  write_bytes(folder / "lattice.urdf", urdf + "</robot>\n");
  std::string text = fmt::format(
      "[model]\nurdf = \"lattice.urdf\"\nbase = \"fixed\"\ncoordinates = \"{}\"\n[initial]\n",
      coordinates);
  for (size_t i = 0; i < l.parts.bodies().size(); ++i)
    text += fmt::format("joints.{}_joint = {{ position = {}, velocity = {} }}\n",
                        l.parts.bodies()[i].name, l.q[i], l.v[i]);
  for (const auto& loop : l.spec.loops)
    text += fmt::format(
        "[[loop]]\nname = \"{}\"\ntype = \"revolute\"\na = {{ link = \"{}\", position = [1, 0, 0] "
        "}}\nb = {{ link = \"{}\", position = [1, 0, 0] }}\n",
        loop.name, loop.a.link, loop.b.link);
  write_bytes(folder / "scene.toml",
              text + "[integrator]\nstep = 0.001953125\n[run]\nduration = 0.0625\n");
  return scene::read_scene((folder / "scene.toml").string());
}

/// The estimate decides: a lattice of 13 × 13 cells measured 10.8 ms a step in reduced coordinates,
/// where the Delassus matrix fills, and 9.7 ms in maximal ones; of 8 × 8 cells 1.7 and 3.2 ms.
TEST(MaximalRun, AutoChoosesTheFasterCoordinates) {
  TemporaryFolder folder;
  for (const auto& [n, is_maximal] : {std::pair{4, false}, std::pair{13, true}}) {
    const auto s = lattice_scene(folder, n, "auto");
    const auto a = scene::assemble(s);
    std::printf("  %d x %d cells: %s\n", n, n, a.why_coordinates.c_str());
    EXPECT_EQ(a.reduced != nullptr, is_maximal) << n;
    const std::string info = scene::info_text(s, a);
    EXPECT_TRUE(says(info, is_maximal ? "maximal: every body" : "reduced: those")) << info;
    EXPECT_TRUE(says(info, "ms a step")) << info;
  }
  const auto stated = lattice_scene(folder, 4, "reduced");
  EXPECT_EQ(scene::assemble(stated).why_coordinates, "");
}

TEST(MaximalRun, AutoIsReducedWhereMaximalCannotBe) {
  const auto why = [](const std::string& name, const std::string& more) {
    TemporaryFolder folder;
    const auto a = scene::assemble(
        shipped(folder, name, {{"[model]\n", "[model]\ncoordinates = \"auto\"\n"}}, more));
    EXPECT_FALSE(a.reduced);
    return a.why_coordinates;
  };
  EXPECT_TRUE(says(why("double_pendulum", ""), "no loops"));
  const auto gear =
      why("four_bar", "\n[[coupling]]\nname = \"gear\"\nfactors = { crank = 1, rocker = 1 }\n");
  EXPECT_TRUE(says(gear, "'gear': a coupling")) << gear;
  const auto spring =
      why("four_bar",
          "\n[[element]]\ntype = \"spring\"\nname = \"s\"\njoint = \"crank\"\nstiffness = 1.0\n");
  EXPECT_TRUE(says(spring, "[[element]] 's' needs them")) << spring;
}

}  // namespace
}  // namespace porthos::test::maximal_run_test
