// Every reference case that needs only trees and uniform gravity, by gauss16: to max(1e-12, 1e-14
// kappa), which is what its README says a double can hold (kappa: the case's own amplification of a
// perturbation).
#include <cmath>

#include "integrators/core/integrator.h"
#include "tests/support/tree_case.h"

namespace porthos::trees_test {
namespace {

using integrators::make_integrator;
using integrators::Outcome;
using mechanics::MechanicalModel;
using nlohmann::json;
using test::number;
using test::numbers;
using Vec = std::vector<double>;

/// Steps a state to time t (a multiple of h).
void advance(integrators::Integrator& method, phs::State& s, double t) {
  while (double(s.step) * method.step_size() < t - 1e-9) ASSERT_EQ(method.step(s), Outcome::ok);
}

/// Worst ratio error / bound over the output times with kappa <= 1e10, and its print-out.
struct Verdict {
  double worst = 0;
  void note(const std::string& name, double t, double error, double kappa) {
    const double bound = test::double_bound(kappa);
    std::printf("  %-28s t = %-6g error %.1e   bound %.1e\n", name.c_str(), t, error, bound);
    EXPECT_LE(error, bound) << name << " at t = " << t;
    worst = std::max(worst, error / bound);
  }
};

/// The cases give the amplification of a perturbation of the *initial* state, a lower bound.
/// Rounding perturbs every step: where the motion lingers near an unstable state the amplification
/// from there counts. Largest growth of a 1e-10 perturbation put in at 16 times up to t.
double amplification(const MechanicalModel& model, const phs::State& start, double h, double t) {
  const auto method = make_integrator("gauss16", model, h);
  const auto size = [](const Vec& x) {
    double n = 0;
    for (double c : x) n += c * c;
    return std::sqrt(n);
  };
  phs::State end = start;
  advance(*method, end, t);
  double worst = 0;
  for (int k = 0; k < 16; ++k) {
    phs::State at = start;
    const auto run = make_integrator("gauss16", model, h);
    advance(*run, at, t * k / 16);
    const double scale = size(at.x);
    for (size_t i = 0; i < at.x.size(); ++i)
      at.x[i] += 1e-10 * scale * (i % 2 ? 1 : -0.5) / std::sqrt(double(at.x.size()));
    advance(*run, at, t);
    Vec d = at.x;
    for (size_t i = 0; i < d.size(); ++i) d[i] -= end.x[i];
    worst = std::max(worst, size(d) / (1e-10 * scale));
  }
  return worst;
}

Vec unwrapped(const phs::State& s, const phs::Description& d, size_t count) {
  Vec q(count);
  for (size_t i = 0; i < count; ++i) q[i] = s.x[i];
  size_t turn = 0;
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle)
      q[size_t(b.at)] =
          double((long double)s.x[size_t(b.at)] + s.lo[size_t(b.at)] +
                 2 * 3.14159265358979323846264338327950288L * (long double)s.turns[turn++]);
  return q;
}

// --- pendula: absolute angles and closed forms ---------------------------------------------------

void planar(const std::string& name, double h) {
  const json file = test::read_json(test::data_file("reference/" + name + ".json"));
  const auto& p = file["generator"]["parameters"];
  const bool single = p["sys"] == "ddp";
  const auto m = single ? test::planar_chain({number(p["m"])}, {number(p["l"])}, {number(p["l"])},
                                             {0}, number(p["g"]))
                        : test::planar_chain(numbers(p["m"]), numbers(p["L"]), numbers(p["c"]),
                                             numbers(p["I"]), number(p["g"]));
  const MechanicalModel model(m);
  const size_t n = size_t(m->nv());
  const Vec initial = numbers(file["initial_state"]);
  Vec q(n), v(n);
  for (size_t i = 0; i < n; ++i) {  // absolute to relative angles
    q[i] = initial[i] - (i ? initial[i - 1] : 0);
    v[i] = single ? initial[1] : initial[n + i] - (i ? initial[n + i - 1] : 0);
  }
  phs::State s(model.description(), model.state(q, v));
  const phs::State start = s;
  const auto method = make_integrator("gauss16", model, h);
  Verdict verdict;
  const auto times = numbers(file["times"]);
  for (size_t k = 0; k < times.size(); ++k) {
    advance(*method, s, times[k]);
    const Vec reference =
        single ? numbers(file["closed_form"]["state"][k]) : numbers(file["outputs"][k]["group0"]);
    Vec angle = unwrapped(s, model.description(), n), rate = model.rates(s.x);
    for (size_t i = 1; i < n; ++i) {
      angle[i] += angle[i - 1];
      rate[i] += rate[i - 1];
    }
    double error = 0, scale = 1e-3;
    for (size_t i = 0; i < n; ++i)
      scale = std::max({scale, std::fabs(reference[n + i]), std::fabs(initial[i])});
    for (size_t i = 0; i < n; ++i)
      error = std::max({error, std::fabs(angle[i] - reference[i]) / scale,
                        std::fabs(rate[i] - reference[n + i]) / scale});
    double kappa = number(file["sensitivity_by_time"][k]);
    if (name == "a_pendulum_near_separatrix")
      kappa = std::max(kappa, amplification(model, start, h, times[k]));
    verdict.note(name, times[k], error, kappa);
  }
}

TEST(Reference, PendulumLarge) { planar("a_pendulum_large", 1.0 / 32); }
TEST(Reference, PendulumNearSeparatrix) { planar("a_pendulum_near_separatrix", 1.0 / 32); }
TEST(Reference, PendulumRotating) { planar("a_pendulum_rotating", 1.0 / 32); }
TEST(Reference, DoublePendulum) { planar("d_double_pendulum_regular", 1.0 / 32); }
TEST(Reference, TriplePendulum) { planar("e_triple_pendulum", 1.0 / 64); }

TEST(Reference, IftommA01) {
  const json file = test::read_json(test::data_file("reference/j_a01_simple_pendulum.json"));
  const MechanicalModel model(test::planar_chain({1}, {1}, {1}, {0}, 9.81));
  phs::State s(model.description(), model.state(Vec{M_PI / 2}, Vec{0}));
  const double h = 1.0 / 32;
  const auto method = make_integrator("gauss16", model, h);
  for (const auto& o : file["outputs"]) {
    const double t = number(o["t"]);
    if (std::fabs(t / h - std::round(t / h)) > 1e-9) continue;
    advance(*method, s, t);
    const double error = std::max(std::fabs(s.x[0] - number(o["theta"])),
                                  std::fabs(model.rates(s.x)[0] - number(o["theta_dot"])));
    // An integrable oscillator: a relative error of 1e-16 in the energy becomes a phase error
    // growing with t.
    const double bound = std::max(1e-12, 1e-14 * t);
    std::printf("  a01 t = %-6g error %.1e   bound %.1e\n", t, error, bound);
    EXPECT_LE(error, bound);
  }
}

// --- tops ----------------------------------------------------------------------------------------

/// A body whose state row is quaternion and body rate, on the given joint.
void top(const std::string& name, const std::string& joint, const mechanics::MassProperties& mass,
         const mechanics::Vec3d& gravity, double h) {
  const json file = test::read_json(test::data_file("reference/" + name + ".json"));
  mechanics::BodySpec body;
  body.name = "top";
  body.parent = "world";
  body.joint.type = joint;
  body.mass = mass;
  const MechanicalModel model(std::make_shared<mechanics::Mechanism>(
      mechanics::MechanismBuilder(name).gravity(gravity).add(body).build()));
  const Vec initial = numbers(file["initial_state"]);
  const size_t at = joint == "free" ? 3 : 0;
  Vec q(at + 4, 0.0), v(size_t(model.mechanism().nv()), 0.0);
  for (size_t i = 0; i < 4; ++i) q[at + i] = initial[i];
  for (size_t i = 0; i < 3; ++i) v[i] = initial[4 + i];
  phs::State s(model.description(), model.state(q, v));
  const phs::State start = s;
  const auto method = make_integrator("gauss16", model, h);
  const test::RowError row_error(file["outputs"], "group1");
  Verdict verdict;
  const auto times = numbers(file["times"]);
  for (size_t k = 0; k < times.size(); ++k) {
    advance(*method, s, times[k]);
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&s.x[at]));
    const Vec w = model.rates(s.x);
    const Vec row{R.x.x, R.y.x, R.z.x, R.x.y, R.y.y, R.z.y, R.x.z, R.y.z, R.z.z, w[0], w[1], w[2]};
    double kappa = number(file["sensitivity_by_time"][k]);
    if (name == "b_euler_dzhanibekov")
      kappa = std::max(kappa, amplification(model, start, h, times[k]));
    verdict.note(name, times[k], row_error(row, numbers(file["outputs"][k]["group1"])), kappa);
  }
}

