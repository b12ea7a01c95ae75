// What the discrete gradients keep besides H, and where.
#include <gtest/gtest.h>

#include "phs/system/user_model.h"
#include "tests/support/energy_run.h"
#include "tests/support/stiff.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::integrators::discrete_gradient_test {
namespace {

using Vec = std::vector<double>;
const char* const discrete_gradients[] = {"gonzalez", "mean_value", "itoh_abe", "itoh_abe2"};

// As δ → 0 the correction of the midpoint gradient goes to zero with δ², as a line integral; the
// textbook's difference of two energies leaves u|H| / |δ|.
TEST(Gonzalez, CorrectionVanishesWithTheStep) {
  const auto r = test::swinging_pendulum();
  auto system = r.model->instantiate<double>();
  for (double h : {1e-6, 1e-9, 1e-12}) {
    Vec delta[2];
    for (const char* name : {"gonzalez", "midpoint"}) {
      phs::State s = r.start;
      ASSERT_EQ(make_integrator(name, *r.model, h)->step(s), Outcome::ok);
      auto& d = delta[name[0] == 'm'];
      for (size_t k = 0; k < 4; ++k) d.push_back((s.x[k] - r.start.x[k]) + s.lo[k]);
    }
    double ours = 0, length = 0;
    for (size_t k = 0; k < 4; ++k) {
      ours = std::max(ours, std::fabs(delta[0][k] - delta[1][k]));
      length = std::max(length, std::fabs(delta[1][k]));
    }
    Vec m = r.start.x, x1 = m, e(4);
    for (size_t k = 0; k < 4; ++k) {
      m[k] += 0.5 * delta[1][k];
      x1[k] += delta[1][k];
    }
    system->gradient(m, e);
    double remainder = system->hamiltonian(x1) - system->hamiltonian(r.start.x), norm = 0;
    for (size_t k = 0; k < 4; ++k) {
      remainder -= e[k] * delta[1][k];
      norm += delta[1][k] * delta[1][k];
    }
    const double textbook = h * std::fabs(remainder) / std::sqrt(norm);
    std::printf("  h = %.0e: |correction| / |delta| %.1e   textbook %.1e\n", h, ours / length,
                textbook / length);
    EXPECT_LE(ours / length, std::max(10 * h * h, 3e-16));
    EXPECT_GT(textbook / length, 1e-13);
  }
}

TEST(DiscreteGradients, RestAtAnEquilibrium) {
  auto r = test::swinging_pendulum();
  r.start = phs::State(r.model->description(), {0, 0, 0, 0});
  for (const char* name : discrete_gradients) {
    phs::State s = r.start;
    ASSERT_EQ(make_integrator(name, *r.model, 0.1)->step(s), Outcome::ok) << name;
    for (size_t k = 0; k < 4; ++k) EXPECT_EQ(s.x[k] + s.lo[k], 0.0) << name;
  }
}

/// A point in the plane with a mass that depends on the radius, H = ½|p|²/(1 + |q|²) + |q|⁴/4:
/// non-separable, q × p kept.
struct Central {
  bool declares;
  phs::Description description() const {
    phs::Description d;
    d.name = "central";
    d.nx = 4;
    d.traits.canonical = true;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
    if (declares) d.invariants = {{"angular_momentum", 1, 0, 2, "kg m^2/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T r2 = x[0] * x[0] + x[1] * x[1];
    return T(0.5) * (x[2] * x[2] + x[3] * x[3]) / (T(1.0) + r2) + T(0.25) * r2 * r2;
  }
  template <class T>
  void invariants(std::span<const T> x, std::span<T> v) const {
    v[0] = x[0] * x[3] - x[1] * x[2];
  }
};

// The energy-momentum property comes from the declaration: undeclared, the same system drifts.
TEST(Gonzalez, KeepsDeclaredQuadraticInvariants) {
  const auto loss = [](bool declares, double& energy) {
    const phs::UserModel model(Central{declares});
    phs::State s(model.description(), {1.2, 0.1, -0.3, 0.9});
    const auto L = [&] {
      const auto x = test::unwrapped(model.description(), s);
      return double(x[0] * x[3] - x[1] * x[2]);
    };
    const double L0 = L();
    const auto H = [&] {
      const auto x = test::unwrapped(model.description(), s);
      return Central{}.hamiltonian<phs::Quad>(x);
    };
    const auto H0 = H();
    const auto method = make_integrator("gonzalez", model, 0.1);
    double worst = 0;
    for (int i = 0; i < 1000; ++i) {
      EXPECT_EQ(method->step(s), Outcome::ok);
      worst = std::max(worst, std::fabs(L() / L0 - 1));
      energy = std::max(energy, std::fabs(double(H() / H0 - 1)));
    }
    return worst;
  };
  double energy[2] = {0, 0};
  const double declared = loss(true, energy[0]), undeclared = loss(false, energy[1]);
  std::printf("  L declared %.1e (2e-15), undeclared %.1e;  H %.1e, %.1e (2e-14)\n", declared,
              undeclared, energy[0], energy[1]);
  EXPECT_LE(declared, 2e-15);
  EXPECT_GT(undeclared, 1e-6);
  EXPECT_LE(std::max(energy[0], energy[1]), 2e-14);
}

// A free body from tumbling to a steady spin, where all of δ is a symmetry and nothing is left to
// correct.
TEST(Gonzalez, FreeBody) {
  mechanics::BodySpec body;
  body.name = "body";
  body.parent = "world";
  body.joint.name = "base";
  body.joint.type = "free";
  body.mass = {1, {0, 0, 0}, {1, 0, 0, 2, 0, 3}};
  const mechanics::MechanicalModel model(std::make_shared<mechanics::Mechanism>(
      mechanics::MechanismBuilder("body").add(body).build()));
  test::Gauge gauge(model);
  for (double nutation : {1.0, 1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-10, 0.0}) {
    const Vec v{nutation, 0.3 * nutation, 1, 0.01, 0, 0.1};
    phs::State s(model.description(), model.state(model.mechanism().neutral(), v));
    const auto H0 = gauge.energy(s);
    const auto I0 = gauge.invariants(s);
    const auto method = make_integrator("gonzalez", model, 0.25);
    double H = 0, L = 0, xi = 0;
    for (int i = 0; i < 4000; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok);
      H = std::max(H, std::fabs(double((gauge.energy(s) - H0) / H0)));
      L = std::max(L, gauge.error("angular_momentum", s, I0));
      xi = std::max(xi, gauge.error("quaternion_norm.base.attitude", s, I0));
    }
    std::printf("  nutation %.0e: energy %.1e, angular momentum %.1e, |xi|^2 %.1e   bounds 1e-14\n",
                nutation, H, L, xi);
    EXPECT_LE(std::max({H, L, xi}), 1e-14);
  }
}

/// Euler's equations of a body whose energy is not quadratic: J(m) e = m × e, friction R = r |m|² 1
/// that depends on m.
struct Spin {
  double friction = 0;
  phs::Description description() const {
    phs::Description d;
    d.name = "spin";
    d.nx = 3;
    d.traits.lossless = friction == 0;
    d.blocks = {{"m", phs::BlockKind::linear, 0, 3, -1, "kg m^2/s", ""}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T a = x[0] * x[0], b = x[1] * x[1], c = x[2] * x[2];
    return T(0.5) * a + T(0.3) * b + T(0.2) * c + T(0.1) * a * b * b + T(0.2) * c * c;
  }
  template <class T>
  void structure(std::span<const T> x, std::span<const T> e, std::span<T> f) const {
    for (size_t i = 0; i < 3; ++i) {
      const size_t j = (i + 1) % 3, k = (i + 2) % 3;
      f[i] = x[j] * e[k] - x[k] * e[j];
    }
  }
  template <class T>
  void dissipation(std::span<const T> x, std::span<const T> e, std::span<T> Re) const {
    for (size_t i = 0; i < 3; ++i)
      Re[i] = T(friction) * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) * e[i];
  }
};

// J that depends on the state: energy exact where HBVM does not apply and midpoint fails.
TEST(DiscreteGradients, StateDependentStructure) {
  const phs::UserModel model(Spin{}), lossy(Spin{0.02});
  const auto text = misfit(declaration_of("hbvm4"), model.description());
  EXPECT_TRUE(text && text->find("needs a canonical system") != std::string::npos);
  const phs::State start(model.description(), {0.9, -0.7, 0.8});
  const auto error = [&](const phs::Model& m, const char* name) {
    auto system = m.instantiate<phs::Quad>();
    phs::State s = start;
    const auto method = make_integrator(name, m, 0.1);
    double worst = 0;
    const auto H0 = system->hamiltonian(test::unwrapped(m.description(), s));
    for (int i = 0; i < 1000; ++i) {
      EXPECT_EQ(method->step(s), Outcome::ok);
      const auto H = system->hamiltonian(test::unwrapped(m.description(), s));
      worst = std::max(worst, std::fabs(double(H / H0 - 1)));
    }
    return worst;
  };
  for (const char* name : discrete_gradients) {
    const double kept = error(model, name), lost = error(lossy, name);
    std::printf("  %-12s energy %.1e (2e-14), with friction it falls by %.2f\n", name, kept, lost);
    EXPECT_LE(kept, 2e-14) << name;
    EXPECT_GT(lost, 0.5) << name;
  }
  EXPECT_GT(error(model, "midpoint"), 1e-8);
}

/// A mass between two springs of different stiffness that meet at rest: H is once differentiable.
struct Stop {
  phs::Description description() const {
    phs::Description d;
    d.name = "stop";
    d.nx = 2;
    d.traits.canonical = true;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    using phs::select;
    const T k = select(x[0] < T(0.0), T(1.0), T(30.0));
    return T(0.5) * (x[1] * x[1] + k * x[0] * x[0]);
  }
};

TEST(Gonzalez, KeepsAnEnergyThatIsNotSmooth) {
  const phs::UserModel model(Stop{});
  const phs::State start(model.description(), {-1, 0.1});
  const auto error = [&](const char* name) {
    return test::energy_run(name, model, start, 0.05, 1000).energy;
  };
  test::keeps("gonzalez", error("gonzalez"), 1e-13);
  test::breaks("mean_value, by quadrature", error("mean_value"), 1e-9);
}

/// A driven oscillator, q'' = -q + cos 2t.
struct Driven {
  phs::Description description() const {
    phs::Description d;
    d.name = "driven";
    d.nx = 2;
    d.traits.canonical = true;
    d.traits.autonomous = false;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[0] * x[0] + x[1] * x[1]);
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    T s, c;
    phs::sincos(T(2.0) * t, s, c);
    dx[1] = dx[1] + c;
  }
};

// For quadratic H they are the midpoint rule, drive included.
TEST(DiscreteGradients, TakeADrive) {
  const phs::UserModel model(Driven{});
  for (const char* name : {"gonzalez", "mean_value"}) {
    phs::State a(model.description(), {1, 0}), b = a;
    const auto one = make_integrator(name, model, 0.1),
               other = make_integrator("midpoint", model, 0.1);
    for (int i = 0; i < 100; ++i) {
      ASSERT_EQ(one->step(a), Outcome::ok);
      ASSERT_EQ(other->step(b), Outcome::ok);
    }
    EXPECT_NEAR(a.x[0], b.x[0], 1e-14) << name;
    EXPECT_NEAR(a.x[1], b.x[1], 1e-14) << name;
  }
}

TEST(DiscreteGradients, DivergenceIsAStatus) {
  const auto robot = test::ets_vii(100);
  for (const char* name : {"gonzalez", "mean_value", "hbvm4"}) {
    phs::State s = robot.start;
    EXPECT_NE(make_integrator(name, *robot.model, 20.0)->step(s), Outcome::ok) << name;
    EXPECT_TRUE(s == robot.start) << name;
    s.x[20] = NAN;
    EXPECT_EQ(make_integrator(name, *robot.model, 0.1)->step(s), Outcome::not_finite) << name;
  }
}

/// Energy over `steps` steps, infinite where one fails; the remark of the method in `how`.
double stiff_energy(const phs::Model& model, const phs::State& start, const char* name, double h,
                    int steps, Solver solver, std::string& how) {
  Options o;
  o.solver = solver;
  const auto method = make_integrator(name, model, h, o);
  test::Gauge gauge(model);
  phs::State s = start;
  const auto H0 = gauge.energy(s);
  double worst = 0;
  for (int i = 0; i < steps; ++i) {
    if (method->step(s) != Outcome::ok) return HUGE_VAL;
    worst = std::max(worst, std::fabs(double((gauge.energy(s) - H0) / H0)));
  }
  char text[40];
  std::snprintf(text, sizeof text, " (%.0f sweeps)",
                double(method->cost().sweeps) / double(method->cost().steps));
  how = method->remark() + text;
  return worst;
}

// Joint springs far stiffer than the step resolves, h ω up to thousands: what the midpoint rule
// solves by Newton, the discrete gradients solve too, and keep H.
TEST(DiscreteGradients, StiffJoints) {
  for (const double k : {1e3, 1e4, 1e5, 1e6}) {
    const auto r = test::stiff_chain(8, k, 0);
    for (const char* name : {"midpoint", "gonzalez", "mean_value", "itoh_abe2"}) {
      std::string how;
      const double h = 0.05,
                   fixed = stiff_energy(*r.model, r.start, name, h, 10, Solver::fixed_point, how),
                   e = stiff_energy(*r.model, r.start, name, h, 40, Solver::automatic, how);
      std::printf("  k = %.0e m g l, %-10s energy %.1e   %s\n", k, name, e, how.c_str());
      EXPECT_EQ(fixed, HUGE_VAL) << "the control must fail, else nothing is stiff";
      EXPECT_LT(e, HUGE_VAL) << name;
      if (declaration_of(name).energy_exact == Claim::holds) {
        EXPECT_LE(e, 1e-13) << name;
      }
    }
  }
}

// Stiffness without a solver of its own, and far from linear: dense up to 100 numbers, then Krylov.
// mean_value goes on where gonzalez finds no solution.
TEST(DiscreteGradients, StiffQuarticSprings) {
  const auto check = [](const char* name, int masses, double h) {
    const phs::UserModel model(test::QuarticChain{masses});
    phs::State s(model.description(), Vec(2 * size_t(masses), 0.0));
    for (size_t i = 0; i < size_t(masses); ++i) s.x[i] = 0.3 * std::sin(1.0 + 2.0 * double(i));
    std::string how, what = std::to_string(masses) + " masses, " + name;
    EXPECT_EQ(stiff_energy(model, s, name, h, 10, Solver::fixed_point, how), HUGE_VAL)
        << "the control must fail, else nothing is stiff";
    const double e = stiff_energy(model, s, name, h, 20, Solver::automatic, how);
    what += ", h = " + std::to_string(h) + ": " + how;
    if (declaration_of(name).energy_exact == Claim::holds)
      test::keeps(what, e, 1e-14);
    else
      test::breaks(what, e, 0.1);
  };
  for (const char* name : {"midpoint", "gonzalez", "mean_value", "itoh_abe2"}) check(name, 8, 0.05);
  for (const char* name : {"midpoint", "gonzalez", "mean_value"}) check(name, 60, 0.05);
  for (const char* name : {"midpoint", "mean_value"}) check(name, 60, 0.2);
}

// A Jacobian frozen in an earlier step, at that step's start, is made again from memory().
TEST(DiscreteGradients, RestartUnderNewton) {
  int differ = 0;
  const auto robot = test::stiff_chain(4, 300, 0);
  for (const char* name : {"gonzalez", "mean_value", "itoh_abe2"})
    for (const auto solver : {Solver::automatic, Solver::newton_articulated, Solver::newton_dense,
                              Solver::newton_krylov}) {
      Options o;
      o.solver = solver;
      const auto make = [&] { return make_integrator(name, *robot.model, 0.02, o); };
      const auto run = [](Integrator& m, phs::State& s, int steps) {
        for (int i = 0; i < steps; ++i) EXPECT_EQ(m.step(s), Outcome::ok);
      };
      phs::State through = robot.start, stopped = robot.start;
      const auto whole = make(), first = make(), second = make();
      run(*whole, through, 60);
      run(*first, stopped, 23);
      EXPECT_GT(first->cost().factorisations, 0);
      second->restore(first->memory());
      phs::State forgetful = stopped;
      run(*second, stopped, 37);
      run(*make(), forgetful, 37);
      EXPECT_TRUE(through == stopped) << name << ", " << to_string(solver);
      differ += !(through == forgetful);
    }
  EXPECT_GT(differ, 0) << "the control must differ, else the test sees nothing";
}

// At these steps Newton wanders to where the residual is 1e25 and more and its solve returns
// nothing, by cancellation or overflow. Taken for convergence, that put H at 1e210.
TEST(DiscreteGradients, NoMoveIsNoConvergenceWhereTheResidualIsHuge) {
  const phs::UserModel model(test::QuarticChain{8});
  phs::State s(model.description(), Vec(16, 0.0));
  for (size_t i = 0; i < 8; ++i) s.x[i] = 0.3 * std::sin(1.0 + 2.0 * double(i));
  for (const double h : {0.1, 0.2}) {
    std::string how;
    const double e = stiff_energy(model, s, "gonzalez", h, 20, Solver::newton_krylov, how);
    std::printf("  h = %g: energy %.1e\n", h, e);
    EXPECT_TRUE(e == HUGE_VAL || e <= 1e-14);
  }
}

}  // namespace
}  // namespace porthos::integrators::discrete_gradient_test
