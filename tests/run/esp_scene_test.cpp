// [[controller]] type = "esp": elastic structure preservation on models, against the law from
// formulas and the reference run.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "energy_shaping/elastic/elastic.h"
#include "energy_shaping/elastic/structure_preserving_regulator.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::esp_scene_test {
namespace {

using energy_shaping::PreservedJoint;

/// Rods with their centre 0.3 m below the joint, 0.5 m apart.
struct Rod {
  double mass, inertia;  ///< about the centre
};
std::string urdf_of(const std::vector<Rod>& rods) {
  std::string text = "<robot name='arm'><link name='base'/>", from = "base", z = "0";
  for (size_t k = 0; k < rods.size(); ++k) {
    const std::string n = std::to_string(k + 1);
    text += fmt::format(
        "<link name='rod{}'><inertial><origin xyz='0 0 -0.3'/><mass value='{:.17g}'/><inertia "
        "ixx='1' iyy='{:.17g}' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint "
        "name='joint{}' type='continuous'><parent link='{}'/><child link='rod{}'/><origin xyz='0 0 "
        "{}'/><axis xyz='0 1 0'/></joint>",
        n, rods[k].mass, rods[k].inertia, n, from, n, z);
    from = "rod" + n;
    z = "-0.5";
  }
  return text + "</robot>";
}
struct Setting {
  std::string urdf, controller, family = "family = \"series_elastic\"\nparameters = { k = 100 }",
                                drive = "drive = \"torque\"\ncommand = { constant = 0 }", more = {};
  double duration = 1, step = 0.001;
  int joints = 1;
};
scene::Scene read(const TemporaryFolder& folder, const Setting& s) {
  write_bytes(folder / "arm.urdf", s.urdf);
  std::string actuators;
  for (int k = 1; k <= s.joints; ++k)
    actuators += fmt::format(
        "[[actuator]]\njoint = \"joint{}\"\nname = \"motor{}\"\n{}\n[actuator.theta]\n{}\ninertia "
        "= 0.1\n",
        k, k, s.family, s.drive);
  write_bytes(
      folder / "scene.toml",
      fmt::format("[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
                  "\"uniform\"\nvector = [0, 0, -9.81]\n[integrator]\nmethod = \"gauss8\"\nstep = "
                  "{}\n[run]\nduration = {}\n[verify]\nbalance = 1e-12\n{}{}{}",
                  s.step, s.duration, actuators, s.controller, s.more));
  return scene::read_scene((folder / "scene.toml").string());
}
/// One link with 1 kg m² about its hinge and m g l = 2 N m.
std::string one_link() {
  const double mass = 2 / (9.81 * 0.3);
  return urdf_of({{mass, 1 - 0.09 * mass}});
}
std::string law(const std::string& type, const std::string& joints, const std::string& more = "") {
  return "[[controller]]\ntype = \"" + type + "\"\nname = \"law\"\n" + more + joints;
}
const std::string gains =
    "joints.joint1 = { target = 0.5, damping = 4, stiffness = 60, motor_damping = 2 }\n";

std::vector<double> end_of(const Setting& s) {
  TemporaryFolder folder;
  const auto scene = read(folder, s);
  const auto r = scene::run_in_memory(scene, scene::assemble(scene), {});
  EXPECT_TRUE(r.passed());
  return r.final_state.x;
}

/// The mass matrix and the potential of two such rods.
struct TwoRods {
  static constexpr int n = 2;
  const char* name = "two rods";
  std::array<std::pair<const char*, const char*>, 2> coordinates{
      {{"joint1", "rad"}, {"joint2", "rad"}}};
  double m1 = 2, I1 = 0.1, m2 = 1.5, I2 = 0.07;
  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    const S c = S(m2 * 0.5 * 0.3) * phs::cos(q[1]), lower(I2 + m2 * 0.09);
    M[0] = S(I1 + m1 * 0.09 + m2 * 0.25) + lower + S(2.0) * c;
    M[1] = M[2] = lower + c;
    M[3] = lower;
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-9.81 * (m1 * 0.3 + m2 * 0.5)) * phs::cos(q[0]) -
           S(9.81 * m2 * 0.3) * phs::cos(q[0] + q[1]);
  }
};

}  // namespace

