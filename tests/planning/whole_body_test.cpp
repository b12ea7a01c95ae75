// Inverse dynamics with contacts and priorities against statics, Newton's laws and other kernels.
#include "planning/whole_body.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <chrono>
#include <cmath>
#include <random>

#include "mechanics/aba.h"
#include "mechanics/builder.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "tests/support/robots.h"

namespace porthos::planning::whole_body_test {
namespace {

using mechanics::BodySpec;
using mechanics::Mechanism;
using Machine = std::shared_ptr<const Mechanism>;
using Vec = std::vector<double>;
constexpr double g = 9.81;

mechanics::MechanismBuilder body(double mass, const mechanics::Vec3d& com) {
  mechanics::MechanismBuilder builder("machine");
  builder.gravity({0, 0, -g});
  BodySpec trunk;
  trunk.name = "trunk";
  trunk.parent = "world";
  trunk.joint.name = "base";
  trunk.joint.type = "free";
  trunk.mass.mass = mass;
  trunk.mass.com = com;
  trunk.mass.inertia = {0.4, 0, 0, 0.5, 0, 0.6};
  builder.add(trunk);
  return builder;
}

/// A trunk on four legs of six joints each: 30 freedoms, 40 kg, with feet at the ends of the legs.
Machine four_legs() {
  auto builder = body(16, {0.02, 0.01, 0.03});
  const mechanics::Vec3d axes[] = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0},
                                   {0, 1, 0}, {0, 1, 0}, {1, 0, 0}};
  for (int leg = 0; leg < 4; ++leg)
    for (int k = 0; k < 6; ++k) {
      BodySpec link;
      const std::string name = "leg" + std::to_string(leg) + "_";
      link.name = name + std::to_string(k);
      link.parent = k ? name + std::to_string(k - 1) : "trunk";
      link.joint.name = link.name;
      link.joint.type = "revolute";
      link.joint.axis = axes[k];
      if (k == 0) link.placement.r = {leg % 2 ? 0.3 : -0.3, leg / 2 ? 0.2 : -0.2, 0};
      if (k > 2) link.placement.r = {0, 0, -0.2};
      link.mass.mass = 1;
      link.mass.com = {0, 0, -0.05};
      link.mass.inertia = {2e-3, 0, 0, 2e-3, 0, 2e-3};
      builder.add(link);
    }
  return std::make_shared<const Mechanism>(builder.build());
}

std::vector<ContactPoint> feet() {
  std::vector<ContactPoint> contacts;
  for (int leg = 0; leg < 4; ++leg) {
    ContactPoint p;
    p.name = "foot" + std::to_string(leg);
    p.body = "leg" + std::to_string(leg) + "_5";
    p.position = {0, 0, -0.1};
    contacts.push_back(p);
  }
  return contacts;
}

/// The joints of the legs.
std::vector<mechanics::JointCoordinates> joints(const Mechanism& m) {
  std::vector<mechanics::JointCoordinates> list;
  for (const auto& c : m.coordinates())
    if (c.nv == 1) list.push_back(c);
  return list;
}

/// Legs bent, with some motion of all joints where `speed` is not 0.
void posture(const Mechanism& m, double speed, Vec& q, Vec& v) {
  q = m.neutral();
  v.assign(size_t(m.nv()), 0.0);
  std::mt19937 gen(5);
  std::uniform_real_distribution<double> d(-1, 1);
  for (const auto& j : joints(m)) {
    const int k = j.joint.back() - '0';
    q[size_t(j.q)] = (k == 2 ? 0.5 : k == 3 ? -1.0 : k == 4 ? 0.5 : 0) + 0.05 * d(gen);
  }
  for (auto& x : v) x = speed * d(gen);
}

