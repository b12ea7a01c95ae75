// The laws of the room as controllers of a network, continuous and sampled: against the room's own
// loops, and what the hold injects in the ledger.
#include <functional>
#include <random>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/elastic/elastic.h"
#include "energy_shaping/laws/tracking.h"
#include "phs/system/random_state.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::sampled_use_test {
namespace {

using test::breaks, test::keeps, test::refusal, test::Vec;
using NetworkPtr = std::shared_ptr<const phs::NetworkModel>;

NetworkPtr controlled(std::shared_ptr<const phs::Model> plant, const std::vector<PortLaw>& laws,
                      double period = 0) {
  phs::Network n("controlled");
  n.add("plant", std::move(plant));
  control(n, "law", "plant", laws, {.period = period});
  return n.build();
}

/// A run of a network with its ledger.
struct Booked {
  Vec x;
  std::map<std::string, double> work;
  double defect = 0, turnover = 0;  ///< greatest |H - H(0) - Σ works|, Σ |works| [J]
};
Booked run_booked(const phs::Model& model, const Vec& x0, double h, double duration) {
  const auto method = integrators::make_integrator("gauss8", model, h);
  const auto system = model.instantiate<double>();
  phs::State s(model.description(), x0);
  const auto& powers = model.description().powers;
  const double H0 = system->hamiltonian(s.x);
  Vec sums(powers.size(), 0.0);
  Booked run;
  for (int i = 0; i < std::lround(duration / h); ++i) {
    if (method->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
    double change = system->hamiltonian(s.x) - H0;
    for (size_t a = 0; a < powers.size(); ++a) {
      sums[a] += method->port_work()[a];
      run.turnover += std::fabs(method->port_work()[a]);
      change -= powers[a].kind == phs::PowerKind::supplied ? sums[a] : -sums[a];
    }
    run.defect = std::max(run.defect, std::fabs(change));
  }
  for (size_t a = 0; a < powers.size(); ++a) run.work[powers[a].name] = sums[a];
  run.x = s.x;
  return run;
}

const Vec start{0.1, -0.1, 0.2, -0.3};

TEST(SampledUse, PeriodsWithoutStartsAreRefused) {
  const auto loop = acrobot({});
  CertifyOptions o{.region = {{-0.5, -0.5}, {0.5, 0.5}, 1, 10}, .periods = {0, 0.01}};
  EXPECT_EQ(refusal([&] { (void)certify(*loop, o); }),
            "periods act in runs, and no starts are given, expected some");
  o.starts = {start};  // control
  o.run.duration = 0.1;
  const Certificate held = certify(*loop, o);
  EXPECT_EQ(held.item("sampled").finding, Finding::holds);
  // A period that the linear loop does not stand is told with a rate that does.
  o.periods = {0.5};
  const Certificate slow = certify(*loop, o);
  EXPECT_EQ(slow.item("sampled").finding, Finding::fails);
  EXPECT_NE(slow.item("sampled").text.find("would do"), std::string::npos);
}

TEST(SampledUse, AcrobotAtARate) {
  const auto loop = acrobot({});
  const auto laws = port_laws(loop);
  ASSERT_EQ(laws.size(), 1u);
  EXPECT_EQ(laws[0].port, "elbow.force");
  double injected[4], defect = 0;
  int i = 0;
  for (const double period : {0.01, 0.005, 0.0025, 0.00125}) {
    const auto model = controlled(loop->shared_plant(), laws, period);
    const auto run = run_booked(*model, start, 0.00125, 4);
    const auto own =
        simulate(*loop, start, {.duration = 4, .step = 0.00125, .period = period, .record = 4});
    double difference = 0, size = 0;
    for (size_t k = 0; k < 4; ++k) {
      difference = std::max(difference, std::fabs(run.x[k] - own.x.back()[k]));
      size = std::max(size, std::fabs(run.x[k]));
    }
    keeps("state after 4 s against the room's own hold, relative", difference / size, 1e-10);
    ASSERT_TRUE(run.work.contains("law.hold"));
    std::printf("  period %.1f ms: law %.4f J, hold %.4f J\n", 1e3 * period, run.work.at("law"),
                run.work.at("law.hold"));
    defect = std::max(defect, run.defect / run.turnover);
    injected[i++] = run.work.at("law.hold");
  }
  keeps("ledger against H, relative to what went through", defect, 1e-12);
  // injected = a T + b T² + ...: its ratio from period to half the period tends to 2, the
  // difference halves.
  double off[3];
  for (int k = 0; k < 3; ++k) off[k] = injected[k] / injected[k + 1] - 2;
  std::printf("  injected in proportion to the period: ratios off from 2 by %.3f, %.3f, %.3f\n",
              off[0], off[1], off[2]);
  keeps("the last of them", std::fabs(off[2]), 0.15);
  keeps("the last over the one before: off from 1/2", std::fabs(off[2] / off[1] - 0.5), 0.1);
  breaks("what the hold injects at 100 Hz [J]", std::fabs(injected[0]), 1e-2);
  const auto continuous = run_booked(*controlled(loop->shared_plant(), laws), start, 0.0025, 4);
  EXPECT_FALSE(continuous.work.contains("law.hold"));
}

/// Greatest relative difference of the network's field from the plant's under `u`.
double off_field(const phs::Model& network, const phs::Model& plant,
                 const std::function<void(const Vec&, Vec&)>& u) {
  const auto a = network.instantiate<double>(), b = plant.instantiate<double>();
  std::mt19937_64 generator(3);
  Vec inputs(size_t(plant.description().nu)), f(size_t(plant.description().nx)), g(f);
  double worst = 0;
  for (int i = 0; i < 50; ++i) {
    const auto x = phs::random_state(plant.description(), 0.5, generator);
    u(x, inputs);
    a->field(0.3, x, {}, f);
    b->field(0.3, x, inputs, g);
    double size = 0, off = 0;
    for (size_t k = 0; k < f.size(); ++k) {
      size = std::max(size, std::fabs(g[k]));
      off = std::max(off, std::fabs(f[k] - g[k]));
    }
    worst = std::max(worst, off / size);
  }
  return worst;
}

PotentialShaping springs(int n) {
  PotentialShaping s;
  for (int i = 0; i < n; ++i) {
    const std::string port = "joint_" + std::to_string(i) + ".torque";
    s.joints.push_back({port, 60, 0.2});
    s.damping.push_back({port, {15}});
  }
  s.rest.assign(size_t(n), 0.2);
  return s;
}

TEST(SampledUse, EveryLawOnItsPorts) {
  const auto arm = test::arm(4, 0.1);
  const auto shaped = std::make_shared<const PotentialLoop>(arm, springs(4));
  const auto on_ports = [](const ClosedLoop& loop) {
    return [law = std::shared_ptr<LoopSystem<double>>(loop.loop<double>())](const Vec& x, Vec& u) {
      law->law(0.3, x, u);
    };
  };
  keeps("potential shaping over 4 ports: field",
        off_field(*controlled(arm, port_laws(shaped)), *arm, on_ports(*shaped)), 1e-13);
  PdPlus tracking(arm, sines({0.2, -0.3, 0.5, 0}, {0.8, 0.5, 0.6, 1}, {0.3, 0.5, 0.4, 0.7}),
                  {150, 150, 60, 30}, {60, 60, 20, 10});
  keeps("tracking over 4 ports: field",
        off_field(*controlled(arm, tracking.port_laws()), *arm,
                  [&](const Vec& x, Vec& u) { tracking.law(0.3, x, u); }),
        1e-13);
  const auto body = test::free_body();  // one port of six numbers
  PotentialShaping pose;
  pose.poses = {PoseSpring{"base", {0, 0, 0}, 4, {0, 0, 0}, {1, 1.5, 2}}};
  pose.damping = {{"base.wrench", {3, 3, 3, 6, 6, 6}}};
  pose.rest = {0, 0, 0, 1, 0, 0, 0};
  const auto thrusters = std::make_shared<const PotentialLoop>(body, pose);
  keeps("pose by a wrench: field",
        off_field(*controlled(body, port_laws(thrusters)), *body, on_ports(*thrusters)), 1e-13);
}

struct Link {  // hangs at q = 0
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

// The energy that was shaped still falls to (nearly) nothing at a rate, for laws over several ports
// and for elastic joints; the injected part of the ledger halves with the period.
TEST(SampledUse, SeveralPortsAndElasticJoints) {
  const auto arm = test::arm(4, 0.1);
  const ElasticJoints<Link> joint{.arm = {}, .stiffness = {100}, .motor = {0.1}};
  const ElasticStructurePreserving<Link> esp(joint, {{0.5}, {4}, {60}, {2}});
  PdPlus tracking(arm, rest_to_rest({0, 0, 0, 0}, {0.8, -0.5, 0.6, 1}, 1.5), {150, 150, 60, 30},
                  {6, 6, 2, 1});
  struct Case {
    const char* name;
    std::shared_ptr<const phs::Model> plant;
    std::vector<PortLaw> laws;
  };
  const Case cases[] = {
      {"potential shaping", arm, port_laws(std::make_shared<const PotentialLoop>(arm, springs(4)))},
      {"tracking", arm, tracking.port_laws()},
      {"motor side", elastic_plant(joint), port_laws(motor_side<Link>(joint, {{0.5}, {60}, {2}}))},
      {"structure preserving", esp.plant_model(), esp.port_laws()}};
  for (const auto& c : cases) {
    double hold[2];
    for (const int i : {0, 1}) {
      const auto model = controlled(c.plant, c.laws, i ? 0.001 : 0.002);
      const auto run = run_booked(*model, Vec(size_t(c.plant->description().nx), 0.0), 0.001, 1);
      hold[i] = 0;
      for (const auto& [name, work] : run.work)
        if (name.ends_with(".hold")) hold[i] += work;
      keeps(std::string(c.name) + ": ledger against H, relative", run.defect / run.turnover, 1e-12);
    }
    std::printf("  %s: the holds give %.5f J at 2 ms, %.5f J at 1 ms\n", c.name, hold[0], hold[1]);
    keeps("ratio, off from 2", std::fabs(hold[0] / hold[1] - 2), 0.15);
  }
}

TEST(SampledUse, LimitsAndRefusals) {
  const auto loop = acrobot({});
  const auto free = test::law_at(*loop, start)[0];
  const auto model = controlled(loop->shared_plant(), port_laws(loop, {0.5 * std::fabs(free)}));
  keeps("limited law: field",
        off_field(*model, loop->plant(),
                  [&](const Vec& x, Vec& u) {
                    const double most = 0.5 * std::fabs(free);
                    u[0] = std::clamp(test::law_at(*loop, x)[0], -most, most);
                  }),
        1e-13);
  EXPECT_NE(refusal([&] { (void)port_laws(loop, {1, 2}); }).find("limits"), std::string::npos);
  EXPECT_NE(refusal([&] { (void)port_laws(loop, {-1}); }).find("limit -1"), std::string::npos);
  const auto arm = test::arm(2);
  const auto shaped = std::make_shared<const PotentialLoop>(arm, springs(2));
  phs::Network n("two ports");
  n.add("arm", arm);
  const auto why = refusal([&] {
    control(n, "law", "arm", port_laws(shaped), {.period = 0.01, .encoder = {"arm.joint_0"}});
  });
  std::printf("  %s\n", why.c_str());
  EXPECT_NE(why.find("belongs to one"), std::string::npos);
}

}  // namespace
}  // namespace porthos::energy_shaping::sampled_use_test
