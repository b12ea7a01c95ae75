// The order of every method on a nonlinear problem: a free-floating arm in fast motion (quaternion, wrapped angles, mass
// that depends on q), against a 113-bit run. A linear problem would hide order defects.
#include <gtest/gtest.h>

#include "integrators/gauss.h"
#include "tests/support/robots.h"

namespace porthos::integrators {
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

TEST(Order, OfMethodsBelowEight) {
  for (const auto& d : catalogue()) {
    if (d.order == 0 || d.order > 8 || misfit(d, robot().model->description())) continue;
    if (d.order == 8 && d.family == "Compositions") continue;  // in 113 bits: composition_test
    // Refine by a quarter octave; the order is the least-squares slope over the errors between 2e-7 (2e-4 for order 2,
    // 0.1 for order 1) and round-off.
    const double largest = d.order == 1 ? 0.1 : d.order == 2 ? 2e-4 : 2e-7;
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, error = 1;
    const double most = d.order == 1 ? 16384 : 4096;
    for (double steps = 16; steps < most && error > 1e-12; steps *= std::pow(2, 0.25)) {
      const int k = int(std::lround(steps));
      error = error_after(d.name, k);
      if (!(error < largest) || error < 1e-13) continue;
      const double x = -std::log2(double(k)), y = std::log2(error);
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    const double order = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    std::printf("  %-16s declared %2d   measured %5.2f   over %g step sizes\n", d.name.c_str(),
                d.order, order, n);
    EXPECT_GE(n, 4) << d.name;
    EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << d.name;
  }
}

// Above order 8 the asymptotic range lies below double's round-off: the same tables are run in 113 bits there, and the
// double method is shown to be that method, at a step coarse enough for its error to dwarf round-off.
TEST(Order, OfHighOrderGaussIn113Bits) {
  const auto& model = *robot().model;
  const std::vector<Quad> start(robot().start.x.begin(), robot().start.x.end());
  const Quad T = Quad(1) / 2;
  const auto exact = gauss_reference(model, start, T / 24, 24, 12);
  for (int s = 4; s <= 8; ++s) {
    const double a = test::distance(gauss_reference(model, start, T / 8, 8, s), exact);
    const double b = test::distance(gauss_reference(model, start, T / 16, 16, s), exact);
    const double order = std::log2(a / b);
    const double h = 0.5;
    phs::State x = robot().start;
    const auto method = make_integrator("gauss" + std::to_string(2 * s), model, h);
    for (int i = 0; i < 4; ++i) ASSERT_EQ(method->step(x), Outcome::ok);
    const double same = test::distance(test::unwrapped(model.description(), x),
                                       gauss_reference(model, start, h, 4, s));
    const double own = test::distance(test::unwrapped(model.description(), x),
                                      gauss_reference(model, start, h / 8, 32, 12));
    std::printf(
        "  gauss%-2d measured %5.2f (errors %.1e, %.1e)   double against 113 bits at h = 0.5: "
        "%.1e, method error %.1e\n",
        2 * s, order, a, b, same, own);
    EXPECT_NEAR(order, 2 * s, 0.05 * 2 * s + 0.1);
    EXPECT_LE(same, 1e-13);
    EXPECT_GT(own, 1e3 * same)
        << "the step must be coarse enough to tell the method from its limit";
  }
}

// The rivals converge to the same solution as their tolerance shrinks.
TEST(Order, RivalsAgree) {
  for (const char* name : {"cvode_adams", "cvode_bdf"}) {
    Options o;
    o.rtol = 1e-11, o.atol = 1e-11;
    phs::State s = robot().start;
    const auto integrator = make_integrator(name, *robot().model, duration, o);
    ASSERT_EQ(integrator->step(s), Outcome::ok);
    const double worst = test::distance({s.x.begin(), s.x.end()}, reference());
    std::printf("  %-16s rtol 1e-11: error %.1e   bound 1e-7\n", name, worst);
    EXPECT_LE(worst, 1e-7);
  }
}

}  // namespace
}  // namespace porthos::integrators
