// Kepler's problem over 1000 periods. Must hold: with gauss16 at a step that resolves the
// pericentre, energy and angular momentum at round-off without drift, and the position of the
// closed form. Must fail: rk4 at the same step.
#include "tests/support/energy_run.h"
#include "tests/support/problems.h"

namespace porthos::kepler_test {
namespace {

const phs::UserModel<test::Kepler> model{test::Kepler{}};
constexpr double period = phs::two_pi_hi;

/// At the pericentre, a = 1.
phs::State pericentre(double e) {
  return phs::State(model.description(), {1 - e, 0, 0, std::sqrt((1 + e) / (1 - e))});
}

void thousand_periods(double e, double h) {
  const auto steps = std::int64_t(1000 * period / h);
  const double bound = test::random_walk(steps);
  const auto run = [&](const char* method) {
    return test::energy_run(method, model, pericentre(e), h, steps,
                            {.samples = 20000, .invariant = "angular_momentum"});
  };
  const auto ours = run("gauss16"), rk4 = run("rk4");
  std::printf("  e = %g, h = %g, %lld steps\n", e, h, (long long)steps);
  test::keeps("gauss16 energy", ours.energy, bound);
  test::keeps("gauss16 angular momentum", ours.invariant, bound);
  test::keeps("gauss16 energy, growth exponent", ours.exponent, 0.65);
  EXPECT_FALSE(ours.drifts);
  test::breaks("rk4 energy", rk4.energy, 1e3 * bound);
  test::breaks("rk4 angular momentum", rk4.invariant, 1e3 * bound);
}

TEST(Kepler, ModerateEccentricity) { thousand_periods(0.6, 1.0 / 32); }
TEST(Kepler, HighEccentricity) { thousand_periods(0.9, 1.0 / 256); }

TEST(Kepler, ClosedForm) {
  const auto file = test::read_json(test::data_file("reference/h_kepler_e0.6.json"));
  const double h = 1.0 / 32;
  const auto errors = [&](const char* name) {
    auto s = pericentre(0.6);
    // 0.4 is no double: the rest in the low word, or the orbit is another one (1e-16 in the energy,
    // 1e-12 along the orbit after 1000 periods).
    s.x = {0.4, 0, 0, 2};
    s.lo[0] = double(0.4L - (long double)0.4);
    const auto method = integrators::make_integrator(name, model, h);
    double worst = 0;
    for (const auto& o : file["outputs"]) {
      const double t = test::number(o["t"]), n = t / h;
      if (n != std::floor(n)) continue;
      while (double(s.step) < n) EXPECT_EQ(method->step(s), integrators::Outcome::ok);
      const auto row = test::numbers(o["group0"]);
      // An energy error of relative size d moves the body by 3/2 d t |v| along its orbit, |v| <= 2.
      // d walks to the 1e-14 of the test above (bound there: 5e-14) over 1000 periods.
      const double bound = std::max(1e-14, 3 * t * 1e-14 * std::sqrt(t / (1000 * period)));
      worst = std::max(worst, std::hypot(s.x[0] - row[0], s.x[1] - row[1]) / bound);
      if (std::string(name) == "gauss16")
        std::printf("  t = %-8g |r - closed form| %.1e   bound %.1e\n", t,
                    std::hypot(s.x[0] - row[0], s.x[1] - row[1]), bound);
    }
    return worst;
  };
  test::keeps("gauss16, worst error over its bound", errors("gauss16"), 1);
  test::breaks("rk4, worst error over its bound", errors("rk4"), 1e3);
}

}  // namespace
}  // namespace porthos::kepler_test
