// Gauss-Lobatto SPARK on loops: order, manifold, energy, references, and where it refuses.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/step_control.h"
#include "phs/linear_algebra/dense.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "tests/integrators/problems.h"
#include "tests/support/exact_start.h"
#include "tests/support/reference.h"
#include "tests/support/symplectic.h"

namespace porthos::integrators::spark_test {
namespace {

using phs::Quad;
using test::Linkage;
using test::Vec;

/// Runs a method. @return its outcome; s is the last good state
template <class T>
Outcome run(const std::string& method, const phs::Model& model, T h, int steps,
            phs::BasicState<T>& s, const Options& o = {}) {
  const auto m = make_basic_integrator<T>(method, model, h, o);
  for (int i = 0; i < steps; ++i)
    if (const Outcome end = m->step(s); end != Outcome::ok) return end;
  return Outcome::ok;
}

double distance(const std::vector<Quad>& a, const std::vector<Quad>& b) {
  Quad most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = phs::max(most, phs::abs(a[i] - b[i]));
  return double(most);
}

/// The error at t = 1/2 of a four-bar under gravity, whose Hamiltonian does not separate.
void expect_order(int s, int coarse, double tolerance, int finest = 64) {
  auto l = test::four_bar("spherical");
  const auto model = l.model();
  const auto x = test::exact_start(l, model);
  const auto end = [&](const std::string& method, int steps) {
    phs::BasicState<Quad> state(model.description(), x);
    EXPECT_EQ(run<Quad>(method, model, Quad(0.5) / steps, steps, state), Outcome::ok);
    for (size_t i = 0; i < state.x.size(); ++i) state.x[i] += state.lo[i];
    return state.x;
  };
  const auto exact = end("spark16", finest);
  const std::string name = "spark" + std::to_string(2 * s);
  const double e1 = distance(end(name, coarse), exact), e2 = distance(end(name, 2 * coarse), exact);
  const double order = std::log2(e1 / e2);
  std::printf("  %s: errors %.2e, %.2e, order %.2f\n", name.c_str(), e1, e2, order);
  EXPECT_NEAR(order, 2 * s, tolerance);
}
TEST(Spark, OrderIsTwiceTheStages) {
  expect_order(1, 64, 0.1);   // measured 2.00
  expect_order(2, 32, 0.15);  // 4.00
  expect_order(3, 48, 0.3);
}
TEST(Spark, HighOrdersLONG) {
  expect_order(4, 32, 0.2);
  expect_order(6, 96, 0.3, 256);
  expect_order(8, 80, 1.0, 256);
}

/// Constraints and the invariants of a free-flyer, at every end of a step.
TEST(Spark, PositionsAndVelocitiesStayOnTheManifold) {
  for (const auto& [l0, h, steps] : {std::tuple{test::four_bar(), 1. / 128, 4096},
                                     std::tuple{test::holding_arms(), 1. / 32, 4096}}) {
    Linkage l = l0;
    const Vec x = l.start();
    const auto model = l.model();
    const auto system = model.instantiate<double>();
    const auto rows = system->constraints();
    const size_t m = size_t(rows->count()), k = size_t(model.description().invariant_count());
    Vec g(m), rate(m), e(x.size()), first(k), now(k);
    system->invariants(x, first);
    phs::State s(model.description(), x);
    const auto method = make_integrator("spark16", model, h);
    double gap = 0, slip = 0, drift = 0;
    for (int i = 0; i < steps; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok);
      rows->place(s.x, g);
      system->gradient(s.x, e);
      rows->rates(e, rate);
      system->invariants(s.x, now);
      for (size_t r = 0; r < m; ++r) {
        gap = std::max(gap, std::fabs(g[r]));
        slip = std::max(slip, std::fabs(rate[r]));
      }
      for (size_t j = 0; j < k; ++j) drift = std::max(drift, std::fabs(now[j] - first[j]));
      for (const double w : method->port_work()) EXPECT_LT(std::fabs(w), 1e-14);
    }
    std::printf("  %s: |g| %.1e, |Gv| %.1e, invariants %.1e, %.2f sweeps a step\n",
                model.description().name.c_str(), gap, slip, drift,
                double(method->cost().sweeps) / steps);
    EXPECT_LT(gap, 2e-15);
    EXPECT_LT(slip, 2e-14);
    EXPECT_LT(drift, 1e-14);
  }
}

struct Energies {
  double rms = 0, slope = 0;  ///< relative to the energy turned over; error against steps
};
/// The energy error of a four-bar over 2^n steps, relative to its kinetic energy of about 20 J.
Energies energy_of_run(const std::string& name, int n, double h, const Options& o = {}) {
  auto l = test::four_bar();
  const auto model = l.model();
  test::Gauge gauge(model);
  phs::State s(model.description(), l.start());
  const long double first = gauge.energy(s);
  const auto method = make_integrator(name, model, h, o);
  double sum = 0, early = 0;
  for (int i = 1; i <= 1 << n; ++i) {
    EXPECT_EQ(method->step(s), Outcome::ok);
    const double error = double(gauge.energy(s) - first) / 20;
    sum += error * error;
    if (i == 1 << (n - 4)) early = std::sqrt(sum / i);
  }
  const double rms = std::sqrt(sum / (1 << n));
  return {rms, std::log2(rms / early) / 4};
}
TEST(Spark, EnergyErrorIsRounding) {
  const auto e = energy_of_run("spark16", 12, 1. / 128);
  std::printf("  rms energy error over 2^12 steps %.1e\n", e.rms);
  EXPECT_LT(e.rms, 1e-14);
  // Control: an iteration that stops at 1e-10 shows.
  const auto loose = energy_of_run("spark16", 12, 1. / 128, {.iteration_tolerance = 1e-10});
  std::printf("  with the iteration stopped at 1e-10: %.1e\n", loose.rms);
  EXPECT_GT(loose.rms, 10 * e.rms);
}
TEST(Spark, EnergyErrorStaysBoundedAtLowOrder) {
  const auto e = energy_of_run("spark4", 12, 1. / 64);
  std::printf("  spark4, h = 1/64: rms %.1e, slope %.2f\n", e.rms, e.slope);
  EXPECT_LT(std::fabs(e.slope), 0.3);  // a drift has slope 1
}
/// A rounding that does work of one sign while the crank turns one way would add up: with U and D⁻¹
/// of an elimination rounded apart (docs/mathematics.md, 2) it was 2e-14 here, growing with time.
TEST(Spark, EnergyOfACrankThatTurnsOneWay) {
  auto l = test::four_bar("spherical");
  const auto model = l.model();
  test::Gauge gauge(model);
  phs::State s(model.description(), l.start());
  const long double first = gauge.energy(s);
  const auto method = make_integrator("spark16", model, 1. / 128);
  for (int i = 0; i < 1 << 17; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
  const double error = double(gauge.energy(s) - first) / 20;
  std::printf("  energy error after 2^17 steps %.1e\n", error);
  EXPECT_LT(std::fabs(error), 1e-14);  // 3.7 standard deviations of its noise, 2.7e-15
}
/// Predicted impulses, and those held where only noise moves, by what they save.
TEST(Spark, IterationsOfAStep) {
  const auto sweeps_of = [](test::Linkage l, double h, int steps) {
    const auto model = l.model();
    phs::State s(model.description(), l.start());
    const auto method = make_integrator("spark16", model, h);
    for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), Outcome::ok);
    return double(method->cost().sweeps) / steps;
  };
  const double one = sweeps_of(test::four_bars(1), 1. / 512, 1000),
               lattice = sweeps_of(test::lattice(6), 1. / 512, 200);
  std::printf(
      "  four-bar %.2f (7.35 with impulses extrapolated by all nodes), lattice %.2f (13.8, and "
      "12.5 "
      "without a hold)\n",
      one, lattice);
  EXPECT_LT(one, 6.6);
  EXPECT_LT(lattice, 11);
}
TEST(Spark, EnergyGrowthLONG) {
  const auto e = energy_of_run("spark16", 20, 1. / 128);
  std::printf("  2^20 steps: rms %.1e (bound 6e-14), slope %.2f\n", e.rms, e.slope);
  EXPECT_LT(e.rms, 6e-14);  // a drift of 4e-18 J a step would give 1.6e-13
}

