// Events that change a mechanism: momenta kept, the plastic loss against its closed form, and what
// is refused.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdio>
#include <random>

#include "integrators/core/integrator.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/reconfiguration.h"
#include "mechanics/rotation.h"
#include "mechanics/urdf.h"
#include "tests/places.h"
#include "tests/support/linkages.h"

namespace porthos::test::reconfiguration_test {
namespace {

using namespace mechanics;

BodySpec free_body(const std::string& name, double mass, const Vec3d& com, double size) {
  BodySpec b;
  b.name = name;
  b.parent = "world";
  b.joint.type = "free";
  const double i = mass * size * size / 6;
  b.mass = {mass, com, {i, 0.05 * i, -0.03 * i, 1.1 * i, 0.02 * i, 0.9 * i}};
  return b;
}

/// The ETS-VII arm on its free base, and a free target.
MechanismBuilder servicer_and_target(double mass = 400) {
  UrdfOptions o;
  o.base = UrdfOptions::Base::free;
  o.accept_unphysical_inertia = true;
  auto parts = read_urdf(PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf", o).parts;
  parts.add(free_body("target", mass, {0.1, -0.2, 0.05}, 1.2));
  return parts;
}
std::string last_link(const MechanismBuilder& parts) {
  return parts.bodies()[parts.bodies().size() - 2].name;
}

struct Random {
  std::mt19937_64 engine;
  explicit Random(std::uint64_t seed) : engine(seed) {}
  double operator()(double bound) { return bound * (2 * double(engine() >> 11) * 0x1p-53 - 1); }
};

/// Any position and motion: rates up to 0.3 rad/s, speeds up to 0.1 m/s.
void throw_about(MovingMechanism& m, Random& random) {
  const auto& mech = m.model->mechanism();
  auto q = mech.neutral();
  std::vector<double> v(size_t(mech.nv()));
  for (const auto& c : mech.coordinates()) {
    double norm = 0;
    for (int k = 0; k < c.nq; ++k) {
      double& x = q[size_t(c.q + k)];
      x = random(c.kind == phs::BlockKind::linear ? 3 : 1.5);
      norm += x * x;
    }
    if (c.kind == phs::BlockKind::rotation)
      for (int k = 0; k < 4; ++k) q[size_t(c.q + k)] /= std::sqrt(norm);
    for (int k = 0; k < c.nv; ++k)
      v[size_t(c.v + k)] = random(c.kind == phs::BlockKind::linear ? 0.1 : 0.3);
  }
  m.set(q, v);
}

double kinetic(const MovingMechanism& m) {
  return m.model->instantiate<double>()->hamiltonian(m.state.x);
}
double size(const Vec3d& a) { return std::hypot(a.x, a.y, a.z); }

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// J M⁻¹ Jᵀ of a body frame in world axes about a point, and its twist there, within the mechanism.
std::pair<Matrix6, Vector6> mobility(const MovingMechanism& m, const std::string& body,
                                     const Vec3d& at) {
  const auto& mech = m.model->mechanism();
  Workspace<double> w(mech);
  const size_t nq = size_t(mech.nq()), nv = size_t(mech.nv());
  std::vector<double> q(m.state.x.begin(), m.state.x.begin() + long(nq)), J(6 * nv);
  std::vector<Transform<double>> nodes(mech.nodes().size());
  forward_kinematics<double>(mech, w, q, nodes);
  jacobian<double>(mech, w, q, mech.body(body), JacobianAxes::world, J);
  Eigen::MatrixXd Jw = Eigen::Map<Eigen::MatrixXd>(J.data(), 6, long(nv));
  const Vec3d r = at - body_pose<double>(mech, mech.body(body), nodes).r;
  for (long k = 0; k < Jw.cols(); ++k) {
    const Vec3d omega{Jw(0, k), Jw(1, k), Jw(2, k)}, add = cross(omega, r);
    for (int i = 0; i < 3; ++i) Jw(3 + i, k) += add[i];
  }
  std::vector<double> M(nv * nv);
  const auto f = m.model->rates(m.state.x);
  crba<double>(mech, w, q, M);
  const Eigen::MatrixXd mass = Eigen::Map<Eigen::MatrixXd>(M.data(), long(nv), long(nv));
  const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXd>(f.data(), long(nv));
  return {Jw * mass.ldlt().solve(Jw.transpose()), Jw * v};
}

// Closed form of a weld: ½ Δᵀ (Y_a + Y_b)⁻¹ Δ, with the mobilities Y = J M⁻¹ Jᵀ of both partners at
// one point and Δ the jump of twists there. It is computed from the two mechanisms before, in
// doubles.
TEST(Reconfiguration, AThousandRandomCaptures) {
  const int cases = 1000;
  Random random(11);
  double worst_momentum = 0, worst_loss = 0, worst_ledger = 0, least = HUGE_VAL;
  MovingMechanism start(servicer_and_target());
  const std::string hand = last_link(start.parts);
  for (int i = 0; i < cases; ++i) {
    MovingMechanism m = start;
    throw_about(m, random);
    const double T = kinetic(m);
    const Vec3d at{0, 0, 0};
    const auto [Ya, Va] = mobility(m, hand, at);
    const auto [Yb, Vb] = mobility(m, "target", at);
    const Vector6 jump = Va - Vb;
    const double closed = 0.5 * jump.dot((Ya + Yb).ldlt().solve(jump));
    const Impact r = capture(m, {.body = "target", .link = hand});
    worst_momentum = std::max({worst_momentum, r.linear_jump / size(r.momentum.linear),
                               r.angular_jump / size(r.momentum.angular)});
    worst_loss = std::max(worst_loss, std::fabs(r.dissipated_J - closed) / T);
    worst_ledger = std::max(worst_ledger, std::fabs(T - kinetic(m) - r.dissipated_J) / T);
    least = std::min(least, r.dissipated_J);
  }
  std::printf(
      "  %d captures: momenta %.1e (1e-15), loss against the closed form %.1e, against the "
      "energies "
      "%.1e of the energy (1e-12)\n",
      cases, worst_momentum, worst_loss, worst_ledger);
  EXPECT_LT(worst_momentum, 1e-15);
  EXPECT_LT(worst_loss, 1e-12);
  EXPECT_LT(worst_ledger, 1e-12);
  EXPECT_GT(least, 0);
}

// Two masses on a line: v = (m1 v1 + m2 v2)/(m1 + m2), loss ½ m1 m2/(m1 + m2) (v1 - v2)².
TEST(Reconfiguration, TwoMassesOnALine) {
  MechanismBuilder parts("two");
  parts.add(free_body("a", 3, {0, 0, 0}, 0.5)).add(free_body("b", 5, {0, 0, 0}, 0.5));
  MovingMechanism m(parts);
  auto q = m.model->mechanism().neutral();
  std::vector<double> v(12, 0.0);
  const auto& mech = m.model->mechanism();
  q[size_t(mech.coordinate("b.position").q)] = 1;
  v[size_t(mech.coordinate("a.position").v)] = 0.5;
  v[size_t(mech.coordinate("b.position").v)] = -0.25;
  m.set(q, v);
  const double T = kinetic(m);
  const Impact r = capture(m, {.body = "b", .link = "a"});
  const auto after = m.model->rates(m.state.x);
  EXPECT_NEAR(r.dissipated_J, 0.5 * 15. / 8 * 0.75 * 0.75, 1e-15);
  EXPECT_NEAR(after[size_t(m.model->mechanism().coordinate("a.position").v)], (1.5 - 1.25) / 8,
              1e-16);
  EXPECT_NEAR(kinetic(m), 0.5 * 0.25 * 0.25 / 8, 1e-16) << "of eight kilograms with 0.25 N s";
  EXPECT_NEAR(T - kinetic(m), r.dissipated_J, 1e-15);
}

TEST(Reconfiguration, ReleaseLockAndUnlock) {
  Random random(5);
  MovingMechanism m(servicer_and_target());
  const std::string hand = last_link(m.parts);
  throw_about(m, random);
  m.state.step = 77;
  const std::string joint = "joint_3";
  const auto value = [&] { return m.state.x[size_t(m.model->mechanism().coordinate(joint).q)]; };
  const double angle = value();
  struct Row {
    const char* what;
    Impact impact;
    double energy_change;
  };
  std::vector<Row> rows;
  const auto note = [&](const char* what, auto event) {
    const double T = kinetic(m);
    const Impact r = event();
    rows.push_back({what, r, T - kinetic(m) - r.dissipated_J});
  };
  note("capture", [&] { return capture(m, {.body = "target", .link = hand}); });
  note("lock", [&] { return lock(m, joint); });
  EXPECT_EQ(m.model->mechanism().nv(), 11);
  note("release", [&] { return release(m, "target"); });
  note("unlock", [&] { return unlock(m, joint); });
  note("capture again", [&] { return capture(m, {.body = "target", .link = hand}); });
  const double scale = kinetic(m);
  for (const auto& [what, r, change] : rows) {
    std::printf("  %-14s lost %.3e J, ledger %.1e J, momenta %.1e, %.1e\n", what, r.dissipated_J,
                change, r.linear_jump / size(r.momentum.linear),
                r.angular_jump / size(r.momentum.angular));
    EXPECT_LT(std::fabs(change), 1e-13 * scale) << what;
    EXPECT_LT(r.linear_jump, 1e-15 * size(r.momentum.linear)) << what;
    EXPECT_LT(r.angular_jump, 1e-15 * size(r.momentum.angular)) << what;
  }
  EXPECT_GT(rows[0].impact.dissipated_J, 1e-3);
  EXPECT_GT(rows[1].impact.dissipated_J, 1e-6);
  for (const int i : {2, 3, 4})
    EXPECT_LT(rows[size_t(i)].impact.dissipated_J, 1e-28 * scale)
        << "nothing moves against anything: " << rows[size_t(i)].what;
  EXPECT_NEAR(value(), angle, 1e-16);
  EXPECT_EQ(m.state.step, 77);
}

/// A weld that closes is a capture: the same momenta, rates and loss, by another way. A pin loses
/// less, an opening nothing, and both ends move on as one.
TEST(Reconfiguration, ALoopThatClosesIsAPlasticImpact) {
  Random random(11);
  MovingMechanism start(servicer_and_target());
  throw_about(start, random);
  const std::string hand = last_link(start.parts);
  const auto closed = [&](const char* type) {
    MovingMechanism m = start;
    LoopJoint l{"grip", type, {hand, {rotation_from_rpy(0.3, 0.2, 0.1), {0.2, 0.1, 0}}}, {}};
    l.b.link = "target";
    const double T = kinetic(m);
    const Impact r = close_loop(m, {{l}, {}, {}});
    std::printf("  %-9s lost %.4f J of %.4f, books %.1e, momenta jump %.1e %.1e\n", type,
                r.dissipated_J, T, T - kinetic(m) - r.dissipated_J, r.linear_jump, r.angular_jump);
    EXPECT_NEAR(T - kinetic(m), r.dissipated_J, 1e-14 * T);
    EXPECT_LT(r.linear_jump, 1e-15 * r.scale.linear);
    EXPECT_LT(r.angular_jump, 1e-15 * r.scale.angular);
    return std::pair{m, r};
  };
  const auto [weld, at_weld] = closed("fixed");
  const auto [ball, at_ball] = closed("spherical");
  EXPECT_LT(at_ball.dissipated_J, 0.99 * at_weld.dissipated_J);
  MovingMechanism caught = start;
  Latch latch;
  latch.body = "target";
  latch.link = hand;
  const Impact impact = capture(caught, latch);
  EXPECT_NEAR(at_weld.dissipated_J, impact.dissipated_J, 1e-14 * kinetic(start));
  EXPECT_NEAR(at_weld.rate_jump, impact.rate_jump, 1e-14);
  for (int k = 0; k < 6; ++k) {
    const auto v = weld.model->rates(weld.state.x), u = caught.model->rates(caught.state.x);
    EXPECT_NEAR(v[size_t(k)], u[size_t(k)], 1e-14) << k;
  }
  // On the manifold: positions and rates.
  const auto system = ball.model->instantiate<double>();
  const auto rows = system->constraints();
  std::vector<double> g(size_t(rows->count())), e(ball.state.x.size());
  rows->place(ball.state.x, g);
  for (const double x : g) EXPECT_NEAR(x, 0, 1e-15);
  system->gradient(ball.state.x, e);
  rows->rates(e, g);
  for (const double x : g) EXPECT_NEAR(x, 0, 1e-15);
  MovingMechanism opened = ball;
  const Impact nothing = open_loop(opened, "grip");
  EXPECT_NEAR(nothing.dissipated_J, 0, 1e-28);
  for (size_t i = 0; i < ball.state.x.size(); ++i)
    EXPECT_NEAR(opened.state.x[i], ball.state.x[i], 1e-15 * (1 + std::fabs(ball.state.x[i])));
  EXPECT_TRUE(opened.constraints.empty());
  EXPECT_THROW(open_loop(opened, "grip"), InvalidArgument);
  // A capture by the link before the hand, and the release, with the ball joint closed.
  MovingMechanism both = ball;
  latch.link = both.parts.bodies()[both.parts.bodies().size() - 3].name;
  const auto keeps = [&](const Impact& r, double before) {
    EXPECT_NEAR(before - kinetic(both), r.dissipated_J, 1e-14 * before);
    EXPECT_LT(r.linear_jump, 1e-15 * r.scale.linear);
    const auto now = both.model->instantiate<double>();
    const auto grip = now->constraints();
    std::vector<double> rate(size_t(grip->count())), efforts(both.state.x.size());
    grip->place(both.state.x, rate);
    now->gradient(both.state.x, efforts);
    grip->rates(efforts, rate);
    for (const double x : rate) EXPECT_NEAR(x, 0, 2e-15);
  };
  double before = kinetic(both);
  const Impact second = capture(both, latch);
  keeps(second, before);
  EXPECT_GT(second.dissipated_J, 1e-3);
  before = kinetic(both);
  const Impact freed = release(both, "target");
  keeps(freed, before);
  EXPECT_LT(freed.dissipated_J, 1e-26 * before);
}

/// Locks, releases and captures while a loop is closed: the rates are the nearest with both.
TEST(Reconfiguration, EventsKeepClosedLoops) {
  auto l = test::four_bar();
  MechanismBuilder parts("four_bar");
  parts.add(test::rod("crank", "world", 0, 0, 0.5, 1));
  parts.add(test::rod("coupler", "crank", 0.5, 0, 1.5, 2));
  parts.add(test::rod("rocker", "world", 1.5, 0, 1.25, 1.5));
  MovingMechanism m(parts);
  l.start();
  m.set(l.q, l.v);
  Impact r = close_loop(m, l.spec);
  EXPECT_NEAR(r.dissipated_J, 0, 1e-25);  // it moved as if it were closed
  const double T = kinetic(m);
  r = lock(m, "coupler_joint");  // the last freedom of the linkage
  EXPECT_NEAR(r.dissipated_J, T, 1e-14 * T);
  EXPECT_NEAR(kinetic(m), 0, 1e-25);
  r = unlock(m, "coupler_joint");
  EXPECT_EQ(m.state.x.size(), 6u);
  EXPECT_THROW(lock(m, "nothing"), InvalidArgument);
  ConstraintSpec gear;
  gear.couplings.push_back({"clutch", {{"crank_joint", 1}, {"rocker_joint", -2}}, 0});
  open_loop(m, "pin");
  m.set(l.q, std::vector<double>{1, 0.5, -0.25});
  r = close_loop(m, gear);
  EXPECT_GT(r.dissipated_J, 0.01);
  const auto v = m.model->rates(m.state.x);
  EXPECT_NEAR(v[0], 2 * v[2], 4e-15);
  EXPECT_NEAR(m.constraints.couplings[0].offset, l.q[0] - 2 * l.q[2], 1e-15);
}

// A release ends the lock of the joint that held the body: unlocked after it, the joint would hinge
// the body where its mount was, in the world, with a jump of momentum from nowhere.
TEST(Reconfiguration, AReleaseEndsTheLockOfItsJoint) {
  const std::string joint = "joint_3";
  for (const bool caught_again : {false, true}) {
    Random random(21);
    MovingMechanism m(servicer_and_target());
    throw_about(m, random);
    const auto body =
        std::find_if(m.parts.bodies().begin(), m.parts.bodies().end(), [&](const BodySpec& b) {
          return b.joint.name == joint;
        })->name;
    const std::string base = m.parts.bodies()[0].name;
    lock(m, joint);
    const LockedJoint kept = m.locked.at(joint);
    release(m, body);
    if (caught_again) capture(m, {.body = body, .link = base});
    EXPECT_TRUE(m.locked.empty());
    const auto before = m.state;
    EXPECT_THROW(unlock(m, joint), InvalidArgument);
    EXPECT_EQ(m.state, before);
    // The control: with the lock kept, the momentum jumps.
    m.locked.emplace(joint, kept);
    const Impact wrong = unlock(m, joint);
    const double jump = wrong.linear_jump / size(wrong.momentum.linear);
    std::printf("  with the lock kept%s: momentum jumps by %.2g of itself (control: > 1e-3)\n",
                caught_again ? ", after a second capture" : "", jump);
    EXPECT_GT(jump + wrong.angular_jump / size(wrong.momentum.angular), 1e-3);
  }
}

// A run goes on from the event: the momenta of the whole, across a capture, are those of the start.
TEST(Reconfiguration, ARunGoesOn) {
  Random random(8);
  MovingMechanism m(servicer_and_target());
  throw_about(m, random);
  const auto invariants = [](const MovingMechanism& a) {
    const auto f = a.model->instantiate<double>();
    std::vector<double> I(size_t(a.model->description().invariant_count()));
    f->invariants(a.state.x, I);
    return std::vector<double>(I.begin(), I.begin() + 6);
  };
  const auto first = invariants(m);
  for (const bool caught : {false, true}) {
    if (caught) capture(m, {.body = "target", .link = last_link(m.parts)});
    const auto method = integrators::make_integrator("gauss16", *m.model, 0.05);
    for (int i = 0; i < 1000; ++i)
      ASSERT_EQ(method->step(m.state), integrators::Outcome::ok) << "step " << i;
  }
  const auto last = invariants(m);
  double worst = 0, scale = 0;
  for (size_t i = 0; i < 6; ++i) {
    worst = std::max(worst, std::fabs(first[i] - last[i]));
    scale = std::max(scale, std::fabs(first[i]));
  }
  std::printf("  momenta over 50 s, a capture and 50 s: %.1e (1e-14)\n", worst / scale);
  EXPECT_LT(worst, 1e-14 * scale);
}

TEST(Reconfiguration, WhatCannotBeIsRefusedAndNothingChanges) {
  MovingMechanism m(servicer_and_target());
  const std::string hand = last_link(m.parts);
  auto q = m.model->mechanism().neutral();
  std::vector<double> v(size_t(m.model->mechanism().nv()), 0.0);
  const auto& target = m.model->mechanism().coordinate("target.position");
  q[size_t(target.q)] = 30;
  v[size_t(target.v)] = 0.5;
  m.set(q, v);
  const auto before = m.state;
  const auto refusal = [&](auto f) -> std::string {
    try {
      f();
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "(accepted)";
  };
  EXPECT_NE(refusal([&] {
              capture(m, {.body = "target", .link = hand, .reach = 0.1});
            }).find("m, expected at most 0.1 m, by the latch"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              capture(m, {.body = "target", .link = hand, .speed = 0.1});
            }).find("the relative speed is 0.5 m/s, expected at most 0.1 m/s"),
            std::string::npos);
  const auto both =
      refusal([&] { capture(m, {.body = "target", .link = hand, .reach = 0.1, .speed = 0.1}); });
  EXPECT_NE(both.find("m, expected at most 0.1 m; the relative speed is 0.5 m/s, expected at most "
                      "0.1 m/s, by the latch; from link to body ("),
            std::string::npos)
      << both;
  EXPECT_LE(both.size(), 220u);
  EXPECT_NE(refusal([&] {
              capture(m, {.body = "tarket", .link = hand});
            }).find("there is no body 'tarket', expected one of"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              capture(m, {.body = hand, .link = "target"});
            }).find("is a link of the mechanism with the base"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              capture(m, {.body = m.parts.bodies()[0].name, .link = hand});
            }).find("belong to one mechanism"),
            std::string::npos);
  EXPECT_EQ(refusal([&] { release(m, "target"); }), "release: the body 'target' is free already");
  EXPECT_EQ(refusal([&] { unlock(m, "elbow"); }),
            "unlock: the joint 'elbow' is not locked (the release of a body ends the lock of its "
            "joint), expected one of (none)");
  EXPECT_NE(refusal([&] { lock(m, "elbow"); }).find("there is no joint 'elbow' that moves"),
            std::string::npos);
  EXPECT_EQ(m.state, before);
}

}  // namespace
}  // namespace porthos::test::reconfiguration_test
