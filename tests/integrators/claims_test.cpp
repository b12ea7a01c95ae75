// What each method declares, with a method that must fail the same test.
#include <gtest/gtest.h>

#include <functional>

#include "integrators/methods/collocation.h"
#include "integrators/methods/gauss.h"
#include "mechanics/aba.h"
#include "mechanics/momentum.h"
#include "tests/integrators/problems.h"
#include "tests/support/gauss.h"
#include "tests/support/gsl_methods.h"
#include "tests/support/symplectic.h"

namespace porthos::integrators::claims_test {
namespace {

using Vec = std::vector<double>;

void run(Integrator& method, phs::State& s, std::int64_t steps) {
  for (std::int64_t i = 0; i < steps; ++i)
    ASSERT_EQ(method.step(s), Outcome::ok) << method.declaration().name << " step " << i;
}

/// yoshida8 has sub-steps of 2.4 h, and Tao's methods must resolve their binding, 20 rad/s.
test::Problem step_for(const Declaration& d, test::Problem p) {
  if (d.name == "yoshida8") p.h *= 0.3;
  if (d.name.starts_with("tao")) p.h *= 0.2;
  return p;
}

/// Judges one property of every method of ours: `measure` gives its defect on a problem. What holds
/// must stay within `bound` on every fitting problem; what fails must go beyond `visible` on one of
/// them, else the test sees nothing.
void judge(const char* property, Claim Declaration::*claim, double bound, double visible,
           const std::function<double(const Declaration&, const test::Problem&)>& measure) {
  std::printf("  %s: holds <= %.0e, fails > %.0e\n", property, bound, visible);
  for (const auto& d : catalogue()) {
    if (d.rival || d.needs.contacts) continue;  // those: tests/contact/time_stepping_test.cpp
    double worst = 0;
    std::string line;
    for (const auto& p : test::problems()) {
      if (!test::fits(d, p)) continue;
      const double defect = measure(d, step_for(d, p));
      worst = !(defect <= worst) ? defect : worst;
      char text[32];
      std::snprintf(text, sizeof text, "  %8.1e", defect);
      line += text;
    }
    std::printf("    %-22s %-7s%s\n", d.name.c_str(), to_string(d.*claim), line.c_str());
    if (d.*claim == Claim::holds) {
      EXPECT_LE(worst, bound) << d.name << ": " << property;
    } else if (d.*claim == Claim::fails &&
               d.order > 0) {  // order 0 works to round-off: unseen here
      EXPECT_GT(worst, visible) << d.name << " must fail: " << property;
    }
  }
}

TEST(Claims, Symplectic) {
  judge("|Psi' J Psi - J|", &Declaration::symplectic, 1e-13, 1e-9,
        [](const Declaration& d, const test::Problem& p) {
          return test::symplectic_defect(d.name, *p.model, p.start.x, test::tangents(p), p.h,
                                         d.symplectic == Claim::holds);
        });
}

// Velocity Verlet on M(q) q'' = f, with its explicit "forces" that depend on the velocity, is not
// symplectic.
TEST(Claims, VelocityVerletWithVariableMassIsNotSymplectic) {
  const auto problem = test::double_pendulum();
  const auto& model = dynamic_cast<const mechanics::MechanicalModel&>(*problem.model);
  const auto& m = model.mechanism();
  mechanics::Workspace<phs::Dual> w(m);
  auto system = model.instantiate<phs::Dual>();
  const double h = problem.h;
  std::vector<Vec> images;
  const auto basis = test::tangents(problem);
  for (const auto& u : basis) {
    std::vector<phs::Dual> x(problem.start.x.begin(), problem.start.x.end()), f(4), a(2), p(2);
    for (size_t i = 0; i < 4; ++i) x[i].d = u[i];
    system->field(0.0, x, {}, f);
    std::vector<phs::Dual> q(x.begin(), x.begin() + 2), v(f.begin(), f.begin() + 2);
    mechanics::aba<phs::Dual>(m, w, q, v, {}, a);
    for (size_t i = 0; i < 2; ++i) {
      v[i] += 0.5 * h * a[i];
      q[i] += h * v[i];
    }
    mechanics::aba<phs::Dual>(m, w, q, v, {}, a);
    for (size_t i = 0; i < 2; ++i) v[i] += 0.5 * h * a[i];
    mechanics::momenta_from_rates<phs::Dual>(m, w, q, v, p);
    images.push_back({q[0].d, q[1].d, p[0].d, p[1].d});
  }
  const double defect = test::symplectic_defect(basis, images);
  std::printf("  velocity Verlet, M(q): defect %.1e   must exceed 1e-3\n", defect);
  EXPECT_GT(defect, 1e-3);
}

TEST(Claims, Symmetric) {
  judge("20 steps forth and 20 back", &Declaration::symmetric, 2e-12, 1e-9,
        [](const Declaration& d, const test::Problem& p) {
          return symmetry_defect(d.name, *p.model, p.start, p.h);
        });
}

TEST(Claims, QuadraticInvariants) {
  judge("change of quadratic invariants", &Declaration::quadratic_invariants, 2e-14, 1e-11,
        [](const Declaration& d, const test::Problem& p) {
          const auto defect = invariant_defect(d.name, *p.model, p.start, p.h);
          if (!d.name.starts_with("itoh_abe")) {  // that is no Runge-Kutta method
            EXPECT_LE(defect.linear, 2e-14) << d.name << ": keeps the linear ones";
          }
          return defect.quadratic;
        });
}

TEST(Claims, EnergyExact) {
  judge("largest change of H in 100 steps", &Declaration::energy_exact, 3e-13, 1e-10,
        [](const Declaration& d, const test::Problem& p) {
          return energy_defect(d.name, *p.model, p.start, p.h);
        });
}

TEST(Claims, SymplecticMethodsDoNotDrift) {
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
    if (declaration_of(name).symplectic == Claim::holds)
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
    run(*lanes_method, a, 300);
    run(*scalar_method, b, 300);
    EXPECT_TRUE(a == b) << name;
    EXPECT_EQ(lanes_method->memory(), scalar_method->memory()) << name;
  }
}

// A method restarted from (state, memory) continues with the same bits; without the low words it
// does not.
TEST(Claims, RestartIsContinuation) {
  for (const auto& d : catalogue()) {
    if (!d.resumable) continue;
    for (const auto& problem : test::problems()) {
      const auto p = step_for(d, problem);
      if (!test::fits(d, p)) continue;
      phs::State through = p.start, stopped = p.start;
      run(*make_integrator(d.name, *p.model, p.h), through, 100);
      const auto first = make_integrator(d.name, *p.model, p.h);
      run(*first, stopped, 37);
      phs::State forgetful = stopped;
      const auto second = make_integrator(d.name, *p.model, p.h);
      second->restore(first->memory());
      run(*second, stopped, 63);
      EXPECT_TRUE(through == stopped) << d.name << " on " << p.name;
      if (d.name != "gauss16") continue;
      std::fill(forgetful.lo.begin(), forgetful.lo.end(), 0.0);  // a restart that forgets them
      run(*make_integrator(d.name, *p.model, p.h), forgetful, 63);
      EXPECT_FALSE(through == forgetful) << "the control must differ, else the test sees nothing";
    }
  }
}

/// μ_ij + μ_ji - 1 without rounding.
double exact_pair(const CollocationTable<double>& t, int i, int j) {
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
}  // namespace porthos::integrators::claims_test