TEST(Reference, EulerDzhanibekov) {
  top("b_euler_dzhanibekov", "free", {1, {0, 0, 0}, {1, 0, 0, 2, 0, 3}}, {0, 0, 0}, 0.125);
}
TEST(Reference, EulerGeneric) {
  top("b_euler_generic", "free", {1, {0, 0, 0}, {1, 0, 0, 2, 0, 3}}, {0, 0, 0}, 0.125);
}
TEST(Reference, LagrangeTop) {
  top("c_lagrange_top", "spherical", {1, {0, 0, 0.5}, {1, 0, 0, 1, 0, 0.5}}, {0, 0, -9.8125},
      1.0 / 64);
}

// --- trees ---------------------------------------------------------------------------------------

void tree(const std::string& name, double h) {
  const json file = test::read_json(test::data_file("reference/" + name + ".json"));
  const auto m = test::tree_mechanism(file);
  const MechanicalModel model(m);
  Vec q, v;
  test::split_row(*m, numbers(file["initial_state"]), q, v);
  phs::State s(model.description(), model.state(q, v));
  const auto method = make_integrator("gauss16", model, h);
  const test::RowError row_error(file["outputs"]);
  Verdict verdict;
  const auto times = numbers(file["times"]);
  for (size_t k = 0; k < times.size(); ++k) {
    advance(*method, s, times[k]);
    Vec at = unwrapped(s, model.description(), size_t(m->nq()));
    const Vec reference = numbers(file["outputs"][k]["group0"]);
    if (m->nq() != m->nv() &&
        at[3] * reference[3] + at[4] * reference[4] + at[5] * reference[5] + at[6] * reference[6] <
            0)
      for (size_t i = 3; i < 7; ++i) at[i] = -at[i];  // q and -q are one attitude
    verdict.note(name, times[k], row_error(test::join_row(*m, at, model.rates(s.x)), reference),
                 number(file["sensitivity_by_time"][k]));
  }
}

TEST(Reference, Chain5) { tree("e_chain5_revolute", 1.0 / 128); }
TEST(Reference, FloatingArmWithSpringsAndDampers) { tree("g_floating_arm_damped", 1.0 / 64); }

}  // namespace
}  // namespace porthos::trees_test
