// Bodies from the momenta of a log, without a run: against the bodies that made it; the fits that
// begin there against those from the scene; a torque of the wrong sign.
#include "scene/identification/detail/momentum_regression.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/identification/detail/logged_motion.h"
#include "tests/identification/support.h"
#include "tests/places.h"

namespace porthos::scene::momentum_regression_test {
namespace {

using Vec = std::vector<double>;

Scene arm_in_orbit() {
  Scene s = read_scene(PORTHOS_SOURCE_DIR "/examples/ets_vii/scene.toml");
  s.centre_stays = true;
  return s;
}
/// Half as much mass in the last link, its centre 0.2 m off, half as much inertia.
Scene half_wrong() {
  Scene s = arm_in_orbit();
  const Assembly a = assemble(s);
  const Unknowns own(s, a, {"link_6"});
  auto b = own.mass(0, own.start());
  b.mass /= 2;
  b.com = b.com + mechanics::Vec3d{0.1, -0.1, 0.15};
  auto& I = b.inertia;
  I = {I.xx / 2, I.xy / 2, I.xz / 2, I.yy / 2, I.yz / 2, I.zz / 2};
  return own.with_mass(std::move(s), 0, b);
}

LogNoise rates_noise() {
  LogNoise n;
  for (int i = 1; i <= 6; ++i) n.by_name[fmt::format("joint_{}.velocity", i)] = 1e-5;
  for (const char* axis : {"x", "y", "z"}) {
    n.by_name[fmt::format("base.angular_velocity.{}", axis)] = 1e-7;
    n.by_name[fmt::format("base.linear_velocity.{}", axis)] = 1e-7;
  }
  return n;
}
NamedColumns rates(double duration) {
  std::vector<std::string> names;
  for (const auto& [name, sigma] : rates_noise().by_name) names.push_back(name);
  return noisy(run_of(arm_in_orbit(), names, duration), rates_noise(), 1);
}

/// The largest error of ten numbers, in parts of the body's sizes.
double off(const Unknowns& unknowns, const Vec& z, const Unknowns& truth) {
  const auto found = unknowns.values(z), expected = truth.values(truth.start());
  double worst = 0;
  for (size_t i = 0; i < found.size(); ++i)
    worst = std::max(worst, std::fabs(found[i] - expected[i]) / truth.list()[i].scale);
  return worst;
}

TEST(MomentumRegression, FindsALinkThatIsHalfWrong) {
  const Scene right = arm_in_orbit(), wrong = half_wrong();
  const Assembly a = assemble(right), b = assemble(wrong);
  const Unknowns truth(right, a, {"link_6"}), unknowns(wrong, b, {"link_6"});
  const Log log = log_of(rates(100), rates_noise(), wrong, b);
  const auto z = bodies_by_momenta(wrong, b, unknowns, log);
  ASSERT_EQ(z.size(), 10U);
  const double before = off(unknowns, unknowns.start(), truth), after = off(unknowns, z, truth);
  std::printf("  the ten numbers off by %.2g before, by %.2g after   bound 0.02\n", before, after);
  EXPECT_GT(before, 0.4);
  EXPECT_LT(after, 0.02);
}

/// Control: a log without one of the twelve rates, whose fit begins with the scene's link.
TEST(MomentumRegression, SavesIterations) {
  const Scene wrong = half_wrong();
  const NamedColumns log = rates(100);
  const auto fit = [&](const NamedColumns& columns) {
    LogNoise noise = rates_noise();
    std::erase_if(noise.by_name, [&](const auto& c) { return !columns.contains(c.first); });
    return identify(wrong, columns, {.parameters = {"link_6"}, .noise = noise});
  };
  NamedColumns without = log;
  without.erase("base.linear_velocity.z");
  const auto begun = fit(log), plain = fit(without);
  const auto told = [](const Identification& r) {
    return fmt::format("{} iterations, {} runs, {:+.1f} sigma{}", r.iterations, r.runs,
                       r.surprise(), r.converged ? "" : ", not converged");
  };
  std::printf("  from the scene %s; from the momenta %s\n", told(plain).c_str(),
              told(begun).c_str());
  EXPECT_TRUE(begun.by_momenta);
  EXPECT_TRUE(begun.converged);
  EXPECT_LT(std::fabs(begun.surprise()), 4);
  EXPECT_FALSE(plain.by_momenta);
  EXPECT_TRUE(!plain.converged || 2 * begun.iterations < plain.iterations);
  EXPECT_NE(identification_text(begun).find("\nstart       bodies by least squares"),
            std::string::npos);
  for (const auto& ten : begun.iterates) EXPECT_GT(ten[0], 0);
}

constexpr const char* lever_urdf = R"(<robot name="lever"><link name="ground"/>
<link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="{:.17g}"/>
<inertia ixx="0.2" iyy="0.21" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tip"><inertial><origin xyz="0 0.1 -0.4"/><mass value="1.5"/>
<inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/></joint>
<joint name="wrist" type="continuous"><parent link="rod"/><child link="tip"/>
<origin xyz="0 0 -1"/><axis xyz="1 0 0"/></joint>
</robot>)";

class MomentaOfScenes : public SceneFiles {
 protected:
  /// Two links in gravity on a spring with friction, driven by a torque.
  Scene lever(double mass, double torque) const {
    write("lever.urdf", fmt::format(fmt::runtime(lever_urdf), mass));
    return read(fmt::format(R"([model]
urdf = "lever.urdf"
base = "fixed"
[environment]
gravity = "uniform"
vector = [0, 0, -9.81]
[initial]
joints.hinge = {{ position = 1.2, velocity = 0.3 }}
joints.wrist = {{ position = -3.0, velocity = -1.3 }}
[[element]]
type = "spring"
name = "coil"
joint = "hinge"
stiffness = 6
[[element]]
type = "friction"
name = "bearing"
joint = "wrist"
coulomb = 0.1
viscous = 0.05
smoothing = 0.2
[[element]]
type = "force"
name = "motor"
joint = "hinge"
sine = {{ amplitude = {}, frequency = 0.4 }}
[integrator]
method = "gauss12"
step = 0.02
[run]
duration = 4
)",
                            torque));
  }
  /// The mass of the rod by the momenta, from half of it.
  double mass_by_momenta(double torque, const std::vector<std::string>& columns,
                         std::vector<std::string> parameters = {"rod.mass"},
                         double duration = 4) const {
    NamedColumns columns_of_log = run_of(lever(2, 8), columns, duration);
    for (auto& [name, values] : columns_of_log)  // an encoder of one turn
      for (double& x : values)
        if (name == "wrist.position") x = std::remainder(x, 2 * M_PI);
    const Scene s = lever(1, torque);
    const Assembly a = assemble(s);
    const Unknowns unknowns(s, a, parameters);
    LogNoise noise{.of_all = 1e-3};
    const auto z = bodies_by_momenta(s, a, unknowns, log_of(columns_of_log, noise, s, a));
    return z.empty() ? NAN : unknowns.values(z)[0];
  }
};

