// Limits of the momentum of a wheel and of the attitude of a free base along a plan.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "scene/plan/plan.h"
#include "tests/places.h"

namespace porthos::planning::base_and_wheel_test {
namespace {

namespace fs = std::filesystem;

class BaseAndWheel : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("porthos_base_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  scene::Scene scene(const std::string& text) {
    std::ofstream(folder_ / "scene.toml") << text;
    return scene::read_scene((folder_ / "scene.toml").string());
  }
  scene::PlanReport planned(const std::string& text) {
    const auto s = scene(text);
    return scene::plan(s, scene::assemble(s), (folder_ / "out").string());
  }
  std::string refusal(const std::string& text) {
    try {
      const auto s = scene(text);
      (void)scene::plan_problem(s, scene::assemble(s), scene::read_plan(s));
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  }
  fs::path folder_;
};

/// A hull of 2 kg m² about its wheel's axis.
const char* const hull = R"(<robot name="hull">
  <link name="hull"><inertial><mass value="10"/>
    <inertia ixx="3" iyy="3" izz="2" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="wheel"><inertial><mass value="1"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="spin" type="continuous"><parent link="hull"/><child link="wheel"/>
    <axis xyz="0 0 1"/></joint>
</robot>)";

/// The wheel turns the hull by θ in T with no momentum in all, so it takes up I ω of the hull's.
/// With |p| <= P the rate rises along a parabola for a = 3 (T - θ I/P)/2 and the hull cruises; J =
/// 8/3 P²/a in the limit of short steps. Control: without the limit p goes to 3/2 I θ/T.
TEST_F(BaseAndWheel, MomentumOfAWheel) {
  std::ofstream(folder_ / "hull.urdf") << hull;
  const double theta = 0.4, T = 10, I = 2, P = 0.1, a = 1.5 * (T - theta * I / P);
  const auto text = [&](int steps, const std::string& limit) {
    return "[model]\nurdf = \"hull.urdf\"\nbase = \"free\"\n[integrator]\nmethod = \"gauss4\"\n"
           "step = " +
           std::to_string(T / steps) + "\n[run]\nduration = 10.0\n[plan]\napproach = false\n" +
           "base = { attitude_wxyz = [0.9800665778412416, 0, 0, 0.19866933079506122] }\n" +
           "joints.spin = { " + limit + "rate = 0 }\n";
  };
  const auto most = [](const scene::PlanReport& r) {
    double p = 0;
    for (size_t k = 15; k < r.plan.motion.x.size(); k += 16)
      p = std::max(p, std::fabs(r.plan.motion.x[k]));
    return p;
  };
  double before = HUGE_VAL;
  for (const int steps : {20, 80}) {
    const auto free = planned(text(steps, "")),
               limited = planned(text(steps, "momentum_limit = 0.1, "));
    const double off = std::fabs(limited.plan.cost / (8. / 3 * P * P / a) - 1);
    std::printf(
        "  %d steps: momentum up to %.12f N m s (limit 0.1), free %.6f (closed form %.6f); J off "
        "the continuous one by %.1e, %d iterations, replay off by %.1e\n",
        steps, most(limited), most(free), 1.5 * I * theta / T, off, limited.plan.iterations,
        limited.replay);
    EXPECT_EQ(limited.plan.status, Plan::Status::optimal);
    EXPECT_LE(most(limited), P);
    EXPECT_NEAR(most(free), 1.5 * I * theta / T, 1e-3);
    EXPECT_LT(limited.replay, 1e-9);
    EXPECT_LT(off, before / 6);  // order 2: sixteenfold; the ends of the cruise fall anywhere
    before = off;
  }
  EXPECT_LT(before, 5e-3);
}

/// ETS-VII's arm goes to another posture while the base stays within an angle of its start.
/// Control: without the limit the base turns further.
TEST_F(BaseAndWheel, AttitudeOfTheBase) {
  const auto text = [&](const std::string& base) {
    std::string s = "[model]\nurdf = \"" PORTHOS_SOURCE_DIR
                    "/examples/ets_vii/ets_vii.urdf\"\nbase = \"free\"\n"
                    "unphysical_inertia = \"accept\"\n[initial]\n";
    const double at[] = {0.3, -0.6, 1.1, -0.4, 0.9, 0.2};
    for (int i = 0; i < 6; ++i)
      s += "joints.joint_" + std::to_string(i + 1) + " = { position = " + std::to_string(at[i]) +
           " }\n";
    s += "[integrator]\nmethod = \"gauss4\"\nstep = 2.0\n[run]\nduration = 40.0\n"
         "[plan]\napproach = false\n" +
         base + "[plan.joints]\n";
    for (int i = 0; i < 6; ++i)
      s += "joint_" + std::to_string(i + 1) + " = { rate_weight = 1.0, weight = 1e-6, position = " +
           std::to_string(at[i] + (i % 2 ? -0.5 : 0.6)) + " }\n";
    return s;
  };
  const auto furthest = [](const scene::PlanReport& r) {
    double angle = 0;
    for (size_t k = 3; k < r.plan.motion.x.size(); k += 26)
      angle = std::max(angle, 2 * std::acos(std::min(1.0, std::fabs(r.plan.motion.x[k]))));
    return angle;
  };
  const auto free = planned(text(""));
  const double limit = 0.7 * furthest(free);
  const std::string key = "base = { attitude_limit = " + std::to_string(limit) + " }\n";
  const auto limited = planned(text(key));
  std::printf(
      "  the base turns by %.6f rad (limit %.6f), free %.6f; J = %.6f and %.6f, %d "
      "iterations, %d limits reached, replay off by %.1e\n",
      furthest(limited), limit, furthest(free), limited.plan.cost, free.plan.cost,
      limited.plan.iterations, limited.plan.active_limits, limited.replay);
  EXPECT_EQ(limited.plan.status, Plan::Status::optimal);
  EXPECT_LT(furthest(limited), 1.02 * limit);  // between the stages: order 2
  EXPECT_GT(limited.plan.cost, free.plan.cost);
  EXPECT_GT(limited.plan.active_limits, 0);
  EXPECT_LT(limited.replay, 1e-9);
}

TEST_F(BaseAndWheel, Refusals) {
  std::ofstream(folder_ / "hull.urdf") << hull;
  const auto said = [&](const std::string& base, const std::string& joint) {
    return refusal(
        "[model]\nurdf = \"hull.urdf\"\nbase = \"free\"\n[initial]\n"
        "joints.spin = { velocity = 10 }\n[integrator]\nmethod = \"gauss4\"\nstep = 1\n"
        "[run]\nduration = 10\n[plan]\nbase = { " +
        base + " }\njoints.spin = { " + joint + " }\n");
  };
  for (const auto& [base, joint, words] : std::vector<std::array<std::string, 3>>{
           {"", "momentum_limit = 0.2",
            "joint 'spin' starts with a momentum of 0.3, which is beyond"},
           {"", "momentum_limit = 0", "momentum_limit is 0, expected"},
           {"attitude_limit = 3.2", "",
            "attitude_limit is 3.2 rad, expected less than half a turn"},
           {"attitude_limit = 0.3, attitude_wxyz = [0.9800665778412416, 0, 0, 0.19866933079506122]",
            "", "attitude_wxyz is 0.4 rad from the start, which is beyond attitude_limit 0.3"}}) {
    const std::string text = said(base, joint);
    EXPECT_NE(text.find(words), text.npos) << text;
  }
}

}  // namespace
}  // namespace porthos::planning::base_and_wheel_test
