// Negative control of the constrained methods: eliminated multipliers (index 1) leave the manifold.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/core/integrator.h"
#include "integrators/rivals/index_one.h"
#include "tests/support/linkages.h"
#include "tests/support/robots.h"

namespace porthos::integrators::index_one_test {
namespace {

using test::Vec;

/// What a model in double alone can do.
const Options plain{.solver = Solver::fixed_point, .lanes = false};

struct Off {
  double gap = 0, slip = 0, energy = 0;  ///< largest over a run; energy relative to 20 J
};

Off run(const std::string& name, const phs::Model& stepped, const phs::Model& model, const Vec& x,
        int steps) {
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  test::Gauge gauge(model);
  Vec g(size_t(rows->count())), e(x.size());
  phs::State s(stepped.description(), x);
  const long double first = gauge.energy(s);
  const auto method = make_integrator(name, stepped, 1. / 128, plain);
  Off off;
  const auto see = [](double& most, const Vec& values) {
    for (const double v : values) most = std::max(most, std::fabs(v));
  };
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(method->step(s), Outcome::ok) << name << " " << i;
    rows->place(s.x, g);
    see(off.gap, g);
    system->gradient(s.x, e);
    rows->rates(e, g);
    see(off.slip, g);
    off.energy = std::max(off.energy, std::fabs(double(gauge.energy(s) - first)) / 20);
  }
  return off;
}

TEST(IndexOne, LeavesTheManifoldThatSparkKeeps) {
  auto l = test::four_bar();
  const Vec x = l.start();
  const auto model = l.model();
  const IndexOneModel eliminated(model);
  const Off kept = run("spark16", model, model, x, 2048);
  const Off early = run("gauss16", eliminated, model, x, 256),
            late = run("gauss16", eliminated, model, x, 2048);
  for (const auto& [what, off] : {std::pair{"spark16, 2048 steps", kept},
                                  {"index 1, 256 steps", early},
                                  {"index 1, 2048 steps", late}})
    std::printf("  %-20s gap %.1e m, slip %.1e m/s, energy %.1e\n", what, off.gap, off.slip,
                off.energy);
  EXPECT_LT(kept.gap, 2e-15);
  EXPECT_GT(late.gap, 10 * kept.gap);
  EXPECT_GT(late.gap, 3 * early.gap);
  // The same multipliers to start with: one step of both ends at the same place.
  phs::State a(model.description(), x), b(eliminated.description(), x);
  ASSERT_EQ(make_integrator("spark16", model, 1. / 128)->step(a), Outcome::ok);
  ASSERT_EQ(make_integrator("gauss16", eliminated, 1. / 128, plain)->step(b), Outcome::ok);
  for (size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(a.x[k], b.x[k], 1e-13) << k;
}

}  // namespace
}  // namespace porthos::integrators::index_one_test
