// Regulators of energy shaping at the drives of actuators: through the ports of a network they see
// the elastic joint, and the loop is the one energy_shaping/elastic/elastic.h has as a whole.
#include "energy_shaping/elastic/elastic.h"
#include "energy_shaping/loop/run.h"
#include "integrators/core/integrator.h"
#include "tests/support/bounds.h"
#include "tests/support/robots.h"
#include "tests/vsa/actuators.h"

namespace porthos::test::regulators_test {
namespace {

struct Link {  // as pendulum(1, 2)
  static constexpr int n = 1, m = 1;
  const char* name = "link";
  std::array<std::pair<const char*, const char*>, 1> coordinates{{{"joint", "rad"}}};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = S(1.0);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-2.0) * phs::cos(q[0]);
  }
};
struct Arm {  // as two_links(): 2 and 1 kg, 0.5 m, centres half way
  static constexpr int n = 2, m = 2;
  const char* name = "two links";
  std::array<std::pair<const char*, const char*>, 2> coordinates{
      {{"shoulder", "rad"}, {"elbow", "rad"}}};
  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    const S c = S(0.125) * phs::cos(q[1]), lower(0.03125 + 0.0625);
    M[0] = S(0.0625 + 0.125 + 0.25) + lower + S(2.0) * c;
    M[1] = M[2] = lower + c;
    M[3] = lower;
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-9.8125) * (phs::cos(q[0]) + S(0.25) * phs::cos(q[0] + q[1]));
  }
};

vsa::Actuator series(double stiffness, double rotor) {
  return {.elastic = vsa::series_elastic({stiffness}),
          .theta = {.kind = vsa::Drive::Kind::torque, .inertia = rotor}};
}

/// What a run of the network says: energy against its ledger, and H_d from step to step.
struct Watched {
  double defect = 0, rise = 0, first = 0, last = 0;
};
template <class Shaped, class Each>
Watched watch(const phs::NetworkModel& model, phs::State& s, double h, int steps,
              const Shaped& shaped, const Each& each) {
  const auto method = integrators::make_integrator("gauss8", model, h);
  Gauge gauge(model);
  const auto start = gauge.energy(s);
  long double in = 0;
  Watched w;
  w.first = w.last = shaped(s.x);
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(method->step(s), integrators::Outcome::ok);
    for (size_t k = 0; k < method->port_work().size(); ++k) {
      const double work = method->port_work()[k];
      in += model.description().powers[k].kind == phs::PowerKind::supplied ? work : -work;
    }
    w.defect = std::max(w.defect, double(std::fabs(gauge.energy(s) - start - in)));
    const double now = shaped(s.x);
    w.rise = std::max(w.rise, now - w.last);
    w.last = now;
    each(s);
  }
  return w;
}

TEST(Regulators, StructurePreservingThroughThePortsOfASeriesElasticJoint) {
  const energy_shaping::ElasticJoints<Link> joint{.arm = {}, .stiffness = {100}, .motor = {0.1}};
  const energy_shaping::ElasticStructurePreserving<Link> esp(joint, {{0.5}, {4}, {60}, {2}});
  const auto build = [&](double sign) {
    phs::Network n("elastic joint");
    n.add("mechanism", pendulum(1, 2)).main("mechanism");
    vsa::attach(n, "vsa", "mechanism.hinge.torque", series(100, 0.1));
    n.control("esp", "vsa.theta", phs::law([esp, sign](auto, auto x, auto y, auto u) {
                using T = std::remove_cvref_t<decltype(u[0])>;
                // The actuator knows (q, θ, B θ'); the link's rate is a sensor at its joint, and M
                // = 1.
                const std::array<T, 4> state{x[0], x[1], T(sign) * y[1], x[2]};
                std::array<T, 1> torque;
                esp.template law<T>(std::span<const T>(state), std::span<T>(torque));
                u[0] = torque[0];
              }),
              {.sensors = {"mechanism.hinge.torque"}});
    return n.build();
  };
  const auto model = build(1);
  const auto at = size_t(model->offset("vsa"));
  const auto target_plant = esp.target();
  const auto target = target_plant->instantiate<double>();
  const auto shaped = [&](const std::vector<double>& x) {
    const std::array<double, 4> state{x[0], x[at + 1], x[1], x[at + 2]};
    std::array<double, 4> z;
    esp.to_target<double>(state, z);
    return target->hamiltonian(z);
  };
  const double h = 0.0025;
  const auto whole = esp.under_law();  // the same loop as one system
  const auto own = integrators::make_integrator("gauss8", *whole, h);
  phs::State z(whole->description(), {0, 0, 0, 0}), s = state_of(*model, {0, 0}, {});
  double apart = 0;
  const auto w = watch(*model, s, h, 1000, shaped, [&](const phs::State& now) {
    ASSERT_EQ(own->step(z), integrators::Outcome::ok);
    const double mine[] = {now.x[0], now.x[at + 1], now.x[1], now.x[at + 2]};
    for (size_t i = 0; i < 4; ++i) apart = std::max(apart, std::fabs(mine[i] - z.x[i]));
  });
  std::printf("  H_d from %.4f to %.2e J\n", w.first, w.last);
  EXPECT_NEAR(w.first, 7.5, 1e-12) << "of the reference run";
  keeps("H_d rises in a step by [J]", w.rise, 1e-13);
  keeps("ledger of the network [J]", w.defect, 1e-12);
  keeps("apart from the loop as one system", apart, 1e-11);
  keeps("off its rest", std::fabs(s.x[0] - 0.5), 2e-3);
  // A rate of the wrong sign from the sensor undamps the link.
  const auto wrong = build(-1);
  phs::State r = state_of(*wrong, {0, 0}, {});
  breaks("H_d with the sensor turned round",
         watch(*wrong, r, h, 400, shaped, [](const phs::State&) {}).rise, 1e-3);
}