/// f = ½ m g (1 ± d/L): a body on two points at ±L whose centre of mass is at d.
TEST(WholeBody, TwoFeetCarryByTheLever) {
  const double mass = 7, L = 0.3, d = 0.11;
  const auto m = std::make_shared<const Mechanism>(body(mass, {d, 0, 0.5}).build());
  WholeBodyOptions o;
  for (const double x : {-L, L}) {
    ContactPoint p;
    p.name = x < 0 ? "left" : "right";
    p.body = "trunk";
    p.position = {x, 0, 0};
    o.contacts.push_back(p);
  }
  WholeBody control(m, o);
  control.update(m->neutral(), Vec(6, 0.0));
  const auto& s = control.solve({});
  ASSERT_TRUE(s.possible) << s.why;
  const double left = 0.5 * mass * g * (1 - d / L), right = 0.5 * mass * g * (1 + d / L);
  std::printf("  forces off by %.1e and %.1e N (bound 1e-12)\n", s.forces[2] - left,
              s.forces[5] - right);
  EXPECT_NEAR(s.forces[2], left, 1e-12);
  EXPECT_NEAR(s.forces[5], right, 1e-12);
  for (const double t : s.tau) EXPECT_EQ(t, 0);
  // Control: with the centre of mass beyond the right foot no pushing forces hold the body.
  const auto falls = std::make_shared<const Mechanism>(body(mass, {1.5 * L, 0, 0.5}).build());
  WholeBody other(falls, o);
  other.update(falls->neutral(), Vec(6, 0.0));
  const auto& no = other.solve({});
  std::printf("  beyond the foot: %s\n", no.why.c_str());
  EXPECT_FALSE(no.possible);
  EXPECT_TRUE(no.tau.empty());
  EXPECT_NE(no.why.find("least force of 'left'"), std::string::npos) << no.why;
}

/// A block that is pushed harder than friction holds accelerates by μ g along an edge of the
/// pyramid and by μ g/√2 across a face; that the task misses is told. Below that it is met.
TEST(WholeBody, BlockSlidesBeyondFriction) {
  const double mu = 0.4;
  const auto m = std::make_shared<const Mechanism>(body(3, {0, 0, 0}).build());
  WholeBodyOptions o;
  ContactPoint p;  // pushed through its centre of mass
  p.name = "palm";
  p.body = "trunk";
  p.friction = mu;
  p.touch = Touch::pushes;
  o.contacts = {p};
  WholeBody control(m, o);
  control.update(m->neutral(), Vec(6, 0.0));
  const auto reached = [&](double angle, double wanted) {
    const Vec up{0, 0, 0, NAN, NAN, 0};
    const Vec aside{NAN, NAN, NAN, wanted * std::cos(angle), wanted * std::sin(angle), NAN};
    const std::vector<TaskLevel> tasks{control.frame("trunk", {0, 0, 0}, up),
                                       control.frame("trunk", {0, 0, 0}, aside)};
    const auto& s = control.solve(tasks);
    EXPECT_TRUE(s.possible) << s.why;
    EXPECT_TRUE(s.tasks[0].met);
    const double a = std::hypot(s.v_dot[3], s.v_dot[4]);
    EXPECT_EQ(s.tasks[1].met, wanted < mu * g / std::sqrt(2)) << angle;
    EXPECT_NEAR(s.tasks[1].distance(), std::max(wanted - a, 0.0), 1e-9);
    return a;
  };
  std::printf("  edge: a - μg = %.1e, face: a - μg/√2 = %.1e m/s² (bound 1e-11)\n",
              reached(M_PI / 4, 2 * mu * g) - mu * g,
              reached(0, 2 * mu * g) - mu * g / std::sqrt(2));
  EXPECT_NEAR(reached(M_PI / 4, 2 * mu * g), mu * g, 1e-11);
  EXPECT_NEAR(reached(0, 2 * mu * g), mu * g / std::sqrt(2), 1e-11);
  EXPECT_NEAR(reached(0, 1), 1, 1e-12);
}

