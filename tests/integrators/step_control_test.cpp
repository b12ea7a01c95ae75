// Steps of varying size that keep what constant steps keep; a controller that looks at errors as
// the negative control.
#include <gtest/gtest.h>

#include <random>

#include "integrators/control/step_control.h"
#include "integrators/methods/gauss.h"
#include "phs/system/check.h"
#include "phs/system/time_transform.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/kepler.h"
#include "tests/support/robots.h"

namespace porthos::integrators::step_control_test {
namespace {

using test::PowerOfRadius;
using Real = long double;
const phs::UserModel<test::Kepler> kepler{test::Kepler{}};
const double period = 2 * M_PI;

template <int twice_power>
ControlOptions power_of_radius() {
  return {.scale = std::make_shared<phs::UserTimeScale<PowerOfRadius<twice_power>>>(
              PowerOfRadius<twice_power>{})};
}

phs::State kepler_state(double e) { return {kepler.description(), test::kepler_start(e)}; }

/// Relative energy errors at the steps of an orbit, taken at the start and after every further
/// `orbits`: the mean over an orbit does not see the oscillation.
struct Drift {
  double first = 0, last = 0, band = 0;  ///< means over the first and the last tenth; largest error
  std::int64_t steps = 0;
};
template <class Step>
Drift energy_drift(phs::State s, double duration, Step&& step) {
  test::Gauge gauge(kepler);
  const Real H0 = gauge.energy(s);
  Drift d;
  Real sum_first = 0, sum_last = 0, weight_first = 0, weight_last = 0;
  double t = 0;
  while (t < duration) {
    const double before = t;
    t = step(s);
    if (!(t > before)) {
      d.band = HUGE_VAL;
      return d;
    }
    const Real error = (gauge.energy(s) - H0) / fabsl(H0);
    d.band = std::max(d.band, double(fabsl(error)));
    if (t < 0.1 * duration) {
      sum_first += error;
      weight_first += 1;
    }
    if (t > 0.9 * duration) {
      sum_last += error;
      weight_last += 1;
    }
    ++d.steps;
  }
  d.first = double(sum_first / weight_first);
  d.last = double(sum_last / weight_last);
  return d;
}
template <class Method>
Drift energy_drift(Method& m, phs::State s, double duration) {
  return energy_drift(
      s, duration, [&](phs::State& x) { return m.step(x) == Outcome::ok ? m.time(x) : -HUGE_VAL; });
}

/// The textbook controller: h for the next step from the distance to a method of lower order.
class ErrorController {
 public:
  ErrorController(const char* method, const char* lower, int order, double tolerance, double h)
      : method_(make_integrator(method, kepler, h)),
        lower_(make_integrator(lower, kepler, h)),
        exponent_(1.0 / order),
        tolerance_(tolerance),
        h_(h) {}
  double operator()(phs::State& s) {
    for (;;) {
      phs::State a = s, b = s;
      if (method_->advance(t_, h_, a) != Outcome::ok || lower_->advance(t_, h_, b) != Outcome::ok) {
        h_ *= 0.5;
        continue;
      }
      double error = 0;
      for (size_t i = 0; i < 4; ++i)
        error = std::max(error, std::fabs(a.x[i] - b.x[i]) / (1 + std::fabs(a.x[i])));
      const double taken = h_;
      h_ *= std::clamp(0.9 * std::pow(tolerance_ / error, exponent_), 0.3, 3.0);
      if (error > tolerance_) continue;
      s = a;
      return t_ += taken;
    }
  }

