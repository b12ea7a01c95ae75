// A spacecraft is its internal model and an orbit: it has the members of the internal model.
#include <gtest/gtest.h>

#include "space/parts.h"
#include "space/spacecraft.h"
#include "tests/space/support.h"

namespace porthos::space::wrappers_test {
namespace {

TEST(Wrappers, ASpacecraftHasEffortsSolverAndTurnsOfItsMechanism) {
  const auto arm = test::small_arm();
  const Spacecraft craft(arm, arm, Environment{});
  const auto system = craft.instantiate<double>();
  auto x = craft.state(arm->state(arm->mechanism().neutral(), std::vector<double>(9, 0.1)),
                       {{7e6, 1e5, 0}, {0, 7.5e3, 0}});
  const size_t n = craft.internal_size();
  std::vector<double> dx(x.size()), e(x.size(), NAN), gradient(x.size());
  system->field(0, x, {}, dx);
  system->efforts(0, x, dx, e);
  system->gradient(x, gradient);
  double worst = 0;
  for (size_t i = 0; i < x.size(); ++i) worst = std::max(worst, std::fabs(e[i] - gradient[i]));
  std::printf("  efforts against the gradient %.1e   bound 1e-14\n", worst);
  EXPECT_LE(worst, 1e-14);
  EXPECT_EQ(e[n], 0);

  const auto resolvent = system->resolvent();
  ASSERT_NE(resolvent, nullptr);
  EXPECT_FALSE(resolvent->exact());
  std::vector<phs::Complex4> r(x.size(), phs::Complex4(1.0));
  resolvent->factor(0, x, phs::Complex4(0.1));
  resolvent->solve(r);
  EXPECT_EQ(r[n].re[0], 1) << "the orbit is slow";
  EXPECT_NE(r[0].re[0], 1);

  system->set_turn_angles(std::vector<double>(2, phs::two_pi_hi));
  std::vector<double> of_clone(x.size());
  system->field(0, x, {}, dx);
  system->clone()->field(0, x, {}, of_clone);
  EXPECT_EQ(dx, of_clone);
}

TEST(Wrappers, ThrustersLeaveTheSolverAndMakeItInexact) {
  const auto arm = test::small_arm();
  Parts parts;
  EXPECT_TRUE(PartsModel(arm, parts).instantiate<double>()->resolvent()->exact());
  Thruster t;
  t.name = "jet";
  t.link = "base";
  t.direction = {1, 0, 0};
  t.thrust = 1;
  parts.thrusters.push_back(t);
  EXPECT_FALSE(PartsModel(arm, parts).instantiate<double>()->resolvent()->exact());
}

}  // namespace
}  // namespace porthos::space::wrappers_test