/// A ball on a tilted body touches at its lowest point. Control: the same without a radius.
TEST(WholeBody, BallsTouchAtTheirLowestPoint) {
  const auto m = std::make_shared<const Mechanism>(body(3, {0, 0, 0}).build());
  const double r = 0.05, turn = 0.7, rate = 2;
  ContactPoint foot;
  foot.name = "foot";
  foot.body = "trunk";
  foot.position = {0.1, 0.02, -0.3};
  WholeBodyOptions o;
  auto ball = foot;
  ball.name = "ball";
  ball.radius = r;
  o.contacts = {foot, ball};
  WholeBody control(m, o);
  auto q = m->neutral();
  q[0] = std::cos(turn / 2);  // about y
  q[2] = std::sin(turn / 2);
  control.update(q, Vec{0, rate, 0, 0, 0, 0});
  const auto centre = control.contact(0), lowest = control.contact(1);
  const double place = mechanics::norm(lowest.at - centre.at - mechanics::Vec3d{0, 0, -r});
  // It turns about y: the lowest point moves against x by r times the rate.
  const double motion =
      mechanics::norm(lowest.moving - centre.moving - mechanics::Vec3d{-r * rate, 0, 0});
  std::printf("  off by %.1e m and %.1e m/s (bound 1e-15)\n", place, motion);
  EXPECT_LE(std::max(place, motion), 1e-15);
}

/// The equations of motion at a moving state with torque limits: torques and contact forces through
/// the ABA give the accelerations, contacts keep their velocity, nothing exceeds cones and limits.
TEST(WholeBody, TorquesGiveTheAccelerations) {
  const auto m = four_legs();
  WholeBodyOptions o;
  o.contacts = feet();
  double strongest = 0, beyond = 0, aba_off = 0, foot = 0, task = 0;
  for (const double torque : {60.0, 12.0}) {
    o.limits.clear();
    for (const auto& j : joints(*m)) {
      JointLimit l;
      l.joint = j.joint;
      l.torque = torque;
      o.limits.push_back(l);
    }
    WholeBody control(m, o);
    Vec q, v;
    posture(*m, 0.2, q, v);
    control.update(q, v);
    const std::vector<TaskLevel> tasks{control.centre_of_mass(Vec{0.5, 0.3, 2}),
                                       control.joints(Vec(30, 0.0))};
    const auto& s = control.solve(tasks);
    ASSERT_TRUE(s.possible) << s.why;
    if (torque == 60) task = s.tasks[0].distance();
    EXPECT_TRUE(s.tasks[0].met || torque < 60);
    for (const double t : s.tau) {
      strongest = std::max(strongest, std::fabs(t) / torque);
      beyond = std::max(beyond, std::fabs(t) - torque);
    }
    mechanics::Workspace<double> w(*m);
    Vec tau = s.tau, v_dot(30), left(30);
    for (size_t c = 0; c < 4; ++c) {
      auto frame = m->body(o.contacts[c].body);
      frame.pose.r = frame.pose.R * o.contacts[c].position + frame.pose.r;
      Vec J(6 * 30), later(6 * 30), q_dot(q.size()), moved = q;
      mechanics::jacobian<double>(*m, w, q, frame, mechanics::JacobianAxes::world, J);
      for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 3; ++k) tau[i] += J[6 * i + 3 + k] * s.forces[3 * c + k];
      const double fn = s.forces[3 * c + 2];
      beyond = std::max({beyond, -fn, std::hypot(s.forces[3 * c], s.forces[3 * c + 1]) - 0.7 * fn});
      // d/dt (J v) by duals: J̇ along q', and J v'
      mechanics::coordinate_rates<double>(*m, q, v, q_dot);
      mechanics::Workspace<phs::Dual> wd(*m);
      std::vector<phs::Dual> qd, Jd(6 * 30);
      for (size_t i = 0; i < q.size(); ++i) qd.emplace_back(q[i], q_dot[i]);
      mechanics::jacobian<phs::Dual>(*m, wd, qd, frame, mechanics::JacobianAxes::world, Jd);
      for (size_t k = 3; k < 6; ++k) {
        double a = 0;
        for (size_t i = 0; i < 30; ++i) a += Jd[6 * i + k].d * v[i] + J[6 * i + k] * s.v_dot[i];
        foot = std::max(foot, std::fabs(a));
      }
    }
    mechanics::rnea<double>(*m, w, q, v, s.v_dot, {}, left);
    for (size_t i = 0; i < 30; ++i) aba_off = std::max(aba_off, std::fabs(left[i] - tau[i]));
  }
  std::printf(
      "  torques off by %.1e N m (bound 1e-10), feet accelerate by %.1e m/s² (1e-11), task "
      "%.1e m/s², beyond limits %.1e (1e-9), strongest torque %.3f of its limit\n",
      aba_off, foot, task, beyond, strongest);
  EXPECT_LE(aba_off, 1e-10);
  EXPECT_LE(foot, 1e-11);
  EXPECT_LE(beyond, 1e-9);
  EXPECT_GE(strongest, 0.99);
}