/// Two windows pass through the line twenty times in 20 s. The couplings hold the branch there.
TEST(Spark, WindowsOfA02AgainstEllipticFunctions) {
  const auto reference = test::read_json(test::data_file("reference/j_a02_four_bar_N2.json"));
  auto l = test::windows(2, true);
  const auto model = l.model();
  const Vec x = l.start();
  phs::State s(model.description(), x);
  const double h = 1. / 128;
  const auto method = make_integrator("spark16", model, h);
  const double up = l.q[0];
  for (const auto& out : reference["outputs"]) {
    const double t = std::stod(out["t"].get<std::string>());
    while (s.time(h) < t - h / 2) ASSERT_EQ(method->step(s), Outcome::ok) << s.time(h);
    if (std::fabs(s.time(h) - t) > 1e-12) continue;
    const double turned = up - (s.x[0] + s.lo[0] + phs::two_pi_hi * double(s.turns[0]));
    const double expected = std::stod(out["rotation_from_top_clockwise"].get<std::string>());
    std::printf("  t %5.2f s: error %.1e rad\n", t, turned - expected);
    EXPECT_NEAR(turned, expected, 1e-13) << t;
  }
}
/// Control: without the couplings the loops lose rank at the first passage, which is told.
TEST(Spark, SingularPositionsAreTold) {
  auto l = test::windows(2, false);
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const auto method = make_integrator("spark16", model, 1. / 256);
  Outcome o = Outcome::ok;
  for (int i = 0; i < 5120 && o == Outcome::ok; ++i) o = method->step(s);
  EXPECT_EQ(o, Outcome::singular) << to_string(o);
  EXPECT_NEAR(s.time(1. / 256), 0.73, 0.1);
  EXPECT_NE(method->remark().find("smallest pivot"), std::string::npos) << method->remark();
  std::printf("  %.3f s: %s\n", s.time(1. / 256), method->remark().c_str());
}

