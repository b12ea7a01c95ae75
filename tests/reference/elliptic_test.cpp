// Closed forms by GSL's elliptic functions, in need of no file: the pendulum and the free
// asymmetric body. GSL is GPL-3 and stands in the tests alone.
#include <gtest/gtest.h>

#ifdef PORTHOS_HAVE_GSL
#include <gsl/gsl_sf_ellint.h>
#include <gsl/gsl_sf_elljac.h>

#include <cmath>

#include "integrators/core/integrator.h"
#include "tests/support/tree_case.h"

namespace porthos::elliptic_test {
namespace {

struct Jacobi {
  double sn, cn, dn;
  Jacobi(double u, double m) { gsl_sf_elljac_e(u, m, &sn, &cn, &dn); }
};

phs::State run(const mechanics::MechanicalModel& model, phs::State s, double h, int steps) {
  const auto method = integrators::make_integrator("gauss16", model, h);
  for (int i = 0; i < steps; ++i) EXPECT_EQ(method->step(s), integrators::Outcome::ok);
  return s;
}

// θ = 2 asin(k sn(K - ω₀t, k)), k = sin(θ₀/2), released at rest.
TEST(ClosedForm, Pendulum) {
  const double g = 9.8125, theta0 = 2.0, k = std::sin(theta0 / 2);
  const mechanics::MechanicalModel model(test::planar_chain({1}, {1}, {1}, {0}, g));
  const phs::State start(model.description(), model.state(std::vector{theta0}, std::vector{0.0}));
  const double K = gsl_sf_ellint_Kcomp(k, GSL_PREC_DOUBLE);
  double worst = 0;
  for (int t : {1, 3, 10}) {
    const double exact = 2 * std::asin(k * Jacobi(K - std::sqrt(g) * t, k * k).sn);
    worst = std::max(worst, std::fabs(run(model, start, 1.0 / 32, 32 * t).x[0] - exact));
  }
  std::printf("  pendulum against elliptic functions, 10 s: %.1e   bound 1e-13\n", worst);
  EXPECT_LE(worst, 1e-13);
}

// Euler's equations with I1 < I2 < I3 and L² > 2E I2: ω = (a cn, -b sn, c dn) of τ (Landau,
// Lifshitz, Mechanics, § 37).
TEST(ClosedForm, FreeAsymmetricBody) {
  const double I1 = 1, I2 = 2, I3 = 3;
  mechanics::BodySpec body;
  body.name = "body";
  body.parent = "world";
  body.joint.type = "free";
  body.mass = {1, {0, 0, 0}, {I1, 0, 0, I2, 0, I3}};
  const mechanics::MechanicalModel model(
      std::make_shared<mechanics::Mechanism>(mechanics::MechanismBuilder().add(body).build()));
  const double w1 = 0.5, w3 = 1.25;  // at τ = 0: cn = dn = 1, sn = 0
  const double E2 = I1 * w1 * w1 + I3 * w3 * w3, L2 = I1 * I1 * w1 * w1 + I3 * I3 * w3 * w3;
  ASSERT_GT(L2, E2 * I2);
  const double b = std::sqrt((E2 * I3 - L2) / (I2 * (I3 - I2)));
  const double rate = std::sqrt((I3 - I2) * (L2 - E2 * I1) / (I1 * I2 * I3));
  const double m = (I2 - I1) * (E2 * I3 - L2) / ((I3 - I2) * (L2 - E2 * I1));
  const phs::State start(model.description(), model.state(model.mechanism().neutral(),
                                                          std::vector<double>{w1, 0, w3, 0, 0, 0}));
  double worst = 0;
  for (int t : {1, 10, 100}) {
    const Jacobi j(rate * t, m);
    const auto w = model.rates(run(model, start, 1.0 / 8, 8 * t).x);
    // the sign of ω2 follows from Euler's equation: I2 ω2' = (I3 - I1) ω3 ω1 > 0 at the start
    const double exact[] = {w1 * j.cn, b * j.sn, w3 * j.dn};
    for (size_t i = 0; i < 3; ++i) worst = std::max(worst, std::fabs(w[i] - exact[i]));
  }
  std::printf("  free body against elliptic functions, 100 s: %.1e   bound 1e-12\n", worst);
  EXPECT_LE(worst, 1e-12);
}

}  // namespace
}  // namespace porthos::elliptic_test
#endif
