// Laws of a contact: force and energy belong together, the restitution has its closed form.
#include <gtest/gtest.h>

#include "contact/law.h"
#include "phs/error.h"
#include "tests/support/reference.h"

namespace porthos::contact::law_test {
namespace {

using phs::Dual;

std::vector<Law> laws() {
  std::vector<Law> all;
  for (const double n : {1.0, 1.5, 2.0, 3.0})
    all.push_back({.form = Law::Form::power, .stiffness = 700, .exponent = n});
  all.push_back({.form = Law::Form::smooth, .stiffness = 700, .width = 0.01});
  return all;
}

TEST(Law, ForceIsTheSlopeOfTheEnergy) {
  double worst = 0;
  for (const Law& law : laws())
    for (const double d : {-0.5, -0.01, -1e-5, 0.0, 1e-5, 0.01, 0.3}) {
      const double f = elastic_force(law, d);
      const Dual U = elastic_energy(law, Dual{d, 1});
      worst = std::max(worst, std::fabs(U.d - f) / (1e-3 + f));
      EXPECT_GE(f, 0);
    }
  std::printf("  off by %.1e of the force   bound 1e-12\n", worst);
  EXPECT_LE(worst, 1e-12);
}

/// The hyperbola is above the force of n = 1 by at most k s/2. The softplus law with the sign and
/// the corner as sometimes printed, f = -k softplus(-d/ε) ε of the distance d, attracts.
TEST(Law, TheSmoothLawOnlyPushes) {
  const Law smooth{.form = Law::Form::smooth, .stiffness = 700, .width = 0.01};
  const auto printed = [](double depth) {
    return -700 * 0.01 * std::log1p(std::exp(depth / 0.01));
  };
  double most = 0, least = HUGE_VAL, control = 0;
  for (double d = -1; d < 1; d += 1e-3) {
    const double f = elastic_force(smooth, d);
    most = std::max(most, f - 700 * std::max(d, 0.0));
    least = std::min(least, f);
    control = std::min(control, printed(d));
  }
  std::printf("  above by %.4f N   bound 3.5, least force %.1e N   bound 0 (printed: %.0f N)\n",
              most, least, control);
  EXPECT_LE(most, 3.5 * (1 + 1e-12));
  EXPECT_GT(least, 0);
  EXPECT_LT(control, -100);
}

/// Far outside δ + r cancels; the closed form there has all digits: f = k s²/(2 (r - δ)).
TEST(Law, TheSmoothForceKeepsItsDigitsFarOutside) {
  const Law smooth{.form = Law::Form::smooth, .stiffness = 1, .width = 1e-6};
  const double f = elastic_force(smooth, -1.0);
  EXPECT_NEAR(f / (1e-12 / 4), 1, 1e-11);  // off by s²/4 itself
  EXPECT_GT(std::fabs(0.5 * (-1 + std::sqrt(1 + 1e-12)) / f - 1), 1e-6);
}

/// Restitutions of the reference lead back to the loss they were computed with.
TEST(Law, LossForARestitution) {
  const auto reference = test::read_json(test::data_file("reference/q_hunt_crossley.json"));
  double worst = 0;
  for (const auto& each : reference["dissipative"]) {
    const auto number = [&](const char* key) {
      const std::string text = each[key];
      const size_t slash = text.find('/');
      return slash == std::string::npos ? std::stod(text)
                                        : std::stod(text) / std::stod(text.substr(slash + 1));
    };
    const double e = number("e"), a = number("a");
    // e differs from 1 by 2/3 a v, whose rounding the inverse amplifies
    const double scale = 1 / (1 - e);
    worst = std::max(worst, std::fabs(loss_for(e, number("v_in")) / a - 1) / scale);
  }
  std::printf("  off by %.1e   bound 1e-14\n", worst);
  EXPECT_LE(worst, 1e-14);
  EXPECT_EQ(loss_for(1, 3), 0);
  EXPECT_THROW((void)loss_for(1.1, 1), InvalidArgument);
}

/// Against the numbers of the literature: π √(m/k), Hertz's 2.943 d/v, and 2.804 d/v of n = 2.
TEST(Law, ContactTime) {
  const auto time = [](double n, double speed) {
    return contact_time({.form = Law::Form::power, .stiffness = 5, .exponent = n}, 3, speed);
  };
  const auto depths = [&](double n, double v) {
    return time(n, v) * v / std::pow((n + 1) * 3 * v * v / 10, 1 / (n + 1));
  };
  EXPECT_NEAR(time(1, 2), M_PI * std::sqrt(3 / 5.), 1e-15);
  EXPECT_NEAR(depths(1.5, 2), 2.9432, 1e-4);
  EXPECT_NEAR(depths(2, 2), 2.8044, 1e-4);
  EXPECT_NEAR(time(1.5, 64) / time(1.5, 2), 0.5, 1e-15) << "Hertz: v^(-1/5)";
  EXPECT_GT(depths(1, 2), 3.14) << "control";
  EXPECT_FALSE(std::isfinite(time(2, 0)));
}

TEST(Law, LossNeverGivesBack) {
  const Law law{.form = Law::Form::power, .stiffness = 10, .exponent = 2, .loss = 0.5};
  for (const double v : {-100.0, -3.0, -1.0, 0.0, 2.0}) {
    const double f = elastic_force(law, 0.1), c = loss_coefficient(law, f, v);
    EXPECT_GE(c, 0);
    EXPECT_NEAR(f + c * v, f * std::max(1 + 0.5 * v, 0.0), 1e-15);
  }
}

}  // namespace
}  // namespace porthos::contact::law_test
