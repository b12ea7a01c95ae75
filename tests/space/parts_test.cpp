// Thrusters, torquers and soft latches on bodies: closed forms, impulses, axioms, momenta.
#include "space/parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "mechanics/momentum.h"
#include "phs/network/elements.h"
#include "phs/network/network.h"
#include "phs/system/check.h"
#include "tests/space/support.h"

namespace porthos::test::parts_test {
namespace {

using mechanics::BodySpec;
using mechanics::MechanicalModel;
using mechanics::MechanismBuilder;
using mechanics::Pose;
using space::Parts;
using space::PartsModel;
using space::Schedule;
using space::SoftLatch;
using space::Thruster;
using space::Torquer;
using Vec = std::vector<double>;

/// A run of a model by a method: the state at the end and the works of all steps.
struct Motion {
  phs::State state;
  Vec works;
  double energy = 0;  ///< change
};
Motion run(const PartsModel& model, const Vec& x, const char* method, double h, int steps) {
  Motion r{phs::State(model.description(), x), Vec(model.description().powers.size(), 0.0), 0};
  const auto integrator = integrators::make_integrator(method, model, h);
  const auto system = model.instantiate<long double>();
  const auto energy = [&] {
    std::vector<long double> s(r.state.x.begin(), r.state.x.end());
    for (size_t i = 0; i < s.size(); ++i) s[i] += r.state.lo[i];
    return system->hamiltonian(s);
  };
  const long double before = energy();
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(integrator->step(r.state), integrators::Outcome::ok);
    for (size_t a = 0; a < r.works.size(); ++a) r.works[a] += integrator->port_work()[a];
  }
  r.energy = double(energy() - before);
  return r;
}
double work(const PartsModel& m, const Motion& r, const std::string& name) {
  for (size_t a = 0; a < r.works.size(); ++a)
    if (m.description().powers[a].name == name) return r.works[a];
  ADD_FAILURE() << name;
  return NAN;
}

Thruster thruster(Vec3d at, Vec3d along, double newton, Schedule schedule) {
  Thruster t;
  t.name = "jet";
  t.link = "body";
  t.position = at;
  t.direction = along;
  t.thrust = newton;
  t.schedule = std::move(schedule);
  return t;
}
Vec turning(const MechanicalModel& m, Vec3d rate) {
  const double wxyz[] = {1, 0, 0, 0};
  return body_state(m, wxyz, rate);
}

TEST(Thruster, GivesItsImpulseFromSwitchToSwitchByAnyMethod) {
  // 3 N from 0.5 s to 2 s and from 2.5 s to 3 s, in steps of 0.1 s: 6 N s.
  const auto body = rigid_body(20, {2, 3, 4});
  const PartsModel model(
      body, Parts{.thrusters = {thruster({0, 0, 0}, {0, 1, 0}, 3, Schedule({0.5, 2, 2.5, 3}))}});
  // rk4 has stages on both ends of its steps: half on there, it gets the impulse and not quite the
  // work.
  for (const char* method : {"gauss16", "gauss8", "gauss2", "rk4"}) {
    const double ledger = method == std::string("rk4") ? 2e-4 : 2e-14;
    const Motion r = run(model, turning(*body, {0, 0, 0}), method, 0.1, 40);
    const double P = r.state.x[7 + 1], v = P / 20;
    std::printf("  %-9s P - F dt %8.1e  impulse row %8.1e  energy - work %8.1e J   bound 2e-14\n",
                method, P - 6, work(model, r, "jet.impulse.y") - 6,
                r.energy - work(model, r, "jet"));
    EXPECT_NEAR(P, 6, 2e-14) << method;
    EXPECT_NEAR(work(model, r, "jet.impulse.y"), 6, 2e-14) << method;
    EXPECT_NEAR(r.energy, 0.5 * 20 * v * v, 2e-14);
    EXPECT_NEAR(work(model, r, "jet"), r.energy, ledger) << method;
  }
  // Control: a switch inside a step is not hit, which is what off_grid is for.
  const PartsModel off(
      body, Parts{.thrusters = {thruster({0, 0, 0}, {0, 1, 0}, 3, Schedule({0.5, 2.03}))}});
  const double P = run(off, turning(*body, {0, 0, 0}), "gauss16", 0.1, 40).state.x[7 + 1];
  EXPECT_GT(std::fabs(P - 3 * 1.53), 1e-3);
  EXPECT_EQ(Schedule({0.5, 2.03}).off_grid(0.1), 2.03);
  EXPECT_LT(Schedule({0.5, 2, 2.5, 3}).off_grid(0.1), 0);
}

TEST(Thruster, OnATurningBodyFollowsTheBody) {
  // The force turns with the body: P = F/w (sin wt, 1 - cos wt). With an arm about z it spins the
  // body up: L = r F t.
  const auto body = rigid_body(20, {2, 2, 4});
  const double w = 0.7, F = 3, T = 5;
  const PartsModel through(body, Parts{.thrusters = {thruster({0, 0, 0.4}, {1, 0, 0}, F, {})}});
  const PartsModel centred(body, Parts{.thrusters = {thruster({0, 0, 0}, {1, 0, 0}, F, {})}});
  const PartsModel arm(
      body,
      Parts{.thrusters = {thruster({0.5, 0, 0}, {0, 1, 0}, F, Schedule::pulses(1, 1, 0.5, 3))}});
  const Motion a = run(centred, turning(*body, {0, 0, w}), "gauss12", 0.1, 50);
  const double ex = a.state.x[7] - F / w * std::sin(w * T),
               ey = a.state.x[8] - F / w * (1 - std::cos(w * T));
  const Motion b = run(arm, turning(*body, {0, 0, w}), "gauss12", 0.1, 50);
  const double L = arm.mechanical().rates(b.state.x)[2] * 4 - 4 * w - 0.5 * F * 1.5;
  const Motion c = run(through, turning(*body, {0, 0, w}), "gauss12", 0.1, 50);
  std::printf("  P off by %.1e %.1e, L by %.1e   bound 1e-13; energy - work %.1e\n", ex, ey, L,
              b.energy - work(arm, b, "jet"));
  EXPECT_NEAR(ex, 0, 1e-13);
  EXPECT_NEAR(ey, 0, 1e-13);
  EXPECT_NEAR(L, 0, 1e-13);
  EXPECT_NEAR(b.energy, work(arm, b, "jet"), 1e-13);
  EXPECT_GT(std::fabs(c.state.x[7] - a.state.x[7]), 0.1);  // control: off the centre it tumbles
}

/// A base with a hinged link, and another body free beside them.
std::shared_ptr<const MechanicalModel> arm_and_target() {
  MechanismBuilder b("arm and target");
  const auto add = [&](const char* name, const char* parent, const char* type, Vec3d axis,
                       Vec3d place, double m) {
    BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = std::string(name) + "_joint";
    s.joint.type = type;
    s.joint.axis = axis;
    s.placement.r = place;
    s.mass.mass = m;
    s.mass.com = {0.1, -0.05, 0.2};
    s.mass.inertia.xx = 1.1 * m;
    s.mass.inertia.yy = 1.3 * m;
    s.mass.inertia.zz = 0.7 * m;
    s.mass.inertia.xy = 0.1 * m;
    s.mass.inertia.xz = -0.05 * m;
    s.mass.inertia.yz = 0.08 * m;
    b.add(s);
  };
  add("base", "world", "free", {0, 0, 1}, {0, 0, 0}, 20);
  add("hand", "base", "revolute", {0.6, 0.8, 0}, {1, 0.5, -0.2}, 5);
  add("target", "world", "free", {0, 0, 1}, {0, 0, 0}, 8);
  return std::make_shared<MechanicalModel>(std::make_shared<const mechanics::Mechanism>(b.build()));
}
Parts all_parts(bool exchanged = false) {
  SoftLatch l;
  l.name = "latch";
  l.link = "hand";
  l.body = "target";
  l.on_link = {mechanics::rotation_from_rpy(0.3, -0.2, 0.5), {0.2, 0.1, 0.4}};
  l.on_body = {mechanics::rotation_from_rpy(-0.4, 0.1, 0.2), {-0.3, 0.2, 0.1}};
  if (exchanged) std::swap(l.link, l.body), std::swap(l.on_link, l.on_body);
  l.stiffness = {40, 70, 25};
  l.turning_stiffness = {9, 4, 6};
  return Parts{.latches = {l}};
}
Vec arm_state(const MechanicalModel& m) {
  auto q = m.mechanism().neutral();
  Vec v{0.1, -0.2, 0.3, 0.05, 0.02, -0.1, 0.4, -0.3, 0.2, 0.5, 0.1, 0.05, -0.2};
  q[7] = 0.4;
  q[8] = 1.2;
  q[9] = 0.7;
  q[10] = 0.1;
  return m.state(q, v);
}

TEST(Parts, KeepTheAxiomsOfAPortHamiltonianSystem) {
  const auto m = arm_and_target();
  Parts parts = all_parts();
  parts.latches[0].damping = {2, 3, 1};
  parts.latches[0].turning_damping = {0.4, 0.2, 0.3};
  Thruster t = thruster({0.1, 0.2, 0.3}, {0, 0.6, 0.8}, 2, {});
  t.link = "hand";
  Torquer rod;
  rod.name = "rod";
  rod.direction = {0.6, 0, 0.8};
  rod.dipole = phs::constant(3);
  parts.thrusters = {t};
  parts.torquers = {rod};
  parts.field = {0.1, -0.2, 0.3};
  for (const Parts& p : {all_parts(), parts}) {
    const PartsModel model(m, p);
    const auto report = phs::check(model);
    for (const auto& a : report.axioms) {
      std::printf("  %-28s %.1e   bound %.1e\n", a.axiom.c_str(), a.worst, a.limit);
      EXPECT_TRUE(a.holds()) << a.axiom;
    }
  }
}

/// In a network their storages and powers stand before those of what acts at the joints.
TEST(Parts, KeepTheirBooksInANetwork) {
  const auto m = arm_and_target();
  std::string port, coordinate;
  for (const auto& c : m->mechanism().coordinates())
    if (c.nq == 1 && port.empty()) coordinate = c.name;
  for (const auto& p : m->description().ports)
    if (p.size == 1 && p.name.rfind(coordinate + ".", 0) == 0) port = p.name;
  phs::Network n("arm with a spring");
  n.add("arm", std::make_shared<const PartsModel>(m, all_parts())).main("arm");
  n.potential("spring", "arm." + coordinate, phs::spring(3, 0.2));
  n.resist("damper", "arm." + port, phs::viscous(0.5));
  const auto report = phs::check(*n.build());
  for (const auto& a : report.axioms) EXPECT_TRUE(a.holds()) << a.axiom << " " << a.worst;
}

TEST(SoftLatch, OscillatesAsTwoBodiesOnASpringDo) {
  // Slide: w = sqrt(K/mu). Turn: a pendulum in the relative angle, Q (1 - cos), of any amplitude.
  MechanismBuilder b("pair");
  for (const char* name : {"a", "b"}) {
    BodySpec s;
    s.name = name;
    s.parent = "world";
    s.joint.type = "free";
    const double k = *name == 'a' ? 3 : 5;
    s.mass.mass = 2 * k;
    s.mass.inertia.xx = s.mass.inertia.yy = s.mass.inertia.zz = k;
    b.add(s);
  }
  const auto m =
      std::make_shared<MechanicalModel>(std::make_shared<const mechanics::Mechanism>(b.build()));
  SoftLatch l;
  l.name = "latch";
  l.link = "a";
  l.body = "b";
  l.stiffness = {30, 30, 30};
  l.turning_stiffness = {8, 5, 7};
  const PartsModel model(m, Parts{.latches = {l}});
  const double mu = 6.0 * 10 / 16, I = 3.0 * 5 / 8;
  const double slide = 2 * M_PI * std::sqrt(mu / 30), amplitude = 1.5;
  const double turn = 4 * std::comp_ellint_1(std::sin(amplitude / 2)) * std::sqrt(I / 5);
  for (const bool turns : {false, true}) {
    auto q = m->mechanism().neutral();
    if (turns) {  // about y
      q[7 + 3] = std::cos(amplitude / 2);
      q[7 + 5] = std::sin(amplitude / 2);
    } else
      q[7 + 2] = 0.3;
    const Vec x = m->state(q, Vec(12, 0.0));
    const double period = turns ? turn : slide;
    const int n = 160;
    const Motion r = run(model, x, "gauss16", 10 * period / n, n);
    const Motion off = run(model, x, "gauss16", 10.01 * period / n, n);
    double away = 0, control = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      away = std::max(away, std::fabs(r.state.x[i] - x[i]));
      control = std::max(control, std::fabs(off.state.x[i] - x[i]));
    }
    std::printf("  %s: after ten periods of %.4f s off by %.1e   bound 1e-11 (1 %% later %.1e)\n",
                turns ? "turn " : "slide", period, away, control);
    EXPECT_LE(away, 1e-11);
    EXPECT_GT(control, 1e-3);
  }
}

