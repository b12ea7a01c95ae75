// The methods of other libraries on constrained systems: that they converge, what they keep and
// what they do not.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "integrators/catalogue.h"
#include "tests/support/linkages.h"
#include "tests/support/robots.h"

namespace porthos::integrators::constrained_rival_test {
namespace {

using test::Vec;

std::vector<std::string> rivals() {
  std::vector<std::string> names;
  for (const auto& d : catalogue())
    if (d.rival && d.constraints) names.push_back(d.name);
  return names;
}
Options tolerance(double tol) { return {.rtol = tol, .atol = 0.01 * tol}; }

/// The largest gap of a run, its energy error and its end.
struct Motion {
  double gap = 0, slip = 0;  ///< [m | rad], [/s]
  double energy = 0;         ///< [J], at the end
  std::int64_t evaluations = 0;
  std::vector<double> end;
};

Motion run(const std::string& name, const phs::Model& model, const Vec& x, double h, int steps,
           const Options& o = {}) {
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  test::Gauge gauge(model);
  Vec g(size_t(rows->count())), e(x.size());
  phs::State s(model.description(), x);
  const long double first = gauge.energy(s);
  const auto method = make_integrator(name, model, h, o);
  Motion r;
  for (int i = 0; i < steps; ++i) {
    const Outcome outcome = method->step(s);
    EXPECT_EQ(outcome, Outcome::ok) << name << " " << i << ": " << method->remark();
    if (outcome != Outcome::ok) break;
    rows->place(s.x, g);
    for (const double v : g) r.gap = std::max(r.gap, std::fabs(v));
    system->gradient(s.x, e);
    rows->rates(e, g);
    for (const double v : g) r.slip = std::max(r.slip, std::fabs(v));
  }
  r.energy = double(gauge.energy(s) - first);
  r.evaluations = method->cost().evaluations;
  size_t angle = 0;
  for (size_t k = 0; k < x.size(); ++k) r.end.push_back(s.x[k] + s.lo[k]);
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle)
      r.end[size_t(b.at)] += phs::two_pi_hi * double(s.turns[angle++]);
  return r;
}

double distance(const Vec& a, const Vec& b) {
  double most = 0;
  for (size_t k = 0; k < a.size(); ++k) most = std::max(most, std::fabs(a[k] - b[k]));
  return most;
}

TEST(ConstrainedRivals, ClaimNothingAndNeedConstraints) {
  EXPECT_GE(rivals().size(), 3u);
  const auto free = test::four_bar();
  const mechanics::MechanicalModel tree(free.mechanism);
  for (const auto& name : rivals()) {
    const Declaration& d = declaration_of(name);
    EXPECT_TRUE(d.constraints && d.rival && !d.resumable) << name;
    EXPECT_EQ(d.symplectic, Claim::fails) << name;
    EXPECT_EQ(misfit(d, tree.description()),
              "method '" + name + "' needs a system with constraints, 'four_bar' is not one");
  }
}

/// A four-bar, a free-flyer with a loop and two quaternions, and dependent rows, against spark16.
TEST(ConstrainedRivals, ConvergeAsTheToleranceShrinks) {
  for (auto l : {test::four_bar(), test::holding_arms(), test::bricard()}) {
    const Vec x = l.start();
    const auto model = l.model();
    const Vec exact = run("spark16", model, x, 1. / 64, 128).end;
    for (const auto& name : rivals()) {
      const double loose = distance(run(name, model, x, 1, 2, tolerance(1e-4)).end, exact);
      const double tight = distance(run(name, model, x, 1, 2, tolerance(1e-11)).end, exact);
      std::printf("  %-12s %-22s error at 1e-4: %.1e, at 1e-11: %.1e (<= 1e-7)\n",
                  model.description().name.c_str(), name.c_str(), loose, tight);
      EXPECT_LE(tight, 1e-7) << name;
      EXPECT_GT(loose, 100 * tight) << name << ": the control";
    }
  }
}

/// The index-2 form holds the manifold as well as its Newton iteration converges. Of eliminated
/// multipliers the gap grows; Baumgarte's terms shrink it.
TEST(ConstrainedRivals, LeaveTheManifold) {
  auto l = test::four_bar();
  const Vec x = l.start();
  const auto model = l.model();
  const auto gap = [&](const std::string& name, int seconds) {
    const Motion m = run(name, model, x, 0.25, 4 * seconds, tolerance(1e-8));
    std::printf("  %-22s after %2d s: gap %.1e m, slip %.1e m/s, energy %.1e J\n", name.c_str(),
                seconds, m.gap, m.slip, m.energy);
    return m.gap;
  };
  const double kept = run("spark16", model, x, 1. / 64, 64 * 16).gap;
  EXPECT_LT(kept, 2e-15);
  for (const auto& name : rivals()) EXPECT_GT(gap(name, 16), 3 * kept) << name;
  EXPECT_LT(gap("ida_ggl", 16), 2e-9);  // measured 4e-10
  EXPECT_GT(gap("index1_cvode_adams", 16), 4 * gap("index1_cvode_adams", 2));
  EXPECT_LT(gap("baumgarte_cvode_adams", 16), 0.2 * gap("index1_cvode_adams", 16));
}

/// From rest with a gap of a millimetre: without stabilisation the pin moves on with its gap, and
/// its force does no work. Baumgarte's terms close the gap by a force that does.
TEST(ConstrainedRivals, BaumgarteDoesWorkOffTheManifold) {
  auto l = test::four_bar();
  l.v = {0, 0, 0};
  Vec x = l.start();
  x[2] += 1e-3;
  const auto model = l.model();
  const Motion plain = run("index1_cvode_adams", model, x, 0.25, 4, tolerance(1e-10));
  const Motion closing = run("baumgarte_cvode_adams", model, x, 0.25, 4, tolerance(1e-10));
  std::printf("  energy of 20 J: %.1e J without, %.1e J with stabilisation\n", plain.energy,
              closing.energy);
  EXPECT_LT(std::fabs(plain.energy), 1e-7);
  EXPECT_GT(std::fabs(closing.energy), 1e-4);
}

}  // namespace
}  // namespace porthos::integrators::constrained_rival_test