TEST(Spark, BricardHasRankFourOfFive) {
  auto l = test::bricard();
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  const auto method = make_integrator("spark16", model, 1. / 32);
  const double first = system->hamiltonian(s.x);
  double gap = 0;
  Vec g(5);
  for (int i = 0; i < 320; ++i) {
    ASSERT_EQ(method->step(s), Outcome::ok) << i << " " << method->remark();
    rows->place(s.x, g);
    EXPECT_EQ(rows->factor(s.x), 4) << i;
    for (const double x : g) gap = std::max(gap, std::fabs(x));
  }
  const double error = system->hamiltonian(s.x) - first;
  std::printf("  |g| %.1e, energy %.1e J\n", gap, error);
  EXPECT_LT(gap, 5e-15);
  EXPECT_LT(std::fabs(error), 1e-12);
}

TEST(Spark, SliderCrankAgainstReference) {
  mechanics::MechanismBuilder b("slider_crank");
  auto crank = test::rod("crank", "world", 0, 0, 0.5, 2);
  crank.mass = {2, {0.125, 0, 0}, {0.0625, 0, 0, 0.125, 0, 0.125}, crank.mass.axes};
  auto bar = test::rod("bar", "crank", 0.5, 0, 1.25, 1);
  bar.mass.inertia = {0.0625, 0, 0, 0.125, 0, 0.125};
  auto slider = test::rod("slider", "world", 0, 0.125, 1, 1.5);
  slider.joint.type = "prismatic";
  slider.joint.axis = {1, 0, 0};
  slider.mass = {1.5, {0, 0, 0}, {1, 0, 0, 1, 0, 1}, slider.mass.axes};
  b.add(crank).add(bar).add(slider).gravity({0, -9.8125, 0});
  Linkage l{std::make_shared<mechanics::Mechanism>(b.build()), {}, {}, {}};
  l.spec.loops.push_back({"pin", "spherical", test::at("bar", 1.25, 0), test::at("slider", 0, 0)});
  const auto reference = test::read_json(test::data_file("reference/q_slider_crank.json"));
  const auto value = [&](size_t row, const char* group, size_t i) {
    return std::stod(reference["outputs"][row][group][i].get<std::string>());
  };
  const double crank0 = value(0, "group0", 2), bar0 = value(0, "group0", 5);
  l.q = {crank0, bar0 - crank0, value(0, "group0", 6)};
  l.v = {value(0, "group0", 11), value(0, "group0", 14) - value(0, "group0", 11),
         value(0, "group0", 15)};
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const double h = 1. / 128;
  const auto method = make_integrator("spark16", model, h);
  for (size_t row = 1; row < reference["outputs"].size(); ++row) {
    const double t = std::stod(reference["outputs"][row]["t"].get<std::string>());
    while (s.time(h) < t - h / 2) ASSERT_EQ(method->step(s), Outcome::ok);
    const double angle = s.x[0] + s.lo[0] + phs::two_pi_hi * double(s.turns[0]);
    const double error = std::max(std::fabs(angle - value(row, "group0", 2)),
                                  std::fabs(s.x[2] - value(row, "group0", 6)));
    std::printf("  t %5.2f s: error %.1e\n", t, error);
    EXPECT_LT(error, 1e-12 * (1 + t)) << t;
  }
}