TEST(SoftLatch, KeepsMomentaAndItsEnergyIsTheSameFromBothSides) {
  const auto m = arm_and_target();
  const Vec x = arm_state(*m);
  const PartsModel lossless(m, all_parts()), exchanged(m, all_parts(true));
  Parts with = all_parts();
  with.latches[0].damping = {2, 3, 1};
  with.latches[0].turning_damping = {0.4, 0.2, 0.3};
  const PartsModel damped(m, with);
  const auto momenta = [&](const PartsModel& model, const phs::State& s) {
    std::vector<long double> y(s.x.begin(), s.x.end()),
        v(size_t(model.description().invariant_count()));
    for (size_t i = 0; i < y.size(); ++i) y[i] += s.lo[i];
    model.instantiate<long double>()->invariants(y, v);
    return std::vector<long double>(v.begin(), v.begin() + 6);
  };
  for (const auto* model : {&lossless, &damped}) {
    const Motion r = run(*model, x, "gauss16", 0.05, 2000);
    const auto a = momenta(*model, phs::State(model->description(), x)),
               b = momenta(*model, r.state);
    double jump = 0;
    for (size_t i = 0; i < 6; ++i) jump = std::max(jump, double(fabsl(b[i] - a[i])));
    const double lost = model == &damped ? work(*model, r, "latch.damping") : 0;
    std::printf(
        "  momenta off by %.1e   bound 2e-13;  energy %.6f J, lost %.6f J, defect %.1e   "
        "bound 1e-12\n",
        jump, r.energy, lost, r.energy + lost);
    EXPECT_LE(jump, 2e-13);
    EXPECT_NEAR(r.energy + lost, 0, 1e-12);
    EXPECT_EQ(model == &damped, lost > 1);
  }
  const double there = lossless.instantiate<double>()->hamiltonian(x),
               back = exchanged.instantiate<double>()->hamiltonian(x);
  EXPECT_NEAR(there, back, 1e-14 * there);
  // Control: a latch that pulled along the link's axes alone would not be the same from both sides.
  Parts sideways = all_parts();
  sideways.latches[0].stiffness = {40, 25, 70};
  EXPECT_GT(std::fabs(PartsModel(m, sideways).instantiate<double>()->hamiltonian(x) - there), 1);
}

