// The order of every method on nonlinear problems, against 113-bit runs.
#include <gtest/gtest.h>

#include "integrators/gauss.h"
#include "tests/integrators/problems.h"

namespace porthos::integrators::order_test {
namespace {

using phs::Quad;

/// ETS-VII at eight times its rates: joints move by two radians.
const test::Robot& robot() {
  static const test::Robot r = test::ets_vii(8);
  return r;
}
constexpr double duration = 4;

const std::vector<Quad>& reference() {
  static const auto x =
      gauss_reference(*robot().model, {robot().start.x.begin(), robot().start.x.end()},
                      Quad(duration) / 64, 64, 12);
  return x;
}

double error_after(const std::string& method, int steps) {
  phs::State s = robot().start;
  const auto integrator = make_integrator(method, *robot().model, duration / steps);
  for (int i = 0; i < steps; ++i)
    if (integrator->step(s) != Outcome::ok) return INFINITY;
  return test::distance(test::unwrapped(robot().model->description(), s), reference());
}

TEST(Order, ReferenceIsConverged) {
  const auto finer =
      gauss_reference(*robot().model, {robot().start.x.begin(), robot().start.x.end()},
                      Quad(duration) / 96, 96, 12);
  const double worst = test::distance(finer, reference());
  std::printf("  113-bit reference against a finer one: %.1e   bound 1e-25\n", worst);
  EXPECT_LE(worst, 1e-25);
}

/// Error of a method in 113 bits after `duration` s in so many steps; infinite if it gave up.
double quad_error(const std::string& method, const test::Problem& p, double T, int steps,
                  const std::vector<Quad>& exact) {
  phs::BasicState<Quad> s(p.model->description(), {p.start.x.begin(), p.start.x.end()});
  const auto integrator =
      make_basic_integrator<Quad>(method, *p.model, Quad(T) / steps, {.max_sweeps = 400});
  for (int i = 0; i < steps; ++i)
    if (integrator->step(s) != Outcome::ok) return INFINITY;
  for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += s.lo[k];
  return test::distance(s.x, exact);
}

// The very step of a run, in 113 bits: orders up to 16 show their slope long before round-off. Variable mass where the
// method can take it. A linear problem would hide order defects.
TEST(Order, OfEveryMethodIn113Bits) {
  const double T = 0.5;
  const auto all = test::problems();
  std::vector<std::vector<Quad>> exact;
  for (const auto& p : all)
    exact.push_back(
        gauss_reference(*p.model, {p.start.x.begin(), p.start.x.end()}, Quad(T) / 32, 32, 12));
  for (const auto& d : catalogue()) {
    if (d.rival || d.order == 0) continue;
    size_t at = 0;  // double pendulum, else Henon-Heiles
    if (!test::fits(d, all[at])) at = 2;
    double before = INFINITY, now = INFINITY;
    int steps = 4;
    while (true) {
      before = now;
      now = quad_error(d.name, all[at], T, steps, exact[at]);
      if (std::isfinite(before) && (now < 1e-22 || steps >= (d.order > 2 ? 64 : 512))) break;
      steps *= 2;
    }
    const double order = std::log2(before / now);
    std::printf("  %-22s declared %2d   measured %5.2f   on the %s, errors %.1e, %.1e\n",
                d.name.c_str(), d.order, order, all[at].name.c_str(), before, now);
    EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << d.name;
  }
}

// What the suite sees in 113 bits is what a run does in double: the same step, the same error.
TEST(Order, DoubleIsTheSameMethod) {
  const auto p = test::double_pendulum();
  for (const auto& d : catalogue()) {
    if (d.rival || !test::fits(d, p)) continue;
    phs::State s = p.start;
    phs::BasicState<Quad> q(p.model->description(), {p.start.x.begin(), p.start.x.end()});
    const auto in_double = make_integrator(d.name, *p.model, p.h);
    const auto in_quad = make_basic_integrator<Quad>(d.name, *p.model, p.h, {.max_sweeps = 400});
    for (int i = 0; i < 4; ++i)
      ASSERT_TRUE(in_double->step(s) == Outcome::ok && in_quad->step(q) == Outcome::ok) << d.name;
    for (size_t k = 0; k < q.x.size(); ++k) q.x[k] += q.lo[k];
    EXPECT_LE(test::distance(test::unwrapped(p.model->description(), s), q.x), 1e-12) << d.name;
  }
}

// A free-floating arm in fast motion: quaternion, wrapped angles, six joints. The order is the least-squares slope over
// the errors between 2e-7 (2e-4 up to order 2) and round-off.
TEST(Order, OnAFloatingArm) {
  for (const auto& d : catalogue()) {
    if (d.rival || d.order == 0 || d.order > 8 || misfit(d, robot().model->description())) continue;
    if (d.order > 6 && d.family == "Compositions")
      continue;  // not yet asymptotic where double still sees
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, error = 1;
    for (double steps = 16; steps < 3000 && error > 1e-12; steps *= std::sqrt(2)) {
      const int k = int(std::lround(steps));
      error = error_after(d.name, k);
      if (!(error < (d.order <= 2 ? 2e-4 : 2e-7)) || error < 1e-13) continue;
      const double x = -std::log2(double(k)), y = std::log2(error);
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    if (d.order == 1) continue;  // its errors are too large here to tell
    const double order = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    std::printf("  %-22s declared %2d   measured %5.2f   over %g step sizes\n", d.name.c_str(),
                d.order, order, n);
    EXPECT_GE(n, 3) << d.name;
    EXPECT_NEAR(order, d.order, 0.1 * d.order + 0.1) << d.name;
  }
}

}  // namespace
}  // namespace porthos::integrators::order_test
