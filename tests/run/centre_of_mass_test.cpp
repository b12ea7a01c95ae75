// The centre of mass is out: in free space and uniform gravity the internal motion has the same
// bits wherever the whole is and however fast it goes.
#include "scene/assemble/centre_of_mass.h"
#include "mechanics/rotation.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "integrators/methods/collocation.h"
#include "scene/ensemble/ensemble.h"
#include "scene/run/record_log.h"
#include "scene/session/info.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

namespace porthos::test::centre_of_mass_test {
namespace {

using mechanics::Vec3d;
using Json = nlohmann::json;

/// The shipped satellite for 50 s: 250 steps.
scene::Scene ets_vii(const Vec3d& velocity = {0, 0, 0}, const Vec3d& position = {0, 0, 0}) {
  scene::Scene s =
      scene::read_scene(fmt::format("{}/examples/ets_vii/scene.toml", PORTHOS_SOURCE_DIR));
  s.step = 0.2;
  s.duration = 50;
  s.record_every = 1;
  s.base.linear_velocity = velocity;
  s.base.position = position;
  return s;
}

scene::RunReport run_in(const TemporaryFolder& folder, const scene::Scene& s) {
  return scene::run(s, scene::assemble(s), into(folder / "out"));
}
Json summary_in(const TemporaryFolder& folder) {
  return Json::parse(read_bytes(folder / "out" / "summary.json"));
}

/// The same motion without the cut: one system of translation and all else, as the world sees it.
phs::State uncut(const scene::Assembly& a, const mechanics::MechanicalModel& model, double h,
                 std::int64_t steps, const char* method = "gauss16") {
  phs::State s = scene::WorldView(a)(0, a.initial);
  const auto method_of_whole = integrators::make_integrator(method, model, h);
  for (std::int64_t i = 0; i < steps; ++i)
    EXPECT_EQ(method_of_whole->step(s), integrators::Outcome::ok);
  return s;
}

/// Largest difference of the angles of joints.
double joints_off(const mechanics::Mechanism& m, const phs::State& a, const phs::State& b) {
  double most = 0;
  size_t turn = 0;
  for (const auto& c : m.coordinates()) {
    if (c.kind != phs::BlockKind::angle) continue;
    const size_t q = size_t(c.q);
    const double off = (a.x[q] - b.x[q]) + (a.lo[q] - b.lo[q]) +
                       phs::two_pi_hi * double(a.turns[turn] - b.turns[turn]);
    most = std::max(most, std::fabs(off));
    ++turn;
  }
  return most;
}

TEST(CentreOfMass, InternalMotionHasTheSameBitsAtAnyVelocityAndPlace) {
  TemporaryFolder folder;
  const auto at_rest = run_in(folder, ets_vii());
  ASSERT_TRUE(at_rest.passed());
  const auto rest = summary_in(folder);
  const Vec3d velocities[] = {{1, 0, 0}, {0, -100, 0}, {0, 0, 7500}, {4321, -1234.5, 5999}};
  const Vec3d places[] = {{0, 0, 0}, {1e6, -2e6, 3e6}};
  for (const Vec3d& V : velocities)
    for (const Vec3d& R : places) {
      const auto r = run_in(folder, ets_vii(V, R));
      EXPECT_TRUE(r.passed());
      EXPECT_EQ(r.final_state, at_rest.final_state) << V.x << " " << R.x;
      EXPECT_EQ(r.energy.initial_J, at_rest.energy.initial_J);
      EXPECT_EQ(r.energy.max_abs_error_J, at_rest.energy.max_abs_error_J);
      EXPECT_EQ(r.angular_momentum_error, at_rest.angular_momentum_error);
      const auto j = summary_in(folder);
      for (const char* joint : {"joint_1", "joint_6", "base.attitude"}) {
        EXPECT_EQ(j["final_state"]["q"][joint], rest["final_state"]["q"][joint]);
        EXPECT_EQ(j["final_state"]["v"][joint], rest["final_state"]["v"][joint]);
      }
    }
}

TEST(CentreOfMass, WithoutTheCutTheErrorGrowsWithTheSquareOfTheVelocity) {
  // The control: what the same method makes of the same start when translation is in the equations.
  const auto error = [](double speed) {
    const scene::Scene s = ets_vii({speed, 0, 0});
    const scene::Assembly a = scene::assemble(s);
    const auto method = integrators::make_integrator(s.method, *a.model, s.step);
    phs::State inside = a.initial;
    const std::int64_t steps = 50;
    for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(inside), integrators::Outcome::ok);
    return joints_off(*a.mechanism, inside, uncut(a, *a.mechanical, s.step, steps));
  };
  const double slow = error(10), fast = error(100);
  EXPECT_GT(slow, 1e-13);
  std::printf("  joints off by %.1e rad at 10 m/s, %.1e at 100 m/s\n", slow, fast);
  EXPECT_GT(fast / slow, 20);
  EXPECT_LT(fast / slow, 500);
}

TEST(CentreOfMass, TheWorldIsShownAgain) {
  // At a velocity the uncut system bears, all numbers of both agree: places, momenta, rates.
  TemporaryFolder folder;
  scene::Scene s = ets_vii({0.3, -0.2, 0.1}, {5, 6, 7});
  s.base.angular_velocity = {0.01, -0.02, 0.03};
  s.base.attitude_wxyz[0] = 0.6;
  s.base.attitude_wxyz[2] = 0.8;
  const scene::Assembly a = scene::assemble(s);
  scene::WorldView view(a);
  for (const char* block : {"base.position", "base.attitude"}) {
    const auto& c = a.mechanism->coordinate(block);
    const double expected[] = {5, 6, 7, 0.6, 0, 0.8, 0};
    for (int k = 0; k < c.nq; ++k)
      EXPECT_EQ(view(0, a.initial).x[size_t(c.q + k)], expected[(c.nq == 4 ? 3 : 0) + k]);
  }
  const auto r = scene::run(s, a, into(folder / "out"));
  const phs::State whole = uncut(a, *a.mechanical, s.step, r.steps);
  const phs::State& world = view(r.simulated_s, r.final_state);
  double off = 0, size = 0;
  for (size_t i = 0; i < whole.x.size(); ++i) {
    off = std::max(off, std::fabs(whole.x[i] - world.x[i]));
    size = std::max(size, std::fabs(whole.x[i]));
  }
  EXPECT_LT(off / size, 1e-13);  // 1.4e-16
  const auto j = summary_in(folder)["final_state"];
  const auto v = a.mechanical->rates(whole.x);  // of the base along its own axes
  const auto& place = a.mechanism->coordinate("base.position");
  const auto rate =
      mechanics::rotation_matrix(mechanics::Quaternion<double>::load(
          &whole.x[size_t(a.mechanism->coordinate("base.attitude").q)])) *
      mechanics::Vec3d{v[size_t(place.v)], v[size_t(place.v) + 1], v[size_t(place.v) + 2]};
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(j["q"]["base.position"][size_t(k)].get<double>(), whole.x[size_t(place.q + k)],
                1e-12);
    EXPECT_NEAR(j["v"]["base.position"][size_t(k)].get<double>(), rate[k], 1e-12);
    EXPECT_NEAR(j["p"]["base.position"][size_t(k)].get<double>(),
                whole.x[size_t(a.mechanism->nq() + place.q + k)], 1e-9);
  }
}