TEST(Torquer, SwingsABodyLikeACompassNeedle) {
  const double I = 2, dipole = 40, B = 0.05, amplitude = 1.2;
  const auto body = rigid_body(10, {1, I, 3});
  Torquer rod;
  rod.name = "rod";
  rod.direction = {1, 0, 0};
  rod.dipole = phs::constant(dipole);
  const PartsModel model(body, Parts{.torquers = {rod}, .field = {B, 0, 0}});
  const double period =
      4 * std::comp_ellint_1(std::sin(amplitude / 2)) * std::sqrt(I / (dipole * B));
  const double wxyz[] = {std::cos(amplitude / 2), 0, std::sin(amplitude / 2), 0};
  const Vec x = body_state(*body, wxyz, {0, 0, 0});
  const Motion half = run(model, x, "gauss16", 0.25 * period / 8, 8);  // lowest point
  const Motion r = run(model, x, "gauss16", 10 * period / 128, 128);
  double away = 0;
  for (size_t i = 0; i < x.size(); ++i) away = std::max(away, std::fabs(r.state.x[i] - x[i]));
  const double down = dipole * B * (1 - std::cos(amplitude));
  std::printf(
      "  after ten periods off by %.1e   bound 1e-12;  work to the lowest point - mB(1-cos) "
      "%.1e, angular impulse - I w %.1e   bound 1e-13\n",
      away, work(model, half, "rod") - down,
      work(model, half, "rod.angular_impulse.y") + std::sqrt(2 * down * I));
  EXPECT_LE(away, 1e-12);
  EXPECT_NEAR(work(model, half, "rod"), down, 1e-13);
  EXPECT_NEAR(work(model, half, "rod.angular_impulse.y"), -std::sqrt(2 * down * I), 1e-13);
  EXPECT_NEAR(half.energy, down, 1e-13);
}

