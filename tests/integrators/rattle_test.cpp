// RATTLE and its compositions on loops: order, manifold, momenta, energy, and what Verlet on
// eliminated multipliers loses. Symmetry and symplecticity: claims_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/rivals/index_one.h"
#include "tests/integrators/problems.h"
#include "tests/support/exact_start.h"
#include "tests/support/rollers.h"

namespace porthos::integrators::rattle_test {
namespace {

using phs::Quad;
using test::Vec;

/// A four-bar under gravity, whose Hamiltonian does not separate, in 113 bits after half a second.
void expect_order(const std::string& name, int order, int coarse, double tolerance) {
  auto l = test::four_bar("spherical");
  const auto model = l.model();
  const auto x = test::exact_start(l, model);
  const auto end = [&](const std::string& method, int steps) {
    phs::BasicState<Quad> s(model.description(), x);
    const auto m = make_basic_integrator<Quad>(method, model, Quad(0.5) / steps);
    for (int i = 0; i < steps; ++i) EXPECT_EQ(m->step(s), Outcome::ok) << method;
    for (size_t i = 0; i < s.x.size(); ++i) s.x[i] += s.lo[i];
    return s.x;
  };
  static const auto exact = end("spark16", 64);
  const double e1 = test::distance(end(name, coarse), exact),
               e2 = test::distance(end(name, 2 * coarse), exact), measured = std::log2(e1 / e2);
  std::printf("  %s: errors %.2e, %.2e, order %.2f\n", name.c_str(), e1, e2, measured);
  EXPECT_NEAR(measured, order, tolerance) << name;
}
TEST(Rattle, OrderIn113Bits) {
  expect_order("rattle", 2, 64, 0.05);
  expect_order("suzuki4_rattle", 4, 32, 0.15);
  expect_order("kahan_li8_rattle", 8, 16, 0.4);
}

struct Off {
  double gap = 0, slip = 0, drift = 0;  ///< largest over a run: |g|, |Gv|, change of invariants
  double rms = 0, early = 0;            ///< of the energy error [J], of all steps and of 1/16
};
Off run(const std::string& name, const phs::Model& model, const Vec& x, double h, int steps) {
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  test::Gauge gauge(model);
  phs::State s(model.description(), x);
  const auto method = make_integrator(name, model, h);
  const size_t k = size_t(model.description().invariant_count());
  Vec g(size_t(rows->count())), e(x.size()), first(k), now(k);
  system->invariants(x, first);
  const long double H = gauge.energy(s);
  const auto see = [](double& most, const Vec& values) {
    for (const double v : values) most = std::max(most, std::fabs(v));
  };
  Off off;
  double sum = 0;
  for (int i = 1; i <= steps; ++i) {
    EXPECT_EQ(method->step(s), Outcome::ok) << name << " " << i << " " << method->remark();
    rows->place(s.x, g);
    see(off.gap, g);
    system->gradient(s.x, e);
    rows->rates(e, g);
    see(off.slip, g);
    system->invariants(s.x, now);
    for (size_t j = 0; j < k; ++j) off.drift = std::max(off.drift, std::fabs(now[j] - first[j]));
    for (const double w : method->port_work()) EXPECT_LT(std::fabs(w), 1e-14);
    const double error = double(gauge.energy(s) - H);
    sum += error * error;
    if (i == steps / 16) off.early = std::sqrt(sum / i);
  }
  off.rms = std::sqrt(sum / steps);
  std::printf("  %-16s on %s: |g| %.1e, |Gv| %.1e, invariants %.1e, energy %.1e J (early %.1e)",
              name.c_str(), model.description().name.c_str(), off.gap, off.slip, off.drift, off.rms,
              off.early);
  std::printf(", %.1f sweeps\n", double(method->cost().sweeps) / steps);
  return off;
}

TEST(Rattle, StaysOnTheManifoldAndKeepsMomenta) {
  for (const auto& p : test::problems()) {
    if (p.model->description().constraints.empty()) continue;
    for (const char* name : {"rattle", "suzuki4_rattle"}) {
      const Off off = run(name, *p.model, p.start.x, p.h / 4, 4096);
      EXPECT_LT(off.gap, 2e-15) << name;
      EXPECT_LT(off.slip, 2e-14) << name;
      EXPECT_LT(off.drift, 1e-14) << name;
      EXPECT_LT(off.rms, 2 * off.early) << name;  // a drift gives 16
    }
  }
}
/// Control: Verlet's kicks and drift on what is left when multipliers are eliminated.
TEST(Rattle, VerletOnEliminatedMultipliersLeavesTheManifold) {
  auto l = test::four_bar("spherical");
  const auto model = l.model();
  const IndexOneModel eliminated(model);
  const auto field = eliminated.instantiate<double>(), system = model.instantiate<double>();
  const auto rows = system->constraints();
  Vec x = l.start(), f(x.size()), e(x.size()), g(size_t(rows->count()));
  const size_t n = x.size() / 2;
  const double h = 1. / 128, H = system->hamiltonian(x);
  double gap = 0, slip = 0;
  for (int i = 0; i < 128; ++i) {
    const auto kick = [&] {
      field->field(0, x, {}, f);
      for (size_t k = n; k < 2 * n; ++k) x[k] += h / 2 * f[k];
    };
    kick();
    field->field(0, x, {}, f);
    for (size_t k = 0; k < n; ++k) x[k] += h * f[k];
    kick();
    rows->place(x, g);
    for (const double v : g) gap = std::max(gap, std::fabs(v));
    system->gradient(x, e);
    rows->rates(e, g);
    for (const double v : g) slip = std::max(slip, std::fabs(v));
  }
  std::printf("  Verlet: |g| %.1e, |Gv| %.1e, energy %.1e J\n", gap, slip,
              system->hamiltonian(x) - H);
  EXPECT_GT(gap, 1e-4);
  EXPECT_GT(slip, 1e-4);
}

/// What the motor of a driven joint puts in, and the energy that is there: they agree to order 2.
TEST(Rattle, DrivenJointsFollowTheirMotion) {
  auto l = test::driven_pendulum(phs::swinging_motion(0.25, 0.75, 0.625, 0.5));
  const auto model = l.model();
  const Vec x = l.start();
  const auto balance = [&](int steps) {
    const auto rows = model.instantiate<double>()->constraints();
    test::Gauge gauge(model);
    phs::State s(model.description(), x);
    const auto method = make_integrator("rattle", model, 1. / steps);
    Vec g(size_t(rows->count()));
    double work = 0, gap = 0;
    const double first = double(gauge.energy(s));
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(method->step(s), Outcome::ok);
      for (const double w : method->port_work()) work += w;
      rows->set_time(s.time(1. / steps));
      rows->place(s.x, g);
      for (const double v : g) gap = std::max(gap, std::fabs(v));
    }
    EXPECT_LT(gap, 1e-14);
    EXPECT_GT(std::fabs(work), 0.1);
    return std::fabs(double(gauge.energy(s)) - first - work);
  };
  const double coarse = balance(128), fine = balance(256);
  std::printf("  balance of one second: %.2e and %.2e J, order %.2f\n", coarse, fine,
              std::log2(coarse / fine));
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.2);
}

