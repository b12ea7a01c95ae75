// Potential shaping and damping injection, in joints, in the world, on SO(3), with a floating base;
// tracking.
#include <random>

#include "energy_shaping/laws/tracking.h"
#include "energy_shaping/loop/derivatives.h"
#include "mechanics/kinematics.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/check.h"
#include "phs/system/random_state.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::fully_actuated_test {
namespace {

using mechanics::Vec3d;
using test::breaks, test::keeps, test::refusal, test::Vec;

PotentialShaping joint_springs(const test::ModelPtr& m, double k, double d, Vec rest) {
  PotentialShaping s;
  for (const auto& c : m->mechanism().coordinates())
    if (c.nq == 1 && c.node >= 0) {
      if (c.joint.rfind("wheel", 0) == 0) continue;
      s.joints.push_back({c.joint + ".torque", k, rest[size_t(c.q)]});
      s.damping.push_back({c.joint + ".torque", {d}});
    }
  s.rest = std::move(rest);
  return s;
}

/// The greatest relative difference between the plant under the law and the target; p scaled by
/// `momentum`.
double law_against_target(const ClosedLoop& loop, double momentum = 1) {
  const auto target = loop.loop<double>();
  const auto plant = loop.plant().instantiate<double>();
  std::mt19937_64 generator(5);
  double worst = 0;
  const size_t nx = size_t(loop.description().nx);
  Vec u(size_t(loop.plant().description().nu)), a(nx), b(nx);
  for (int i = 0; i < 100; ++i) {
    auto x = phs::random_state(loop.description(), 0.7, generator);
    for (size_t k = nx / 2; k < nx; ++k) x[k] *= momentum;
    target->law(0.0, x, u);
    plant->field(0.0, x, u, a);
    target->field(0.0, x, {}, b);
    double size = 0, difference = 0;
    for (size_t k = 0; k < nx; ++k) {
      size = std::max({size, std::fabs(a[k]), std::fabs(b[k])});
      difference = std::max(difference, std::fabs(a[k] - b[k]));
    }
    worst = std::max(worst, difference / size);
  }
  return worst;
}

double rightmost(const ClosedLoop& loop) {
  return phs::eigenvalues(loop.rest().size(), field_jacobian(loop, loop.rest())).back().real();
}

TEST(FullyActuated, RegulationInJointSpace) {
  const auto model = test::arm(4, 0.1);
  const PotentialLoop loop(model, joint_springs(model, 60, 15, {0.4, -0.5, 0.8, 0.3}));
  const auto report = phs::check(loop, {.tolerance = 1e-10});
  EXPECT_TRUE(report.holds()) << report.text();
  keeps("plant under the law against the target", law_against_target(loop), 1e-12);
  EXPECT_LT(rightmost(loop), -0.1);
  const Vec x0 = model->state(Vec{0, 0, 0, 0}, Vec{1, -1, 2, 0});
  const auto run = simulate(loop, x0, {.duration = 20, .step = 0.0005, .record = 1});
  double off = 0;
  for (size_t i = 0; i < 8; ++i) off = std::max(off, std::fabs(run.x.back()[i] - loop.rest()[i]));
  keeps("distance from rest after 20 s", off, 1e-6);
  keeps("rise of H_d in a step [J]", run.rise, 1e-12);
  keeps("H_d balance [J]", std::fabs(run.injected), 1e-5);
}

// The law as met in textbooks: the gradient with the wrong sign, and the plant's damping subtracted
// once more.
TEST(Negative, TextbookLawMakesASaddle) {
  const auto model = test::arm(1, 0.5, 0);
  const double k = 3, kd = 2, d = 0.5;
  const PotentialLoop loop(model, joint_springs(model, k, kd, {0.0}));
  const auto s = model->instantiate<double>();
  const auto rightmost_of = [&](double sign, double twice) {
    Vec J(4), f0(2), f1(2);
    for (size_t j = 0; j < 2; ++j) {
      Vec x(2, 0.0);
      x[j] = 1e-6;
      const double rate = model->rates(x)[0];
      s->field(0.0, x, Vec{-sign * k * x[0] - kd * rate - twice * d * rate}, f1);
      for (size_t i = 0; i < 2; ++i) J[i * 2 + j] = f1[i] / 1e-6;
    }
    return phs::eigenvalues(2, J).back().real();
  };
  keeps("right law: rightmost eigenvalue", rightmost_of(1, 0), -0.1);
  keeps("and that of the loop object", rightmost(loop), -0.1);
  breaks("textbook law: rightmost eigenvalue", rightmost_of(-1, 1), 0.1);
}

TEST(FullyActuated, ConstantCompensationNeedsStiffness) {
  const auto model = test::arm(2);
  const auto with = [&](double k) {
    auto s = joint_springs(model, k, 5, {-1.57, 0.1});  // arm up
    s.compensate = false;
    s.constant_compensation = true;
    return s;
  };
  const PotentialLoop stiff(model, with(60));
  EXPECT_LT(rightmost(stiff), 0);
  keeps("plant under the law against the target", law_against_target(stiff), 1e-12);
  const auto why = refusal([&] { PotentialLoop(model, with(5)); });
  EXPECT_NE(why.find("Hessian of V_d >= 0 fails"), std::string::npos) << why;
  EXPECT_NE(why.find("raise the stiffness at 'joint_"), std::string::npos) << why;

  // Where both are too soft, neither helps alone, and the two that are named do.
  const auto soft = [&](double first, double second) {
    auto s = with(0.1);
    s.joints[0].stiffness = first;
    s.joints[1].stiffness = second;
    return s;
  };
  const auto both = refusal([&] { PotentialLoop(model, soft(0.1, 0.1)); });
  EXPECT_NE(both.find("raise the stiffness at all of 'joint_"), std::string::npos) << both;
  EXPECT_THROW(PotentialLoop(model, soft(1e3, 0.1)), InvalidArgument);
  EXPECT_THROW(PotentialLoop(model, soft(0.1, 1e3)), InvalidArgument);
  EXPECT_NO_THROW(PotentialLoop(model, soft(60, 60)));
}

/// Two links in a vertical plane of which only the first is driven: each refusal names what helps,
/// and with it the loop is certified.
TEST(FullyActuated, AHangingJointWithoutActuatorIsHelped) {
  mechanics::MechanismBuilder b("plane");
  b.gravity({0, 0, -9.81});
  for (const char* name : {"upper", "lower"}) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = name[0] == 'u' ? "world" : "upper";
    s.joint.name = std::string(name) + "_joint";
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.placement.r = {name[0] == 'u' ? 0.0 : 0.4, 0, 0};
    s.mass.mass = 1;
    s.mass.com = {0.2, 0, 0};
    s.mass.inertia = {1e-3, 0, 0, 0.02, 0, 0.02};
    b.add(s);
  }
  const auto model = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
  const auto why = [&](double lower, bool compensate, bool constant, double k = 20) {
    PotentialShaping s;
    s.rest = {0.3, lower - 0.3};
    s.joints = {{"upper_joint.torque", k, 0.3}};
    s.damping = {{"upper_joint.torque", {3}}};
    s.actuators = {"upper_joint.torque"};
    s.compensate = compensate;
    s.constant_compensation = constant;
    return refusal([&] { PotentialLoop(model, s); });
  };
  const double hangs = std::acos(0.0);
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), text.npos) << text;
  };
  EXPECT_EQ(why(hangs, false, true), "");
  says(why(hangs, true, false),
       "joint 'lower_joint' needs a force no actuator provides: drive it, or keep the model's "
       "gravity");
  says(why(hangs, true, false), "constant_compensation = true");
  says(why(hangs, false, false), "rest point fails");
  says(why(hangs, false, false), "constant_compensation = true");
  // Where a constant cannot hold it, leaning or upright, the rest comes first in each way.
  says(why(0.2, false, true),
       "choose a rest at which it hangs (that of a scene's joint is its start unless it is named");
  for (const double lower : {0.2, -hangs})
    says(why(lower, true, false), "no actuator provides: choose a rest at which it hangs, with");
  says(why(0.2, false, false), "without actuator there: choose a rest at which it hangs, with");
  says(why(-hangs, false, true), "'lower_joint' stands up there and nothing drives it");
}

