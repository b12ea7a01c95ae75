// Missions in legs: in orbit the sky goes on from one run to the next, and masses have to.
#include <gtest/gtest.h>
#include <array>

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
  EXPECT_TRUE(says(note(""),
                   ". Rates jump: momenta are continued, and the masses or inertias of "
                   "'lower' are not those of that run"));
  EXPECT_FALSE(says(note(heavy), "ates jump")) << "control: the model of that run";
}

/// A leg of a run that failed says so. Control: of one that passed.
TEST(Legs, ARunThatFailedIsTold) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf());
  const auto note_after = [&](const std::string& limit) {
    const auto leg = [&](const std::string& initial) {
      write_bytes(folder / "scene.toml",
                  "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n[initial]\n" + initial +
                      "[integrator]\nmethod = 'rk4'\nstep = 0.01\n[run]\nduration = 1\n"
                      "[verify]\nenergy = " +
                      limit + "\n");
      return scene::read_scene((folder / "scene.toml").string());
    };
    const auto first = leg("joints.elbow.velocity = 2\n");
    scene::run(first, scene::assemble(first), into(folder / "first"));
    return scene::assemble(leg("from = 'first'\n")).notes.back().text;
  };
  EXPECT_TRUE(says(note_after("1e-15"), "that run FAILED"));
  EXPECT_FALSE(says(note_after("1e-3"), "FAILED"));
}

/// A longitude that is shifted by hand would count the time twice.
TEST(OrbitLegs, AnotherLongitudeIsRefused) {
  TemporaryFolder folder;
  const std::string still = "base.angular_velocity = [0, 0, 1e-3]\n";
  const auto sky = [](const char* moon) {
    return std::string("sun_longitude = 1.0\nmoon_longitude = ") + moon + "\n";
  };
  end_of(folder, craft(still, sky("2.0"), 2000), "one");
  const auto told = [&](const std::string& own) {
    return told_of_leg(folder, craft("from = 'one'\n", own, 2000));
  };
  EXPECT_TRUE(says(told(sky("2.1")),
                   "moon_longitude is 2.1 rad, and the run in one goes on from 2 "
                   "rad: expected that one"));
  EXPECT_TRUE(says(told(sky("2.0")), "go on from there")) << "control";
}

/// A law whose target is not stated holds where the record ends.
TEST(Legs, ATargetThatIsNotStatedIsTheRecords) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf());
  const auto leg = [&](const std::string& initial) {
    write_bytes(
        folder / "scene.toml",
        "[model]\nurdf = 'arm.urdf'\nbase = 'fixed'\n[environment]\ngravity = 'uniform'\n"
        "vector = [0, 0, -9.81]\n[initial]\n" +
            initial +
            "[[controller]]\ntype = 'potential'\nname = 'hold'\njoints.shoulder = { stiffness "
            "= 40, damping = 20 }\njoints.elbow = { stiffness = 40, damping = 20 }\n"
            "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 2\n");
    return scene::read_scene((folder / "scene.toml").string());
  };
  const auto elbow = [&](const scene::Scene& s, const std::string& out) {
    const auto a = scene::assemble(s);
    const auto r = scene::run(s, a, into(folder / out));
    return r.final_state.x[size_t(a.mechanism->coordinate("elbow").q)];
  };
  EXPECT_NEAR(elbow(leg("joints.shoulder.position = 0.5\njoints.elbow.position = 0.7\n"), "first"),
              0.7, 1e-9);
  EXPECT_NEAR(elbow(leg("from = 'first'\n"), "second"), 0.7, 1e-9);
}

/// A joint of [model] lock is where it was locked; one that moves in the record is refused.
TEST(Legs, ALockedJointStaysWhereItWas) {
  TemporaryFolder folder;
  write_bytes(folder / "arm.urdf", arm_urdf());
  const auto leg = [&](const std::string& lock, const std::string& initial) {
    write_bytes(folder / "scene.toml",
                "[model]\nurdf = 'arm.urdf'\nbase = 'free'\n" + lock + "[initial]\n" + initial +
                    "[integrator]\nmethod = 'gauss8'\nstep = 0.01\n[run]\nduration = 1\n"
                    "[[output]]\nquantity = 'position'\nname = 'hand'\nlink = 'lower'\nat = [0, 0, "
                    "-0.5]\nrelative_to = 'upper'\n");
    return scene::read_scene((folder / "scene.toml").string());
  };
  const auto hand = [&](const scene::Scene& s, const std::string& out) {
    const auto r = scene::run(s, scene::assemble(s), into(folder / out));
    return std::array{r.outputs[0].end, r.outputs[1].end, r.outputs[2].end};
  };
  const auto refused = [](const auto& f) {
    try {
      f();
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string locked = "lock = ['elbow']\n";
  const auto first = hand(leg(locked, "joints.elbow.position = -1.2\n"), "first");
  const auto second = hand(leg(locked, "from = 'first'\n"), "second");
  const auto straight = hand(leg(locked, ""), "straight");
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(first[k], second[k], 1e-14);
  EXPECT_GT(std::hypot(first[1] - straight[1], first[2] - straight[2]), 0.1) << "control";
  const auto third = hand(leg(locked, "from = 'second'\n"), "third");
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(first[k], third[k], 1e-14);
  hand(leg("lock = ['shoulder']\n", ""), "other");
  EXPECT_TRUE(says(refused([&] { hand(leg(locked, "from = 'other'\n"), "no"); }),
                   "joint 'elbow' of [model] lock moves in that run: expected an [[event]]"));
  hand(leg("", "joints.elbow.velocity = 0.2\n"), "moving");
  EXPECT_TRUE(says(refused([&] { hand(leg(locked, "from = 'moving'\n"), "no"); }),
                   "joint 'elbow' of [model] lock moves in that run: expected an [[event]]"));
  EXPECT_TRUE(says(refused([&] { leg("", "from = 'first'\njoints.elbow.position = 1\n"); }),
                   "is given besides from"));
}

}  // namespace
}  // namespace porthos::test::legs_test
