// A model whose inputs are held is the plant in all but its inputs.
#include "ensemble/held_inputs.h"

#include <gtest/gtest.h>

#include "integrators/core/integrator.h"
#include "phs/system/check.h"
#include "phs/system/tunable.h"
#include "tests/support/stiff.h"

namespace porthos::test::held_inputs_test {
namespace {

TEST(HeldInputs, EffortsAreReadOffTheFieldAndClonesKnowTurnsAndInputs) {
  const auto robot = stiff_chain(5, 100, 0.1);
  const ensemble::HeldInputs model(robot.model);
  const auto r = phs::check(model);
  EXPECT_TRUE(r.holds()) << r.text();
  const auto system = model.instantiate<double>();
  for (auto& u : phs::parameters_of(*system)) u = 3;
  system->set_turn_angles(std::vector<double>(5, phs::two_pi_hi));
  const auto copy = system->clone();
  std::vector<double> x(robot.start.x.begin(), robot.start.x.end()), dx(x.size()), e(x.size()),
      gradient(x.size()), of_clone(x.size());
  system->field(0, x, {}, dx);
  system->efforts(0, x, dx, e);
  system->gradient(x, gradient);
  copy->field(0, x, {}, of_clone);
  EXPECT_EQ(of_clone, dx);
  double worst = 0, size = 0;
  for (size_t i = 0; i < e.size(); ++i) {
    worst = std::max(worst, std::fabs(e[i] - gradient[i]));
    size = std::max(size, std::fabs(gradient[i]));
  }
  std::printf("  efforts against the gradient %.1e   bound 1e-14\n", worst / size);
  EXPECT_LE(worst / size, 1e-14);
}

TEST(HeldInputs, KeepTheSolverOfThePlant) {
  const auto robot = stiff_chain(8, 1e4, 0);
  const ensemble::HeldInputs held(robot.model);
  const phs::TunedModel model(held, std::vector<double>(8, 2.0));
  phs::State s(model.description(), {robot.start.x.begin(), robot.start.x.end()});
  const auto method = integrators::make_integrator("gauss8", model, 0.02);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(method->step(s), integrators::Outcome::ok);
  EXPECT_NE(method->remark().find("Newton, articulated"), std::string::npos) << method->remark();
}

}  // namespace
}  // namespace porthos::test::held_inputs_test