TEST(FullyActuated, TaskSpaceOfARedundantArm) {
  const auto model = test::arm(5, 0.05);
  auto s = joint_springs(model, 0.5, 2, {0.3, -0.6, 0.5, 0.4, -0.3});
  // The posture is stiff a little, the hand much: rest where both agree.
  mechanics::Workspace<double> w(model->mechanism());
  std::vector<mechanics::Transform<double>> poses(model->mechanism().nodes().size());
  mechanics::forward_kinematics<double>(model->mechanism(), w, s.rest, poses);
  const auto& hand = model->mechanism().body("link_4");
  const auto X = mechanics::body_pose<double>(model->mechanism(), hand, poses) *
                 mechanics::Pose{mechanics::Mat3<double>::identity(), {0.4, 0, 0}};
  s.poses.push_back({"link_4", {0.4, 0, 0}, 80, X.r, {3, 2, 4}, X.R});
  const PotentialLoop loop(model, s);
  const auto report = phs::check(loop, {.tolerance = 1e-9});
  EXPECT_TRUE(report.holds()) << report.text();
  keeps("plant under the law against the target", law_against_target(loop), 1e-12);
  EXPECT_LT(rightmost(loop), 0);
  const auto run = simulate(loop, model->state(Vec(5, 0.0), Vec(5, 0.0)), {.duration = 15});
  keeps("H_d left after 15 s, relative", run.H.back() / run.H.front(), 1e-4);
  keeps("rise of H_d in a step [J]", run.rise, 1e-12);
}

