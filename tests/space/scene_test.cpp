#include "nlohmann/json.hpp"
#include "tests/run/scenes.h"

// Scenes in orbit: what they refuse, what they report, and that they go on where they were stopped.
namespace porthos::scene::scene_test {
namespace {

using test::says;

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
  EXPECT_TRUE(says(f.refusal("[planet]\nharmonics = 'moon'\n" + std::string(low)),
                   "\"earth\", \"none\" or five numbers"));
  EXPECT_TRUE(says(f.refusal("[orbit]\ninclination = 0.3\n"),
                   "none of the keys altitude and semi_major_axis"));
  EXPECT_TRUE(
      says(f.refusal(low + std::string("splitting = 'leapfrog'\n")), "expected one of: strang"));
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
  const std::string sampled =
      "[[element]]\ntype = 'controller'\njoint = 'elbow'\ndamping = 0.1\nrate = 1.0\n";
  EXPECT_TRUE(says(f.refusal(low + sampled), "sampled controller"));
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
  for (int i = 0; i < 100 && part.interrupted; ++i) stop = false, part = run(s, a, options);
  ASSERT_FALSE(part.interrupted);
  EXPECT_TRUE(part.final_state == whole.final_state);
  EXPECT_EQ(part.space->angular_defect, whole.space->angular_defect);
  EXPECT_EQ(part.space->coupling.defect, whole.space->coupling.defect);
}

}  // namespace
}  // namespace porthos::scene::scene_test
