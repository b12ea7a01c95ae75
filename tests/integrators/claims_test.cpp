// What each method declares, with a method that must fail the same test.
#include <gtest/gtest.h>

#include "integrators/gauss.h"
#include "mechanics/aba.h"
#include "mechanics/momentum.h"
#include "tests/support/robots.h"
#include "tests/support/symplectic.h"

namespace porthos::integrators {
namespace {

using Vec = std::vector<double>;
using test::jacobian_of_steps, test::symplectic_defect;

const Declaration& declaration(const std::string& name) {
  for (const auto& d : catalogue())
    if (d.name == name) return d;
  throw InvalidArgument("no such method");
}

/// Partitioned methods lose general quadratic invariants but keep the bilinear ones, momentum maps among them; with the
/// multipliers of the base also the quaternion norm.
bool partitioned(const Declaration& d) {
  return d.name == "stormer_verlet" || d.name.ends_with("_sv");
}

void run(Integrator& method, phs::State& s, std::int64_t steps) {
  for (std::int64_t i = 0; i < steps; ++i)
    ASSERT_EQ(method.step(s), Outcome::ok) << method.declaration().name << " step " << i;
}

const mechanics::MechanicalModel& pendulum() {
  static const mechanics::MechanicalModel m(
      test::planar_chain({1, 1}, {1, 1}, {0.5, 0.5}, {1. / 12, 1. / 12}, 9.81));
  return m;
}
const Vec pendulum_start{0.7, -0.4, 1.1, 0.5};

TEST(Claims, Symplectic) {
  for (const auto& d : catalogue()) {
    if (d.rival || misfit(d, pendulum().description())) continue;
    const double h = d.name == "yoshida8" ? 0.03 : 0.1;  // it has sub-steps of 2.4 h
    const double defect =
        symplectic_defect(jacobian_of_steps(d.name, pendulum(), pendulum_start, h), 4);
    std::printf("  %-16s %-6s defect %.1e   bound 1e-13\n", d.name.c_str(), to_string(d.symplectic),
                defect);
    if (d.symplectic == Claim::holds) {
      EXPECT_LE(defect, 1e-13) << d.name;
    }
    if (d.symplectic == Claim::fails) {
      EXPECT_GT(defect, 1e-6) << d.name << " must fail";
    }
  }
}

// Velocity Verlet on M(q) q'' = f, with its explicit "forces" that depend on the velocity, is not symplectic.
TEST(Claims, VelocityVerletWithVariableMassIsNotSymplectic) {
  const auto& m = pendulum().mechanism();
  mechanics::Workspace<phs::Dual> w(m);
  auto system = pendulum().instantiate<phs::Dual>();
  const double h = 0.1;
  Vec Psi(16);
  for (size_t j = 0; j < 4; ++j) {
    std::vector<phs::Dual> x(pendulum_start.begin(), pendulum_start.end()), f(4), a(2), p(2);
    x[j].d = 1;
    system->field(0.0, x, {}, f);
    std::vector<phs::Dual> q(x.begin(), x.begin() + 2), v(f.begin(), f.begin() + 2);
    mechanics::aba<phs::Dual>(m, w, q, v, {}, a);
    for (size_t i = 0; i < 2; ++i) v[i] += 0.5 * h * a[i], q[i] += h * v[i];
    mechanics::aba<phs::Dual>(m, w, q, v, {}, a);
    for (size_t i = 0; i < 2; ++i) v[i] += 0.5 * h * a[i];
    mechanics::momenta_from_rates<phs::Dual>(m, w, q, v, p);
    for (size_t i = 0; i < 2; ++i) Psi[i * 4 + j] = q[i].d, Psi[(i + 2) * 4 + j] = p[i].d;
  }
  const double defect = symplectic_defect(Psi, 4);
  std::printf("  velocity Verlet, M(q): defect %.1e   must exceed 1e-3\n", defect);
  EXPECT_GT(defect, 1e-3);
}

TEST(Claims, Symmetric) {
  const auto robot = test::ets_vii(5);
  for (const auto& d : catalogue()) {
    if (d.rival || misfit(d, robot.model->description())) continue;
    phs::State s = robot.start;
    run(*make_integrator(d.name, *robot.model, 0.125), s, 40);
    s.step = 0;
    run(*make_integrator(d.name, *robot.model, -0.125), s, 40);
    double worst = 0;
    for (size_t i = 0; i < s.x.size(); ++i)
      worst =
          std::max(worst, std::fabs(s.x[i] - robot.start.x[i]) / (1 + std::fabs(robot.start.x[i])));
    std::printf("  %-16s %-6s forth and back %.1e   bound 1e-13\n", d.name.c_str(),
                to_string(d.symmetric), worst);
    if (d.symmetric == Claim::holds)
      EXPECT_LE(worst, 1e-13) << d.name;
    else
      EXPECT_GT(worst, 1e-10) << d.name << " must fail";
  }
}

TEST(Claims, QuadraticInvariants) {
  const auto robot = test::ets_vii(5);
  test::Gauge gauge(*robot.model);
  const auto start = gauge.invariants(robot.start);
  for (const auto& d : catalogue()) {
    if (d.rival || misfit(d, robot.model->description())) continue;
    phs::State s = robot.start;
    const auto method = make_integrator(d.name, *robot.model, 0.1);
    run(*method, s, 2000);
    const double L = gauge.error("angular_momentum", s, start),
                 P = gauge.error("linear_momentum", s, start),
                 xi = gauge.error("quaternion_norm.base.attitude", s, start);
    std::printf("  %-16s %-6s L %.1e  P %.1e  |xi|^2 %.1e   bounds 2e-14\n", d.name.c_str(),
                to_string(d.quadratic_invariants), L, P, xi);
    EXPECT_LE(P, 2e-14) << d.name;  // linear: every method keeps it
    if (d.quadratic_invariants == Claim::holds || partitioned(d)) {
      EXPECT_LE(L, 2e-14) << d.name;
      EXPECT_LE(xi, 2e-14) << d.name;
    } else {
      EXPECT_GT(L, 1e-12) << d.name << " must fail";
    }
  }
}

TEST(Claims, EnergyOfNoMethodIsExactButSymplecticOnesDoNotDrift) {
  const auto robot = test::ets_vii(3);
  test::Gauge gauge(*robot.model);
  const auto H0 = gauge.energy(robot.start);
  const auto worst_in = [&](Integrator& method, phs::State& s, int steps) {
    double worst = 0;
    for (int i = 0; i < steps; ++i) {
      if (method.step(s) != Outcome::ok) return HUGE_VAL;
      worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0) / H0)));
    }
    return worst;
  };
  for (const char* name : {"midpoint", "stormer_verlet", "gauss4", "rk4"}) {
    phs::State s = robot.start;
    const auto method = make_integrator(name, *robot.model, 0.1);
    const double early = worst_in(*method, s, 3000);
    worst_in(*method, s, 24000);
    const double late = worst_in(*method, s, 3000);
    std::printf("  %-16s energy band: first 300 s %.1e, last 300 s of 3000 %.1e, ratio %.2f\n",
                name, early, late, late / early);
    EXPECT_GT(early, 1e-12) << name;
    if (declaration(name).symplectic == Claim::holds)
      EXPECT_LE(late, 2 * early) << name;
    else
      EXPECT_GT(late, 3 * early) << name << " must drift";
  }
}

