// Starts that close loops, reactions against closed forms, and errors of input.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/constraints/projection.h"
#include "phs/system/forwarding.h"
#include "phs/system/reactions.h"
#include "tests/support/bounds.h"
#include "tests/support/linkages.h"

namespace porthos::mechanics::closed_loops_test {
namespace {

using Vec = std::vector<double>;

TEST(ClosedLoops, StartsAreMovedOntoTheManifold) {
  for (const char* type : {"revolute", "spherical", "cylindrical"}) {
    auto l = test::four_bar(type);
    const ConstraintSet set(*l.mechanism, l.spec);
    const auto found = close_loops(*l.mechanism, set, l.q, l.v);
    EXPECT_GT(found.gap, 0.01);
    EXPECT_EQ(found.largest, "pin");
    EXPECT_EQ(found.rank, 2) << type;
    const auto again = close_loops(*l.mechanism, set, l.q, l.v);
    std::printf("  %-11s gap %.1e after %.2f, slip %.1e after %.2f\n", type, again.gap, found.gap,
                again.slip, found.slip);
    EXPECT_LT(again.gap, 1e-15);
    EXPECT_LT(again.slip, 1e-14);
    EXPECT_LT(again.moved, 1e-15);
  }
}

/// Half a turn apart no row of a weld says which way to turn; a frame that is no rotation says
/// nothing at all.
TEST(ClosedLoops, RefuseFramesHalfATurnApartAndFramesThatAreNone) {
  MechanismBuilder b;
  BodySpec box;
  box.name = "box";
  box.parent = "world";
  box.joint.type = "free";
  box.mass = {1, {0, 0, 0}, {1, 0, 0, 1, 0, 1}};
  const Mechanism m = b.add(box).build();
  const auto why = [&](const Mat3<double>& R) {
    return test::refusal([&] {
      LoopJoint weld;
      weld.name = "weld";
      weld.type = "fixed";
      weld.a.pose.R = R;
      weld.b.link = "box";
      ConstraintSpec spec;
      spec.loops.push_back(weld);
      const ConstraintSet set(m, spec);
      Vec q = m.neutral(), v(6, 0.0);
      close_loops(m, set, q, v);
    });
  };
  EXPECT_EQ(why(rotation_from_rpy(0, 0, 3.1)), "");  // the control: a little less
  EXPECT_EQ(why({{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}),
            "constraint 'weld' (fixed) between 'the world' and 'box' has frames that are half a "
            "turn apart, expected a start nearer to the closed loop");
  EXPECT_EQ(why({{1, 0, 0}, {0, 1, 0}, {0, 1, 1}}),
            "constraint 'weld': the axes of a frame are not a rotation");
}

/// The crank alone is stated: coupler and rocker follow. Held by too many, the loop moves them all.
TEST(ClosedLoops, StatedJointsStayIfTheOthersCanFollow) {
  auto l = test::four_bar();
  const ConstraintSet set(*l.mechanism, l.spec);
  const Vec q0 = l.q, v0 = l.v;
  const auto found = close_loops(*l.mechanism, set, l.q, l.v, std::vector<int>{0});
  EXPECT_NEAR(l.q[0], q0[0], 1e-15);  // the last digits of a gap are shared out
  EXPECT_NEAR(l.v[0], v0[0], 1e-14);
  EXPECT_GT(found.moved, 0.1);
  EXPECT_LT(close_loops(*l.mechanism, set, l.q, l.v).gap, 1e-15);
  Vec q = q0, v = v0;
  close_loops(*l.mechanism, set, q, v, std::vector<int>{0, 2});
  EXPECT_GT(std::fabs(q[0] - q0[0]), 0.1);
  EXPECT_LT(close_loops(*l.mechanism, set, q, v).gap, 1e-15);
}

/// The move is the shortest one in the metric of the kinetic energy: a plastic impulse. So it takes
/// the energy ½ r D⁻¹ r, never adds any, and leaves a motion along the loop alone.
TEST(ClosedLoops, VelocitiesChangeByThePlasticImpulse) {
  auto l = test::four_bar();
  const auto x = l.start();
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  const double before = system->hamiltonian(x);
  Vec v = l.v;
  v[1] += 0.5;
  const double kicked = system->hamiltonian(model.state(l.q, v));
  close_loops(*l.mechanism, ConstraintSet(*l.mechanism, l.spec), l.q, v);
  const double after = system->hamiltonian(model.state(l.q, v));
  EXPECT_LT(after, kicked);
  EXPECT_NE(after, before);
  Vec same = l.v;
  close_loops(*l.mechanism, ConstraintSet(*l.mechanism, l.spec), l.q, same);
  for (size_t i = 0; i < v.size(); ++i) EXPECT_NEAR(same[i], l.v[i], 1e-14);
}

std::string refusal(const test::Linkage& l) {
  try {
    const ConstraintSet set(*l.mechanism, l.spec);
    Vec q = l.q, v = l.v;
    close_loops(*l.mechanism, set, q, v);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

TEST(ClosedLoops, WrongInputIsToldInOneSentence) {
  const auto with = [](auto change) {
    auto l = test::four_bar();
    change(l);
    return refusal(l);
  };
  const auto expect = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(with([](auto& l) { l.spec.loops[0].b = test::at("", 9, 0); }),
         "constraint 'pin' (revolute) between 'coupler' and 'the world' cannot be closed from the "
         "given start: a gap of ");
  expect(with([](auto& l) { l.spec.loops[0].a.link = "couple"; }),
         "constraint 'pin': there is no link 'couple', expected one of crank, coupler, rocker");
  expect(with([](auto& l) { l.spec.loops[0].type = "hinge"; }),
         "no loop joint has the type 'hinge', expected one of revolute, continuous, prismatic");
  expect(with([](auto& l) { l.spec.loops[0].b = test::at("coupler", 0, 0); }),
         "no joint moves 'coupler' and 'coupler' against each other");
  expect(with([](auto& l) { l.spec.loops.push_back(l.spec.loops[0]); }),
         "constraint 'pin': there are two of that name");
  expect(with([](auto& l) { l.spec.loops[0].name = ""; }), "a constraint (revolute) has no name");
  expect(with([](auto& l) { l.spec.loops[0].type = "helical"; }), "pitch is 0 m/rad");
  expect(with([](auto& l) {
           l.spec.rods.push_back({"bar", {"crank"}, {""}, -1});
         }),
         "constraint 'bar': length is -1 m, expected a number > 0");
  expect(with([](auto& l) { l.spec.couplings.push_back({"gear", {{"elbow", 1}}, 0}); }), "'elbow'");
  expect(with([](auto& l) {
           l.spec.couplings.push_back({"gear", {}, 0});
         }),
         "it couples no coordinate");
  expect(with([](auto& l) {
           l.spec.couplings.push_back({"gear", {{"crank_joint", 0}}, 0});
         }),
         "the factor of 'crank_joint' is 0");
  EXPECT_EQ(with([](auto&) {}), "");
}

/// A point mass on a rod: λ = m (v²/l - g cos θ) along it, θ from the lowest point.
TEST(ClosedLoops, ReactionsAreTheTensionOfAPendulum) {
  MechanismBuilder b("pendulum");
  BodySpec body;
  body.name = "mass";
  body.parent = "world";
  body.joint.name = "joint";
  body.joint.type = "planar";
  body.joint.second_axis = Vec3d{1, 0, 0};
  body.mass = {2, {0, 0, 0}, {0.1, 0, 0, 0.1, 0, 0.1}, Mat3<double>::identity()};
  b.add(body).gravity({0, -9.8125, 0});
  const auto m = std::make_shared<Mechanism>(b.build());
  const double l = 1.25;
  const MechanicalModel model(m, {}, {{}, {{"rod", {"mass"}, {""}, l}}, {}});
  phs::Reactions reactions(model);
  for (const double theta : {0.0, 0.5, 2.0, -3.0}) {
    const double rate = 1.5;
    const Vec q{l * std::sin(theta), -l * std::cos(theta), 0.7},
        v{l * std::cos(theta) * rate, l * std::sin(theta) * rate, 0.3};
    const auto lambda = reactions.at(0, model.state(q, v));
    EXPECT_NEAR(lambda[0], 2 * (l * rate * rate + 9.8125 * std::cos(theta)), 1e-12) << theta;
    EXPECT_TRUE(reactions.unique(0));
    EXPECT_EQ(reactions.exerted()[0], lambda[0]);  // the tension of a rod
  }
}

/// A weld holds a body against gravity: its wrench on the body is that of a clamp. The control
/// leans: the wrench is given in the axes of the clamp.
TEST(ClosedLoops, AWeldExertsTheWrenchOfAClamp) {
  for (const double lean : {0.0, 0.5}) {
    MechanismBuilder b("beam");
    BodySpec beam;
    beam.name = "beam";
    beam.parent = "world";
    beam.joint.type = "free";
    beam.mass = {2, {0.5, 0, 0}, {0.1, 0, 0, 0.2, 0, 0.2}, Mat3<double>::identity()};
    b.add(beam).gravity({0, -10, 0});
    const auto m = std::make_shared<Mechanism>(b.build());
    const Mat3<double> R = rotation_from_rpy(lean, 0, 0);
    LoopJoint weld{"weld", "fixed", {"", {R, {0, 0, 0}}}, {"beam", {R, {0, 0, 0}}}};
    const MechanicalModel model(m, {}, {{weld}, {}, {}});
    ASSERT_EQ(model.description().reaction_count(), 6);
    phs::Reactions reactions(model);
    reactions.at(0, model.state(m->neutral(), Vec(6, 0.0)));
    const auto w = reactions.exerted();
    const Vec3d moment = R.tmul(Vec3d{0, 0, 10}), force = R.tmul(Vec3d{0, 20, 0});
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(w[size_t(k)], moment[k], 1e-13) << k;
      EXPECT_NEAR(w[size_t(3 + k)], force[k], 1e-13) << k;
    }
  }
}

/// A falling pendulum drives a disc through a gear: 3 a + b = 0. With J' = J + 9 I the torques are
/// those of two inertias on one shaft.
TEST(ClosedLoops, AGearExertsATorqueOnEachOfItsJoints) {
  MechanismBuilder b("train");
  b.add(test::rod("a", "world", 0, 0, 1, 3)).add(test::rod("b", "world", 2, 0, 0.5, 2));
  b.gravity({0, -10, 0});
  const auto m = std::make_shared<Mechanism>(b.build());
  const double J = 1, I = 2 * 0.25 / 3;  // about the pivots
  const MechanicalModel model(m, {}, {{}, {}, {{"gear", {{"a_joint", 3}, {"b_joint", 1}}, 0}}});
  phs::Reactions reactions(model);
  const double a = 0.4, torque_a = -3 * 10 * 0.5 * std::cos(a),
               torque_b = -2 * 10 * 0.25 * std::cos(-3 * a);
  reactions.at(0, model.state(Vec{a, -3 * a}, Vec{0.2, -0.6}));
  const double lambda = (3 * torque_a / J + torque_b / I) / (9 / J + 1 / I);
  const auto r = reactions.exerted();
  ASSERT_EQ(r.size(), 2u);
  EXPECT_NEAR(r[0], -3 * lambda, 1e-13);
  EXPECT_NEAR(r[1], -lambda, 1e-13);
  const auto& named = model.description().constraints[0].reactions;
  EXPECT_EQ(named[1].name, "gear.b_joint");
  EXPECT_EQ(named[1].unit, "N m");
}

/// The constraints of a system whose state lies behind two numbers of another one, before one more.
TEST(ClosedLoops, ConstraintsOfAnInnerSystem) {
  auto l = test::four_bar();
  const Vec x = l.start();
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  phs::InnerConstraints<double> inside(system->constraints(), 2, x.size());
  Vec wide{7, 8};
  wide.insert(wide.end(), x.begin(), x.end());
  wide.push_back(9);
  const size_t m = size_t(inside.count());
  Vec g(m), g1(m), force(x.size()), force1(wide.size()), lambda{1, -2, 3, 0.5, 0.25};
  rows->place(x, g);
  inside.place(wide, g1);
  EXPECT_EQ(g, g1);
  rows->forces(lambda, force);
  inside.forces(lambda, force1);
  EXPECT_EQ(Vec(force1.begin() + 2, force1.end() - 1), force);
  EXPECT_EQ(force1[0] + force1[1] + force1.back(), 0);
  rows->rates(x, g);
  inside.rates(wide, g1);
  EXPECT_EQ(g, g1);
  EXPECT_EQ(inside.factor(wide), rows->factor(x));
  rows->solve(g);
  inside.solve(g1);
  EXPECT_EQ(g, g1);
}

TEST(ClosedLoops, ReactionsNeedConstraints) {
  auto l = test::four_bar();
  l.spec = {};
  const auto model = l.model();
  EXPECT_EQ(model.instantiate<double>()->constraints(), nullptr);
  EXPECT_THROW(phs::Reactions{model}, InvalidArgument);
}

}  // namespace
}  // namespace porthos::mechanics::closed_loops_test