/// The rate of the centroidal momentum is what the contacts and gravity do; and the point where the
/// forces act is the zero moment point of the accelerations. Control: with g in place of g + z''.
TEST(WholeBody, MomentumAndZeroMomentPoint) {
  const auto m = four_legs();
  WholeBodyOptions o;
  o.contacts = feet();
  WholeBody control(m, o);
  Vec q, v;
  posture(*m, 0.3, q, v);
  for (const auto& j : joints(*m)) q[size_t(j.q)] = std::round(10 * q[size_t(j.q)]) / 10;
  mechanics::Workspace<double> w(*m);
  std::vector<mechanics::Transform<double>> pose(m->nodes().size());
  const auto foot_at = [&](size_t c) {
    mechanics::forward_kinematics<double>(*m, w, q, pose);
    const auto& b = m->body(o.contacts[c].body);
    const auto X = mechanics::body_pose<double>(*m, b, pose);
    return X.R * o.contacts[c].position + X.r;
  };
  q[2] -= foot_at(0).z;  // all feet are on the ground: the joints' angles of the legs are the same
  control.update(q, v);
  const Vec rate{1, -2, 0.5, 40 * 0.4, 40 * -0.3, 40 * 0.6};
  const std::vector<TaskLevel> tasks{control.momentum(rate), control.small_forces()};
  const auto& s = control.solve(tasks);
  ASSERT_TRUE(s.possible) << s.why;
  EXPECT_TRUE(s.tasks[0].met);
  const auto com = mechanics::centre_of_mass<double>(*m, w, q);
  mechanics::Vec3d force{0, 0, -40 * g}, moment{0, 0, 0};
  double px = 0, py = 0, fz = 0;
  for (size_t c = 0; c < 4; ++c) {
    const mechanics::Vec3d f{s.forces[3 * c], s.forces[3 * c + 1], s.forces[3 * c + 2]};
    const auto r = foot_at(c);
    EXPECT_NEAR(r.z, 0, 1e-15);
    force += f;
    moment += mechanics::cross(r - com, f);
    px += r.x * f.z;
    py += r.y * f.z;
    fz += f.z;
  }
  double worst = 0;
  for (int k = 0; k < 3; ++k)
    worst = std::max(
        {worst, std::fabs(moment[k] - rate[size_t(k)]), std::fabs(force[k] - rate[size_t(3 + k)])});
  const auto p = zero_moment_point(40, g, com, {0.4, -0.3, 0.6}, {1, -2, 0.5});
  const auto plain = zero_moment_point(40, g, com, {0.4, -0.3, 0}, {1, -2, 0.5});
  std::printf(
      "  momentum's rate off by %.1e (bound 1e-11), zero moment point by %.1e m (1e-12), with g "
      "alone by %.1e m\n",
      worst, std::hypot(p.x - px / fz, p.y - py / fz),
      std::hypot(plain.x - px / fz, plain.y - py / fz));
  EXPECT_LE(worst, 1e-11);
  EXPECT_NEAR(p.x, px / fz, 1e-12);
  EXPECT_NEAR(p.y, py / fz, 1e-12);
  EXPECT_GE(std::hypot(plain.x - px / fz, plain.y - py / fz), 1e-3);
  const auto known = zero_moment_point(50, g, {0, 0, 0.8}, {0.7, -0.4, 0.3}, {3, -2, 1});
  EXPECT_NEAR(known.x, -0.051434224, 1e-9);
  EXPECT_NEAR(known.y, 0.037586548, 1e-9);
  EXPECT_THROW((void)zero_moment_point(50, g, {0, 0, 1}, {0, 0, -10}, {0, 0, 0}), InvalidArgument);
}

