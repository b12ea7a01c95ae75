// Scenes in maximal coordinates: each example that can be run in them moves as in reduced ones, the
// others are refused.
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
    if (s.step <= 0) continue;
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
      EXPECT_LT(off, 1e-12) << name;  // measured 2e-13, of the governor; 6e-16 of the others
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
