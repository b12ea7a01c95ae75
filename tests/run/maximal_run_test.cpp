// Scenes in maximal coordinates: each example that can be run in them moves as in reduced ones, the
// others are refused.
#include "scene/assemble/assembly.h"
#include "scene/session/info.h"
#include "tests/run/shipped.h"
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

}  // namespace
}  // namespace porthos::test::maximal_run_test
