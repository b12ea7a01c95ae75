// Elastic joints: regulators against reference runs, and the balance of H_d.
#include "energy_shaping/elastic/elastic.h"

#include "phs/system/check.h"
#include "tests/energy_shaping/loops.h"

namespace porthos::energy_shaping::elastic_test {
namespace {

using test::agrees, test::breaks, test::keeps, test::refusal, test::run_loop, test::Vec;

struct Link {  // one link, hanging at q = 0
  static constexpr int n = 1, m = 1;
  double inertia = 1, mgl = 2;
  const char* name = "link";
  std::array<std::pair<const char*, const char*>, 1> coordinates{{{"joint", "rad"}}};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = S(inertia);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-mgl) * phs::cos(q[0]);
  }
};
struct TwoLinks {
  static constexpr int n = 2, m = 2;
  const char* name = "two links";
  std::array<std::pair<const char*, const char*>, 2> coordinates{
      {{"shoulder", "rad"}, {"elbow", "rad"}}};
  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    const S c = S(0.5) * phs::cos(q[1]);
    M[0] = S(2.0) + S(2.0) * c;
    M[1] = M[2] = S(0.5) + c;
    M[3] = S(0.5);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-6.0) * phs::cos(q[0]) - S(2.0) * phs::cos(q[0] + q[1]);
  }
};

const ElasticJoints<Link> joint{.arm = {}, .stiffness = {100}, .motor = {0.1}};

TEST(ReferenceRuns, ElasticStructurePreserving) {
  const ElasticStructurePreserving<Link> esp(joint, {{0.5}, {4}, {60}, {2}});
  const auto target = esp.target();
  EXPECT_TRUE(phs::check(*target, {.tolerance = 1e-10}).holds());
  const auto plant = esp.under_law();
  const auto integrator = integrators::make_integrator("gauss8", *plant, 0.0025);
  const auto H = target->instantiate<double>();
  phs::State s(plant->description(), {0, 0, 0, 0});
  const std::map<double, double> expected{
      {0, 7.5}, {0.5, 0.3756}, {1, 0.03711}, {2, 6.073e-4}, {5, 2.9e-10}};
  // The same run of the target in its own coordinates.
  const auto own = integrators::make_integrator("gauss8", *target, 0.0025);
  phs::State z(target->description(), {0, 0, 0, 0});
  double difference = 0;
  for (const auto& [t, value] : expected) {
    while (double(s.step) * 0.0025 < t - 1e-9) {
      ASSERT_EQ(integrator->step(s), integrators::Outcome::ok);
      ASSERT_EQ(own->step(z), integrators::Outcome::ok);
      Vec mapped(4);
      esp.to_target<double>(s.x, mapped);
      for (size_t i = 0; i < 4; ++i)
        difference = std::max(difference, std::fabs(mapped[i] - z.x[i]));
    }
    Vec mapped(4);
    esp.to_target<double>(s.x, mapped);
    agrees("H_d", H->hamiltonian(mapped), value, t < 4 ? 2e-4 : 2e-2);
    if (t != 1) continue;
    agrees("q(1)", s.x[0], 0.478776, 2e-6);
    agrees("theta(1)", s.x[1], 0.506557, 2e-6);
    const double rates[] = {s.x[2], s.x[3] / 0.1};
    std::printf("  q' = %.6f, theta' = %.6f\n", rates[0], rates[1]);
    agrees("q'(1)", rates[0], -0.233437, 4e-6);
    agrees("theta'(1)", rates[1], -0.238853, 4e-6);
  }
  keeps("the plant under the law against the target's own run", difference, 1e-9);
  agrees("theta at rest", s.x[1], 0.509589, 1e-5);
}

TEST(ReferenceRuns, TomeiOnTheSameJoint) {
  const auto loop = motor_side<Link>(joint, {{0.5}, {60}, {2}});
  const auto system = loop->instantiate<double>();
  const double rest = system->hamiltonian(loop->rest());
  const auto run = run_loop(*loop, {0, 0, 0, 0}, {0, 0.5, 1, 2, 5}, 0.0025);
  const std::map<double, double> expected{
      {0, 8.029601}, {0.5, 3.438}, {1, 2.297}, {2, 1.029}, {5, 0.09451}};
  for (const auto& [t, value] : expected)
    agrees("H_d", run.at(t).H - rest, value, t == 0 ? 1e-7 : 5e-4);  // printed to 4 digits
  EXPECT_TRUE(loop->certificate().holds()) << loop->certificate().text();
}

TEST(Elastic, TorqueFeedbackMakesTheMotorLight) {
  // Ott's law, u = (B/B_d) u' + (1 - B/B_d) τ, with u' = -kp (θ - θ_d) - kd θ' + g(q_d).
  const double B = 0.1, Bd = 0.02, K = 100, kp = 60, kd = 2, rest = 0.5, g = 2 * std::sin(rest);
  const auto loop = motor_side<Link>(joint, {{rest}, {kp}, {kd}, {Bd}});
  for (const Vec& x : {Vec{0.1, 0.3, 0.4, -0.05}, Vec{-1, 0.2, 2, 0.1}}) {
    const double inner = -kp * (x[1] - rest - g / K) - kd * x[3] / B + g;
    agrees("law", test::law_at(*loop, x)[0], B / Bd * inner + (1 - B / Bd) * K * (x[1] - x[0]),
           1e-12);
  }
  const auto why = refusal([&] {
    (void)motor_side<Link>({{1, 200}, {100}, {0.1}}, {{3.1}, {10}, {2}});
  });
  EXPECT_NE(why.find("Hessian of V_d > 0 fails"), std::string::npos) << why;
}

TEST(Elastic, TwoLinksKeepTheBalance) {
  const ElasticStructurePreserving<TwoLinks> esp({{}, {200, 150}, {0.2, 0.1}},
                                                 {{0.6, -0.8}, {6, 3}, {50, 30}, {4, 2}});
  const auto target = esp.target();
  const auto H = target->instantiate<double>();
  const auto model = esp.under_law();
  const auto plant = model->instantiate<double>();
  // d/dt of z along the plant's motion against the target's field.
  double worst = 0;
  const Vec x{0.3, -0.2, 0.35, -0.25, 1.0, 0.5, 0.1, -0.2};
  Vec dx(8), z0(8), z1(8), dz(8), z(8);
  plant->field(0.0, x, {}, dx);
  const double h = 1e-6;
  for (int side = 0; side < 2; ++side) {
    Vec y = x;
    for (size_t i = 0; i < 8; ++i) y[i] += (side ? h : -h) * dx[i];
    esp.to_target<double>(y, side ? z1 : z0);
  }
  esp.to_target<double>(x, z);
  H->field(0.0, z, {}, dz);
  for (size_t i = 0; i < 8; ++i)
    worst = std::max(worst, std::fabs((z1[i] - z0[i]) / (2 * h) - dz[i]));
  keeps("z' along the plant against the target, difference quotient", worst, 1e-7);
  const auto integrator = integrators::make_integrator("gauss8", *model, 0.002);
  phs::State s(model->description(), x);
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(integrator->step(s), integrators::Outcome::ok);
  keeps("q1 off after 10 s", std::fabs(s.x[0] - 0.6), 1e-5);
  keeps("q2 off after 10 s", std::fabs(s.x[1] + 0.8), 1e-5);
}

}  // namespace
}  // namespace porthos::energy_shaping::elastic_test
