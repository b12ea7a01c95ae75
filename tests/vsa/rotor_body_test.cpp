// Rotors as bodies: the gyroscopic moment that rotors by their energy alone neglect.
#include "vsa/rotor_body.h"

#include "integrators/core/integrator.h"
#include "phs/system/check.h"
#include "tests/support/bounds.h"
#include "tests/support/robots.h"
#include "tests/vsa/actuators.h"

namespace porthos::test::rotor_body_test {
namespace {

constexpr double gear = 20, inertia = 2e-4, stiffness = 40;

/// A turntable about z, a frame in it about y, and on the frame a joint about x with its rotor
/// beside it.
struct Gimbal {
  std::shared_ptr<const mechanics::MechanicalModel> mechanism;
  std::shared_ptr<const phs::NetworkModel> model;
  size_t theta;
};
Gimbal gimbal(bool body, bool on_the_ground, const phs::FunctionPtr& torque) {
  mechanics::MechanismBuilder b("gimbal");
  const auto add = [&](const char* name, const char* parent, mechanics::Vec3d axis, double I) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.type = "continuous";
    s.joint.axis = axis;
    s.joint.name = std::string(name) + "_joint";
    s.mass = {1, {0, 0, 0}, {I, 0, 0, I, 0, I}};
    b.add(s);
  };
  add("table", "world", {0, 0, 1}, 0.1);
  add("frame", "table", {0, 1, 0}, 0.05);
  add("link", on_the_ground ? "world" : "frame", {1, 0, 0}, 0.02);
  std::string port;
  if (body) port = vsa::add_rotor(b, "link_joint", {.inertia = inertia, .mass = 0.1});
  Gimbal g;
  g.mechanism = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
  vsa::Actuator a{.elastic = vsa::series_elastic({stiffness})};
  a.theta = {.kind = vsa::Drive::Kind::torque, .gear = gear, .viscous = 1e-5};
  a.theta.friction = phs::viscous(0.02);
  a.theta.torque_limit = 3;
  a.theta.rate_limit = 2;
  a.theta.command = torque;
  a.damping = 0.03;
  phs::Network n("gimbal");
  n.add("mechanism", g.mechanism).main("mechanism");
  if (body) {
    vsa::attach(n, "vsa", "mechanism.link_joint.torque", "mechanism." + port, a);
  } else {
    a.theta.inertia = inertia;
    vsa::attach(n, "vsa", "mechanism.link_joint.torque", a);
  }
  g.model = n.build();
  g.theta = size_t(g.model->offset("vsa")) + 1;
  return g;
}

TEST(RotorBody, PushesTheFrameByOmegaTimesItsSpin) {
  const double turn = 1.5, spin = 300;
  const auto push = [&](bool body) {  // p' of the frame
    const auto g = gimbal(body, false, nullptr);
    std::vector<double> q(body ? 4 : 3, 0.0), v = q;
    v[0] = turn;
    if (body) v[3] = spin;
    auto x = state_of(*g.model, g.mechanism->state(q, v), {}).x;
    if (!body) x[g.theta + 1] = inertia * gear * spin;  // n² J θ'
    std::vector<double> dx(x.size());
    const auto f = g.model->instantiate<double>();
    f->field(0, x, std::vector<double>(size_t(g.model->description().nu), 0.0), dx);
    return dx[q.size() + 1];
  };
  // About y: -(Ω z × J ω x) = -Ω J ω
  keeps("moment on the frame + turn J spin [N m]", std::fabs(push(true) + turn * inertia * spin),
        1e-15);
  keeps("  by energy alone it is nothing [N m]", std::fabs(push(false)), 1e-15);
  breaks("  so this is neglected [N m]", turn * inertia * spin, 0.05);
}

TEST(RotorBody, IsTheRotorByItsEnergyWhereNothingCarriesIt) {
  const auto torque = phs::sine(4, 1.5);
  const auto body = gimbal(true, true, torque), energy = gimbal(false, true, torque);
  const auto moving = gimbal(true, false, torque);
  const auto check = phs::check(*moving.model, {.samples = 8, .spread = 0.5});
  EXPECT_TRUE(check.holds()) << check.text();
  std::vector<double> link[2];
  double spread = 0;
  for (const auto* g : {&body, &energy, &moving}) {
    const std::vector<double> q(g == &energy ? 3 : 4, 0.0);
    auto v = q;
    if (g == &moving) v[0] = 1.5;
    phs::State s = state_of(*g->model, g->mechanism->state(q, v), {});
    const auto method = integrators::make_integrator("gauss8", *g->model, 0.001);
    Gauge gauge(*g->model);
    const auto start = gauge.energy(s);
    long double in = 0;
    for (int i = 0; i < 1000; ++i) {
      ASSERT_EQ(method->step(s), integrators::Outcome::ok);
      for (size_t k = 0; k < method->port_work().size(); ++k) {
        const double w = method->port_work()[k];
        in += g->model->description().powers[k].kind == phs::PowerKind::supplied ? w : -w;
      }
      if (g != &moving) link[g == &body].push_back(s.x[2]);
      if (g != &moving) link[g == &body].push_back(s.x[g->theta]);
    }
    keeps("ledger [J]", double(std::fabs(gauge.energy(s) - start - in)), 1e-13);
  }
  double apart = 0;
  for (size_t i = 0; i < link[0].size(); ++i) {
    apart = std::max(apart, std::fabs(link[0][i] - link[1][i]));
    spread = std::max(spread, std::fabs(link[0][i]));
  }
  EXPECT_GT(spread, 0.05);
  keeps("link and theta apart from those of a rotor by its energy", apart, 1e-12);
}

TEST(RotorBody, WrongOnesAreRefused) {
  mechanics::MechanismBuilder b("arm");
  EXPECT_NE(refusal([&] { vsa::add_rotor(b, "elbow", {.inertia = 1}); }).find("no such joint"),
            std::string::npos);
  EXPECT_NE(refusal([&] { vsa::add_rotor(b, "elbow", {}); }).find("inertia is 0"),
            std::string::npos);
  phs::Network n("joint");
  n.add("mechanism", pendulum(1, 2)).main("mechanism");
  vsa::Actuator a{.elastic = vsa::series_elastic({10.0})};
  a.theta = {.kind = vsa::Drive::Kind::torque, .inertia = 1};
  EXPECT_NE(refusal([&] {
              vsa::attach(n, "vsa", "mechanism.hinge.torque", "mechanism.x", a);
            }).find("without an inertia"),
            std::string::npos);
}

}  // namespace
}  // namespace porthos::test::rotor_body_test