PotentialShaping attitude_spring(Vec3d a, double kw, double k = 0, double kv = 0) {
  PotentialShaping s;
  PoseSpring p{"base", {0, 0, 0}, k, {0, 0, 0}, a};
  s.poses = {p};
  s.damping = {{"base.wrench", {kw, kw, kw, kv, kv, kv}}};
  s.rest = {0, 0, 0, 1, 0, 0, 0};
  return s;
}
Vec turned(const test::ModelPtr& m, double angle, Vec3d axis, double sign = 1) {
  const double s = std::sin(angle / 2) / norm(axis);
  Vec q{
      0, 0, 0, sign * std::cos(angle / 2), sign * s * axis.x, sign * s * axis.y, sign * s * axis.z};
  return m->state(q, Vec(6, 0.0));
}

TEST(Attitude, TracePotential) {
  const auto m = test::free_body();
  const PotentialLoop loop(m, attitude_spring({1, 1.5, 2}, 2));
  const auto report = phs::check(loop, {.tolerance = 1e-10});
  EXPECT_TRUE(report.holds()) << report.text();
  keeps("plant under the law against the target", law_against_target(loop), 1e-12);
  const auto s = loop.instantiate<double>();
  const double pi = std::acos(-1.0);
  const std::pair<Vec3d, double> half_turns[] = {{{1, 0, 0}, 7}, {{0, 1, 0}, 6}, {{0, 0, 1}, 5}};
  Vec e(14);
  for (const auto& [axis, U] : half_turns) {
    const Vec x = turned(m, pi, axis);
    s->gradient(x, e);
    double slope = 0;
    for (const double y : e) slope = std::max(slope, std::fabs(y));
    keeps("slope at a half turn", slope, 1e-14);
    keeps("2 (a_j + a_k) there", std::fabs(s->hamiltonian(x) - U), 1e-14);
    breaks("a half turn is unstable: rightmost eigenvalue",
           phs::eigenvalues(14, field_jacobian(loop, x)).back().real(), 0.05);
  }
}

TEST(Attitude, NoUnwinding) {  // q and -q: the same attitude, the same motion, from 3 rad on
  const auto m = test::free_body();
  const PotentialLoop loop(m, attitude_spring({1, 1.5, 2}, 2));
  const auto a = simulate(loop, turned(m, 3, {1, 2, -1}), {.duration = 60, .step = 0.02});
  const auto b = simulate(loop, turned(m, 3, {1, 2, -1}, -1), {.duration = 60, .step = 0.02});
  double difference = 0;
  for (size_t k = 0; k < a.x.size(); ++k) {
    for (size_t i = 3; i < 7; ++i)
      difference = std::max(difference, std::fabs(a.x[k][i] + b.x[k][i]));
    difference = std::max(difference, std::fabs(a.H[k] - b.H[k]));
  }
  keeps("difference between the runs from q and -q", difference, 0);
  keeps("H_d after 60 s", a.H.back(), 1e-6);
}

TEST(Attitude, PoseWithThrusters) {
  const auto m = test::free_body();
  const PotentialLoop loop(m, attitude_spring({1, 1.5, 2}, 3, 4, 6));
  Vec x0 = turned(m, 2, {0.3, 1, 1});
  x0[0] = 1;
  x0[1] = -2;
  x0[2] = 0.5;
  const auto run = simulate(loop, x0, {.duration = 40, .step = 0.02});
  keeps("H_d after 40 s, relative", run.H.back() / run.H.front(), 1e-5);
  keeps("rise of H_d in a step [J]", run.rise, 1e-12);
}

