// Locks of joints that a closed coupling moves: what is left of the coupling, momenta and losses,
// and the way back.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/core/integrator.h"
#include "mechanics/reconfiguration.h"
#include "tests/support/linkages.h"

namespace porthos::test::locked_couplings_test {
namespace {

using namespace mechanics;

/// A free craft that turns, with three arms in one plane, which move.
MovingMechanism three_arms() {
  MechanismBuilder parts("three_arms");
  BodySpec bus;
  bus.name = "bus";
  bus.parent = "world";
  bus.joint.name = "bus";
  bus.joint.type = "free";
  bus.mass = {4, {0, 0.125, 0}, {0.5, 0, 0, 0.75, 0, 1}, Mat3<double>::identity()};
  parts.add(bus);
  parts.add(rod("a", "bus", 0.5, 0, 1, 1));
  parts.add(rod("b", "bus", -0.5, 0, 1.25, 0.5));
  parts.add(rod("c", "bus", 0, 0.5, 0.75, 2));
  MovingMechanism m(std::move(parts));
  auto q = m.model->mechanism().neutral();
  q[7] = 0.25;
  q[8] = -1;
  q[9] = 0.625;
  m.set(q, Vec{0.25, -0.125, 0.5, 0.1, 0, -0.2, 1.5, -2, 1});
  return m;
}
ConstraintSpec gear(const std::vector<std::pair<const char*, double>>& factors) {
  ConstraintSpec s;
  s.couplings.push_back({"gear", {}, 0});
  for (const auto& [joint, factor] : factors) s.couplings[0].terms.push_back({joint, factor});
  return s;
}
double rate(const MovingMechanism& m, const std::string& joint) {
  return m.model->rates(m.state.x)[size_t(m.model->mechanism().coordinate(joint).v)];
}
double angle(const MovingMechanism& m, const std::string& joint) {
  return m.state.x[size_t(m.model->mechanism().coordinate(joint).q)];
}
void expect_momenta_kept(const Impact& r) {
  EXPECT_LT(r.linear_jump, 1e-15 * (1 + r.scale.linear));
  EXPECT_LT(r.angular_jump, 1e-15 * (1 + r.scale.angular));
  EXPECT_GT(r.dissipated_J, 1e-3);
}
/// Steps for a while. @return the largest |g|
double run(MovingMechanism& m, int steps) {
  const auto rows = m.model->instantiate<double>()->constraints();
  const auto method = integrators::make_integrator("spark8", *m.model, 1. / 64);
  Vec g(size_t(rows->count()));
  double gap = 0;
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(method->step(m.state), integrators::Outcome::ok) << i;
    rows->place(m.state.x, g);
    for (const double x : g) gap = std::max(gap, std::fabs(x));
  }
  return gap;
}

/// The lock of one joint of a gear stops the other, as locks of both would.
TEST(LockedCouplings, OneJointOfAGearStopsTheOther) {
  MovingMechanism geared = three_arms();
  close_loop(geared, gear({{"a_joint", 2}, {"b_joint", 1}}));
  MovingMechanism alone = geared;
  open_loop(alone, "gear");

  const double offset = geared.constraints.couplings[0].offset;
  const Impact one = lock(geared, "a_joint");
  expect_momenta_kept(one);
  EXPECT_NEAR(rate(geared, "b_joint"), 0, 1e-15);
  const double first = lock(alone, "a_joint").dissipated_J,
               both = first + lock(alone, "b_joint").dissipated_J;
  std::printf("  loss %.15g J, of two locks %.15g J, of one without the gear %.3g J\n",
              one.dissipated_J, both, first);
  EXPECT_NEAR(one.dissipated_J, both, 1e-14);
  EXPECT_GT(both, 1.01 * first);  // else the gear stops nothing
  EXPECT_NEAR(rate(geared, "c_joint"), rate(alone, "c_joint"), 1e-14);

  const double held = angle(geared, "b_joint");
  EXPECT_LT(run(geared, 64), 1e-15);
  EXPECT_NEAR(angle(geared, "b_joint"), held, 1e-15);
  const Impact freed = unlock(geared, "a_joint");  // and the gear holds as before
  EXPECT_NEAR(freed.dissipated_J, 0, 1e-20);
  EXPECT_EQ(geared.constraints.couplings[0].offset, offset);
  EXPECT_LT(run(geared, 64), 4e-15);
  EXPECT_NEAR(2 * rate(geared, "a_joint") + rate(geared, "b_joint"), 0, 1e-14);
  EXPECT_GT(std::fabs(rate(geared, "a_joint")), 1e-3);
}

/// A differential of three: two are left of it, then one, then nothing that moves.
TEST(LockedCouplings, WhatIsLeftOfADifferential) {
  MovingMechanism m = three_arms();
  close_loop(m, gear({{"a_joint", 2}, {"b_joint", 1}, {"c_joint", -1.5}}));
  const double offset = m.constraints.couplings[0].offset;
  expect_momenta_kept(lock(m, "b_joint"));
  ASSERT_EQ(m.model->constraint_set()->count(), 1);
  const auto& left = m.model->constraint_set()->couplings()[0];
  EXPECT_EQ(left.terms.size(), 2u);
  EXPECT_NEAR(left.offset, offset - 1 * -1, 1e-15);  // control: the locked value is in it
  EXPECT_NEAR(2 * rate(m, "a_joint") - 1.5 * rate(m, "c_joint"), 0, 1e-15);
  EXPECT_GT(std::fabs(rate(m, "a_joint")), 0.1);
  EXPECT_LT(run(m, 128), 4e-15);
  expect_momenta_kept(lock(m, "c_joint"));
  EXPECT_NEAR(rate(m, "a_joint"), 0, 1e-15);
  lock(m, "a_joint");  // it stands already
  EXPECT_EQ(m.model->constraint_set(), nullptr);
  EXPECT_EQ(m.constraints.couplings.size(), 1u);  // closed all the same
  unlock(m, "b_joint");
  EXPECT_NEAR(angle(m, "b_joint"), -1, 0);
  ASSERT_EQ(m.model->constraint_set()->count(), 1);
  EXPECT_EQ(m.model->constraint_set()->couplings()[0].terms.size(), 1u);
  unlock(m, "a_joint");
  unlock(m, "c_joint");
  EXPECT_LT(run(m, 128), 4e-15);
  const double sum = 2 * angle(m, "a_joint") + angle(m, "b_joint") - 1.5 * angle(m, "c_joint");
  EXPECT_NEAR(std::remainder(sum - offset, 2 * M_PI), 0, 1e-14);
}

/// A coupling that closes while a joint of it is locked takes the joint's value.
TEST(LockedCouplings, CloseAndOpenWhileLocked) {
  MovingMechanism m = three_arms();
  lock(m, "a_joint");
  close_loop(m, gear({{"a_joint", 2}, {"b_joint", 1}}));
  EXPECT_NEAR(rate(m, "b_joint"), 0, 1e-15);
  EXPECT_NEAR(m.constraints.couplings[0].offset, 2 * 0.25 - 1, 1e-15);
  MovingMechanism other = m;
  unlock(m, "a_joint");
  EXPECT_EQ(m.model->constraint_set()->couplings()[0].terms.size(), 2u);
  EXPECT_LT(run(m, 64), 4e-15);
  open_loop(other, "gear");
  EXPECT_EQ(other.model->constraint_set(), nullptr);
  unlock(other, "a_joint");
  EXPECT_EQ(other.model->constraint_set(), nullptr);
}

TEST(LockedCouplings, DrivenJointsAreRefused) {
  MovingMechanism m = three_arms();
  ConstraintSpec spec;
  spec.driven.push_back({"turn", "a_joint", phs::steady_motion(0.25, 1.5)});
  m.constraints = spec;
  try {
    lock(m, "a_joint");
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(),
                 "lock: the motion 'turn' drives joint 'a_joint', expected a joint without one");
  }
}

}  // namespace
}  // namespace porthos::test::locked_couplings_test
