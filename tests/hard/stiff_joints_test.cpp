// Numbers far apart in one mechanism. Must hold at steps that resolve the fastest motion: energy at
// round-off with joint springs of 1e2 … 1e6 m g l; ABA inverts RNEA and the energy holds with
// inertias 1e6 apart, heavy root or heavy tip; the relative accuracy does not depend on the rate
// from 1e-6 to 100 rad/s. Must fail: rk4 at the same steps.
#include <cmath>

#include "mechanics/aba.h"
#include "mechanics/rnea.h"
#include "tests/support/energy_run.h"

namespace porthos::stiff_joints_test {
namespace {

/// Links of 1 m along -z on revolute joints, axes x, y, x, …; masses as given, slender boxes.
mechanics::Mechanism chain(const std::vector<double>& m, double stiffness, double g) {
  mechanics::MechanismBuilder b("chain");
  b.gravity({0, 0, -g});
  for (size_t i = 0; i < m.size(); ++i) {
    mechanics::BodySpec s;
    s.name = "link" + std::to_string(i);
    s.parent = i ? "link" + std::to_string(i - 1) : "world";
    s.joint.type = "revolute";
    s.joint.stiffness = stiffness;
    if (i % 2)
      s.joint.axis = {0, 1, 0};
    else
      s.joint.axis = {1, 0, 0};
    if (i) s.placement.r = {0, 0, -1};
    s.mass = {m[i], {0, 0, -0.5}, {m[i] / 12, 0, 0, m[i] / 12, 0, m[i] / 100}};
    b.add(s);
  }
  return b.build();
}

struct Start {
  std::vector<double> q, v;
};
test::EnergyRun run(const mechanics::MechanicalModel& model, const char* method, const Start& at,
                    double h, std::int64_t steps, double scale = 0) {
  return test::energy_run(method, model, phs::State(model.description(), model.state(at.q, at.v)),
                          h, steps, {.scale = scale});
}

/// Largest eigenvalue of M⁻¹ at q: power iteration, ABA at rest without gravity being M⁻¹.
double stiffest_direction(const mechanics::Mechanism& m, const std::vector<double>& q) {
  mechanics::Workspace<double> w(m);
  const std::vector<double> rest(q.size(), 0.0);
  std::vector<double> a(q.size(), 1.0), tau(q.size());
  a[0] = -1;
  double size = 0;
  for (int i = 0; i < 200; ++i) {
    size = 0;
    for (double x : a) size += x * x;
    size = std::sqrt(size);
    for (size_t k = 0; k < a.size(); ++k) tau[k] = a[k] / size;
    mechanics::aba<double>(m, w, q, rest, {tau, {}}, a);
  }
  return size;
}

TEST(StiffJoints, SpringsFarAboveGravity) {
  const double g = 9.81;
  const std::int64_t steps = 20000;
  for (const double ratio : {1e2, 1e3, 1e4, 1e5, 1e6}) {
    const double k = ratio * g;  // m g l = 9.81 N m
    const mechanics::MechanicalModel model(
        std::make_shared<mechanics::Mechanism>(chain({1, 1, 1}, k, g)));
    const Start at{{0.3, -0.2, 0.1}, {0, 0, 0}};
    const double h = 0.5 / std::sqrt(k * stiffest_direction(chain({1, 1, 1}, 0, 0), at.q));
    const std::string name =
        "k = " + std::to_string(int(std::log10(ratio))) + " decades above m g l";
    const auto ours = run(model, "gauss16", at, h, steps);
    test::keeps("gauss16 energy, " + name, ours.energy, test::random_walk(steps));
    EXPECT_FALSE(ours.drifts);
    test::breaks("rk4 energy, " + name, run(model, "rk4", at, h, steps).energy, 1e-9);
  }
}

/// |RNEA(ABA(τ)) - τ| / |τ|, and the same for the accelerations that ABA gives back.
std::pair<double, double> round_trip(const mechanics::Mechanism& m, const Start& at) {
  mechanics::Workspace<double> w(m);
  const size_t n = size_t(m.nv());
  std::vector<double> tau(n), a(n), back(n), again(n);
  for (size_t i = 0; i < n; ++i) tau[i] = (i % 2 ? -1.0 : 0.5) / double(i + 1);
  mechanics::aba<double>(m, w, at.q, at.v, {tau, {}}, a);
  mechanics::rnea<double>(m, w, at.q, at.v, a, {}, back);
  mechanics::aba<double>(m, w, at.q, at.v, {back, {}}, again);
  double d = 0, size = 0, e = 0, motion = 0;
  for (size_t i = 0; i < n; ++i) {
    d = std::max(d, std::fabs(back[i] - tau[i]));
    size = std::max(size, std::fabs(tau[i]));
    e = std::max(e, std::fabs(again[i] - a[i]));
    motion = std::max(motion, std::fabs(a[i]));
  }
  return {d / size, e / motion};
}

TEST(StiffJoints, InertiasAMillionApart) {
  const std::int64_t steps = 20000;
  const Start at{{0.3, -0.2, 0.5, 0.4}, {1, -2, 1.5, 0.5}};
  struct Case {
    const char* name;
    std::vector<double> m;
    double worst_torque, h;
  };
  // A light root under a heavy tip needs torques of the size of the tip's, 1e6 times the root's
  // own: that much of τ cancels. Its light links are strings under the tip's weight: √(1e6 g / l) =
  // 3e3 rad/s and more, which the step must resolve.
  for (const auto& c : {Case{"heavy root, light tip", {1e6, 1e4, 1e2, 1}, 1e-9, 1.0 / 128},
                        Case{"light root, heavy tip", {1, 1e2, 1e4, 1e6}, 1e-6, 1.0 / 4096}}) {
    const auto m = std::make_shared<mechanics::Mechanism>(chain(c.m, 0, 9.81));
    const mechanics::MechanicalModel model(m);
    const auto [torque, motion] = round_trip(*m, at);
    const std::string name = c.name;
    test::keeps("RNEA(ABA(τ)) - τ, " + name, torque, c.worst_torque);
    test::keeps("ABA(RNEA(a)) - a, " + name, motion, 1e-9);
    const auto ours = run(model, "gauss16", at, c.h, steps);
    test::keeps("gauss16 energy, " + name, ours.energy, test::random_walk(steps));
    EXPECT_FALSE(ours.drifts);
    test::breaks("rk4 energy, " + name, run(model, "rk4", at, c.h, steps).energy, 1e-11);
  }
}

TEST(StiffJoints, RatesFromAMillionthToAHundred) {
  // No gravity, no springs: a rate only sets the unit of time, so with h·rate fixed the runs are
  // the same.
  const mechanics::MechanicalModel model(
      std::make_shared<mechanics::Mechanism>(chain({1, 1, 1}, 0, 0)));
  const std::int64_t steps = 5000;
  double least = HUGE_VAL;
  for (const double rate : {1e-6, 1e-3, 1.0, 100.0}) {
    const Start at{{0.3, -0.7, 0.5}, {rate, -0.8 * rate, 0.6 * rate}};
    const auto ours = run(model, "gauss16", at, 0.05 / rate, steps),
               rk4 = run(model, "rk4", at, 0.05 / rate, steps);
    char name[64];
    std::snprintf(name, sizeof name, "rate %g rad/s", rate);
    test::keeps("gauss16 energy, " + std::string(name), ours.energy, test::random_walk(steps));
    test::breaks("rk4 energy, " + std::string(name), rk4.energy, 1e-9);
    least = std::min(least, rk4.energy);
    test::keeps("rk4, over the least of the rates - 1", rk4.energy / least - 1, 1e-3);
  }
}

}  // namespace
}  // namespace porthos::stiff_joints_test
