#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "nlohmann/json.hpp"
#include "scene/session/memory_run.h"
#include "space/kepler.h"
#include "space/orbit.h"
#include "tests/run/scenes.h"
#include "tests/support/bounds.h"

// Scenes in orbit: what they refuse, what they report, and that they go on where they were stopped.
namespace porthos::scene::scene_test {
namespace {

using test::breaks, test::keeps, test::says;

const char* const head = "title = 't'\n[model]\nurdf = 'm.urdf'\nbase = 'free'\n";
const char* const tail =
    "[integrator]\nmethod = 'gauss8'\nstep = 5.0\n[run]\nduration = 2000.0\nrecord_every = 50.0\n"
    "[verify]\nenergy = 1e-11\nangular_momentum = 1e-13\norbital = 1e-15\ncoupling = 0.1\n";
const char* const low = "[orbit]\naltitude = 500e3\ninclination = 0.6\n";

struct Folder {
  test::TemporaryFolder at;
  Folder() { test::write_bytes(at / "m.urdf", test::arm_urdf()); }
  std::string scene(const std::string& middle, const std::string& start = head,
                    const std::string& end = tail) const {
    test::write_bytes(at / "s.toml", start + middle + end);
    return (at / "s.toml").string();
  }
  std::string refusal(const std::string& middle, const std::string& start = head,
                      const std::string& end = tail) const {
    const auto file = scene(middle, start, end);
    return test::refusal([&] { assemble(read_scene(file)); });
  }
};

TEST(OrbitScene, RefusesInOneSentenceEach) {
  const Folder f;
  EXPECT_EQ(f.refusal(low), "");
  EXPECT_TRUE(says(f.refusal("[orbit]\naltitude = -5e3\n"), "below the surface of the planet"));
  EXPECT_TRUE(
      says(f.refusal("[orbit]\naltitude = 620\n"), "a thousandth of its radius, in metres"));
  EXPECT_TRUE(says(f.refusal("[orbit]\naltitude = 5e5\ninclination = 97.8\n"),
                   "97.8 degrees are 1.70693 rad"));
  EXPECT_EQ(f.refusal("[orbit]\naltitude = 5e5\ninclination = 1.70693\nnode = -3\n"), "");
  EXPECT_TRUE(
      says(f.refusal("[orbit]\nsemi_major_axis = 7.5e6\neccentricity = 0.3\ntrue_anomaly = 2.5\n"),
           "pericentre is"));
  const std::string fast = "[orbit]\nposition = [7e6, 0, 0]\nvelocity = [0, 11e3, 0]\n";
  EXPECT_TRUE(says(f.refusal(fast), "hyperbolic"));
  EXPECT_EQ(f.refusal(fast + "bound = false\n"), "");
  const std::string drag =
      "drag = { density = 1e-12, altitude = 500e3, scale_height = 60e3, area_coefficient = 9.0 }\n";
  EXPECT_TRUE(says(f.refusal(low + drag), "whose rotation is not given"));
  EXPECT_EQ(f.refusal("[planet]\nrotation_rate = 7.29e-5\n" + (low + drag)), "");
  EXPECT_TRUE(says(f.refusal(low + std::string("sunlight = { area_coefficient = 9.0 }\n")),
                   "without a sun"));
  EXPECT_TRUE(says(f.refusal("[planet]\nharmonics = 'earth'\n"), "without an [orbit]"));
  EXPECT_TRUE(
      says(f.refusal("[planet]\nharmonics = [-4.84165e-4, 0, 0, 0, 0]\n" + std::string(low)),
           "of normalised coefficients J2 is -sqrt(5) C20, here 0.00108263"));
  EXPECT_TRUE(says(f.refusal("[planet]\nharmonics = 'moon'\n" + std::string(low)),
                   "\"earth\", \"none\" or five numbers"));
  EXPECT_TRUE(says(f.refusal("[orbit]\ninclination = 0.3\n"),
                   "none of the keys altitude and semi_major_axis"));
  EXPECT_TRUE(
      says(f.refusal(low + std::string("splitting = 'leapfrog'\n")), "expected one of strang"));
  EXPECT_TRUE(
      says(f.refusal(low + std::string("altitud = 3\n")), "the nearest known one is 'altitude'"));
  EXPECT_TRUE(says(
      f.refusal(low + std::string("[environment]\ngravity = 'uniform'\nvector = [0, 0, -9.8]\n")),
      "uniform gravity"));
  EXPECT_TRUE(
      says(f.refusal(low + std::string("[initial]\nbase = { linear_velocity = [1, 0, 0] }\n")),
           "linear velocity besides the [orbit]"));
  std::string fixed = head;
  fixed.replace(fixed.find("'free'"), 6, "'fixed'");
  EXPECT_TRUE(says(f.refusal(low, fixed), "base is \"fixed\""));
  const std::string damped = "[[element]]\ntype = 'damper'\njoint = 'elbow'\ndamping = 0.1\n";
  const auto back = f.scene(low + std::string("splitting = 'aba864'\n") + damped);
  EXPECT_TRUE(says(test::refusal([&] {
                     const Scene s = read_scene(back);
                     const Assembly a = assemble(s);
                     make_integrator(s, *a.model, s.step);
                   }),
                   "steps backwards"));
}

// Sampled controllers read at whole steps and hold through the kicks and drifts of the split. About
// a planet so light that nothing pulls, the motion is that in free space; the continuous
// controller's is the control.
TEST(OrbitScene, SampledControllersHoldThroughTheSplit) {
  const Folder f;
  const auto arm = [&](const std::string& rate) {
    std::string text = "[initial]\njoints.elbow = { position = 0.4, velocity = 0.05 }\n";
    for (const char* joint : {"elbow", "shoulder"})
      text += std::string("[[element]]\ntype = 'controller'\njoint = '") + joint +
              "'\nstiffness = 0.05\ndamping = 0.1\n" + rate;
    return text;
  };
  const std::string rate = "rate = 0.5\n",
                    end =
                        "[integrator]\nmethod = 'gauss12'\nstep = 0.5\n[run]\nduration = 200.0\n"
                        "record_every = 5.0\n[verify]\nbalance = 1e-13\n";
  const std::string light = "[planet]\nmu = 1.0\n[orbit]\naltitude = 500e3\n";
  const auto go = [&](const char* name, const std::string& middle) {
    const Scene s = read_scene(f.scene(middle, head, end));
    const auto r = run(s, assemble(s), test::into(f.at / name));
    EXPECT_TRUE(r.passed()) << name;
    return r;
  };
  const auto free = go("free", arm(rate)), orbit = go("orbit", light + arm(rate)),
             smooth = go("smooth", light + arm(""));
  const auto off = [&](const RunReport& r) {
    double worst = 0;
    const size_t n = free.final_state.x.size();
    for (size_t i = 3; i < n; ++i)  // from the attitude on: the place is relative to the centre
      if (i < n / 2 || i >= n / 2 + 3)
        worst = std::max(worst, std::fabs(r.final_state.x[i] - free.final_state.x[i]));
    return worst;
  };
  double held = 0;
  for (const auto& [name, joule] : orbit.ports)
    if (name == "elbow.controller.hold") held = joule;
  std::printf("  off the free run by %.1e   bound 1e-12; continuous %.1e; the hold gave %.2e J\n",
              off(orbit), off(smooth), held);
  EXPECT_LE(off(orbit), 1e-12);
  EXPECT_GT(off(smooth), 1e-5);
  EXPECT_NE(held, 0);
  // A real orbit, continued from a checkpoint between two instants.
  const Scene s = read_scene(f.scene(low + arm(rate), head, end));
  const Assembly a = assemble(s);
  const auto whole = run(s, a, test::into(f.at / "whole"));
  EXPECT_TRUE(whole.passed());
  std::atomic<bool> stop = true;
  auto options = test::into(f.at / "parts");
  options.stop = &stop;
  options.progress = [&](double, double, double) { stop = true; };
  auto part = run(s, a, options);
  options.resume = true;
  for (int i = 0; i < 200 && part.interrupted; ++i) {
    stop = false;
    part = run(s, a, options);
  }
  EXPECT_TRUE(part.final_state == whole.final_state);
}

// Drag stated in km would be none.
TEST(OrbitScene, DragInKilometresIsRefused) {
  const Folder f;
  const auto why = [&](const std::string& numbers) {
    return test::refusal([&] {
      (void)read_scene(f.scene(
          "[planet]\nrotation_rate = 7.29e-5\n[orbit]\naltitude = 620e3\ndrag = { density = "
          "1.2e-13, area_coefficient = 20, " +
              numbers + " }\n",
          head, tail));
    });
  };
  EXPECT_EQ(why("altitude = 620e3, scale_height = 70e3"), "");
  EXPECT_TRUE(
      says(why("altitude = 620, scale_height = 70e3"), "expected 10 000 m or more: are they km?"));
  EXPECT_TRUE(says(why("altitude = 620e3, scale_height = 70"),
                   "expected 1000 to 1 000 000 m: are they km?"));
}

// So would be a planet's pull.
TEST(OrbitScene, APlanetInKilometresIsRefused) {
  const Folder f;
  const auto why = [&](const std::string& numbers) {
    return test::refusal([&] {
      (void)read_scene(f.scene("[planet]\n" + numbers + "[orbit]\naltitude = 620e3\n", head, tail));
    });
  };
  EXPECT_EQ(why("mu = 3.986e14\nradius = 6.378e6\n"), "");
  for (const char* km : {"mu = 398600.4418\n", "radius = 6378.137\n"})
    EXPECT_TRUE(says(why(km), "are they in km?")) << km;
}

// A way that leads below the surface ends there, with the results until then. Without the check a
// fall bounces at the centre or goes round it, and passes.
TEST(OrbitScene, EndsAtTheSurface) {
  struct Case {
    const char* what;
    std::string orbit;
  };
  const std::string air =
      "[planet]\nrotation_rate = 7.29e-5\n[orbit]\naltitude = 150e3\n"
      "drag = { density = 2e-9, altitude = 150e3, scale_height = 25e3, area_coefficient = 900.0 "
      "}\n";
  const Folder f;
  for (const Case& c :
       {Case{"steep", "[orbit]\nposition = [8e6, 0, 0]\nvelocity = [0, 2e3, 0]\nbound = false\n"},
        Case{"straight down",
             "[orbit]\nposition = [8e6, 0, 0]\nvelocity = [0, 0, 0]\nbound = false\n"},
        Case{"drag", air}}) {
    std::string text = tail;
    text.replace(text.find("2000.0"), 6, "20000.0");
    const Scene s = read_scene(f.scene(c.orbit, head, text));
    const auto out = f.at / c.what;
    const auto r = run(s, assemble(s), test::into(out));
    EXPECT_EQ(r.outcome, integrators::Outcome::failed) << c.what;
    EXPECT_FALSE(r.passed());
    EXPECT_TRUE(says(r.trouble, "below the surface at t = ")) << c.what;
    const double t = std::stod(r.trouble.substr(r.trouble.find('=') + 1));
    // The last good state is the step before, above the surface, and the results are there.
    EXPECT_GE(t, r.simulated_s);
    EXPECT_LE(t, r.simulated_s + s.step);
    const auto* x = &r.final_state.x[r.final_state.x.size() - 6];
    const double height = std::hypot(x[0], x[1], x[2]) - s.orbit->environment.planet.radius;
    std::printf("  %-14s below at %.4f s, last state %.2f km above\n", c.what, t, height / 1e3);
    EXPECT_GT(height, 0);
    for (const char* file : {"summary.json", "run.h5", "checkpoint/state.bin"})
      EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  }
}

// By closed forms: a straight fall from rest, and steps so long that the way through the planet
// lies inside one.
TEST(OrbitMotion, FindsTheSurfaceBetweenItsEnds) {
  space::Environment env;
  const double mu = env.planet.mu, R = env.planet.radius, r0 = 8e6;
  const space::OrbitMotion motion(env, 100);
  const double fall = std::sqrt(r0 * r0 * r0 / (2 * mu)) *
                      (std::sqrt(R / r0 * (1 - R / r0)) + std::acos(std::sqrt(R / r0)));
  for (const double dt : {fall + 1, fall + 300.0, 1500.0}) {
    space::OrbitPoint p{{r0, 0, 0}, {0, 0, 0}};
    const auto t = motion.drift_above_surface(p, dt);
    ASSERT_TRUE(t) << dt;
    EXPECT_NEAR(*t, fall, 1e-8);
    EXPECT_EQ(double(p.r.x), r0) << "the state stays";
  }
  space::OrbitPoint p{{r0, 0, 0}, {0, 0, 0}};
  EXPECT_FALSE(motion.drift_above_surface(p, fall - 1));
  // A pericentre 100 km below, passed between two states 400 km above; and one above, which is no
  // trouble.
  for (const double q : {R - 100e3, R + 100e3}) {
    const double a = 0.5 * (q + 4 * R);
    const auto at = space::from_elements(mu, a, 1 - q / a, 0.3, 0, 0, 0);
    space::OrbitPoint start = space::kepler_flow<space::OrbitReal>(
        mu, {{at.r.x, at.r.y, at.r.z}, {at.v.x, at.v.y, at.v.z}}, -600);
    const auto before = start;
    EXPECT_EQ(bool(motion.drift_above_surface(start, 1200)), q < R);
    EXPECT_GT(double(mechanics::norm(start.r)), R) << "both ends are above";
    EXPECT_EQ(before.r.x == start.r.x, q < R);
  }
}

// What a scene gets that names no splitting: 8 h of a body that librates under the gravity
// gradient, steps of 10 s.
TEST(OrbitScene, TheDefaultSplittingIsGoodAtTenSeconds) {
  const Folder f;
  test::write_bytes(
      f.at / "m.urdf",
      "<robot name='s'><link name='bus'><inertial><mass value='500'/><inertia "
      "ixx='300' iyy='250' izz='100' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  const auto attitude = [&](const std::string& splitting, const std::string& step) {
    const Scene s = read_scene(f.scene(
        "[initial]\nbase = { angular_velocity = [0, 0.0011, 0.0002] }\n[orbit]\naltitude = "
        "550e3\ninclination = 0.6\n" +
            splitting,
        head,
        "[integrator]\nmethod = 'gauss12'\nstep = " + step + "\n[run]\nduration = 28800.0\n"));
    const auto r = run(s, assemble(s), test::into(f.at / ("out" + splitting.substr(0, 1) + step)));
    return std::vector<double>(r.final_state.x.begin() + 3, r.final_state.x.begin() + 7);
  };
  const auto exact = attitude("splitting = 'aba864'\n", "2.0");
  const auto off = [&](const std::vector<double>& q) {
    double worst = 0;
    for (size_t i = 0; i < 4; ++i) worst = std::max(worst, std::fabs(q[i] - exact[i]));
    return worst;
  };
  const double now = off(attitude("", "10.0")),
               before = off(attitude("splitting = 'lobatto4'\n", "10.0"));
  std::printf("  attitude off by %.1e   bound 1e-6; lobatto4 without the corrector %.1e\n", now,
              before);
  EXPECT_LE(now, 1e-6);
  EXPECT_GT(before, 1e-4);
}

// The mean node drifts by -3/2 n J2 (R/p)² cos i to first order in J2; the start and the end are
// whole revolutions apart, where what swings within one is the same.
TEST(OrbitScene, OutputsOfTheOrbitHaveTheDriftOfAnOblatePlanet) {
  const Folder f;
  const double mu = space::Planet{}.mu, R = space::Planet{}.radius, a = 7e6, inclination = 0.6;
  const double n = std::sqrt(mu / a) / a, duration = 20 * 2 * M_PI / n, J2 = 1.0826e-5;
  std::string outputs;
  for (const char* name : {"semi_major_axis", "eccentricity", "inclination", "node"})
    outputs += fmt::format("[[output]]\nquantity = \"{0}\"\nname = \"{0}\"\n", name);
  const auto of = [&](double oblateness) {
    const Scene s = read_scene(f.scene(
        fmt::format("[planet]\nharmonics = [{}, 0, 0, 0, 0]\n[orbit]\nsemi_major_axis = 7e6\n"
                    "inclination = 0.6\nnode = 0.4\n{}",
                    oblateness, outputs),
        head,
        fmt::format("[integrator]\nmethod = 'gauss8'\nstep = {}\n[run]\nduration = {}\n",
                    duration / 4000, duration)));
    return run_in_memory(s, assemble(s), {}).outputs;
  };
  const auto oblate = of(J2), sphere = of(0);
  ASSERT_EQ(oblate.size(), 4u);
  keeps("semi-major axis at the start, relative", std::fabs(oblate[0].start / a - 1), 1e-14);
  keeps("eccentricity of the round one", sphere[1].largest, 1e-9);
  keeps("inclination", std::fabs(oblate[2].start - inclination), 1e-14);
  keeps("node", std::fabs(oblate[3].start - 0.4), 1e-14);
  const double rate = -1.5 * n * J2 * (R / a) * (R / a) * std::cos(inclination);
  const auto miss = [&](const auto& o) {
    return std::fabs((o[3].end - o[3].start) / duration / rate - 1);
  };
  keeps("drift of the node, relative", miss(oblate), 1e-3);
  breaks("control: a round planet", miss(sphere), 0.9);
}

TEST(OrbitScene, ReportsItsLedgersAndGoesOnWhereItStopped) {
  const Folder f;
  const std::string moving = std::string(low) +
                             "[initial]\nbase = { angular_velocity = [0, 0.01, 0.02] "
                             "}\njoints.elbow = { velocity = 0.05 }\n";
  const Scene s = read_scene(f.scene(moving));
  const Assembly a = assemble(s);
  const auto whole = run(s, a, test::into(f.at / "whole"));
  ASSERT_TRUE(whole.space);
  EXPECT_TRUE(whole.passed());
  const auto advice = [](const RunReport& r) -> std::string {
    for (const std::string& n : r.notes)
      if (n.starts_with("the coupling ledger does not close to its limit: ")) return n;
    return "";
  };
  const auto told = [&](const RunReport& r) {
    return advice(r).find("limit: a shorter step does, or a splitting") != std::string::npos;
  };
  EXPECT_FALSE(told(whole));
  Scene strict = s;
  strict.verify.coupling = 1e-9;
  EXPECT_TRUE(told(run(strict, assemble(strict), test::into(f.at / "strict"))));
  strict.orbit->splitting = "lobatto8c";
  strict.verify.coupling = 1e-16;
  EXPECT_TRUE(
      advice(run(strict, assemble(strict), test::into(f.at / "8c"))).ends_with("step does"));
  Scene held = read_scene(
      f.scene(moving +
              "[[controller]]\ntype = \"potential\"\nname = \"arm\"\njoints.elbow = { target = "
              "0.1, bandwidth = 0.1 }\n"));
  held.verify.coupling = 1e-16;
  const auto slower = advice(run(held, assemble(held), test::into(f.at / "held")));
  EXPECT_NE(slower.find("lower its damping and stiffness (bandwidth), else a shorter step"),
            std::string::npos)
      << slower;
  const auto j = nlohmann::json::parse(test::read_bytes(f.at / "whole" / "summary.json"));
  for (const char* name : {"orbital", "internal", "coupling"})
    EXPECT_TRUE(j["ledgers"].contains(name)) << name;
  EXPECT_FALSE(j["ledgers"].contains("total"));
  EXPECT_GT(std::fabs(j["ledgers"]["orbital"]["initial_J"].get<double>()), 1e8);

  // Stopped before its first step, then again whenever it has looked at the clock for a while.
  std::atomic<bool> stop = true;
  auto options = test::into(f.at / "parts");
  options.stop = &stop;
  options.progress = [&](double, double, double) { stop = true; };
  auto part = run(s, a, options);
  EXPECT_TRUE(part.interrupted);
  options.resume = true;
  for (int i = 0; i < 100 && part.interrupted; ++i) {
    stop = false;
    part = run(s, a, options);
  }
  ASSERT_FALSE(part.interrupted);
  EXPECT_TRUE(part.final_state == whole.final_state);
  EXPECT_EQ(part.space->angular_defect, whole.space->angular_defect);
  EXPECT_EQ(part.space->coupling.defect, whole.space->coupling.defect);
}

}  // namespace
}  // namespace porthos::scene::scene_test