TEST(Regulators, MotorPdOfTwoElasticJoints) {
  using Design = energy_shaping::MotorSide<Arm>;
  const energy_shaping::ElasticJoints<Arm> joints{
      .arm = {}, .stiffness = {200, 150}, .motor = {0.2, 0.1}};
  const energy_shaping::ElasticGains<Arm> gain{{0.6, -0.8}, {60, 30}, {4, 2}};
  const auto loop = energy_shaping::motor_side<Arm>(joints, gain);
  EXPECT_TRUE(loop->certificate().holds()) << loop->certificate().text();
  const Design design{.form = {.j = joints}, .gain = gain};
  phs::Network n("elastic arm");
  n.add("mechanism", two_links()).main("mechanism");
  const char* const names[] = {"shoulder", "elbow"};
  for (size_t a = 0; a < 2; ++a) {
    const std::string drive = std::string(names[a]) + "_drive";
    vsa::attach(n, drive, "mechanism." + std::string(names[a]) + ".torque",
                series(joints.stiffness[a], joints.motor[a]));
    n.control(drive + ".pd", drive + ".theta",
              phs::law([rest = design.theta(a), g = design.g[a], kp = gain.kp[a], kd = gain.kd[a]](
                           auto, auto x, auto y, auto u) {
                using T = std::remove_cvref_t<decltype(u[0])>;
                u[0] = T(g) - T(kp) * (x[1] - T(rest)) - T(kd) * y[0];
              }));
  }
  const auto model = n.build();
  const size_t at[] = {size_t(model->offset("shoulder_drive")),
                       size_t(model->offset("elbow_drive"))};
  const auto as_one = [&](const std::vector<double>& x) {  // (q, θ, p, B θ')
    return std::array<double, 8>{x[0], x[1], x[at[0] + 1], x[at[1] + 1],
                                 x[2], x[3], x[at[0] + 2], x[at[1] + 2]};
  };
  const auto closed = loop->instantiate<double>();
  const auto shaped = [&](const std::vector<double>& x) { return closed->hamiltonian(as_one(x)); };
  const double h = 0.0025;
  const auto own = integrators::make_integrator("gauss8", *loop, h);
  phs::State z(loop->description(), std::vector<double>(8, 0.0)),
      s = state_of(*model, {0, 0, 0, 0}, {});
  double apart = 0;
  const auto w = watch(*model, s, h, 4000, shaped, [&](const phs::State& now) {
    ASSERT_EQ(own->step(z), integrators::Outcome::ok);
    const auto mine = as_one(now.x);
    for (size_t i = 0; i < 8; ++i) apart = std::max(apart, std::fabs(mine[i] - z.x[i]));
  });
  const double rest = closed->hamiltonian(loop->rest());
  std::printf("  H_d from %.4f to %.2e J above its rest\n", w.first - rest, w.last - rest);
  keeps("H_d rises in a step by [J]", w.rise, 1e-12);
  keeps("ledger of the network [J]", w.defect, 1e-11);
  keeps("apart from the matched loop", apart, 1e-9);
  EXPECT_LT(w.last - rest, 0.05 * (w.first - rest));
}

}  // namespace
}  // namespace porthos::test::regulators_test