TEST(Rattle, WithoutConstraintsItIsStormerVerlet) {
  const auto p = test::floating_arm();
  phs::State a = p.start, b = p.start;
  const auto one = make_integrator("rattle", *p.model, p.h),
             other = make_integrator("stormer_verlet", *p.model, p.h);
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(one->step(a), Outcome::ok);
    ASSERT_EQ(other->step(b), Outcome::ok);
  }
  for (size_t i = 0; i < a.x.size(); ++i) EXPECT_NEAR(a.x[i], b.x[i], 1e-11) << i;
}

/// A far too long step is a status, and the state stays; so is a position where rows lose rank.
TEST(Rattle, FailuresLeaveTheState) {
  auto l = test::windows(2, false);
  const auto model = l.model();
  phs::State s(model.description(), l.start()), before = s;
  const auto method = make_integrator("rattle", model, 1. / 256);
  Outcome o = Outcome::ok;
  for (int i = 0; i < 5120 && o == Outcome::ok; ++i) {
    before = s;
    o = method->step(s);
  }
  EXPECT_EQ(o, Outcome::singular) << to_string(o);
  EXPECT_TRUE(s == before);
  EXPECT_NEAR(s.time(1. / 256), 0.73, 0.1);
  EXPECT_NE(make_integrator("rattle", model, 8)->step(s), Outcome::ok);
  EXPECT_TRUE(s == before);
}

}  // namespace
}  // namespace porthos::integrators::rattle_test
