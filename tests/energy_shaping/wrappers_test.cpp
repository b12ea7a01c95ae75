// What is put around a plant drops nothing of it: its solver, its sampled controllers, its ledger.
#include "energy_shaping/loop/interconnection.h"
#include "phs/network/network.h"
#include "phs/system/tunable.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::wrappers_test {
namespace {

using test::Vec;

PotentialShaping joint_springs(int n) {
  PotentialShaping s;
  for (int i = 0; i < n; ++i) {
    const std::string port = "joint_" + std::to_string(i) + ".torque";
    s.joints.push_back({port, 60, 0.2});
    s.damping.push_back({port, {15}});
  }
  s.rest.assign(size_t(n), 0.2);
  return s;
}

/// One link that a sampled controller turns, u = 1 from the first instant on.
std::shared_ptr<const phs::NetworkModel> sampled_arm(const test::ModelPtr& arm) {
  phs::Network n("sampled arm");
  n.add("arm", arm);
  n.control("push", "arm.joint_0.torque", phs::law([](auto, auto, auto, auto u) { u[0] = 1.0; }),
            {.period = 0.1});
  return n.build();
}
/// Rate of the first joint after a second.
double rate_after(const phs::Model& model) {
  const auto method = integrators::make_integrator("gauss4", model, 0.05);
  phs::State s(model.description(), Vec(size_t(model.description().nx), 0.0));
  if (model.description().nx == 3) s.x[2] = 1;  // the tank
  for (int i = 0; i < 20; ++i)
    if (method->step(s) != integrators::Outcome::ok) ADD_FAILURE();
  return s.x[1];
}

TEST(Wrappers, ASampledControllerOfThePlantIsSampled) {
  const auto arm = test::arm(1, 0, 0);
  const auto plant = sampled_arm(arm);
  EXPECT_NEAR(rate_after(*plant), 1, 1e-12);

  const auto nothing = phs::law([](auto, auto, auto, auto u) { u[0] = 0.0; });
  const auto tanked = with_tank(plant, "joint_0.torque", nothing, {});
  EXPECT_NEAR(rate_after(*tanked), 1, 1e-12);

  const PotentialLoop loop(arm, joint_springs(1));
  const auto held = std::make_shared<const std::vector<double>>(1, 0.0);
  EXPECT_NEAR(rate_after(DrivenPlant(loop, *plant, {}, held)), 1, 1e-12);
}

TEST(Wrappers, HeldInputsKeepThePlantsSolver) {
  const auto arm = test::arm(2);
  const PotentialLoop loop(arm, joint_springs(2));
  const auto held = std::make_shared<const std::vector<double>>(2, 0.5);
  const DrivenPlant sampled(loop, *arm, {}, held), continuous(loop, *arm);
  const auto system = sampled.instantiate<double>();
  const auto resolvent = system->resolvent();
  ASSERT_NE(resolvent, nullptr);
  EXPECT_FALSE(resolvent->exact());
  EXPECT_EQ(continuous.instantiate<double>()->resolvent(), nullptr) << "the law may be stiffer";
}

}  // namespace
}  // namespace porthos::energy_shaping::wrappers_test