TEST(Parts, MomentaLessImpulsesAreKept) {
  // A tumbling body under a jet off its centre and a rod in a field: L - L(0) is the impulses, to
  // rounding.
  const auto body = rigid_body(10, {1, 2, 2.5});
  Torquer rod;
  rod.name = "rod";
  rod.direction = {0.6, 0.8, 0};
  rod.dipole = phs::sine(3, 0.2);
  const PartsModel model(
      body,
      Parts{.thrusters = {thruster({0.3, -0.2, 0.1}, {0, 0.6, 0.8}, 0.4, Schedule({1, 4, 6, 15}))},
            .torquers = {rod},
            .field = {0.1, 0.2, -0.3}});
  const Vec x = turning(*body, {0.3, -0.5, 0.2});
  const Motion r = run(model, x, "gauss16", 0.1, 200);
  mechanics::Workspace<double> w(body->mechanism());
  const auto momentum = [&](const Vec& s) {
    return mechanics::momentum<double>(body->mechanism(), w, std::span(s).first(7),
                                       std::span(s).subspan(7));
  };
  const auto a = momentum(x), b = momentum(r.state.x);
  double off = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const std::string axis(1, char('x' + k));
    const double P = work(model, r, "jet.impulse." + axis),
                 L = work(model, r, "jet.angular_impulse." + axis) +
                     work(model, r, "rod.angular_impulse." + axis);
    off = std::max({off, std::fabs(b.linear[k] - a.linear[k] - P),
                    std::fabs(b.angular[k] - a.angular[k] - L)});
    size = std::max(size, std::fabs(b.angular[k]));
  }
  std::printf("  off by %.1e of %.1f   bound 1e-12\n", off, size);
  EXPECT_LE(off, 1e-12);
  EXPECT_GT(size, 1);
}

