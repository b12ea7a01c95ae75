// Captures by a link that is not the root: the tree is turned round. Same motion, momenta kept, the
// plastic loss against its closed form, the robot given back; what is refused.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdio>
#include <map>
#include <random>

#include "integrators/catalogue.h"
#include "integrators/core/integrator.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/reconfiguration.h"

namespace porthos::test::turning_test {
namespace {

using namespace mechanics;

BodySpec solid(const std::string& name, const std::string& parent, const std::string& type,
               double mass, const Pose& placement = {Mat3<double>::identity(), {0, 0, 0}}) {
  BodySpec b;
  b.name = name;
  b.parent = parent;
  b.placement = placement;
  b.joint.type = type;
  b.joint.name = name + "_joint";
  b.joint.axis = {0.3, -0.5, 0.8};
  const double i = 0.2 * mass;
  b.mass = {mass, {0.1, -0.05, 0.2}, {i, 0.05 * i, -0.03 * i, 1.1 * i, 0.02 * i, 0.9 * i}};
  return b;
}
Pose at(double roll, double pitch, double yaw, const Vec3d& r) {
  return {rotation_from_rpy(roll, pitch, yaw), r};
}

/// A chaser with an arm, and a target: a bus, from which joints of every type with one axis and a
/// fixed one lead to a pad, and a panel beside.
MechanismBuilder chaser_and_target() {
  MechanismBuilder parts("two");
  parts.add(solid("chaser", "world", "free", 20));
  parts.add(solid("hand", "chaser", "revolute", 3, at(0.2, 0.1, -0.3, {0.5, 0.1, 0})));
  auto bus = solid("bus", "world", "free", 12);
  bus.joint.name = "target";
  parts.add(bus);
  auto lift = solid("lift", "bus", "helical", 2, at(0.4, -0.2, 0.1, {0.1, 0.3, 0.2}));
  lift.joint.pitch = 0.05;
  lift.joint.stiffness = 3;
  lift.joint.damping = 0.2;
  lift.joint.rotor_inertia = 0.1;
  parts.add(lift);
  parts.add(solid("mount", "lift", "fixed", 1, at(1.2, 0.7, -0.4, {0, 0.2, 0.1})));
  parts.add(solid("slide", "mount", "prismatic", 1.5, at(-0.6, 0.3, 0.9, {0.2, 0, 0.1})));
  parts.add(solid("sleeve", "slide", "cylindrical", 1, at(0.1, 0.5, 0.2, {0, 0.1, 0.3})));
  parts.add(solid("pad", "sleeve", "continuous", 0.8, at(0.3, 0.3, 0.3, {0.1, 0.1, 0.1})));
  parts.add(solid("panel", "bus", "revolute", 2, at(0, 0.8, 0, {-0.4, 0, 0})));
  return parts;
}

double uniform(std::mt19937_64& rng, double bound) {
  return bound * (2 * double(rng() >> 11) * 0x1p-53 - 1);
}
void throw_about(MovingMechanism& m, std::mt19937_64& rng) {
  const auto& mech = m.model->mechanism();
  auto q = mech.neutral();
  std::vector<double> v(size_t(mech.nv()));
  for (const auto& c : mech.coordinates()) {
    double norm = 0;
    for (int k = 0; k < c.nq; ++k) {
      double& x = q[size_t(c.q + k)];
      x = uniform(rng, 1.5);
      norm += x * x;
    }
    if (c.kind == phs::BlockKind::rotation)
      for (int k = 0; k < 4; ++k) q[size_t(c.q + k)] /= std::sqrt(norm);
    for (int k = 0; k < c.nv; ++k) v[size_t(c.v + k)] = uniform(rng, 0.5);
  }
  m.set(q, v);
}
double energy(const MovingMechanism& m) {
  return m.model->instantiate<double>()->hamiltonian(m.state.x);
}
double largest(const Vec3d& a) {
  return std::max({std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)});
}
double size(const Vec3d& a) { return std::hypot(a.x, a.y, a.z); }

/// Poses of a body, and the coordinates of one number, by name.
Pose pose_of(const MovingMechanism& m, const std::string& body) {
  return relative_pose(m, "", body);
}
double apart(const Pose& a, const Pose& b) {
  return std::max(
      {largest(a.r - b.r), largest(a.R.x - b.R.x), largest(a.R.y - b.R.y), largest(a.R.z - b.R.z)});
}
std::map<std::string, double> numbers(const MovingMechanism& m) {
  std::map<std::string, double> all;
  for (const auto& c : m.model->mechanism().coordinates())
    if (c.nq == 1) all[c.name] = m.state.x[size_t(c.q)];
  return all;
}

/// J M⁻¹ Jᵀ of a body frame in world axes about the origin, and its twist there.
std::pair<Eigen::MatrixXd, Eigen::VectorXd> mobility(const MovingMechanism& m,
                                                     const std::string& body) {
  const auto& mech = m.model->mechanism();
  const auto nv = size_t(mech.nv()), nq = size_t(mech.nq());
  Workspace<double> w(mech);
  const auto q = std::span<const double>(m.state.x).first(nq);
  const Pose X = pose_of(m, body);
  Eigen::MatrixXd J(6, long(nv));
  std::vector<double> rate(nv, 0.0), p(nq), m_of_q(nv * nv);
  const auto twist = [&](std::span<const double> v) {
    momenta_from_rates<double>(mech, w, q, v, p);
    const auto& frame = mech.body(body);
    const Motion<double> V = frame.pose.to_child(w.V[size_t(frame.node)]);
    const Vec3d omega = X.R * V.w, v0 = X.R * V.v - cross(omega, X.r);
    return Eigen::Matrix<double, 6, 1>{omega.x, omega.y, omega.z, v0.x, v0.y, v0.z};
  };
  for (size_t k = 0; k < nv; ++k) {
    rate[k] = 1;
    J.col(long(k)) = twist(rate);
    rate[k] = 0;
  }
  crba<double>(mech, w, q, m_of_q);
  const Eigen::MatrixXd M = Eigen::Map<const Eigen::MatrixXd>(m_of_q.data(), long(nv), long(nv));
  const auto v = m.model->rates(m.state.x, m.state.turns);
  return {J * M.ldlt().solve(J.transpose()), twist(v)};
}

std::string refusal(const MechanismBuilder& parts, const std::string& body,
                    const std::string& link) {
  try {
    MovingMechanism m(parts);
    capture(m, {.body = body, .link = link});
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "(accepted)";
}

}  // namespace

TEST(Turning, ACaptureByAnyLinkIsAPlasticImpact) {
  std::mt19937_64 rng(5);
  double momenta = 0, loss = 0, ledger = 0, moved = 0, control = 0, least = HUGE_VAL;
  for (int i = 0; i < 200; ++i) {
    MovingMechanism m(chaser_and_target());
    throw_about(m, rng);
    const double H = energy(m);
    const auto [Ya, Va] = mobility(m, "hand");
    const auto [Yb, Vb] = mobility(m, "pad");
    const Eigen::VectorXd jump = Va - Vb;
    // The two mechanisms do not touch: their mobilities add.
    const double closed = 0.5 * jump.dot((Ya + Yb).ldlt().solve(jump));
    const auto [Yr, Vr] = mobility(m, "bus");
    const Eigen::VectorXd of_root = Va - Vr;
    const double by_root = 0.5 * of_root.dot((Ya + Yr).ldlt().solve(of_root));
    const auto before = numbers(m);
    std::map<std::string, Pose> poses;
    for (const auto& b : m.parts.bodies()) poses[b.name] = pose_of(m, b.name);
    const Impact r = capture(m, {.body = "pad", .link = "hand"});
    EXPECT_EQ(numbers(m), before) << "the coordinates keep their bits";
    for (const auto& [name, pose] : poses) moved = std::max(moved, apart(pose_of(m, name), pose));
    momenta = std::max({momenta, r.linear_jump / size(r.momentum.linear),
                        r.angular_jump / size(r.momentum.angular)});
    loss = std::max(loss, std::fabs(r.dissipated_J - closed) / H);
    ledger = std::max(ledger, std::fabs(H - energy(m) - r.dissipated_J) / H);
    least = std::min(least, r.dissipated_J);
    control = std::max(control, std::fabs(r.dissipated_J - by_root) / H);
  }
  std::printf(
      "  200 captures by the pad: momenta %.1e (1e-14), loss against the closed form %.1e (1e-12), "
      "against the energies %.1e (1e-12); bodies moved %.1e m (1e-14)\n",
      momenta, loss, ledger, moved);
  EXPECT_LT(momenta, 1e-14);
  EXPECT_LT(loss, 1e-12);
  EXPECT_LT(ledger, 1e-12);
  EXPECT_LT(moved, 1e-14);
  EXPECT_GT(least, 0);
  EXPECT_GT(control, 1e-2) << "a capture by the root loses something else";
}

/// The same mechanism, hung on either end: from one motion to the same motion.
TEST(Turning, ATurnedTreeMovesAsBefore) {
  std::mt19937_64 rng(6);
  // A small body is at the pad: it carries the target, which is turned round, or is carried by it.
  auto with_dust = chaser_and_target();
  auto dust = solid("dust", "world", "free", 1e-3);
  dust.joint.name = "dust";
  with_dust.add(dust);
  MovingMechanism held(with_dust);
  throw_about(held, rng);
  MovingMechanism turned = held;
  capture(turned, {.body = "pad", .link = "dust"});
  release(turned, "pad");
  MovingMechanism welded = turned;  // from here on both have one motion
  capture(welded, {.body = "pad", .link = "dust"});
  MovingMechanism other = turned;
  capture(other, {.body = "dust", .link = "pad"});  // the same weld, the tree as it was
  const auto run = [](MovingMechanism& m) {
    const auto method = integrators::make_integrator("gauss12", *m.model, 0.01);
    for (int i = 0; i < 200; ++i) ASSERT_EQ(method->step(m.state), integrators::Outcome::ok);
  };
  EXPECT_NEAR(energy(welded), energy(other), 1e-13 * energy(other));
  const Pose before = pose_of(welded, "panel");
  run(welded);
  run(other);
  double worst = 0;
  for (const char* body : {"bus", "panel", "lift", "mount", "slide", "sleeve", "pad", "dust"})
    worst = std::max(worst, apart(pose_of(welded, body), pose_of(other, body)));
  const auto a = numbers(welded), b = numbers(other);
  for (const auto& [name, value] : b) worst = std::max(worst, std::fabs(a.at(name) - value));
  std::printf("  turned against not turned, after 2 s: %.1e (1e-11)\n", worst);
  EXPECT_LT(worst, 1e-11);
  EXPECT_GT(apart(pose_of(welded, "panel"), before), 0.1) << "it moves";
  EXPECT_NEAR(energy(welded), energy(other), 1e-12 * energy(other)) << "with a damper and a spring";
}

TEST(Turning, AReleaseGivesTheRobotBack) {
  std::mt19937_64 rng(7);
  MovingMechanism m(chaser_and_target());
  throw_about(m, rng);
  const auto names = [&] {
    std::vector<std::string> all;
    for (const auto& c : m.model->mechanism().coordinates()) all.push_back(c.name);
    return all;
  };
  const auto before = names();
  capture(m, {.body = "pad", .link = "hand"});
  EXPECT_NE(names(), before);
  EXPECT_EQ(m.parts.bodies().size(), 13u) << "four frames";
  const auto pose = pose_of(m, "bus");
  const double H = energy(m);
  const auto held = numbers(m);
  const Impact r = release(m, "pad");
  EXPECT_EQ(names(), before);
  EXPECT_EQ(numbers(m), held);
  EXPECT_LT(apart(pose_of(m, "bus"), pose), 1e-15);  // 4e-16
  EXPECT_NEAR(energy(m), H, 1e-14 * H);
  EXPECT_LT(r.dissipated_J, 1e-28 * H) << "nothing is lost";
  EXPECT_TRUE(m.captured.empty());
  for (const auto& b : m.parts.bodies()) EXPECT_FALSE(b.joint.turned) << b.name;
}

/// A joint is locked while its tree is turned round, and unlocked after the release.
TEST(Turning, LocksLastAcrossARelease) {
  std::mt19937_64 rng(8);
  MovingMechanism m(chaser_and_target());
  throw_about(m, rng);
  capture(m, {.body = "pad", .link = "hand"});
  const double q = numbers(m).at("slide_joint");
  lock(m, "slide_joint");
  const auto place = relative_pose(m, "mount", "slide");
  release(m, "pad");
  EXPECT_EQ(numbers(m).count("slide_joint"), 0u);
  EXPECT_LT(apart(relative_pose(m, "mount", "slide"), place), 1e-15);
  unlock(m, "slide_joint");
  EXPECT_EQ(numbers(m).at("slide_joint"), q);
  EXPECT_LT(apart(relative_pose(m, "mount", "slide"), place), 1e-15);
  // Locked before the capture: it can be turned, and unlocked after the release only.
  lock(m, "slide_joint");
  capture(m, {.body = "pad", .link = "hand"});
  EXPECT_LT(apart(relative_pose(m, "mount", "slide"), place), 1e-14);
  try {
    unlock(m, "slide_joint");
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(),
                 "unlock: the joint 'slide_joint' was locked before the capture of 'pad' turned it "
                 "round, expected its unlocking before the capture or after the release");
  }
  release(m, "pad");
  unlock(m, "slide_joint");
  EXPECT_EQ(numbers(m).at("slide_joint"), q);
}

