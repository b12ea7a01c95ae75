// Missions in legs: in orbit the sky goes on from one run to the next, and masses have to.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "scene/session/run.h"
#include "tests/run/scenes.h"

namespace porthos::test::legs_test {
namespace {

/// A floating arm under Sun, Moon and a tilted dipole that turns with the planet.
std::string craft(const std::string& initial, const std::string& sky, double duration) {
  return "[model]\nurdf = 'arm.urdf'\nbase = 'free'\nlock = ['shoulder', "
         "'elbow']\n[planet]\nrotation_rate = 7.292115e-5\n"
         "magnetic = { equator = 3e-5, tilt = 0.3 }\n[orbit]\naltitude = 720e3\n"
         "inclination = 1.7\n" +
         sky + "[initial]\n" + initial +
         "[[element]]\ntype = 'torquer'\nname = 'rod'\ndirection = [0, 1, 0]\nconstant = 20.0\n"
         "[integrator]\nmethod = 'gauss8'\nstep = 2.0\n[run]\nlow_words = true\nrecord_every = "
         "100\n"
         "duration = " +
         std::to_string(duration) + "\n";
}

phs::State end_of(const TemporaryFolder& folder, const std::string& text, const std::string& out) {
  write_bytes(folder / "arm.urdf", arm_urdf(""));
  write_bytes(folder / "scene.toml", text);
  const auto s = scene::read_scene((folder / "scene.toml").string());
  return scene::run(s, scene::assemble(s), into(folder / out)).final_state;
}

double apart(const phs::State& a, const phs::State& b) {
  double most = 0;
  for (size_t i = 0; i < a.x.size(); ++i)
    most = std::fmax(most, std::fabs(a.x[i] - b.x[i]) / std::fmax(1, std::fabs(a.x[i])));
  return most;
}

TEST(OrbitLegs, TheSkyGoesOn) {
  const std::string still = "base.angular_velocity = [0, 0, 1e-3]\n";
  for (const std::string sky : {"epoch = '2026-03-20T06:00:00'\nsun = true\nmoon = true\n",
                                "sun_longitude = 1.0\nmoon_longitude = 2.0\n"}) {
    TemporaryFolder folder;
    const auto whole = end_of(folder, craft(still, sky, 6000), "whole");
    end_of(folder, craft(still, sky, 2000), "one");
    end_of(folder, craft("from = 'one'\n", sky, 2000), "two");
    const auto three = end_of(folder, craft("from = 'two'\n", sky, 2000), "three");
    const double off = apart(whole, three);
    // Control: a date that is shifted by hand as well.
    if (sky.starts_with("epoch")) {
      const std::string later = "epoch = '2026-03-20T07:06:40'\nsun = true\nmoon = true\n";
      const auto twice = end_of(folder, craft("from = 'two'\n", later, 2000), "twice");
      EXPECT_GT(apart(whole, twice), 100 * off);
    }
    std::printf("  three legs end %.1e from one run\n", off);
    EXPECT_LT(off, 1e-12);
  }
}

/// Momenta are continued: with other masses rates jump, which must not go unsaid.
TEST(Legs, OtherMassesThanTheRecordsAreTold) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf(""));
  const auto leg = [&](const std::string& model, const std::string& initial) {
    write_bytes(folder / "scene.toml",
                "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n" + model + "[initial]\n" + initial +
                    "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n");
    return scene::read_scene((folder / "scene.toml").string());
  };
  const std::string heavy = "mass_factor.lower = 5\n",
                    moving = "base.linear_velocity = [0.1, 0, 0]\njoints.elbow.velocity = 2\n";
  const auto first = leg(heavy, moving);
  scene::run(first, scene::assemble(first), into(folder / "first"));
  const auto note = [&](const std::string& model) {
    return scene::assemble(leg(model, "from = 'first'\n")).notes.back().text;
  };
  EXPECT_TRUE(says(note(""), "Its rates jump: its kinetic energy was "));
  EXPECT_FALSE(says(note(heavy), "rates jump")) << "control: the model of that run";
}

}  // namespace
}  // namespace porthos::test::legs_test