TEST(Parts, WhatCannotBeIsRefused) {
  const auto m = arm_and_target();
  const auto says = [&](Parts p, const std::string& words) {
    try {
      PartsModel(m, std::move(p));
      ADD_FAILURE() << "nothing was thrown, expected: " << words;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  const auto changed = [](auto change) {
    Parts p = all_parts();
    change(p.latches[0]);
    return p;
  };
  says(changed([](SoftLatch& l) { l.body = "traget"; }), "there is no link 'traget'");
  says(changed([](SoftLatch& l) { l.body = "hand"; }), "joins 'hand' to itself");
  says(changed([](SoftLatch& l) { l.damping.y = -1; }), "a stiffness or damping is -1");
  says({.thrusters = {thruster({0, 0, 0}, {1, 1, 0}, 1, {})}}, "its direction has length 1.41");
  says({.thrusters = {thruster({0, 0, 0}, {1, 0, 0}, -1, {})}}, "its thrust is -1 N");
  Torquer rod;
  rod.name = "rod";
  rod.dipole = phs::constant(1);
  says({.torquers = {rod}}, "there is no magnetic field");
  rod.dipole = nullptr;
  says({.torquers = {rod}, .field = {1, 0, 0}}, "it has no dipole and unloads wheels by 0 1/s");
  rod.unload = 1;
  rod.wheels = {"hand_joint"};
  EXPECT_NO_THROW(PartsModel(m, {.torquers = {rod}, .field = {1, 0, 0}}));
  rod.wheels = {"wheel"};
  says({.torquers = {rod}, .field = {1, 0, 0}}, "joint 'wheel' does not turn on a free base");
  EXPECT_THROW(Schedule({2, 1}), InvalidArgument);
  EXPECT_THROW(Schedule({-1, 1}), InvalidArgument);
  EXPECT_THROW(Schedule::pulses(0, 1, 1, 3), InvalidArgument);
}

}  // namespace
}  // namespace porthos::test::parts_test