/// Limits of rate and position over the next period are kept; one that would need more than the
/// torque allows is told.
TEST(WholeBody, RatesAndPositions) {
  const auto m = four_legs();
  WholeBodyOptions o;
  o.contacts = feet();
  JointLimit l;
  l.joint = "leg0_2";
  l.rate = 0.4;
  l.upper = 0.6;
  o.limits = {l};
  o.period = 0.01;
  WholeBody control(m, o);
  Vec q, v;
  posture(*m, 0, q, v);
  const auto all = joints(*m);
  const auto& joint = find_named(all, "leg0_2", "no joint",
                                 [](const auto& j) -> const std::string& { return j.joint; });
  Vec wanted(30, NAN);
  wanted[size_t(joint.v)] = 1000;
  const auto next = [&](double at, double rate) {
    q[size_t(joint.q)] = at;
    v[size_t(joint.v)] = rate;
    control.update(q, v);
    const std::vector<TaskLevel> tasks{control.joints(wanted)};
    const auto& s = control.solve(tasks);
    EXPECT_TRUE(s.possible) << s.why;
    return s.v_dot[size_t(joint.v)];
  };
  EXPECT_NEAR(next(0.5, 0.1), (0.4 - 0.1) / 0.01, 1e-9);              // the rate's limit
  EXPECT_NEAR(next(0.599, 0.1), (0.6 - 0.599 - 0.001) / 5e-5, 1e-9);  // the position's
  o.limits[0].torque = 5;
  o.limits[0].rate = HUGE_VAL;
  for (const auto& j : all) {
    if (j.joint == "leg0_2") continue;
    o.limits.emplace_back();
    o.limits.back().joint = j.joint;
    o.limits.back().torque = 60;
  }
  o.period = 1e-3;
  WholeBody weak(m, o);
  q[size_t(joint.q)] = 0.7;  // back within a period: 2e5 rad/s²
  weak.update(q, v);
  const auto& s = weak.solve({});
  ASSERT_TRUE(s.possible) << s.why;
  std::printf("  %.0f of 202000 rad/s2 with these torques\n", -s.v_dot[size_t(joint.v)]);
  ASSERT_EQ(s.exceeded.size(), 1u);
  EXPECT_EQ(s.exceeded[0], "position of 'leg0_2'");
  EXPECT_LE(std::fabs(s.tau[size_t(joint.v)]), 5 + 1e-9);
}

/// ETS-VII's arm on the ground: a null-space torque does not reach the task. Control: by
/// Moore-Penrose's projector it does.
TEST(OperationalSpace, NullSpaceTorqueIsNotFelt) {
  mechanics::UrdfOptions options;
  options.accept_unphysical_inertia = true;
  const auto file = PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf";
  const auto m = mechanics::read_urdf(file, options).mechanism;
  ASSERT_EQ(m.nv(), 6);
  const Vec q{0.3, -0.6, 1.1, -0.4, 0.9, 0.2}, v{0.5, -0.7, 1, 0.8, -0.6, 1};
  mechanics::Workspace<double> w(m);
  Vec M(36), b(6), J(36), rows, v_dot(6), tau(6);
  mechanics::crba<double>(m, w, q, M);
  mechanics::rnea<double>(m, w, q, v, {}, {}, b);
  const auto& hand = m.bodies().back();
  mechanics::jacobian<double>(m, w, q, hand, mechanics::JacobianAxes::world, J);
  for (size_t r = 3; r < 6; ++r)
    for (size_t c = 0; c < 6; ++c) rows.push_back(J[6 * c + r]);
  const Eigen::Map<const Eigen::Matrix<double, 3, 6, Eigen::RowMajor>> Jt(rows.data());
  const Eigen::Map<const Eigen::Matrix<double, 6, 6>> Mm(M.data());
  const Vec drift{0.1, 0.2, -0.3}, wanted{0.5, -0.2, 0.4}, tau0{3, -5, 2, 4, -1, 6};
  const auto task = [&](const Vec& t) {
    const Eigen::Map<const Eigen::VectorXd> tt(t.data(), 6), bb(b.data(), 6);
    return Eigen::Vector3d(Jt * Mm.lu().solve(tt - bb));
  };
  operational_space_torque(M, b, rows, drift, wanted, {}, tau);
  const Eigen::Vector3d alone = task(tau);
  double off = 0;
  for (long i = 0; i < 3; ++i)
    off = std::max(off, std::fabs(alone[i] + drift[size_t(i)] - wanted[size_t(i)]));
  operational_space_torque(M, b, rows, drift, wanted, tau0, tau);
  const double leak = (task(tau) - alone).norm();
  const Eigen::Map<const Eigen::VectorXd> t0(tau0.data(), 6);
  const Eigen::MatrixXd pinv = Jt.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXd plain = t0 - Jt.transpose() * (pinv.transpose() * t0);
  const double felt = (Jt * Mm.lu().solve(plain)).norm(), whole = (Jt * Mm.lu().solve(t0)).norm();
  std::printf(
      "  task off by %.1e m/s², leak %.1e (bounds 1e-12), Moore-Penrose lets through %.2f\n", off,
      leak, felt / whole);
  EXPECT_LE(off, 1e-12);
  EXPECT_LE(leak, 1e-12);
  EXPECT_GE(felt, 0.1 * whole);
  EXPECT_THROW(operational_space_torque(M, b, Vec(12, 1.0), Vec(2, 0.0), Vec(2, 0.0), {}, tau),
               InvalidArgument);
}