// Stages as lanes give the bits of scalar stages, for every stage count.
TEST(Gauss, StageLanesEqualScalarStages) {
  const auto robot = test::ets_vii(5);
  for (int s = 1; s <= 8; ++s) {
    const std::string name = "gauss" + std::to_string(2 * s);
    Options scalar;
    scalar.lanes = false;
    phs::State a = robot.start, b = robot.start;
    const auto lanes_method = make_integrator(name, *robot.model, 0.1),
               scalar_method = make_integrator(name, *robot.model, 0.1, scalar);
    run(*lanes_method, a, 300), run(*scalar_method, b, 300);
    EXPECT_TRUE(a == b) << name;
    EXPECT_EQ(lanes_method->memory(), scalar_method->memory()) << name;
  }
}

// A method restarted from (state, memory) continues with the same bits; without the low words it does not.
TEST(Claims, RestartIsContinuation) {
  const auto robot = test::ets_vii(5);
  for (const auto& d : catalogue()) {
    if (!d.resumable || misfit(d, robot.model->description())) continue;
    phs::State through = robot.start, stopped = robot.start;
    const auto one = make_integrator(d.name, *robot.model, 0.1);
    run(*one, through, 200);
    const auto first = make_integrator(d.name, *robot.model, 0.1);
    run(*first, stopped, 77);
    phs::State forgetful = stopped;
    const auto second = make_integrator(d.name, *robot.model, 0.1);
    second->restore(first->memory());
    run(*second, stopped, 123);
    EXPECT_TRUE(through == stopped) << d.name;
    if (d.name == "gauss16") {
      const auto third = make_integrator(d.name, *robot.model, 0.1);
      std::fill(forgetful.lo.begin(), forgetful.lo.end(),
                0.0);  // a restart that forgets the low words
      run(*third, forgetful, 123);
      EXPECT_FALSE(through == forgetful) << "the control must differ, else the test sees nothing";
    }
  }
}