/// A floating arm that falls, of the helper scenes.
scene::Scene falling() {
  scene::Scene s;
  s.title = "falling arm";
  s.urdf.base = mechanics::UrdfOptions::Base::free;
  s.urdf.gravity = {0.5, 0, -9.81};
  s.base.position = {0, 0, 100};
  s.base.linear_velocity = {3, 0, 12};
  s.base.angular_velocity = {0.02, -0.05, 0.1};
  s.joints["shoulder"] = {0.4, 1.5};
  s.joints["elbow"] = {-0.7, -2.5};
  s.method = "gauss16";
  s.step = 0.02;
  s.duration = 5;
  s.record_every = 0.1;
  s.verify.energy = 1e-13;
  s.verify.linear_momentum = 1e-13;
  s.verify.angular_momentum = 1e-13;
  return s;
}

TEST(CentreOfMass, FallsInClosedFormAndTheRestDoesNotFeelIt) {
  TemporaryFolder folder;
  const Case falls = make_case(folder, falling(), arm_urdf());
  const auto r = scene::run(falls.scene, falls.assembly, into(folder / "falls"));
  EXPECT_TRUE(r.passed());
  scene::Scene s = falling();
  s.urdf.gravity = {0, 0, 0};
  s.base.position = {0, 0, 0};
  s.base.linear_velocity = {0, 0, 0};
  const Case rests = make_case(folder, s, arm_urdf());
  EXPECT_EQ(scene::run(rests.scene, rests.assembly, into(folder / "rests")).final_state,
            r.final_state);

  // 113 bits of the whole, gravity in its equations.
  const mechanics::MechanicalModel whole(std::make_shared<const mechanics::Mechanism>(
      mechanics::parse_urdf(falls.scene.urdf_text, "arm.urdf", falls.scene.urdf).mechanism));
  scene::WorldView view(falls.assembly);
  const phs::State begin = view(0, falls.assembly.initial);
  using phs::Quad;
  const auto method =
      integrators::make_collocation<Quad>({.name = "reference"}, integrators::gauss_table<Quad>(12),
                                          whole, Quad(0.0625), {.max_sweeps = 400});
  phs::BasicState<Quad> exact(whole.description(), {begin.x.begin(), begin.x.end()});
  for (size_t k = 0; k < exact.x.size(); ++k) exact.lo[k] = begin.lo[k];
  for (int i = 0; i < 80; ++i) ASSERT_EQ(method->step(exact), integrators::Outcome::ok);

  const auto error = [&](const phs::State& s) {  // of the joints [rad]
    double most = 0;
    size_t turn = 0;
    for (const auto& b : whole.description().blocks) {
      if (b.kind != phs::BlockKind::angle) continue;
      const size_t k = size_t(b.at);
      const Quad turns = Quad(double(s.turns[turn++]));
      const Quad own =
          Quad(s.x[k]) + Quad(s.lo[k]) + turns * (Quad(phs::two_pi_hi) + Quad(phs::two_pi_lo));
      most = std::max(most, std::fabs(double(own - (exact.x[k] + exact.lo[k]))));
    }
    return most;
  };
  const phs::State end = view(5, r.final_state);
  const double cut = error(end), not_cut = error(uncut(falls.assembly, whole, 0.02, 250));
  std::printf("  joints off by %.1e rad, without the cut %.1e\n", cut, not_cut);
  EXPECT_LT(cut, 1e-14);
  EXPECT_GT(not_cut, 5 * cut) << "the control";
  for (size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(end.x[k], double(exact.x[k]), 1e-13) << "the base in the world, axis " << k;
}

TEST(CentreOfMass, HasItsOwnLinesInTheSummary) {
  TemporaryFolder folder;
  const Case c = make_case(folder, falling(), arm_urdf());
  const auto r = scene::run(c.scene, c.assembly, into(folder / "out"));
  const auto j = summary_in(folder);
  const auto& centre = j["centre_of_mass"];
  EXPECT_EQ(centre["motion"], "closed form");
  const double begin = centre["kinetic_start_J"], end = centre["kinetic_end_J"],
               work = centre["work_of_gravity_J"], m = centre["mass_kg"];
  EXPECT_NEAR(end - begin, work, 1e-12 * begin);
  const double V = centre["start"]["velocity_m_s"][2], z = centre["start"]["position_m"][2];
  EXPECT_NEAR(centre["end"]["position_m"][2].get<double>(), z + 5 * V - 0.5 * 9.81 * 25, 1e-12);
  EXPECT_NEAR(centre["linear_momentum_kg_m_s"][2].get<double>(), m * (V - 5 * 9.81), 1e-10);
  // The base's momentum in the world is that of the whole.
  EXPECT_NEAR(j["final_state"]["p"]["base.position"][2].get<double>(), m * (V - 5 * 9.81), 1e-10);
  EXPECT_LT(r.energy.scale_J, 100) << "of the motion inside, not of 25 kg that fall";
  EXPECT_TRUE(says(j["not_applicable"].dump(), "the centre of mass moved in closed form"));
}

constexpr const char* beside = R"([model]
urdf = "model.urdf"
base = "free"
[initial]
base.linear_velocity = [{V}, 0, 0]
base.position = [{R}, 0, 0]
joints.shoulder = { position = 0.4, velocity = 0.2 }
[[body]]
name = "target"
mass = 4
inertia = [1, 1.5, 2, 0, 0, 0]
position = [{R2}, 0.5, -0.25]
linear_velocity = [{V2}, 0.015625, 0]
angular_velocity = [0.1, 0, 0.2]
[[event]]
type = "capture"
at = 2
link = "lower"
body = "target"
reach = 100
[integrator]
method = "gauss8"
step = 0.125
[run]
duration = 4
[verify]
energy = 1e-12
angular_momentum = 1e-13
linear_momentum = 1e-13
)";