/// A time scale that goes by the momentum of the crank: its slope needs the forces of the loop.
struct ByMomentum {
  template <class T>
  T value(std::span<const T> x) const {
    return T(1.0) / (T(1.0) + T(0.05) * x[3] * x[3]);
  }
};
/// The steps of the reversible control stay h sigma, though only its rate is integrated. Without
/// the constraint forces in that rate they leave it at once, and the run ends with a step of no
/// size.
TEST(Spark, ReversibleStepsFollowTheConstrainedMotion) {
  auto l = test::four_bar();
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const double h = 1. / 128;
  const auto scale = std::make_shared<phs::UserTimeScale<ByMomentum>>(ByMomentum{});
  const auto method = make_reversible("spark16", model, h, {.scale = scale});
  double off = 0, least = 1, most = 0;
  for (int i = 0; i < 4000; ++i) {
    const double t = s.time(h), before = ByMomentum{}.value(std::span<const double>(s.x));
    ASSERT_EQ(method->step(s), Outcome::ok) << i;
    const double sigma = (before + ByMomentum{}.value(std::span<const double>(s.x))) / 2;
    const double step = s.time(h) - t;
    off = std::max(off, std::fabs(step / (h * sigma) - 1));
    least = std::min(least, step / h);
    most = std::max(most, step / h);
  }
  std::printf("  steps from %.2f h to %.2f h, off h sigma by %.3f   bound 0.02\n", least, most,
              off);
  EXPECT_LT(off, 0.02);
  EXPECT_GT(most / least, 1.5);
}

TEST(Spark, LanesAndRestartKeepBits) {
  for (const auto& p : test::problems()) {
    if (p.model->description().constraints.empty()) continue;
    phs::State a = p.start, b = p.start, c = p.start;
    const auto one = make_integrator("spark16", *p.model, p.h);
    const auto other = make_integrator("spark16", *p.model, p.h, {.lanes = false});
    for (int i = 0; i < 40; ++i) {
      ASSERT_EQ(one->step(a), Outcome::ok);
      ASSERT_EQ(other->step(b), Outcome::ok);
      if (i != 20) continue;
      c = a;
    }
    EXPECT_EQ(a.x, b.x) << p.name;
    const auto again = make_integrator("spark16", *p.model, p.h);
    phs::State d = p.start;
    for (int i = 0; i <= 20; ++i) ASSERT_EQ(again->step(d), Outcome::ok);
    const auto resumed = make_integrator("spark16", *p.model, p.h);
    resumed->restore(again->memory());
    for (int i = 21; i < 40; ++i) ASSERT_EQ(resumed->step(d), Outcome::ok);
    EXPECT_EQ(a.x, d.x) << p.name;
    EXPECT_EQ(a.lo, d.lo) << p.name;
  }
}

/// The claims of symplecticity and symmetry stand on directions along the manifold. Across it the
/// step is no symplectic map, because it comes back to the manifold.
TEST(Spark, OnlyDirectionsAlongTheManifoldCount) {
  for (const auto& [name, freedoms] : {std::pair{"four_bar", 1}, std::pair{"holding_arms", 8}}) {
    const auto& all = test::problems();
    const auto p = std::find_if(all.begin(), all.end(),
                                [&, n = name](const auto& each) { return each.name == n; });
    ASSERT_NE(p, all.end());
    const auto along = test::tangents(*p);
    Vec gram(along.size() * along.size());
    for (size_t i = 0; i < along.size(); ++i)
      for (size_t j = 0; j < along.size(); ++j)
        gram[i * along.size() + j] =
            phs::dense::dot(along[i].size(), along[i].data(), &along[j][0]);
    const auto sizes = phs::symmetric_eigenvalues(along.size(), gram);
    const auto found = std::count_if(sizes.begin(), sizes.end(), [](double x) { return x > 1e-9; });
    EXPECT_EQ(found, 2 * freedoms) << name;
  }
  auto l = test::four_bar();
  const auto model = l.model();
  const Vec Psi = test::jacobian_of_steps("spark16", model, l.start(), 1. / 32);
  EXPECT_GT(test::symplectic_defect(Psi, 6), 1e-3);
}

TEST(Spark, OtherMethodsRefuseConstraints) {
  auto l = test::four_bar();
  const auto model = l.model();
  try {
    make_integrator("gauss16", model, 0.01);
    FAIL();
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(),
                 "method 'gauss16' keeps no constraints, and 'four_bar' has 'pin': expected a "
                 "method such as 'spark16'");
  }
}

/// Without constraints it is the Gauss method, to rounding.
TEST(Spark, WithoutConstraintsItIsGauss) {
  const auto p = test::double_pendulum();
  phs::State a = p.start, b = p.start;
  ASSERT_EQ(run<double>("spark16", *p.model, 0.05, 100, a), Outcome::ok);
  ASSERT_EQ(run<double>("gauss16", *p.model, 0.05, 100, b), Outcome::ok);
  for (size_t i = 0; i < a.x.size(); ++i) EXPECT_NEAR(a.x[i], b.x[i], 1e-11);
}

}  // namespace
}  // namespace porthos::integrators::spark_test