TEST(EspScene, ALinkMovesAsTheReferenceRun) {
  // After 1 s (q, q', θ, θ') = (0.478776, -0.233437, 0.506557, -0.238853): RK4 of 0.5 ms of the law
  // of Keppler et al. 2018, with these numbers, printed to six digits.
  const auto x = end_of({one_link(), law("esp", gains)});  // q, p, link, θ, p_θ
  EXPECT_NEAR(x[0], 0.478776, 2e-6);
  EXPECT_NEAR(x[1], -0.233437, 4e-6);
  EXPECT_NEAR(x[3], 0.506557, 2e-6);
  EXPECT_NEAR(x[4] / 0.1, -0.238853, 4e-6);
  const auto later = end_of({.urdf = one_link(), .controller = law("esp", gains), .duration = 5});
  keeps("off after 5 s [rad]", std::fabs(later[0] - 0.5), 1e-5);
  EXPECT_NEAR(later[3], 0.509589, 1e-5);
  const auto held =
      end_of({.urdf = one_link(), .controller = law("esp", gains, "rate = 500\n"), .duration = 5});
  keeps("sampled at 500 Hz [rad]", std::fabs(held[0] - 0.5), 1e-4);
  // Negative control: motor positions alone (Tomei) do not damp the link so soon.
  const auto tomei = end_of({.urdf = one_link(),
                             .controller = law("motor_side",
                                               "joints.joint1 = { target = 0.5, stiffness = 60, "
                                               "damping = 2 }\n"),
                             .duration = 5});
  breaks("by motor positions alone [rad]", std::fabs(tomei[0] - 0.5), 0.01);
}

TEST(EspScene, TheLawOfAModelIsThatOfItsFormulas) {
  TemporaryFolder folder;
  const TwoRods rods;
  const auto s = read(
      folder,
      {.urdf = urdf_of({{rods.m1, rods.I1}, {rods.m2, rods.I2}}), .controller = {}, .joints = 2});
  const auto a = scene::assemble(s);
  const std::vector<PreservedJoint> joints{{"joint2.torque", 150, 0.1, -0.8, 3, 30, 2},
                                           {"joint1.torque", 200, 0.2, 0.6, 6, 50, 4}};
  const energy_shaping::StructurePreservingRegulator made(a.mechanical, joints);
  std::printf("%s", made.certificate().text().c_str());
  const auto laws = made.laws({{5, 7}, {4, 6}});
  const auto formulas = [&](double damping) {
    return energy_shaping::ElasticStructurePreserving<TwoRods>(
        {rods, {200, 150}, {0.2, 0.1}}, {{0.6, -0.8}, {damping, 3}, {50, 30}, {4, 2}});
  };
  const auto esp = formulas(6), other = formulas(6.06);
  std::mt19937_64 generator(3);
  std::normal_distribution<double> spread(0, 1);
  double worst = 0, changed = HUGE_VAL;
  for (int i = 0; i < 100; ++i) {
    std::vector<double> x(8), u(2), v(2), w(2);
    for (double& k : x) k = spread(generator);
    laws[0]->operator()(0.0, std::span<const double>(x), std::span<const double>(),
                        std::span<double>(u).subspan(1));
    laws[1]->operator()(0.0, std::span<const double>(x), std::span<const double>(),
                        std::span<double>(u).first(1));
    const std::vector<double> z{x[0], x[1], x[4], x[5], x[2], x[3], x[6], x[7]};  // (q, θ, p, Bθ')
    esp.law<double>(z, v);
    other.law<double>(z, w);
    const double size = std::fabs(v[0]) + std::fabs(v[1]);
    worst = std::max(worst, (std::fabs(u[0] - v[0]) + std::fabs(u[1] - v[1])) / size);
    changed = std::min(changed, (std::fabs(u[0] - w[0]) + std::fabs(u[1] - w[1])) / size);
  }
  keeps("the law of the model against that of formulas, relative", worst, 1e-11);
  breaks("1 % more damping at one link", changed, 1e-5);
}