 private:
  std::unique_ptr<Integrator> method_, lower_;
  double exponent_, tolerance_, h_, t_ = 0;
};

// --- the transformed system ----------------------------------------------------------------------

TEST(TimeTransform, IsAPortHamiltonianSystem) {
  const auto robot = test::ets_vii(5);
  const phs::RateTimeScale rates(*robot.model, 0.5);
  const phs::TimeTransformedModel transformed(*robot.model, rates);
  EXPECT_TRUE(transformed.description().traits.canonical);
  const auto r = phs::check(transformed);  // ∂K/∂x against duals: the gradient of sigma through D²H
  EXPECT_TRUE(r.holds()) << r.text();

  // Damping is paid out of p_t: J stays skew, K stays 0 along a solution.
  const phs::UserModel<test::DrivenPendulum> damped{test::DrivenPendulum{}};
  const phs::RateTimeScale damped_rates(damped, 1);
  const phs::TimeTransformedModel closed(damped, damped_rates);
  EXPECT_FALSE(closed.description().traits.canonical);
  EXPECT_TRUE(closed.description().traits.lossless);
  const auto c = phs::check(closed);
  EXPECT_TRUE(c.holds()) << c.text();
}

TEST(TimeTransform, LanesEqualScalarsBitForBit) {
  const auto robot = test::ets_vii(5);
  const phs::RateTimeScale rates(*robot.model, 0.5);
  const phs::TimeTransformedModel model(*robot.model, rates);
  const size_t n = size_t(model.description().nx);
  const auto lanes = model.instantiate<phs::Pack8>();
  const auto scalar = model.instantiate<double>();
  std::vector<phs::Pack8> x(n), f(n);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (auto& xi : x)
    for (int k = 0; k < 8; ++k) xi.set(k, normal(random));
  lanes->field(0.0, x, {}, f);
  for (int k = 0; k < 8; ++k) {
    std::vector<double> one(n), g(n);
    for (size_t i = 0; i < n; ++i) one[i] = x[i][k];
    scalar->field(0.0, one, {}, g);
    for (size_t i = 0; i < n; ++i) EXPECT_EQ(f[i][k], g[i]) << i;
  }
}

// In the coordinates (q, t, p, p_t) the steps are symplectic. The Jacobian comes from duals, so
// sigma needs a gradient in duals.
TEST(TimeTransform, StepsAreSymplectic) {
  const auto control = power_of_radius<2>();
  const phs::TimeTransformedModel model(kepler, *control.scale);
  const size_t n = 6;
  auto start = test::kepler_start(0.5);
  start = {start[0], start[1], 0.0, start[2], start[3], 0.5};
  for (const auto& [name, holds] :
       {std::pair{"gauss4", true}, {"gauss16", true}, {"stormer_verlet", true}, {"rk4", false}}) {
    std::vector<double> Psi(n * n);
    for (size_t j = 0; j < n; ++j) {
      phs::BasicState<phs::Dual> s(model.description(), {start.begin(), start.end()});
      s.x[j].d = 1;
      const auto method = make_basic_integrator<phs::Dual>(name, model, 0.1);
      for (int i = 0; i < 3; ++i) ASSERT_EQ(method->step(s), Outcome::ok) << name;
      for (size_t i = 0; i < n; ++i) Psi[i * n + j] = s.x[i].d + s.lo[i].d;
    }
    double worst = 0;
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) {
        double sum = i + 3 == j ? -1.0 : j + 3 == i ? 1.0 : 0.0;
        for (size_t k = 0; k < 3; ++k)
          sum += Psi[k * n + i] * Psi[(k + 3) * n + j] - Psi[(k + 3) * n + i] * Psi[k * n + j];
        worst = std::max(worst, std::fabs(sum));
      }
    std::printf("  transformed Kepler, %-14s defect %.1e   %s 1e-12\n", name, worst,
                holds ? "bound" : "must exceed 1e6 *");
    if (holds)
      EXPECT_LE(worst, 1e-12) << name;
    else
      EXPECT_GT(worst, 1e-6) << name;
  }
}

// --- energy over long times ----------------------------------------------------------------------

// At round-off: K walks by about u a step, and H - H0 = K/sigma is ten times that at the
// pericentre, where sigma = 0.1, over
// |H0| = 1/2. sqrt(240 000) 1.1e-16 * 20 = 1.1e-12.
TEST(StepControl, TimeTransformedGauss16KeepsTheEnergyOfAnEccentricOrbit) {
  const auto method = make_time_transformed("gauss16", kepler, period / 24, power_of_radius<2>());
  const Drift d = energy_drift(*method, kepler_state(0.9), 10'000 * period);
  std::printf(
      "  time-transformed gauss16, e = 0.9, 1e4 periods, %.1f steps a period: mean energy error "
      "first "
      "tenth %.1e, last %.1e   bound 5e-13; largest %.1e   bound 3e-12\n",
      double(d.steps) / 1e4, d.first, d.last, d.band);
  EXPECT_LE(std::fabs(d.last), 5e-13);
  EXPECT_LE(d.band, 3e-12);
}

// All three with steps coarse enough for their truncation error to stand far above rounding.
TEST(StepControl, NoDriftWhereAnErrorControllerDrifts) {
  const auto start = kepler_state(0.9);
  const double duration = 2'000 * period;
  ErrorController naive("gauss8", "gauss6", 7, 2e-6, 1e-3);
  const Drift control = energy_drift(start, duration, naive);
  const auto transformed = make_time_transformed("gauss8", kepler, 0.3, power_of_radius<3>());
  const Drift t = energy_drift(*transformed, start, duration);
  const auto reversible = make_reversible("gauss8", kepler, 0.12, power_of_radius<3>());
  const Drift r = energy_drift(*reversible, start, duration);
  for (const auto& [name, d] :
       {std::pair{"error controller", control}, {"time transformed", t}, {"reversible", r}})
    std::printf(
        "  gauss8, %-17s %5.1f steps a period: mean energy error first tenth %.2e, last %.2e, "
        "largest %.2e, drift %.1e\n",
        name, double(d.steps) / 2e3, d.first, d.last, d.band, std::fabs(d.last - d.first));
  // A linear drift moves the mean of the last tenth 19 times as far as that of the first.
  EXPECT_GT(std::fabs(control.last), 10 * std::fabs(control.first)) << "must drift";
  EXPECT_LE(std::fabs(t.last - t.first), 1e-2 * t.band);
  EXPECT_LE(std::fabs(r.last - r.first), 1e-2 * r.band);
  EXPECT_GT(std::fabs(control.last - control.first), 100 * std::fabs(t.last - t.first));
  EXPECT_GT(std::fabs(control.last - control.first), 100 * std::fabs(r.last - r.first));
}

}  // namespace
}  // namespace porthos::integrators::step_control_test
