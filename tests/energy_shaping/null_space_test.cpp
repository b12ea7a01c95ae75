// Postures in the null space of a task: leakage by the inverse that is used, the tank's bounds, the
// energy of the loop.
#include "energy_shaping/laws/null_space.h"

#include <random>

#include "mechanics/kinematics.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/check.h"
#include "phs/system/random_state.h"
#include "tests/energy_shaping/robots.h"
#include "tests/support/reference.h"

namespace porthos::energy_shaping::null_space_test {
namespace {

using mechanics::Vec3d;
using test::breaks, test::keeps, test::refusal, test::Vec;

const Vec bent{0.3, -0.5, 0.4, -0.8, 0.2, 0.7, 0.1};

/// The last link's origin is to stay where `q` puts it; attitude too if asked.
PotentialShaping hold_hand(const test::ModelPtr& m, const std::string& link, const Vec& q,
                           bool attitude = false) {
  mechanics::Workspace<double> w(m->mechanism());
  std::vector<mechanics::Transform<double>> poses(m->mechanism().nodes().size());
  mechanics::forward_kinematics<double>(m->mechanism(), w, q, poses);
  const auto X = mechanics::body_pose<double>(m->mechanism(), m->mechanism().body(link), poses);
  PotentialShaping s;
  s.name = "hand";
  s.poses = {PoseSpring{link, {0, 0, 0}, 300, X.r, {0, 0, 0}, X.R}};
  if (attitude) s.poses[0].attitude_stiffness = {20, 25, 30};
  for (const auto& c : m->mechanism().coordinates())
    s.damping.push_back({c.joint + ".torque", {4}});
  s.rest = q;
  return s;
}

/// Task acceleration by a posture's force projected by another inverse, Moore and Penrose's, over
/// that not projected.
double leak_of_moore_penrose(const NullSpaceLoop& loop, const Vec& q, const Vec& tau) {
  const auto& m = loop.task().mechanical().mechanism();
  const size_t n = q.size(), r = loop.rows().size();
  mechanics::Workspace<double> w(m);
  Vec all(6 * n), S(r * r), b(r);
  mechanics::jacobian<double>(m, w, q, loop.task().parts().poses[0].frame,
                              mechanics::JacobianAxes::body, all);
  const auto J = [&](size_t i, size_t j) { return all[6 * j + size_t(loop.rows()[i])]; };
  for (size_t i = 0; i < r; ++i)
    for (size_t j = 0; j < n; ++j) {
      b[i] += J(i, j) * tau[j];
      for (size_t k = 0; k < r; ++k) S[i * r + k] += J(i, j) * J(k, j);
    }
  const auto f = phs::linear_solve(r, S, b);
  Vec left = tau;
  for (size_t j = 0; j < n; ++j)
    for (size_t i = 0; i < r; ++i) left[j] -= J(i, j) * f[i];
  double a = 0, free = 0;
  for (const double x : loop.task_acceleration(q, left)) a = std::hypot(a, x);
  for (const double x : loop.task_acceleration(q, tau)) free = std::hypot(free, x);
  return a / free;
}

void leakage(const test::ModelPtr& m, const std::string& link) {
  for (const bool attitude : {false, true}) {
    Vec other = bent;
    for (double& x : other) x += 0.2;
    const NullSpaceLoop loop(m, hold_hand(m, link, bent, attitude), {{8}, other});
    keeps(attitude ? "pose of the hand: leakage, 200 coordinates"
                   : "place of the hand: leakage, 200 coordinates",
          loop.certificate().item("leakage into the task").value, 1e-11);
    std::mt19937_64 generator(7);
    double sum = 0, own = 0;
    for (int i = 0; i < 50; ++i) {
      const auto x = phs::random_state(m->description(), 0.5, generator);
      const auto tau = phs::random_state(m->description(), 1, generator);
      const Vec q(x.begin(), x.begin() + 7), t(tau.begin(), tau.begin() + 7);
      sum += leak_of_moore_penrose(loop, q, t) / 50;
      double a = 0, b = 0;
      for (const double y : loop.task_acceleration(q, loop.projected(q, t))) a = std::hypot(a, y);
      for (const double y : loop.task_acceleration(q, t)) b = std::hypot(b, y);
      own += a / b / 50;
    }
    keeps("  mean", own, 1e-13);
    breaks("  mean with Moore and Penrose's inverse", sum, 0.01);
  }
}
TEST(NullSpace, OnlyTheInertiaWeightedInverseDoesNotLeak) { leakage(test::arm(7), "link_6"); }
TEST(NullSpace, LeakageOfTheSevenJointArm) {
  const auto file = test::data_file("reference/pinocchio/urdf/panda7.urdf");
  mechanics::UrdfOptions o;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  const auto urdf = mechanics::read_urdf(file.string(), o);
  const auto m = std::make_shared<const mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(urdf.mechanism));
  leakage(m, "panda_link7");
}

NullSpacePosture elsewhere(double level = 4, double fill = 0.5) {
  return {{8}, {1, -1, 0.9, -0.2, 0.8, 0.1, -0.5}, level, 0.1, 8, fill};
}
double hand_off(const NullSpaceLoop& loop, const Vec& x) {
  const auto& m = loop.task().mechanical().mechanism();
  mechanics::Workspace<double> w(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  mechanics::forward_kinematics<double>(m, w, std::span(x).first(7), poses);
  const auto& pose = loop.task().parts().poses[0];
  return norm(mechanics::body_pose<double>(m, pose.frame, poses).r - pose.spring.position);
}

TEST(NullSpace, ThePostureSettlesAndTheHandStays) {
  const auto m = test::arm(7);
  const auto task = hold_hand(m, "link_6", bent);
  const NullSpaceLoop loop(m, task, elsewhere());
  std::printf("%s", loop.certificate().text().c_str());
  const auto report = phs::check(loop, {.spread = 0.3, .tolerance = 1e-9});
  EXPECT_TRUE(report.holds()) << report.text();
  // The plant under the law moves as the loop.
  const auto own = loop.loop<double>();
  const auto plant = m->instantiate<double>();
  std::mt19937_64 generator(4);
  Vec u(7), f(15), g(14);
  double off = 0;
  for (int i = 0; i < 50; ++i) {
    auto x = phs::random_state(loop.description(), 0.4, generator);
    x[14] = 0.1 + 1.9 * std::fabs(x[14]) / (1 + std::fabs(x[14]));
    own->law(0.0, x, u);
    own->field(0.0, x, {}, f);
    plant->field(0.0, std::span<const double>(x).first(14), u, g);
    double size = 0, most = 0;
    for (size_t k = 0; k < 14; ++k) {
      size = std::max(size, std::fabs(g[k]));
      most = std::max(most, std::fabs(f[k] - g[k]));
    }
    off = std::max(off, most / size);
  }
  keeps("plant under the law against the target", off, 1e-12);

  struct Outcome {
    double hand = 0, settled = 0, low = HUGE_VAL, high = 0, rise = 0, defect = 0;
  };
  const auto run = [&](const NullSpaceLoop& l, const std::string& method, double duration) {
    const auto integrator = integrators::make_integrator(method, l, 0.01);
    Vec x0 = m->state(bent, Vec(7, 0.0));
    x0.push_back(l.posture().level);
    phs::State s(l.description(), x0);
    const auto system = l.instantiate<double>();
    double before = system->hamiltonian(s.x);
    Outcome o;
    for (int i = 0; i < std::lround(duration / 0.01); ++i) {
      if (integrator->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
      const double now = system->hamiltonian(s.x);
      double lost = 0;
      for (const double w : integrator->port_work()) lost += w;
      o.rise = std::max(o.rise, now - before);
      o.defect = std::max(o.defect, std::fabs(now - before + lost));
      before = now;
      o.low = std::min(o.low, s.x[14]);
      o.high = std::max(o.high, s.x[14]);
    }
    for (size_t k = 0; k < 7; ++k) o.settled = std::max(o.settled, std::fabs(s.x[k] - l.rest()[k]));
    o.hand = hand_off(l, s.x);
    return o;
  };
  const auto o = run(loop, "gonzalez", 30);
  keeps("distance from the settled posture after 30 s [rad]", o.settled, 1e-3);
  std::printf("  tank from %.3f to %.3f J\n", o.low, o.high);
  keeps("the hand, off at the end [m]", o.hand, 1e-4);
  keeps("rise of H_d in a step [J]", o.rise, 1e-12);
  keeps("tank, below its lower bound [J]", loop.posture().least - o.low, 0);
  keeps("tank, above its upper bound [J]", o.high - loop.posture().most, 0);
  // A tank that starts full spills, one that starts empty and is not filled lets the posture pull
  // at the hand.
  const auto full = run(NullSpaceLoop(m, task, elsewhere(8, 1)), "gonzalez", 10);
  keeps("full tank: above its upper bound [J]", full.high - 8, 0);
  keeps("full tank: rise of H_d in a step [J]", full.rise, 1e-12);
  const auto empty = run(NullSpaceLoop(m, task, elsewhere(0.11, 0)), "gonzalez", 10);
  std::printf("  empty tank: level %.4f to %.4f J\n", empty.low, empty.high);
  keeps("empty tank: below its lower bound [J]", 0.1 - empty.low, 0);
  keeps("empty tank: rise of H_d in a step [J]", empty.rise, 1e-12);
  breaks("empty tank: the hand, off at the end [m]", empty.hand, 0.01);
}

TEST(NullSpace, RefusesWithTheReason) {
  const auto m = test::arm(7);
  const auto task = hold_hand(m, "link_6", bent);
  auto two = task, springs = task;
  two.poses.push_back(two.poses[0]);
  springs.joints = {{"joint_0.torque", 1, 0}};
  const Vec three{0.1, 0.2, 0.3};
  const auto small = test::arm(3);
  const std::pair<std::string, std::string> cases[] = {
      {refusal([&] { NullSpaceLoop(m, two, elsewhere()); }), "expected one pose alone"},
      {refusal([&] { NullSpaceLoop(m, springs, elsewhere()); }), "expected one pose alone"},
      {refusal([&] { NullSpaceLoop(m, task, elsewhere(9)); }), "least <= level <= most"},
      {refusal([&] { NullSpaceLoop(m, task, elsewhere(1, 2)); }), "a share in [0, 1]"},
      {refusal([&] {
         NullSpaceLoop(small, hold_hand(small, "link_2", three), {{8}, three});
       }),
       "leaves no degree of freedom"}};
  for (const auto& [got, expected] : cases) {
    std::printf("  %s\n", got.c_str());
    EXPECT_NE(got.find(expected), std::string::npos) << got;
  }
}

}  // namespace
}  // namespace porthos::energy_shaping::null_space_test