TEST(CentreOfMass, OfTwoBodiesBesideEachOtherIsOneAndACaptureKeepsIt) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf", arm_urdf());
  const auto captured = [&](double V, double R) {
    std::string text = beside;
    const auto put = [&](const std::string& name, double x) {
      const auto at = text.find(name);
      text.replace(at, name.size(), std::to_string(x));
    };
    put("{V}", V);
    put("{R}", R);
    put("{V2}", V - 0.0625);
    put("{R2}", R + 2.5);
    write_bytes(folder / "scene.toml", text);
    const scene::Scene s = scene::read_scene((folder / "scene.toml").string());
    fs::remove_all(folder / "out");
    return scene::run(s, scene::assemble(s), into(folder / "out"));
  };
  const auto at_rest = captured(0, 0), fast = captured(7500, 1e6);
  EXPECT_TRUE(at_rest.passed());
  EXPECT_TRUE(fast.passed());
  EXPECT_EQ(fast.final_state, at_rest.final_state);
  const auto j = summary_in(folder);
  const double m = 29;
  EXPECT_NEAR(j["events"][0]["linear_momentum"][0].get<double>() / (7500 * m), 1, 1e-5);
  EXPECT_NEAR(j["final_state"]["q"]["base.position"][0].get<double>(), 1e6 + 7500 * 4, 5);
}

