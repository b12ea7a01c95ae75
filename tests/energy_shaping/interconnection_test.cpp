// Control by interconnection with Casimirs, the dissipation obstacle, tanks, swing-up; and the
// program of the docs page.
#include <random>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/matching/swing_up.h"
#include "phs/network/network.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::interconnection_test {
namespace {

using test::breaks, test::keeps, test::refusal, test::Vec;

// A dynamic controller as a port-Hamiltonian system, a spring whose elongation is the controller's
// state. The Casimir elongation - angle is found, and with it H + H_c is a function of the plant's
// state alone.
TEST(Interconnection, CasimirShapesTheEnergy) {
  const auto arm = test::arm(1, 0.1, 0);
  phs::Network n("arm with a spring for a controller");
  n.add("arm", arm).add("controller", phs::spring_element(phs::spring(5)));
  n.feedback("arm.joint_0.torque", "controller.ends");
  n.resist("injected", "arm.joint_0.torque", phs::viscous(0.4));
  const auto loop = n.build();
  ASSERT_EQ(loop->casimirs().size(), 1u);
  std::printf("  Casimir: %s\n", loop->casimirs()[0].text.c_str());
  const auto H = loop->instantiate<double>();
  const auto method = integrators::make_integrator("gonzalez", *loop, 0.01);
  phs::State s(loop->description(), {0.7, 0, 0.7});
  const double first = s.x[2] - s.x[0];
  double casimir = 0, rise = 0, before = H->hamiltonian(s.x);
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    casimir = std::max(casimir, std::fabs(s.x[2] + s.lo[2] - s.x[0] - s.lo[0] - first));
    const double now = H->hamiltonian(s.x);
    rise = std::max(rise, now - before);
    before = now;
  }
  keeps("elongation - angle", casimir, 1e-14);
  keeps("rise of H + H_c [J]", rise, 1e-14);
  keeps("angle after 20 s", std::fabs(s.x[0]), 1e-3);
}

// The dissipation obstacle: a coordinate with damping on it has no Casimir with the controller. A
// leaky spring (a resistor in series) lets its elongation slip, and none is found.
TEST(Interconnection, DissipationObstacle) {
  const auto casimirs = [](bool resistive) {
    phs::Network n(
        "electrical");  // a winding as the plant, a capacitor for a controller; R in the winding's own loop
    n.add("winding", phs::inertia_element(0.1, phs::electricity));
    n.add("controller", phs::spring_element(phs::spring(2), phs::electricity));
    n.add("plant", phs::spring_element(phs::spring(3), phs::electricity));
    n.one_junction("loop", {{"winding.body"}, {"controller.ends"}, {"plant.ends"}});
    if (resistive) n.resist("R", "winding.body", phs::viscous(0.5));
    return n.build()->casimirs().size();
  };
  // Charges of both capacitors move together, damped or not: R grad C = 0. The flux has no Casimir
  // either way.
  EXPECT_EQ(casimirs(false), 1u);
  EXPECT_EQ(casimirs(true), 1u);
  phs::Network n(
      "leaking");  // R across the plant's capacitor: its charge is dissipated, and the Casimir is gone
  n.add("winding", phs::inertia_element(0.1, phs::electricity));
  n.add("controller", phs::spring_element(phs::spring(2), phs::electricity));
  n.add("plant", phs::spring_element(phs::spring(3), phs::electricity));
  n.one_junction("loop", {{"winding.body"}, {"controller.ends"}, {"plant.ends"}});
  n.resist("leak", "plant.ends", phs::viscous(0.1));
  EXPECT_EQ(n.build()->casimirs().size(), 0u);
}

TEST(ReferenceRuns, EnergySwingUp) {  // numbers of the DFKI torque-limited pendulum
  const double m = 0.57288, l = 0.5, g = 9.81, b = 0.1;
  EnergySwingUp law{
      .inertia = m * l * l, .mgl = m * g * l, .gain = 1, .friction = b, .limit = 1, .kick = 1};
  EXPECT_TRUE(law.stuck(0, 0));
  auto without = law;
  without.kick = 0;
  EXPECT_NE(refusal([&] { without.check_start(0, 0); }).find("stuck"), std::string::npos);
  law.check_start(0, 0);
  // As published: dt = 10 ms held, Runge-Kutta; here until |q - π| < 0.1 and |q'| < 1, where a
  // regulator would take over.
  const auto up = [&](const EnergySwingUp& u_law) {
    double q = 0, v = 0;
    for (int i = 0; i < 2000; ++i) {
      if (std::fabs(std::remainder(q - std::acos(-1.0), 2 * std::acos(-1.0))) < 0.1 &&
          std::fabs(v) < 1)
        return 0.01 * i;
      const double u = u_law(q, v);
      for (int s = 0; s < 10; ++s) {
        const double h = 1e-3;
        const auto a = [&](double x, double w) {
          return (u - b * w - m * g * l * std::sin(x)) / (m * l * l);
        };
        const double k1 = a(q, v), k2 = a(q + h / 2 * v, v + h / 2 * k1),
                     k3 = a(q + h / 2 * v + h * h / 4 * k1, v + h / 2 * k2),
                     k4 = a(q + h * v + h * h / 2 * k2, v + h * k3);
        q += h * v + h * h / 6 * (k1 + k2 + k3);
        v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
    }
    return HUGE_VAL;
  };
  std::printf("  up after %.2f s (published with a regulator that catches it earlier: 2.91 s)\n",
              up(law));
  keeps("time to the top [s]", up(law), 6);
  breaks("without a kick", up(without), 10);
  // d/dt ½ (E - E_d)² = -k q'² (E - E_d)², away from the limit.
  law.limit = HUGE_VAL;
  const double q = 1, v = 2, E = law.energy(q, v) - law.target(), u = law(q, v);
  keeps("rate of the energy", std::fabs(v * (u - b * v) * E + v * v * E * E) / (v * v * E * E),
        1e-14);
}

// The program of docs/controllers.md.
struct MyDesign {
  static constexpr int n = 2;
  std::string name = "my wheel";
  std::vector<Gain> gains() const { return {{"k", 0.1}, {"kv", 10}}; }
  template <class S, class T>
  void mass(std::span<const S>, std::span<const T>, std::span<S> Md) const {
    Md[0] = S(1.0);
    Md[1] = Md[2] = S(-1.5);
    Md[3] = S(6.0);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    const S z = q[1] + S(4.5) * q[0];
    return S(-2.0) * porthos::phs::cos(q[0]) + S(0.5) * S(k[0]) * z * z;
  }
};

TEST(Docs, ControllerInTwentyLines) {
  const Region region{{-3.2, -20}, {3.2, 20}, 20};
  const MatchedLoop loop(inertia_wheel_plant({}), shaping(MyDesign{}), {"wheel.force"}, {0, 0},
                         {.region = region});
  CertifyOptions o{.region = region, .starts = {{3.14, 0, 0, 0}}, .periods = {0, 0.001}};
  o.run.duration = 40;
  o.run.step = 0.001;
  const auto c = certify(loop, o);
  std::printf("%s", c.text().c_str());
  EXPECT_TRUE(c.holds());
}

}  // namespace
}  // namespace porthos::energy_shaping::interconnection_test