TEST(EspScene, AnArmOfTwoRodsComesToItsTargetAndKeepsItsLedger) {
  const std::string joints =
      "joints.joint1 = { target = 0.6, damping = 6, stiffness = 50, motor_damping = 4 }\n"
      "joints.joint2 = { target = -0.8, damping = 3, stiffness = 30, motor_damping = 2 }\n";
  for (const std::string more : {"", "tank = { level = 60, most = 100 }\n"}) {
    TemporaryFolder folder;
    const auto s = read(folder, {.urdf = urdf_of({{2, 0.1}, {1.5, 0.07}}),
                                 .controller = law("esp", joints, more),
                                 .duration = 8,
                                 .step = 0.002,
                                 .joints = 2});
    const auto a = scene::assemble(s);
    const auto r = scene::run_in_memory(s, a, {});
    EXPECT_TRUE(r.passed());
    keeps("joint 1 off after 8 s [rad]", std::fabs(r.final_state.x[0] - 0.6), 1e-5);
    keeps("joint 2 off after 8 s [rad]", std::fabs(r.final_state.x[1] + 0.8), 1e-5);
    EXPECT_TRUE(a.certificates.at(0).holds());
  }
}

TEST(EspScene, AResumedRunHasTheSameBits) {
  for (const std::string rate : {"", "rate = 200\ntank = { level = 9, most = 20 }\n"}) {
    TemporaryFolder folder;
    const auto s = read(folder, {.urdf = one_link(), .controller = law("esp", gains, rate)});
    const auto a = scene::assemble(s);
    const auto whole = scene::run(s, a, into(folder / "whole"));
    EXPECT_TRUE(whole.passed());
    auto half = into(folder / "half");
    half.stop_at = 333;  // between two samples
    EXPECT_TRUE(scene::run(s, a, half).interrupted);
    const auto rest = scene::run(s, a, into(folder / "half", true));
    EXPECT_EQ(whole.final_state, rest.final_state);
    EXPECT_EQ(whole.held, rest.held);
  }
}

TEST(EspScene, ARateThatIsTooLowIsRefusedWithOneThatHolds) {
  TemporaryFolder folder;
  expect_named_rate_holds(
      [&](double rate) {
        return refusal([&] {
          scene::assemble(
              read(folder, {.urdf = one_link(),
                            .controller = law("esp", gains, fmt::format("rate = {}\n", rate))}));
        });
      },
      4);
}

TEST(EspScene, RefusalsSayWhereAndWhat) {
  const auto says = [](const Setting& s, const std::string& part) {
    TemporaryFolder folder;
    std::string told;
    try {
      (void)scene::assemble(read(folder, s));
    } catch (const InvalidArgument& e) {
      told = e.what();
    }
    EXPECT_NE(told.find(part), std::string::npos) << told;
    EXPECT_NE(told.find("scene.toml:"), std::string::npos) << told;
  };
  const auto own = law("esp", gains);
  says({.urdf = one_link(), .controller = own, .joints = 0}, "has no [[actuator]]");
  says({.urdf = urdf_of({{2, 0.1}, {1, 0.1}}), .controller = own}, "'joint2' has no motor");
  says({.urdf = one_link(),
        .controller = own,
        .drive = "drive = \"position\"\nkp = 1\nkd = 1\n"
                 "command = { constant = 0 }"},
       "expected drive = \"torque\"");
  says({.urdf = one_link(), .controller = law("esp", "joints.joint1 = { stiffness = 60 }\n")},
       "rightmost eigenvalue");
  says({.urdf = one_link(),
        .controller = own,
        .family = "family = \"series_elastic\"\nparameters = { k = 100 }\ndamping = 0.1"},
       "has a damper beside its spring");
  says({.urdf = one_link(), .controller = law("esp", gains, "rate = 100\ndelay = 1\n")},
       "acts on motors");
}

}  // namespace porthos::test::esp_scene_test
