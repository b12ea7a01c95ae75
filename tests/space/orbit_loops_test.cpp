// Mechanisms with loops in orbit: kicks along the manifold, their order, and the unsplit system.
#include "mechanics/constraints/projection.h"
#include "tests/space/support.h"
#include "tests/support/linkages.h"

namespace porthos::space::orbit_loops_test {
namespace {

using integrators::Outcome;
using Vec = std::vector<double>;

/// Two arms that hold each other, at 7000 km.
struct Flight {
  test::Linkage linkage = test::holding_arms();
  std::shared_ptr<const mechanics::MechanicalModel> model;
  std::unique_ptr<Spacecraft> craft;
  Vec start;

  Flight() {
    for (double& v : linkage.v) v *= 0.02;
    const auto x = linkage.start();
    model = std::make_shared<mechanics::MechanicalModel>(linkage.model());
    Environment env;
    env.planet.mu = 3.986e14;
    craft = std::make_unique<Spacecraft>(model, model, env);
    start = craft->state(x, {{7e6, 0, 0}, {0, 6000, 4500}});
  }
  /// The state of the arms after 40 s.
  Vec fly(const std::string& splitting, double h, double* gap = nullptr) const {
    phs::State s(craft->description(), start);
    SplitIntegrator by(*craft, h, {.splitting = splitting, .method = "spark16"});
    run(by, s, h, gap);
    return inner(s);
  }
  /// The same by the method itself on the whole system.
  Vec unsplit(double h) const {
    phs::State s(craft->description(), start);
    const auto by = integrators::make_integrator("spark16", *craft, h);
    run(*by, s, h, nullptr);
    return inner(s);
  }

 private:
  void run(integrators::Integrator& by, phs::State& s, double h, double* gap) const {
    const auto system = model->instantiate<double>();
    const auto rows = system->constraints();
    Vec g(size_t(rows->count())), e(craft->internal_size());
    for (int i = 0; i < int(std::lround(40 / h)); ++i) {
      ASSERT_EQ(by.step(s), Outcome::ok) << i << " " << by.remark();
      if (!gap) continue;
      const auto x = std::span<const double>(s.x).first(e.size());
      rows->place(x, g);
      for (const double v : g) *gap = std::max(*gap, std::fabs(v));
      system->gradient(x, e);
      rows->rates(e, g);
      for (const double v : g) *gap = std::max(*gap, std::fabs(v));
    }
  }
  Vec inner(const phs::State& s) const {
    return Vec(s.x.begin(), s.x.begin() + long(craft->internal_size()));
  }
};

double difference(const Vec& a, const Vec& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

/// The corrected scheme has order 4 with its potential taken along the manifold; the plain one,
/// order 2, is the control. Both stay on the manifold.
TEST(OrbitLoops, KicksAlongTheManifoldKeepTheirOrder) {
  const Flight f;
  double gap = 0;
  const Vec exact = f.fly("aba864", 0.125, &gap);
  std::printf("  gap and slip at most %.1e\n", gap);
  EXPECT_LT(gap, 2e-15);
  for (const auto& [name, order] : {std::pair{"lobatto4c", 4.0}, {"lobatto4", 2.0}}) {
    const double coarse = difference(f.fly(name, 4), exact),
                 fine = difference(f.fly(name, 2), exact);
    const double found = std::log2(coarse / fine);
    std::printf("  %-9s errors %.2e, %.2e: order %.2f\n", name, coarse, fine, found);
    EXPECT_NEAR(found, order, 0.3) << name;
  }
}

/// The same motion without the splitting: the loops in the field of gravity of the whole system.
TEST(OrbitLoops, TheUnsplitSystemMovesAlike) {
  const Flight f;
  const double apart = difference(f.fly("aba864", 0.5), f.unsplit(0.5));
  const double control = difference(f.fly("strang", 4), f.unsplit(0.5));
  std::printf("  apart by %.1e   bound 1e-15, rounding (strang, 4 s: %.1e)\n", apart, control);
  EXPECT_LT(apart, 1e-15);
  EXPECT_GT(control, 1e-9);
}

TEST(OrbitLoops, ALoopToTheWorldIsRefused) {
  auto l = test::holding_arms();
  l.spec.loops.push_back({"hold", "spherical", test::at("base", 0, 0), {}});
  const auto model = std::make_shared<mechanics::MechanicalModel>(l.model());
  EXPECT_EQ(test::refusal([&] { Spacecraft(model, model, Environment{}); }),
            "'holding_arms' has a loop to the world, expected loops between links in orbit");
}

}  // namespace
}  // namespace porthos::space::orbit_loops_test
