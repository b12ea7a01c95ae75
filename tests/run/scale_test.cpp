// Errors are relative to what moves: the verdict does not see where the origin is, which way the
// axes point, how often a screw has turned, or how seldom the run is recorded.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "mechanics/momentum.h"
#include "mechanics/rotation.h"
#include "scene/read/variation.h"
#include "scene/run/measure.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::scale_test {
namespace {

using mechanics::Pose;
using mechanics::Vec3d;
using Quaternion = mechanics::Quaternion<double>;

/// A motion of the whole world.
struct Move {
  Vec3d shift{0, 0, 0};
  Quaternion turn{1, {0, 0, 0}};
  mechanics::Mat3<double> R() const { return mechanics::rotation_matrix(turn); }
};
constexpr double far_away = 1e6;  // [m] along each axis
const Quaternion turn{0.8, {0.36, -0.288, 0.384}};

void move(scene::BaseStart& b, const Move& to) {
  const auto R = to.R();
  b.position = to.shift + R * b.position;
  b.linear_velocity = R * b.linear_velocity;
  const auto a = to.turn * Quaternion::load(b.attitude_wxyz);
  const double wxyz[] = {a.w, a.v.x, a.v.y, a.v.z};
  std::copy_n(wxyz, 4, b.attitude_wxyz);
}

/// The scene put together with everything in it moved: free bodies by their start, others by where
/// they are mounted.
scene::Assembly assemble(scene::Scene& s, const Move& to) {
  const auto R = to.R();
  s.urdf.gravity = R * s.urdf.gravity;
  s.magnetic_field = R * s.magnetic_field;
  for (auto& b : s.bodies) move(b.start, to);
  if (s.urdf.base == mechanics::UrdfOptions::Base::free) {
    move(s.base, to);
    return scene::assemble(s);
  }
  scene::Assembly a = scene::assemble(s);
  for (auto& b : a.parts.bodies())
    if (b.parent == "world") b.placement = Pose{R, to.shift} * b.placement;
  a.mechanism = std::make_shared<const mechanics::Mechanism>(a.parts.build());
  a.mechanical = std::make_shared<const mechanics::MechanicalModel>(a.mechanism);
  a.model = scene::with_joint_parts(a.mechanical, s);
  a.initial = scene::start_of(s, a).state;  // of what stands in the world
  return a;
}

scene::Scene example(const std::string& file) {
  return scene::read_scene(std::string(PORTHOS_SOURCE_DIR) + "/examples/" + file);
}

scene::RunReport run(scene::Scene s, const Move& to) {
  TemporaryFolder folder;
  const auto a = assemble(s, to);
  return scene::run(s, a, into(folder / "out"));
}

TEST(Scale, TheDoublePendulumFailsFarFromTheOriginAsItDoesThere) {
  auto s = example("double_pendulum/scene.toml");
  s.method = "rk4";
  s.duration = 10;
  s.verify = {};
  s.verify.energy = 1e-9;
  const auto here = run(s, {}), there = run(s, Move{{0, 0, 1e6}});
  std::printf("  rk4: error %.3e J of %.4g J = %.3e; 1000 km up %.3e of %.4g = %.3e\n",
              here.energy.max_abs_error_J, here.energy.scale_J, here.energy.max_rel_error,
              there.energy.max_abs_error_J, there.energy.scale_J, there.energy.max_rel_error);
  EXPECT_FALSE(here.passed());
  EXPECT_FALSE(there.passed());
  EXPECT_GT(std::fabs(there.energy.initial_J), 1e7)
      << "control: the start says where the origin is";
  EXPECT_NEAR(there.energy.scale_J / here.energy.scale_J, 1, 1e-6);
  EXPECT_NEAR(there.energy.max_rel_error / here.energy.max_rel_error, 1, 1e-6);
  // What it is made of: two rods of 1 kg that swing through at most 2 m and 4 m.
  ASSERT_EQ(here.energy.scale_parts.size(), 2u);
  EXPECT_EQ(here.energy.scale_parts[0].first, "kinetic");
  EXPECT_EQ(here.energy.scale_parts[1].first, "gravity");
  EXPECT_GT(here.energy.scale_J, 10);
  EXPECT_LT(here.energy.scale_J, 2 * 6 * 9.81);
}

TEST(Scale, TheMonitorStopsThereToo) {
  auto s = example("double_pendulum/scene.toml");
  s.method = "rk4";
  s.duration = 10;
  s.monitor.emplace().limit = 1e-6;
  s.monitor->action = integrators::OnViolation::stop;
  const auto here = run(s, {}), there = run(s, Move{{0, 0, 1e6}});
  EXPECT_EQ(here.outcome, integrators::Outcome::failed);
  EXPECT_EQ(there.outcome, integrators::Outcome::failed);
  EXPECT_LT(here.simulated_s, 10);
  EXPECT_NEAR(there.simulated_s, here.simulated_s, 0.011) << "a step of 0.01 s";
}

/// Figures of a run and of the moved one. What truncation makes is the same but for rounding;
/// errors that are rounding themselves fall differently in turned axes: within a factor.
void compare(const std::string& name, const scene::RunReport& here, const scene::RunReport& there) {
  constexpr double truncation = 1e-10, factor = 8;
  // H is measured with 64 bits, m g z of a base that stands far away with it.
  const double rounding = 1e-14 + 4e-19 * std::fabs(there.energy.initial_J) / there.energy.scale_J;
  EXPECT_EQ(here.passed(), there.passed()) << name;
  EXPECT_EQ(here.outcome, there.outcome) << name;
  ASSERT_EQ(here.checks.size(), there.checks.size()) << name;
  for (size_t k = 0; k < here.checks.size(); ++k)
    EXPECT_EQ(here.checks[k].pass, there.checks[k].pass)
        << name << " " << here.checks[k].name << " " << here.checks[k].value << " "
        << there.checks[k].value;
  EXPECT_NEAR(there.energy.scale_J / here.energy.scale_J, 1, 1e-6) << name;
  const auto same = [&](const char* what, double a, double b) {
    if (a > truncation)
      EXPECT_NEAR(b / a, 1, 1e-6) << name << " " << what;
    else
      EXPECT_LT(std::max(a, b), factor * std::max(std::min(a, b), rounding)) << name << " " << what;
  };
  same("energy", here.energy.max_rel_error, there.energy.max_rel_error);
  same("linear momentum", here.linear_momentum_error, there.linear_momentum_error);
  same("angular momentum", here.angular_momentum_error, there.angular_momentum_error);
  same("quaternion norm", here.quaternion_norm_error, there.quaternion_norm_error);
}

TEST(Scale, ScenesMovedAndTurnedHaveTheSameVerdict) {
  struct Row {
    const char* file;
    double duration;
    // A spring between two free bodies feels where they are: 1000 km away doubles know that to
    // 1e-10 m, here to 1e-14 m.
    double far = far_away;
  };
  for (const Row& row : std::initializer_list<Row>{{"canadarm/scene.toml", 20},
                                                   {"capture/scene.toml", 25},
                                                   {"capture/soft.toml", 25, 10},
                                                   {"dc_motor_arm/scene.toml", 3},
                                                   {"deployment/scene.toml", 4},
                                                   {"double_pendulum/scene.toml", 3},
                                                   {"dzhanibekov/scene.toml", 100},
                                                   {"ensemble/scene.toml", 100},
                                                   {"ets_vii/scene.toml", 100},
                                                   {"flexible_panel/scene.toml", 4},
                                                   {"ledger/scene.toml", 50},
                                                   {"qbmove_arm/scene.toml", 2},
                                                   {"throwing_arm/scene.toml", 0.5},
                                                   {"vsa_cycle/scene.toml", 2}}) {
    auto s = example(row.file);
    s.duration = row.duration;
    std::erase_if(s.events, [&](const scene::Event& e) { return e.at >= s.duration; });
    const auto here = run(s, {});
    const Vec3d shift{row.far, -row.far, row.far};
    std::string energy, angular;
    for (const Move& to : {Move{shift}, Move{{0, 0, 0}, turn}, Move{shift, turn}}) {
      const auto there = run(s, to);
      energy += fmt::format(" {:.1e}", there.energy.max_rel_error);
      angular += fmt::format(" {:.1e}", there.angular_momentum_error);
      compare(row.file, here, there);
    }
    std::printf("  %-28s %9.4g J, energy %.1e:%s, angular %.1e:%s\n", row.file, here.energy.scale_J,
                here.energy.max_rel_error, energy.c_str(), here.angular_momentum_error,
                angular.c_str());
  }
}

/// In orbit the planet has a place: the whole is turned about its axis, along which zonal harmonics
/// are round.
TEST(Scale, OrbitsTurnedAboutThePlanetsAxisHaveTheSameVerdict) {
  const double angle = 1.1;
  const Move turned{{0, 0, 0}, {std::cos(angle / 2), {0, 0, std::sin(angle / 2)}}};
  for (const char* file : {"ets_vii_orbit/scene.toml", "capture/orbit.toml"}) {
    auto s = example(file);
    s.duration = 100 * s.step;
    std::erase_if(s.events, [&](const scene::Event& e) { return e.at >= s.duration; });
    auto there = s;
    auto& start = there.orbit->start;
    start.r = turned.R() * start.r;
    start.v = turned.R() * start.v;
    compare(file, run(s, {}), run(there, turned));
  }
}

/// A base of 10 kg, 5 kg on a screw of 0.3 m/rad that has turned almost twice.
TEST(Scale, AScrewBeyondHalfATurnHasTheEnergyItHas) {
  TemporaryFolder folder;
  scene::Scene s;
  s.title = "screw";
  s.urdf.base = mechanics::UrdfOptions::Base::free;
  s.method = "gauss8";
  s.step = 1e-3;
  s.duration = 1e-3;
  s.record_every = 1e-3;
  s.verify.energy = 1e-12;
  s.base.angular_velocity = {0.1, 0.2, 0.3};
  s.joints["screw"] = {12.0, 0.0};
  const std::string urdf =
      "<robot name='screw'>" + link("body", 10) + link("nut", 5) +
      "<joint name='screw' type='helical'><parent link='body'/><child link='nut'/><axis xyz='0 0 "
      "1'/><pitch value='0.3'/></joint></robot>";
  const Case c = make_case(folder, s, urdf);
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto j = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
  const auto rate = j["final_state"]["v"]["base.attitude"].get<std::vector<double>>();
  std::printf("  H %.4g J, scale %.4g J, base rates %.4f %.4f %.4f\n", r.energy.initial_J,
              r.energy.scale_J, rate[0], rate[1], rate[2]);
  EXPECT_NEAR(r.energy.scale_J / r.energy.initial_J, 1, 1e-4) << "all of it is motion";
  for (size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(rate[k], 0.1 * double(k + 1), 0.01) << "a millisecond later";
  // The state with the angle whole and with its turns apart is one state.
  const auto& m = *c.assembly.mechanical;
  const auto& x = c.assembly.initial;
  ASSERT_EQ(x.turns.back(), 2);
  auto whole = x.x;
  whole[size_t(c.assembly.mechanism->coordinate("screw").q)] = 12.0;
  const auto a = m.rates(x.x, x.turns), b = m.rates(whole), without = m.rates(x.x);
  for (size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], 1e-12);
  EXPECT_GT(std::fabs(without[1] - a[1]), 1) << "control: the turns matter";
  const scene::Meter meter(c.assembly);
  EXPECT_NEAR(meter.initial_J(), r.energy.initial_J, 1e-12);
}

/// Two rods that swing past the lower rest with long steps: Störmer-Verlet's error comes and goes
/// with the speed.
TEST(Scale, AnErrorThatComesAndGoesBetweenRecordsIsSeen) {
  auto s = example("double_pendulum/scene.toml");
  s.method = "stormer_verlet";
  s.step = 1e-3;
  s.duration = 2;
  s.verify = {};
  s.joints["shoulder"].position = 0.5;
  s.joints["elbow"].position = 0;
  s.record_every = s.step;
  const auto all = run(s, {});
  s.record_every = s.duration;
  const auto sparse = run(s, {});
  std::printf(
      "  largest error %.3e at every step, %.3e at %lld records and %lld looks, rms of the "
      "records %.1e\n",
      all.energy.max_rel_error, sparse.energy.max_rel_error, (long long)sparse.records,
      (long long)sparse.looks, sparse.energy.rms_rel_error);
  EXPECT_EQ(all.looks, 0);
  EXPECT_EQ(sparse.records, 2);
  EXPECT_EQ(sparse.looks, 2000 / 64) << "an explicit method";
  EXPECT_GT(sparse.energy.max_rel_error, 0.9 * all.energy.max_rel_error);
  EXPECT_LE(sparse.energy.max_rel_error, 1.1 * all.energy.max_rel_error);
  EXPECT_NEAR(sparse.energy.scale_J / all.energy.scale_J, 1, 0.01);
}

}  // namespace
}  // namespace porthos::test::scale_test