TEST(WholeBody, RefusesWrongInput) {
  const auto m = four_legs();
  const auto refuses = [&](auto change, const std::string& said) {
    WholeBodyOptions o;
    o.contacts = feet();
    o.limits.resize(1);
    o.limits[0].joint = "leg0_2";
    change(o);
    try {
      WholeBody control(m, o);
      ADD_FAILURE() << said;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
    }
  };
  refuses([](auto& o) { o.contacts[1].name = "foot0"; }, "foot0");
  refuses([](auto& o) { o.contacts[1].body = "tail"; }, "tail");
  refuses([](auto& o) { o.contacts[1].normal = {0, 0, 0}; }, "foot1");
  refuses([](auto& o) { o.contacts[1].friction = -1; }, "foot1");
  refuses([](auto& o) { o.limits[0].joint = "base"; }, "base");
  refuses([](auto& o) { o.limits.push_back(o.limits[0]); }, "twice");
  refuses(
      [](auto& o) {
        o.limits[0].lower = 1;
        o.limits[0].upper = 0;
      },
      "leg0_2");
  refuses([](auto& o) { o.period = 0; }, "period");
}

/// Prints times; asserts none. 30 freedoms, 4 contacts, all limits, three levels of tasks.
TEST(WholeBody, Time) {
  const auto m = four_legs();
  WholeBodyOptions o;
  o.contacts = feet();
  for (const auto& j : joints(*m)) {
    JointLimit l;
    l.joint = j.joint;
    l.torque = 60;
    l.rate = 10;
    l.lower = -3;
    l.upper = 3;
    o.limits.push_back(l);
  }
  WholeBody control(m, o);
  Vec q, v;
  posture(*m, 0.1, q, v);
  double least[2] = {HUGE_VAL, HUGE_VAL}, update = HUGE_VAL;
  int active[2] = {0, 0};
  for (int k = 0; k < 400; ++k) {
    const auto start = std::chrono::steady_clock::now();
    const auto us = [&] {
      return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
          .count();
    };
    control.update(q, v);
    update = std::min(update, us());
    const double push = k % 2 ? 12 : 0.5;  // beyond friction: limits are active
    const std::vector<TaskLevel> tasks{
        control.centre_of_mass(Vec{push, 0.1, 0.2}),
        control.frame("trunk", {0, 0, 0}, Vec{0, 0, 0, NAN, NAN, NAN}),
        control.joints(Vec(30, 0.0))};
    const auto& s = control.solve(tasks);
    least[k % 2] = std::min(least[k % 2], us());
    ASSERT_TRUE(s.possible) << s.why;
    active[k % 2] = !s.tasks[0].met;
  }
  std::printf(
      "  %d unknowns: %.0f us within limits, %.0f us at the friction's limit; update alone %.0f\n",
      control.unknowns(), least[0], least[1], update);
  EXPECT_EQ(active[0], 0);
  EXPECT_EQ(active[1], 1);
}

}  // namespace
}  // namespace porthos::planning::whole_body_test