TEST(FloatingBase, JointRegulationKeepsMomentum) {
  const auto m = test::ets_vii_model(false);
  Vec rest = m->mechanism().neutral();
  const double target[] = {0.5, -0.4, 0.9, 0.3, -0.6, 0.2};
  std::copy(target, target + 6, rest.end() - 6);
  auto s = joint_springs(m, 20, 60, rest);
  for (const auto& d : s.damping) s.actuators.push_back(d.port);
  const PotentialLoop loop(m, s);
  const auto report = phs::check(loop, {.tolerance = 1e-9});
  EXPECT_TRUE(report.holds()) << report.text();
  Vec q = m->mechanism().neutral(), v(12, 0.0);
  v[0] = 0.01;
  v[4] = 0.02;  // the base moves: its momentum is to stay
  const auto run = simulate(loop, m->state(q, v), {.duration = 100, .step = 0.02, .record = 1});
  double off = 0;
  for (size_t i = 7; i < 13; ++i) off = std::max(off, std::fabs(run.x.back()[i] - rest[i]));
  keeps("joints off after 100 s [rad]", off, 1e-3);
  keeps("total momentum, relative change", test::momentum_change(*m, run.x), 1e-13);
  keeps("rise of H_d in a step [J]", run.rise, 1e-11);
}

TEST(FloatingBase, AttitudeByWheelsAndArm) {
  const auto m = test::ets_vii_model(true);
  const size_t nq = size_t(m->mechanism().nq());
  Vec rest = m->mechanism().neutral();
  auto s = joint_springs(m, 20, 60, rest);
  s.poses = {PoseSpring{"base", {0, 0, 0}, 0, {0, 0, 0}, {3050, 9550, 50}}};  // about 0.01 rad/s
  for (auto& j : s.joints) j.stiffness = 200;
  for (const char* w : {"wheel_x.torque", "wheel_y.torque", "wheel_z.torque"})
    s.damping.push_back({w, {0.008}});
  s.zero_momentum = true;
  for (const auto& d : s.damping) s.actuators.push_back(d.port);
  const PotentialLoop loop(m, s);
  keeps(
      "on momentum zero: plant under the law against the target",
      [&] {
        const auto target = loop.loop<double>();
        const auto plant = m->instantiate<double>();
        std::mt19937_64 generator(2);
        double worst = 0;
        Vec u(size_t(m->mechanism().nv())), a(2 * nq), b(2 * nq);
        for (int i = 0; i < 100; ++i) {
          auto x = phs::random_state(m->description(), 0.5, generator);
          for (size_t k = 0; k < 7; ++k) x[nq + k] = 0;
          target->law(0.0, x, u);
          plant->field(0.0, x, u, a);
          target->field(0.0, x, {}, b);
          double size = 0, difference = 0;
          for (size_t k = 0; k < 2 * nq; ++k) {
            size = std::max(size, std::fabs(a[k]));
            difference = std::max(difference, std::fabs(a[k] - b[k]));
          }
          worst = std::max(worst, difference / size);
        }
        return worst;
      }(),
      1e-12);
  // A wheel that is not driven cannot make its part of the base's torque.
  auto undriven = s;
  std::erase(undriven.actuators, "wheel_z.torque");
  std::erase_if(undriven.damping, [](const auto& d) { return d.port == "wheel_z.torque"; });
  EXPECT_NE(refusal([&] {
              PotentialLoop(m, undriven);
            }).find("joint 'wheel_z' needs a force no actuator provides: drive it"),
            std::string::npos)
      << refusal([&] { PotentialLoop(m, undriven); });
  Vec q = m->mechanism().neutral();
  q[3] = std::cos(0.025);
  q[4] = 0.6 * std::sin(0.025);
  q[5] = 0.8 * std::sin(0.025);
  for (const auto& c : m->mechanism().coordinates())
    if (c.joint.rfind("joint_", 0) == 0) q[size_t(c.q)] = 0.3;
  const auto run = simulate(loop, m->state(q, Vec(size_t(m->mechanism().nv()), 0.0)),
                            {.duration = 1500, .step = 0.05, .record = 5});
  for (size_t k = 0; k < run.t.size(); k += 60)
    std::printf("  t = %6.0f s: H_d %.3e J, attitude off %.2e\n", run.t[k], run.H[k],
                2 * std::hypot(run.x[k][4], run.x[k][5], run.x[k][6]));
  keeps("total momentum, relative change", test::momentum_change(*m, run.x), 1e-13);
  keeps("rise of H_d in a step [J]", run.rise, 1e-11);
  keeps("H_d at the end, relative", run.H.back() / run.H.front(), 1e-2);
}

