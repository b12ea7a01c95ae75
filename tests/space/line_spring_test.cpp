// Springs along a line between two points: orbits on a spring, the ledger of the damper, what they
// hold in the world.
#include <cmath>

#include "phs/system/check.h"
#include "space/parts.h"
#include "tests/space/support.h"

namespace porthos::space::line_spring_test {
namespace {

using mechanics::BodySpec;
using mechanics::MechanicalModel;
using mechanics::MechanismBuilder;
using Vec = std::vector<double>;

/// Free bodies a (3 kg) and b (5 kg).
std::shared_ptr<const MechanicalModel> pair_of_bodies() {
  MechanismBuilder b("pair");
  for (const char* name : {"a", "b"}) {
    BodySpec s;
    s.name = name;
    s.parent = "world";
    s.joint.type = "free";
    s.mass.mass = *name == 'a' ? 3 : 5;
    s.mass.inertia = {1, 0, 0, 2, 0, 2.5};
    b.add(s);
  }
  return std::make_shared<MechanicalModel>(std::make_shared<const mechanics::Mechanism>(b.build()));
}

SoftLatch line(const char* body, SoftLatch::Line of) {
  SoftLatch l;
  l.name = "tether";
  l.link = "a";
  l.body = body;
  l.line = of;
  return l;
}

phs::State run(const PartsModel& model, const Vec& x, double h, int steps, Vec* works = nullptr) {
  phs::State s(model.description(), x);
  const auto integrator = integrators::make_integrator("gauss16", model, h);
  if (works) works->assign(model.description().powers.size(), 0.0);
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(integrator->step(s), integrators::Outcome::ok);
    for (size_t k = 0; works && k < works->size(); ++k) (*works)[k] += integrator->port_work()[k];
  }
  return s;
}

/// Two bodies circle each other on a stretched spring: k (d - l) = mu d w². Beyond half a turn the
/// force has pointed everywhere in the plane.
TEST(LineSpring, BodiesCircleOnIt) {
  const auto m = pair_of_bodies();
  const double k = 7, rest = 0.75, d = 2, mu = 15. / 8;
  const double w = std::sqrt(k * (d - rest) / (mu * d));
  auto q = m->mechanism().neutral();
  q[0] = -d * 5 / 8;
  q[7] = d * 3 / 8;
  Vec v(12, 0.0);
  v[4] = -w * d * 5 / 8;
  v[10] = w * d * 3 / 8;
  const auto distance_off = [&](double length) {
    const PartsModel model(m, Parts{.latches = {line("b", {k, length, 0})}});
    const auto s = run(model, m->state(q, v), 2 * M_PI / w / 32, 320);
    return std::hypot(s.x[0] - q[0], s.x[1]);
  };
  const double off = distance_off(rest), control = distance_off(rest + 1e-3);
  std::printf("  after ten turns off by %.1e m   bound 1e-12 (rest 1 mm longer: %.1e)\n", off,
              control);
  EXPECT_LT(off, 1e-12);
  EXPECT_GT(control, 1e-3);
}

TEST(LineSpring, KeepsTheAxiomsAndItsLedger) {
  const auto m = pair_of_bodies();
  auto tether = line("b", {40, 0.8, 3});
  tether.on_link.r = {0.2, -0.1, 0.3};
  tether.on_body.r = {-0.4, 0.3, 0.1};
  for (const bool world : {false, true}) {
    if (world) tether.body = "world";
    const PartsModel model(m, Parts{.latches = {tether}});
    const auto report = phs::check(model);
    for (const auto& a : report.axioms) EXPECT_TRUE(a.holds()) << a.axiom << " " << a.worst;
    auto q = m->mechanism().neutral();
    q[8] = 1.5;
    const Vec x = m->state(q, Vec{0.2, -0.3, 0.4, 0.5, 0, 0.3, -0.2, 0.1, 0.6, -0.1, 0.3, 0.2});
    Vec works;
    const auto s = run(model, x, 0.02, 500, &works);
    const auto system = model.instantiate<double>();
    const double before = system->hamiltonian(x), lost = before - system->hamiltonian(s.x);
    std::printf("  %s: lost %.3f J, booked less %.1e J   bound 1e-13\n", world ? "world" : "pair",
                lost, works[0] - lost);
    ASSERT_EQ(model.description().powers[0].name, "tether.damping");
    EXPECT_GT(lost, 0.1);
    EXPECT_NEAR(works[0], lost, 1e-13);
    // Both bodies keep their momenta together; one end in the world takes them.
    size_t momenta = 0;
    for (const auto& i : model.description().invariants)
      momenta += i.name.find("_momentum") != std::string::npos;
    EXPECT_EQ(momenta, world ? 0u : 2u);
    double P = 0;
    for (int axis = 0; axis < 3; ++axis)
      P = std::max(P, std::fabs(s.x[size_t(14 + axis)] + s.x[size_t(21 + axis)] -
                                x[size_t(14 + axis)] - x[size_t(21 + axis)]));
    if (world) {
      EXPECT_GT(P, 0.1);
    } else {
      EXPECT_LT(P, 1e-14);
    }
  }
}

/// Without a rest length it is smooth where its ends meet.
TEST(LineSpring, PassesThroughItsOwnEnd) {
  const auto m = pair_of_bodies();
  const PartsModel model(m, Parts{.latches = {line("world", {27, 0, 0})}});
  auto q = m->mechanism().neutral();
  q[1] = 0.5;
  const Vec x = m->state(q, Vec(12, 0.0));
  const double period = 2 * M_PI * std::sqrt(3. / 27);
  const auto half = run(model, x, period / 32, 16), whole = run(model, x, period / 32, 32);
  EXPECT_NEAR(half.x[1], -0.5, 1e-15);
  EXPECT_NEAR(whole.x[1], 0.5, 1e-15);
  // At rest there, with damping and a rest length: no force, nothing divided by zero.
  for (const double rest : {0.0, 0.3}) {
    const PartsModel damped(m, Parts{.latches = {line("world", {27, rest, 4})}});
    const Vec still = m->state(m->mechanism().neutral(), Vec(12, 0.0));
    const auto s = run(damped, still, 0.1, 10);
    for (size_t i = 0; i < still.size(); ++i) EXPECT_EQ(s.x[i], still[i]) << i;
  }
}

/// The energy has the digits of its scalar.
TEST(LineSpring, EnergyIn113BitsIsOfThoseBits) {
  const auto m = pair_of_bodies();
  const PartsModel model(m, Parts{.latches = {line("b", {2, 0.7, 0})}});
  auto q = m->mechanism().neutral();
  q[0] = 1;
  q[1] = 1;
  const Vec x = m->state(q, Vec(12, 0.0));
  using phs::Quad;
  const Quad length = phs::sqrt(Quad(2)) - Quad(0.7);
  const std::vector<Quad> wide(x.begin(), x.end());
  const double off = double(model.instantiate<Quad>()->hamiltonian(wide) - length * length);
  EXPECT_LT(std::fabs(off), 1e-31);
}

TEST(LineSpring, WrongNumbersAndOneBodyAreRefused) {
  const auto m = pair_of_bodies();
  const auto why = [&](const SoftLatch& l) {
    try {
      PartsModel(m, Parts{.latches = {l}});
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(why(line("b", {1, -1, 0})),
            "line spring 'tether': its stiffness, rest or damping is -1, expected numbers of 0 or "
            "more");
  EXPECT_EQ(why(line("a", {1, 1, 0})),
            "line spring 'tether': it joins 'a' to itself, expected two bodies");
  EXPECT_NE(why(line("c", {1, 1, 0})).find("'c'"), std::string::npos) << why(line("c", {1, 1, 0}));
  EXPECT_EQ(why(line("b", {1, 1, 0})), "");
}

}  // namespace
}  // namespace porthos::space::line_spring_test