/// μ_ij + μ_ji - 1 without rounding.
double exact_pair(const GaussTable<double>& t, int i, int j) {
  return double(phs::Quad(t.mu[size_t(i * t.s + j)]) + phs::Quad(t.mu[size_t(j * t.s + i)]) - 1);
}

TEST(Gauss, TableIsExactlySymplecticInFloatingPoint) {
  for (int s = 1; s <= 8; ++s) {
    const auto t = gauss_table<double>(s);
    for (int i = 0; i < s; ++i)
      for (int j = 0; j < s; ++j) EXPECT_EQ(exact_pair(t, i, j), 0.0) << s;
    for (double h : {0.5, 0.1, 0.02, 1.0 / 3}) {
      std::vector<double> hb(t.b.size());
      t.weights(h, hb);
      phs::Quad exact = 0;
      for (double w : hb) exact += w;
      EXPECT_EQ(double(exact - phs::Quad(h)), 0.0)
          << "weights of s = " << s << " must sum to h exactly";
      for (int i = 0; i < s; ++i) EXPECT_EQ(hb[size_t(i)], hb[size_t(s - 1 - i)]);
    }
  }
  int inexact = 0;
  const auto wrong = gauss_table_wrong_triangle(8);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) inexact += exact_pair(wrong, i, j) != 0;
  EXPECT_GT(inexact, 20) << "negative control: the other triangle leaves inexact pairs";
}

TEST(Catalogue, RefusesNonsense) {
  const auto robot = test::ets_vii();
  const auto text = [&](const std::string& method, double h) -> std::string {
    try {
      make_integrator(method, *robot.model, h);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(text("gauss15", 0.1).find("unknown method 'gauss15', expected one of gauss16, gauss14"),
            std::string::npos);
  EXPECT_NE(text("gauss16", 0).find("step is 0"), std::string::npos);
  EXPECT_NE(text("gauss16", NAN).find("expected a finite number other than 0"), std::string::npos);
}

// A step far too long is a status, not a wrong answer; the state is left as it was.
TEST(Gauss, DivergenceIsAStatus) {
  const auto robot = test::ets_vii(100);
  for (const char* name : {"gauss16", "gauss2", "stormer_verlet"}) {
    phs::State s = robot.start;
    const Outcome o = make_integrator(name, *robot.model, 20.0)->step(s);
    EXPECT_NE(o, Outcome::ok) << name;
    EXPECT_TRUE(s == robot.start) << name;
  }
  phs::State s = robot.start;
  s.x[20] = NAN;
  const phs::State before = s;
  EXPECT_EQ(make_integrator("gauss16", *robot.model, 0.1)->step(s), Outcome::not_finite);
  EXPECT_EQ(std::isnan(s.x[20]), std::isnan(before.x[20]));
}

}  // namespace
}  // namespace porthos::integrators