TEST(FullyActuated, RefusesWithTheReason) {
  const auto m = test::free_body();
  const auto a = test::arm(2);
  auto s = joint_springs(a, 10, 1, {0, 0});
  auto unknown = s, negative = s, unactuated = s, moved = s, thrust = attitude_spring({1, 1, 1}, 0);
  unknown.joints[0].port = "elbow.torque";
  negative.damping[0].damping = {-1};
  unactuated.actuators = {"joint_1.torque"};
  unactuated.damping.clear();
  moved.rest = {0.1, 0};
  thrust.damping.clear();
  thrust.zero_momentum = true;
  thrust.rest = {1, 0};
  const std::pair<std::string, std::string> cases[] = {
      {refusal([&] { PotentialLoop(a, unknown); }), "no port 'elbow.torque'"},
      {refusal([&] { PotentialLoop(a, negative); }), "damping of 'joint_0.torque' is -1"},
      {refusal([&] { PotentialLoop(a, unactuated); }),
       "joint 'joint_0' needs a force no actuator provides: drive it, or keep the model's gravity"},
      {refusal([&] { PotentialLoop(a, moved); }), "rest point fails"},
      {refusal([&] { PotentialLoop(m, thrust); }), "rest has 2 entries, expected 7"}};
  for (const auto& [got, expected] : cases) {
    std::printf("  %s\n", got.c_str());
    EXPECT_NE(got.find(expected), std::string::npos) << got;
  }
}

TEST(Tracking, ErrorEnergyFallsByTheDampingAlone) {
  const auto model = test::arm(4, 0.2);
  const auto trajectory = sines({0.2, -0.3, 0.5, 0}, {0.8, 0.5, 0.6, 1}, {0.3, 0.5, 0.4, 0.7});
  PdPlus law(model, trajectory, {150, 150, 60, 30}, {60, 60, 20, 10});
  const auto plant = model->instantiate<double>();
  const auto ledger = [&](double extra, double& error) {
    Vec x = model->state(Vec{1, 0, 0, 0.5}, Vec{0, 1, 0, -1}), u(4), k[4], y(8);
    const double h = 5e-4;  // Runge-Kutta of order 4, ledger by Simpson's rule over pairs of steps
    double lost = 0, worst = 0, H0 = law.error_energy(0, x), P[3] = {law.error_power(0, x)};
    for (int i = 0; i < 20000; ++i) {
      const double t = i * h;
      const auto slope = [&](double at, const Vec& z, Vec& f) {
        f.resize(8);
        law.law(at, z, u);
        const Vec v = model->rates(z);
        for (size_t a = 0; a < 4; ++a) u[a] -= extra * v[a];
        plant->field(at, z, u, f);
      };
      slope(t, x, k[0]);
      for (int j = 1; j < 4; ++j) {
        const double c = j == 3 ? 1 : 0.5;
        for (size_t a = 0; a < 8; ++a) y[a] = x[a] + c * h * k[j - 1][a];
        slope(t + c * h, y, k[j]);
      }
      for (size_t a = 0; a < 8; ++a)
        x[a] += h / 6 * (k[0][a] + 2 * k[1][a] + 2 * k[2][a] + k[3][a]);
      P[1 + i % 2] = law.error_power(t + h, x);
      if (i % 2 == 0) continue;
      lost += h / 3 * (P[0] + 4 * P[1] + P[2]);
      P[0] = P[2];
      worst = std::max(worst, std::fabs(law.error_energy(t + h, x) - H0 + lost));
    }
    error = law.error(10, x);
    return worst / H0;
  };
  double error = 0;
  keeps("ledger of the error energy, relative", ledger(0, error), 1e-7);
  keeps("error after 10 s [rad]", error, 1e-4);
  breaks("with 0.01 N m s/rad of friction that the law does not know", ledger(0.01, error), 1e-5);
}

}  // namespace
}  // namespace porthos::energy_shaping::fully_actuated_test