TEST(CentreOfMass, OfEachCaseOfAnEnsembleIsItsOwn) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf", arm_urdf());
  write_bytes(folder / "cases.csv", "initial.base.linear_velocity[0]\n0\n7500\n");
  write_bytes(folder / "scene.toml",
              "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[initial]\n"
              "base.linear_velocity = [0, 0, 0]\njoints.shoulder = { velocity = 1.5 }\n"
              "[integrator]\nmethod = \"gauss8\"\nstep = 0.05\n[run]\nduration = 4\n"
              "[ensemble]\ntable = \"cases.csv\"\n");
  const scene::Ensemble e(scene::read_scene((folder / "scene.toml").string()));
  std::vector<std::vector<double>> rows(2);
  std::int64_t next = 0;
  e.work([&] { return next < 2 ? next++ : -1; },
         [&](std::span<const double> row) {
           rows[size_t(scene::integer(row[0]))].assign(row.begin(), row.end());
         },
         {});
  const auto& l = e.layout();
  const auto x = [&](size_t k, size_t i) { return rows[k][l.x() + i]; };
  EXPECT_EQ(rows[0][l.energy], rows[1][l.energy]);
  EXPECT_NEAR(x(1, 0) - x(0, 0), 4 * 7500, 1e-9) << "the base in the world";
  for (size_t i = 3; i < 9; ++i) EXPECT_EQ(x(1, i), x(0, i)) << "attitude and joints, number " << i;
}

TEST(CentreOfMass, StaysInTheEquationsWhereSomethingPushes) {
  TemporaryFolder folder;
  write_bytes(folder / "model.urdf", arm_urdf());
  const auto plan = [&](const std::string& more) {
    write_bytes(folder / "scene.toml",
                "[model]\nurdf = \"model.urdf\"\nbase = \"free\"\n[environment]\ngravity = "
                "\"uniform\"\nvector = [0, 0, -1.5]\n" +
                    more + "[integrator]\nmethod = \"gauss8\"\nstep = 0.1\n[run]\nduration = 1\n");
    const scene::Scene s = scene::read_scene((folder / "scene.toml").string());
    return scene::info_text(s, scene::assemble(s));
  };
  const auto apart = plan("");
  EXPECT_TRUE(says(apart, "the centre of mass moves in closed form"));
  EXPECT_TRUE(says(apart, "on the centre of mass alone, uniform (0, 0, -1.5) m/s^2"));
  const auto whole = plan(
      "[[element]]\ntype = \"thruster\"\nname = \"jet\"\nlink = \"body\"\ndirection = [1, 0, 0]\n"
      "thrust = 2\nswitches = [0.2, 0.5]\n");
  EXPECT_TRUE(says(whole, "integrated with everything else: thruster 'jet' pushes from outside"));
  EXPECT_TRUE(says(whole, "active, uniform (0, 0, -1.5) m/s^2"));
}

}  // namespace
}  // namespace porthos::test::centre_of_mass_test
