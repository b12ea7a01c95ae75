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
    std::printf("  three legs end %.1e from one run\n", off);
    EXPECT_LT(off, 1e-12);
  }
}

std::string told_of_leg(const TemporaryFolder& folder, const std::string& text) {
  write_bytes(folder / "arm.urdf", arm_urdf(""));
  write_bytes(folder / "leg.toml", text);
  try {
    const auto s = scene::read_scene((folder / "leg.toml").string());
    return scene::start_of(s, scene::assemble(s)).note;
  } catch (const InvalidArgument& e) {
    return e.what();
  }
}

/// A date that is shifted by hand would count the time twice, and none at all has no Sun.
TEST(OrbitLegs, AnotherEpochAndOtherForcesAreTold) {
  const std::string still = "base.angular_velocity = [0, 0, 1e-3]\n",
                    sky = "epoch = '2026-03-20T06:00:00'\nsun = true\nmoon = true\n";
  TemporaryFolder folder;
  end_of(folder, craft(still, sky, 2000), "one");
  const auto told = [&](const std::string& own) {
    return told_of_leg(folder, craft("from = 'one'\n", own, 2000));
  };
  EXPECT_TRUE(says(told("epoch = '2026-03-20T06:33:20'\nsun = true\nmoon = true\n"),
                   "[orbit] has epoch = \"2026-03-20T06:33:20\", and the run in one goes on from "
                   "epoch = \"2026-03-20T06:00:00\": expected that one"));
  EXPECT_TRUE(says(told(""), "[orbit] has no epoch, and the run in one goes on from epoch = "));
  EXPECT_TRUE(says(told("epoch = '2026-03-20T06:00:00'\nmoon = false\n"),
                   "; orbit, the Sun, the dipole go on from there, whatever start [orbit] states, "
                   "2000 s after the epoch; that run had the Moon, and this scene has not"));
  EXPECT_TRUE(says(told("epoch = '2026-03-20T06:00:00'\nsun = true\nmoon = true\n"
                        "drag = { density = 1e-13, altitude = 7e5, scale_height = 6e4, "
                        "area_coefficient = 2 }\n"),
                   "; this scene has drag, and that run had not"));
  const std::string same = told(sky);
  EXPECT_TRUE(says(same, "go on from there")) << same;
  EXPECT_FALSE(says(same, "had")) << "control: the same sky; " << same;
}

/// In orbit places count from the common centre of mass, which a missing body shifts.
TEST(OrbitLegs, ABodyOfTheRecordThatTheSceneLacksIsNamed) {
  const std::string body =
      "[[body]]\nname = 'debris'\nmass = 5.0\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]\n"
      "position = [3.0, 0.0, 0.0]\n";
  const std::string still = "base.angular_velocity = [0, 0, 1e-3]\n";
  TemporaryFolder folder;
  end_of(folder, craft(still, "", 2000) + body, "one");
  const std::string lost =
      "states of the record that this scene has not: debris.attitude, debris.position";
  EXPECT_TRUE(says(told_of_leg(folder, craft("from = 'one'\n", "", 2000)),
                   lost + "; in orbit places count from the common centre of mass"));
  EXPECT_FALSE(says(told_of_leg(folder, craft("from = 'one'\n", "", 2000) + body), "has not"));

  const auto free = [](const std::string& initial) {
    return "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\n" + initial +
           "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 0.1\n";
  };
  end_of(folder, free(still) + body, "free");
  const std::string told = told_of_leg(folder, free("from = 'free'\n"));
  EXPECT_TRUE(says(told, lost)) << told;
  EXPECT_FALSE(says(told, "rates jump")) << "the masses are the same; " << told;
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
  EXPECT_TRUE(says(note(""), ". Rates jump: momenta are continued, and the masses or inertias of "
                             "'lower' are not those of that run"));
  EXPECT_FALSE(says(note(heavy), "ates jump")) << "control: the model of that run";
}

}  // namespace
}  // namespace porthos::test::legs_test
