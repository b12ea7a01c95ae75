// Measured springs whose settings differ much in stiffness, and the loop that is left over.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/support/bounds.h"
#include "vsa/table.h"

namespace porthos::test::table_settings_test {
namespace {

double exact(double phi, double sigma) {
  return (1 + 49 * sigma) * phi + 60 * sigma * phi * phi * phi;
}

/// A soft setting and a stiff one, with errors of 4 % of each torque, or of one size.
std::string two_settings(double relative, double absolute, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> error(0, 1);
  std::string text = "deflection,sigma,torque\n";
  for (const double sigma : {0.0, 1.0})
    for (int i = 0; i <= 40; ++i) {
      const double phi = -0.5 + i / 40.0, f = exact(phi, sigma);
      text += fmt::format("{},{},{}\n", phi, sigma,
                          f * (1 + relative * error(generator)) + absolute * error(generator));
    }
  return text;
}

std::string said_of(const std::string& text, const vsa::TorqueErrors& errors, double& off) {
  off = NAN;
  try {
    const auto m = vsa::parse_measurements(text, "s.csv", errors);
    const auto e = vsa::tabulated(m, {}, 0.02, errors);
    off = 0;
    for (double phi = -0.45; phi <= 0.45; phi += 0.05)
      off = std::max(off, std::fabs(e->slopes(phi, 0, 0.0).q - exact(phi, 0)) / 0.5);
    return m.remark;
  } catch (const InvalidArgument& refused) {
    return refused.what();
  }
}

/// What is named for the stiff setting does not flatten the soft one.
TEST(TableSettings, TheNumberForAStiffSettingLeavesASoftOne) {
  int told = 0;
  for (unsigned seed = 0; seed < 6; ++seed) {
    const auto text = two_settings(0.04, 0, seed);
    double off = 0;
    const auto first = said_of(text, 0.1, off);
    const auto at = first.find("state ");
    if (at == first.npos) continue;
    ++told;
    EXPECT_EQ(first.find(" N m", at), first.npos) << first;
    EXPECT_LE(first.size(), 220u);
    const double named = std::strtod(first.c_str() + at + 6, nullptr);
    const auto then = said_of(text, {0, named}, off);
    EXPECT_EQ(then, "") << named;
    keeps("torque of the soft setting, of its largest", off, 0.05);
  }
  EXPECT_GE(told, 5);
  double off = 0;
  const auto control = said_of(two_settings(0, 0.02, 1), 0.002, off);  // one size is right there
  EXPECT_NE(control.find(" N m", control.find("state ")), control.npos) << control;
}

/// The width of the loop of rows about the curve; control: none in noise.
TEST(TableSettings, TheWidthOfALoopIsMeasured) {
  const auto width = [](double half) {
    std::mt19937_64 generator(3);
    std::normal_distribution<double> error(0, 0.2);
    std::string text = "deflection,torque\n";
    for (int i = 0; i < 400; ++i) {
      const double t = M_PI * i / 199.5 + 0.02, phi = 0.3 * std::sin(t);
      text += fmt::format("{},{}\n", phi,
                          120 * phi + (std::cos(t) > 0 ? half : -half) + error(generator));
    }
    const double errors = 1.3 * std::hypot(half, 0.2);
    return vsa::measured_loop(
        *vsa::tabulated(vsa::parse_measurements(text, "l.csv", errors), {}, 0.02, errors));
  };
  keeps("width of a loop of 2 N m", std::fabs(width(1) - 2), 0.1);
  EXPECT_EQ(width(0), 0) << "control";
}

}  // namespace
}  // namespace porthos::test::table_settings_test