TEST_F(MomentaOfScenes, TellATorqueOfTheWrongSign) {
  const std::vector<std::string> rates{"hinge.velocity", "wrist.velocity"};
  const double right = mass_by_momenta(8, rates), wrong = mass_by_momenta(-8, rates);
  std::printf("  mass %.6g kg of 2, with the torque the other way %.4g\n", right, wrong);
  EXPECT_NEAR(right, 2, 1e-3);
  EXPECT_NEAR(mass_by_momenta(8, rates, {"rod.mass"}, 90), 2, 1e-3);  // 4501 times
  EXPECT_GT(std::fabs(wrong - 2), 0.2);
}

TEST_F(MomentaOfScenes, TakeThePlacesOfTheLogWhereItHasThem) {
  const std::vector<std::string> all{"hinge.velocity", "wrist.velocity", "hinge.position",
                                     "wrist.position"};
  EXPECT_NEAR(mass_by_momenta(8, all), 2, 1e-3);
  // A start that is sought is not known: it has to be in the log.
  EXPECT_NEAR(mass_by_momenta(8, all, {"rod.mass", "hinge.position"}), 2, 1e-3);
  const std::vector<std::string> rates{"hinge.velocity", "wrist.velocity"};
  EXPECT_TRUE(std::isnan(mass_by_momenta(8, rates, {"rod.mass", "hinge.position"})));
}

TEST_F(MomentaOfScenes, NeedAllRatesAndABody) {
  EXPECT_TRUE(std::isnan(mass_by_momenta(8, {"hinge.velocity", "wrist.position"})));
  EXPECT_TRUE(
      std::isnan(mass_by_momenta(8, {"hinge.velocity", "wrist.velocity"}, {"coil.stiffness"})));
}

/// Control: the scene that made the log is nearer to it than what the momenta tell; and a torque
/// the other way, whose run disagrees with the log.
TEST_F(MomentaOfScenes, BeginAFitOnlyNearerToTheLog) {
  const NamedColumns log = run_of(lever(2, 8), {"hinge.velocity", "wrist.velocity"}, 4);
  const IdentificationRequest request{.parameters = {"rod.mass"}, .noise = {.of_all = 1e-3}};
  const auto r = identify(lever(1, 8), log, request);
  EXPECT_TRUE(r.by_momenta);
  EXPECT_NEAR(r.found[0].value, 2, 1e-6);
  EXPECT_NEAR(r.iterates.front()[0], 2, 1e-3);
  const auto turned = identify(lever(1, -8), log, request);
  EXPECT_TRUE(!turned.converged || turned.surprise() > 3);
  const auto at_truth = identify(lever(2, 8), log, request);
  EXPECT_FALSE(at_truth.by_momenta);  // the scene's own run has the log
  EXPECT_EQ(identification_text(at_truth).find("\nstart  "), std::string::npos);
}

/// Control: of the fourth power they are off.
TEST(LoggedMotion, IntegratesCubicsOnUnequalTimes) {
  const Vec times{0, 0.1, 0.25, 0.3, 0.5, 0.55};
  for (const int power : {0, 1, 2, 3, 4}) {
    double worst = 0;
    for (size_t i = 0; i + 1 < times.size(); ++i) {
      const Neighbours n = integration(times, i);
      double sum = 0;
      for (size_t k = 0; k < n.count; ++k) sum += n.weight[k] * std::pow(times[n.first + k], power);
      const double exact =
          (std::pow(times[i + 1], power + 1) - std::pow(times[i], power + 1)) / (power + 1);
      worst = std::max(worst, std::fabs(sum - exact));
    }
    if (power < 4)
      EXPECT_LT(worst, 1e-15) << power;
    else
      EXPECT_GT(worst, 1e-6);
  }
}

}  // namespace
}  // namespace porthos::scene::momentum_regression_test
