// Pose of a base by thrusters for its place and reaction wheels for its attitude.
#include "energy_shaping/laws/wheel_base.h"

#include "phs/network/network.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::wheel_base_test {
namespace {

using test::breaks, test::keeps, test::refusal, test::Vec;

/// A satellite with wheels on these axes, their inertia about the axis and across it.
test::ModelPtr satellite(const std::vector<mechanics::Vec3d>& axes, double lopsided = 0) {
  mechanics::MechanismBuilder b("satellite");
  mechanics::BodySpec s;
  s.name = "base";
  s.parent = "world";
  s.joint.type = "free";
  s.mass.mass = 12;
  s.mass.inertia = {3, 0.2, -0.1, 2, 0.1, 1.5};
  b.add(s);
  for (size_t i = 0; i < axes.size(); ++i) {
    mechanics::BodySpec w;
    w.name = "wheel_" + std::to_string(i);
    w.parent = "base";
    w.joint.name = w.name;
    w.joint.type = "revolute";
    w.joint.axis = (1 / norm(axes[i])) * axes[i];
    w.placement.r = {0.1, 0.05 * double(i), -0.1};
    // J = b 1 + (a - b) aaᵀ
    const double along = 0.02, across = 0.011;
    const auto n = (1 / norm(axes[i])) * axes[i];
    const double d = along - across;
    w.mass.mass = 1;
    w.mass.com = mechanics::Vec3d{lopsided, 0, 0};
    w.mass.inertia = {across + d * n.x * n.x, d * n.x * n.y, d * n.x * n.z,
                      across + d * n.y * n.y, d * n.y * n.z, across + d * n.z * n.z};
    b.add(w);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}
PotentialShaping pose(const test::ModelPtr& m) {
  PotentialShaping s;
  s.name = "pose";
  s.poses = {PoseSpring{"base", {0, 0, 0}, 4, {0, 0, 0}, {1, 1.5, 2}}};
  s.damping = {{"base.wrench", {3, 3, 3, 6, 6, 6}}};
  s.actuators = {"base.wrench"};
  s.rest = m->mechanism().neutral();
  return s;
}
const std::vector<mechanics::Vec3d> pyramid{{1, 0, 1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, 1}};
std::vector<std::string> ports(size_t n) {
  std::vector<std::string> list;
  for (size_t i = 0; i < n; ++i) list.push_back("wheel_" + std::to_string(i) + ".torque");
  return list;
}

TEST(WheelBase, PoseByThrustersAndWheels) {
  const auto m = satellite(pyramid);
  const auto shaped = std::make_shared<const PotentialLoop>(m, pose(m));
  const WheelBase base(shaped, {.wheels = ports(4)});
  std::printf("%s", base.certificate().text().c_str());
  EXPECT_TRUE(base.certificate().holds());
  // Half a turn nearly, off its place, with spinning wheels: a total momentum that is not 0.
  Vec q = m->mechanism().neutral(), v(10, 0.0);
  q[0] = 1;
  q[1] = -2;
  q[2] = 0.5;
  q[3] = std::cos(1.4);
  q[4] = std::sin(1.4) * 0.6;
  q[6] = std::sin(1.4) * 0.8;
  v[6] = 40;
  v[7] = -20;
  v[8] = 30;
  const auto run = [&](double period, double& off, double& rise, double& hold) {
    phs::Network n("satellite under its law");
    n.add("satellite", m).main("satellite");
    control(n, "pose", "satellite", base.port_laws(), {.period = period});
    const auto model = n.build();
    const double h = 0.02;
    const auto method = integrators::make_integrator("gauss8", *model, h);
    phs::State s(model->description(), m->state(q, v));
    double H = base.hamiltonian(s.x), lost = base.dissipation(s.x) * h / 3;
    const double start = H;
    hold = 0;
    rise = -HUGE_VAL;
    for (int i = 1; i <= 3000; ++i) {
      ASSERT_EQ(method->step(s), integrators::Outcome::ok);
      const double now = base.hamiltonian(s.x);
      rise = std::max(rise, now - H);
      H = now;
      lost += base.dissipation(s.x) * h / 3 * (i == 3000 ? 1 : i % 2 ? 4 : 2);
      for (size_t a = 0; a < method->port_work().size(); ++a)
        if (model->description().powers[a].name.ends_with(".hold")) hold += method->port_work()[a];
    }
    off = std::max({std::hypot(s.x[0], s.x[1], s.x[2]), 2 * std::hypot(s.x[4], s.x[5], s.x[6])});
    if (period == 0)
      keeps("H_d balance over the run, relative", std::fabs(H - start + lost) / start, 1e-5);
  };
  double off = 0, rise = 0, hold = 0;
  run(0, off, rise, hold);
  keeps("off in place or attitude after 60 s", off, 1e-4);
  keeps("rise of H_d in a step [J]", rise, 1e-12);
  double slow = 0, fast = 0;
  run(0.2, off, rise, slow);
  keeps("at 5 Hz: off after 60 s", off, 1e-3);
  run(0.1, off, rise, fast);
  std::printf("  the holds give %.3f J at 5 Hz, %.3f J at 10 Hz\n", slow, fast);
  keeps("ratio, off from 2", std::fabs(slow / fast - 2), 0.4);
}

TEST(WheelBase, RefusesWithTheReason) {
  const auto m = satellite(pyramid);
  const auto shaped = std::make_shared<const PotentialLoop>(m, pose(m));
  auto damped = pose(m);
  damped.actuators.push_back("wheel_0.torque");
  damped.damping.push_back({"wheel_0.torque", {1}});
  const auto lopsided = satellite(pyramid, 0.02);
  const std::pair<std::string, std::string> cases[] = {
      {refusal([&] { WheelBase(shaped, {.wheels = ports(2)}); }), "axes span fails"},
      {refusal([&] { WheelBase(shaped, {.wheels = {"base.wrench"}}); }),
       "no joint of one degree of freedom"},
      {refusal([&] {
         WheelBase(std::make_shared<const PotentialLoop>(m, damped), {.wheels = ports(4)});
       }),
       "damping at the wheel"},
      {refusal([&] {
         WheelBase(std::make_shared<const PotentialLoop>(lopsided, pose(lopsided)),
                   {.wheels = ports(4)});
       }),
       "wheels axisymmetric fails"}};
  for (const auto& [got, expected] : cases) {
    std::printf("  %s\n", got.substr(0, 300).c_str());
    EXPECT_NE(got.find(expected), std::string::npos) << got;
  }
}

}  // namespace
}  // namespace porthos::energy_shaping::wheel_base_test