TEST(Turning, CapturesInTurnAreReleasedInTurn) {
  auto parts = chaser_and_target();
  auto tug = solid("tug", "world", "free", 5);
  tug.joint.name = "tug";
  parts.add(tug);
  MovingMechanism m(parts);
  std::mt19937_64 rng(9);
  throw_about(m, rng);
  const auto first = numbers(m);
  capture(m, {.body = "pad", .link = "tug"});     // the target hangs on the tug
  capture(m, {.body = "panel", .link = "hand"});  // tug and target hang on the hand
  try {
    release(m, "pad");
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(),
                 "release: 'pad' is held by 'panel', by which it was captured, expected the "
                 "release of that link");
  }
  lock(m, "sleeve_joint");  // between the two, turned round twice
  release(m, "panel");
  release(m, "pad");
  unlock(m, "sleeve_joint");
  EXPECT_EQ(numbers(m), first);
  EXPECT_EQ(m.parts.bodies().size(), parts.bodies().size());
}

TEST(Turning, Refusals) {
  auto parts = chaser_and_target();
  EXPECT_EQ(refusal(parts, "pad", "panel"),
            "capture: the link 'panel' and 'pad' belong to one mechanism, expected another "
            "mechanism's link");
  parts.bodies()[0].joint.name = "base";
  EXPECT_EQ(refusal(parts, "hand", "bus"),
            "capture: 'hand' is a link of the mechanism with the base, expected it as the link, "
            "and as the body 'bus'");
  for (const char* type : {"spherical", "universal", "planar"}) {
    auto other = parts;
    other.bodies()[5].joint.type = type;
    EXPECT_EQ(refusal(other, "pad", "hand"),
              std::string("capture: joint 'slide_joint' between 'pad' and the root 'bus' is ") +
                  type +
                  ", expected joints of one axis there (a loop of type \"fixed\" that closes joins "
                  "any two links)");
    EXPECT_EQ(refusal(other, "lift", "hand"), "(accepted)") << "it is not on the way";
  }
  parts.bodies()[2].joint.type = "fixed";
  EXPECT_EQ(refusal(parts, "pad", "hand"),
            "capture: the body 'pad' is not free in the world, expected one that is, or a link of "
            "a robot that floats");
}

}  // namespace porthos::test::turning_test
