// Energy and Casimirs: what a dynamic controller shapes, the dissipation obstacle, and laws paid
// from a tank.
#include "energy_shaping/loop/interconnection.h"

#include "phs/system/check.h"
#include "phs/system/user_model.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::energy_casimir_test {
namespace {

using test::breaks, test::keeps, test::refusal, test::Vec;

/// A spring, or a capacitor, with a leak beside it: x' = rate - leak · k x.
struct Leaking {
  double k, leak;
  phs::Domain domain;
  phs::Description description() const {
    phs::Description d;
    d.name = "leaking store";
    d.nx = 1;
    d.nu = 1;
    d.blocks = {{"x", phs::BlockKind::linear, 0, 1, -1, domain.displacement, ""}};
    d.ports = {{"ends", phs::PortKind::flow_in, 1, 0, domain.flow, domain.effort}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5 * k) * x[0] * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(k) * x[0];
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T>, std::span<T> Je) const {
    Je[0] = T(0.0);
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(leak) * e[0];
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = u[0];
  }
};
std::shared_ptr<const phs::Model> leaking(double k, double leak, const phs::Domain& domain) {
  return std::make_shared<phs::UserModel<Leaking>>(Leaking{k, leak, domain});
}

TEST(EnergyCasimir, ASpringForAControllerHoldsALoad) {
  const auto arm = test::arm(1, 0.1);
  const std::string port = "joint_0.torque";
  const Interconnection loop(arm, phs::spring_element(phs::spring(40)),
                             {.joins = {{port, "ends", 2}}, .rest = {0.4, 0}});
  std::printf("%s", loop.certificate().text().c_str());
  EXPECT_TRUE(loop.certificate().holds());
  EXPECT_EQ(loop.certificate().item("damped directions").value, 1);
  keeps("the tie: off from the angle",
        std::fabs(std::fabs(loop.ties()(0, 0)) - 1) + std::fabs(loop.ties()(0, 1)), 1e-12);
  // Started on the leaf it ends at x*, H_d falls all the way; started off the leaf it ends
  // elsewhere.
  const auto end_of = [&](Vec x0, double& rise) {
    const auto method = integrators::make_integrator("gonzalez", *loop.loop(), 0.01);
    phs::State s(loop.loop()->description(), std::move(x0));
    double before = loop.loop()->instantiate<double>()->hamiltonian(s.x);
    for (int i = 0; i < 3000; ++i) {
      if (method->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
      const double now = loop.loop()->instantiate<double>()->hamiltonian(s.x);
      rise = std::max(rise, now - before);
      before = now;
    }
    return std::fabs(s.x[0] - 0.4);
  };
  double rise = 0;
  auto x0 = loop.start(Vec{-0.5, 0});
  keeps("H_d of the plant's state against H + H_c",
        std::fabs(loop.energy(Vec{-0.5, 0}) - loop.loop()->instantiate<double>()->hamiltonian(x0)),
        1e-14);
  keeps("off from x* after 30 s", end_of(x0, rise), 1e-6);
  keeps("rise of H_d in a step [J]", rise, 1e-12);
  x0[2] += 0.3;
  breaks("another leaf: off from x* after 30 s", end_of(x0, rise), 0.05);
}

TEST(EnergyCasimir, ObstaclesAreReported) {
  const auto arm = test::arm(1, 0.1);
  const double hanging = std::acos(0.0);
  const auto slips = refusal([&] {
    Interconnection(arm, leaking(40, 0.5, phs::rotation),
                    {.joins = {{"joint_0.torque", "ends"}}, .rest = {hanging, 0}});
  });
  std::printf("  %s\n", slips.c_str());
  EXPECT_NE(slips.find("controller states tied fails"), std::string::npos);
  // A capacitor with a resistor across it, to be held at a voltage: power for ever.
  const auto plant = leaking(1, 0.5, phs::electricity);
  const auto coil = phs::inertia_element(0.1, phs::electricity);
  const InterconnectionOptions o{.joins = {{"ends", "body"}}, .rest = {2}};
  const auto why = refusal([&] { Interconnection(plant, coil, o); });
  std::printf("  %s\n", why.c_str());
  EXPECT_NE(why.find("power lost at rest fails"), std::string::npos) << why;
  EXPECT_NE(why.find("2 W for ever"), std::string::npos) << why;
  auto kept = o;
  kept.refuse = false;
  const Interconnection looked_at(plant, coil, kept);
  EXPECT_FALSE(looked_at.certificate().holds());
  EXPECT_EQ(looked_at.certificate().item("controller states tied").value, 0);
  const auto unknown = refusal([&] {
    Interconnection(arm, coil, {.joins = {{"elbow", "body"}}, .rest = {0, 0}});
  });
  EXPECT_NE(unknown.find("no port 'elbow'"), std::string::npos) << unknown;
}

// A law that makes energy, negative damping: from a tank it gives what there is and no more.
TEST(EnergyCasimir, TankMemberPaysForALawThatIsNotPassive) {
  const auto arm = test::arm(2, 0, 0);
  const auto pump = phs::law([](auto, auto, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(0.8) * y[0];
  });
  const TankOptions tank{.level = 3, .least = 0.5, .most = 4};
  const auto model = with_tank(arm, "joint_0.torque", pump, tank);
  const auto report = phs::check(*model, {.spread = 0.5, .tolerance = 1e-10});
  EXPECT_TRUE(report.holds()) << report.text();
  struct Outcome {
    double low = HUGE_VAL, high = 0, rise = 0, defect = 0, arm = 0;
  };
  const auto run = [](const phs::Model& m, Vec x0, double duration) {
    const auto method = integrators::make_integrator("gonzalez", m, 0.005);
    const auto system = m.instantiate<double>();
    phs::State s(m.description(), std::move(x0));
    double before = system->hamiltonian(s.x);
    const double first = before;
    const auto& powers = m.description().powers;
    double booked = 0;
    Outcome o;
    for (int i = 0; i < std::lround(duration / 0.005); ++i) {
      if (method->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
      const double now = system->hamiltonian(s.x);
      for (size_t a = 0; a < powers.size(); ++a)
        booked += (powers[a].kind == phs::PowerKind::supplied ? 1 : -1) * method->port_work()[a];
      o.rise = std::max(o.rise, now - before);
      before = now;
      o.defect = std::max(o.defect, std::fabs(now - first - booked));
      o.low = std::min(o.low, s.x.back());
      o.high = std::max(o.high, s.x.back());
    }
    o.arm = before - s.x.back();
    return o;
  };
  auto x0 = arm->state(Vec{0.3, -0.2}, Vec{1, -0.5});
  x0.push_back(tank.level);
  const auto o = run(*model, x0, 20);
  std::printf("  tank %.3f to %.3f J, the arm ends with %.3f J\n", o.low, o.high, o.arm);
  keeps("below the lower bound [J]", tank.least - o.low, 0);
  keeps("rise of H + E in a step [J]", o.rise, 1e-11);
  keeps("ledger against H + E [J]", o.defect, 1e-10);
  breaks("the law was served: energy of the arm gained [J]", o.arm - 0.3, 1);
  // Damping fills it to the upper bound and no further.
  auto fed = tank;
  fed.damping = 3;
  auto fast = arm->state(Vec{0.3, -0.2}, Vec{6, -4});
  fast.push_back(tank.level);
  const auto full = run(*with_tank(arm, "joint_0.torque", phs::law([](auto, auto, auto, auto u) {
                                     u[0] = typename decltype(u)::value_type(0.0);
                                   }),
                                   fed),
                        fast, 10);
  keeps("above the upper bound [J]", full.high - tank.most, 0);
  breaks("it was filled [J]", full.high, 3.8);
  keeps("rise of H + E in a step [J]", full.rise, 1e-11);
  // Without a tank the same law makes energy from nothing.
  phs::Network n("pumped");
  n.add("arm", arm).control("pump", "arm.joint_0.torque", pump);
  auto bare = arm->state(Vec{0.3, -0.2}, Vec{1, -0.5});
  breaks("without a tank: rise of H in a step [J]", run(*n.build(), bare, 2).rise, 1e-4);
  EXPECT_NE(refusal([&] {
              (void)with_tank(arm, "joint_0.torque", pump, {.level = 5});
            }).find("least <= level <= most"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::energy_shaping::energy_casimir_test
