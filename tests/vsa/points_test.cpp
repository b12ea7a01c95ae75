// Numbers of the literature and of independent computations, tables, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <random>

#include <fmt/format.h>

#include "tests/support/bounds.h"
#include "vsa/catalogue.h"
#include "vsa/families.h"
#include "vsa/table.h"

namespace porthos::test::points_test {
namespace {

using vsa::Limits;

/// `digits` of the value given, rounded: half a unit of its last place.
#define EXPECT_DIGITS(measured, given, unit_of_last) \
  EXPECT_NEAR(measured, given, 0.5000001 * (unit_of_last)) << #measured

TEST(Points, QbmoveAdvanced) {
  const auto e = vsa::elastic_of(vsa::device("qbmove_advanced"));
  EXPECT_DIGITS(e->stiffness(0, 0, 0), 0.298936, 1e-6);
  EXPECT_DIGITS(e->stiffness(0, 0, 0.2), 0.613464, 1e-6);
  EXPECT_DIGITS(e->stiffness(0, 0, 0.8), 32.64165, 1e-5);
  EXPECT_DIGITS(-e->slopes(0.2, 0.0, 0.4).q, -0.590592, 1e-6);
  EXPECT_DIGITS(e->energy(0.2, 0.0, 0.4), 0.093858, 1e-6);
  EXPECT_DIGITS(-e->slopes(0.8, 0.0, 0.0).q, -4.847951, 1e-6);
  EXPECT_DIGITS(e->energy(0.8, 0.0, 0.0), 0.713485, 1e-6);
  // The closed forms, to rounding.
  const double a = 6.7328, k = 0.0222, phi = 0.31, s = 0.17;
  EXPECT_NEAR(e->slopes(phi, 0.0, s).q, 2 * k * std::cosh(a * s) * std::sinh(a * phi), 1e-15);
  EXPECT_NEAR(e->slopes(phi, 0.0, s).sigma, 2 * k * std::cosh(a * phi) * std::sinh(a * s), 1e-15);
  EXPECT_NEAR(e->stiffness(phi, 0, s), 2 * a * k * std::cosh(a * s) * std::cosh(a * phi), 1e-14);
}

TEST(Points, Maccepa) {
  const auto e = vsa::elastic_of(vsa::device("maccepa_vd"));
  // The angle counts from the link to the motor: q = -0.5 at theta = 0.
  EXPECT_DIGITS(e->energy(-0.5, 0.0, 1.5), 0.116378, 1e-6);
  EXPECT_DIGITS(-e->slopes(-0.5, 0.0, 1.5).q, 0.145438, 1e-6);  // towards theta
  EXPECT_DIGITS(e->stiffness(-0.5, 0, 1.5), 0.341293, 1e-6);
  EXPECT_DIGITS(e->slopes(-0.5, 0.0, 1.5).sigma, 0.13006, 1e-5);
  EXPECT_EQ(e->stiffness(0, 0, 0), 0);
}

TEST(Points, Edinburgh) {
  const auto e = vsa::elastic_of(vsa::device("edinburgh"));
  EXPECT_DIGITS(e->energy(0.2, 1.0, 2.0), 1.44183608, 1e-8);
  EXPECT_DIGITS(-e->slopes(0.2, 1.0, 2.0).q, -0.44067028, 1e-8);
  EXPECT_DIGITS(e->stiffness(0.2, 1, 2), 0.8098218, 1e-7);
}

TEST(Points, ClosedFormsOfTheOtherFamilies) {
  const double phi = 0.23, s = 0.6;
  const auto lever = vsa::lever_arm({.ks = 8e4});
  EXPECT_NEAR(lever->stiffness(0, 0, 0.09), 2 * 8e4 * 0.09 * 0.09, 1e-9);
  EXPECT_NEAR(lever->slopes(phi, 0.0, s).sigma, 2 * 8e4 * s * std::pow(std::sin(phi), 2), 1e-9);
  EXPECT_NEAR(lever->stiffness(phi, 0, s), 2 * 8e4 * s * s * std::cos(2 * phi), 1e-9);
  const auto tendons = vsa::antagonistic_quadratic({.ks = 3e5, .r = 0.02});
  const double c = 4 * 3e5 * 8e-6;
  EXPECT_NEAR(tendons->slopes(phi, 0.0, s).q, c * s * phi, 1e-14);  // a linear spring
  EXPECT_NEAR(tendons->stiffness(phi, 0, s), c * s, 1e-14);
  EXPECT_NEAR(tendons->slopes(phi, 0.0, s).sigma, 0.5 * c * (phi * phi + s * s), 1e-14);
  EXPECT_NEAR(tendons->slopes(0.9, 0.0, 0.1).q, 0.25 * c * 1.0, 1e-14) << "one tendon is slack";
  const auto exponential = vsa::antagonistic_exponential({.c = 0.2, .b = 4});
  EXPECT_NEAR(exponential->slopes(phi, 0.0, s).q, 0.4 * std::exp(4 * s) * std::sinh(4 * phi),
              1e-14);
  const auto pivot = vsa::moving_pivot({.ks = 2e4, .R = 0.1, .L = 0.1}, {.sigma_upper = 0.09});
  const double alpha = 0.06 / 0.04;
  EXPECT_NEAR(pivot->stiffness(0, 0, 0.06), 2e4 * 0.01 * alpha * alpha, 1e-10);
  EXPECT_NEAR(pivot->slopes(phi, 0.0, 0.06).q, 0.5 * 200 * alpha * alpha * std::sin(2 * phi),
              1e-12);
  const auto two = vsa::cosh_springs({.a = 6.7328, .k = 0.0222, .a2 = 6.9602, .k2 = 0.0216});
  EXPECT_NEAR(two->stiffness(0, 0, 0), 6.7328 * 0.0222 + 6.9602 * 0.0216, 1e-15);
}

TEST(Points, ChargeAndReleaseOfTheQbmove) {  // sigma 0 -> 0.6 -> 0 at zero deflection
  const auto e = vsa::elastic_of(vsa::device("qbmove_advanced"));
  const int n = 4096;
  double work = 0, peak = 0;
  for (int i = 0; i < n; ++i) {  // sigma = 0.3 (1 - cos t): exponentially exact
    const double t = 2 * M_PI * i / n;
    work += e->slopes(0.0, 0.0, 0.3 * (1 - std::cos(t))).sigma * 0.3 * std::sin(t) * 2 * M_PI / n;
    peak = std::max(peak, e->energy(0.0, 0.0, 0.3 * (1 - std::cos(t))));
  }
  EXPECT_DIGITS(peak, 0.180776, 1e-6);
  keeps("net work of the cycle [J]", std::fabs(work), 1e-15);
}

// --- tables --------------------------------------------------------------------------------------

vsa::Measurements measured(double noise = 0, bool curl = false) {
  vsa::Measurements m;
  const double a = 6.7328, k = 0.0222;
  for (int i = -20; i <= 20; ++i) m.deflection.push_back(0.02 * i);
  for (int j = 0; j <= 10; ++j) m.sigma.push_back(0.04 * j);
  int n = 0;
  for (const double s : m.sigma)
    for (const double f : m.deflection) {
      m.torque.push_back(2 * k * std::cosh(a * s) * std::sinh(a * f) *
                         (1 + noise * std::sin(13.0 * n++)));
      m.stiffness.push_back(2 * a * k * std::cosh(a * s) * std::cosh(a * f));
      m.sigma_effort.push_back(curl ? 0 : 2 * k * std::cosh(a * f) * std::sinh(a * s));
    }
  return m;
}

TEST(Table, IsTheEnergyItWasTakenFrom) {
  const auto table = vsa::tabulated(measured());
  const auto model = vsa::elastic_of(vsa::device("qbmove_advanced"));
  double torque = 0, energy = 0, effort = 0, knots = 0;
  for (double f = -0.35; f <= 0.35; f += 0.017)
    for (double s = 0.05; s <= 0.35; s += 0.013) {
      const auto a = table->slopes(f, 0.0, s), b = model->slopes(f, 0.0, s);
      torque = std::max(torque, std::fabs(a.q - b.q));
      effort = std::max(effort, std::fabs(a.sigma - b.sigma));
      energy = std::max(energy, std::fabs(table->energy(f, 0.0, s) - model->energy(f, 0.0, s)));
    }
  const auto m = measured();
  for (size_t i = 0; i < m.deflection.size(); ++i)
    for (size_t j = 0; j < m.sigma.size(); ++j)
      knots = std::max(knots, std::fabs(table->slopes(m.deflection[i], 0.0, m.sigma[j]).q -
                                        m.torque[j * m.deflection.size() + i]));
  keeps("torques of the table are met [N m]", knots, 1e-14);
  // Natural splines bend none at their ends: about h² f''/9√3 there, 0.04² · 135/16, falling by 3.7
  // a knot.
  keeps("torque between its places, of 3 N m", torque, 3e-3);
  keeps("energy, of 0.3 J", energy, 5e-4);
  keeps("effort of the stiffness port, of 3 N m", effort, 2e-2);
}

/// Without efforts the energy at zero deflection is not known: remarked. Controls: with them, and
/// of one setting.
TEST(Table, WithoutEffortsThePretensionIsRemarked) {
  auto m = measured();
  const auto full = vsa::tabulated(m);
  EXPECT_EQ(full->traits().remark, "");
  m.sigma_effort.clear();
  const auto bare = vsa::tabulated(m);
  EXPECT_NE(bare->traits().remark.find("lack the pretension"), std::string::npos);
  keeps("torque without efforts less with [N m]",
        std::fabs(bare->slopes(0.2, 0.0, 0.3).q - full->slopes(0.2, 0.0, 0.3).q), 1e-12);
  breaks("energy without efforts less with, of it",
         1 - bare->energy(0.2, 0.0, 0.3) / full->energy(0.2, 0.0, 0.3), 0.1);
  const size_t n = m.deflection.size();
  m.sigma.resize(1);
  m.torque.resize(n);
  if (!m.stiffness.empty()) m.stiffness.resize(n);
  EXPECT_EQ(vsa::tabulated(m)->traits().remark, "");
}

TEST(Table, NoEnergyIsRefused) {
  EXPECT_NO_THROW(vsa::tabulated(measured(1e-4))) << "noise is not a contradiction";
  EXPECT_NE(refusal([] {
              vsa::tabulated(measured(0, true));
            }).find("is of no energy: round the cell of deflections -0.4"),
            std::string::npos)
      << refusal([] { vsa::tabulated(measured(0, true)); });
  auto m = measured();
  m.torque[100] = m.torque[99];
  EXPECT_NE(refusal([&] {
              vsa::tabulated(m);
            }).find("expected it to rise: the equilibrium would not be unique"),
            std::string::npos);
  m = measured();
  for (auto& k : m.stiffness) k *= 1.2;
  EXPECT_NE(refusal([&] { vsa::tabulated(m); }).find("expected the derivative of the torque"),
            std::string::npos);
  m = measured();
  m.sigma[3] = m.sigma[2];
  EXPECT_NE(refusal([&] {
              vsa::tabulated(m);
            }).find("sigma number 4 is 0.08, expected finite numbers that rise"),
            std::string::npos);
}

// 5 φ + 40 φ³, times 1 and 1.5, with errors of 0.1 N m. The curve is within four times these of
// that without errors, and its slopes within 0.3 N m over the 0.1 rad on which it turns.
TEST(Table, SmoothingTakesOutNoise) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> error(0, 0.1);
  vsa::Measurements m;
  m.sigma = {0, 0.5};
  for (int i = -20; i <= 20; ++i) m.deflection.push_back(0.025 * i);
  const auto exact = [](double f, double s) { return (1 + s) * (5 * f + 40 * f * f * f); };
  for (const double s : m.sigma)
    for (const double f : m.deflection) m.torque.push_back(exact(f, s) + error(generator));
  const std::string rough = refusal([&] { vsa::tabulated(m); });
  EXPECT_NE(rough.find("would not be unique (smoothing [N m] takes out noise)"), std::string::npos)
      << rough;
  const auto e = vsa::tabulated(m, {}, 0.02, 0.1);
  double torque = 0, stiffness = 0, left = 0;
  for (size_t j = 0; j < 2; ++j)
    for (size_t i = 0; i < 41; ++i) {
      const double f = m.deflection[i], s = m.sigma[j], t = e->slopes(f, 0.0, s).q;
      torque = std::max(torque, std::fabs(t - exact(f, s)));
      left += std::pow(t - m.torque[j * 41 + i], 2) / 82;
      if (std::fabs(f) < 0.45)
        stiffness =
            std::max(stiffness, std::fabs(e->stiffness(f, 0, s) - (1 + s) * (5 + 120 * f * f)));
      EXPECT_GE(e->stiffness(f, 0, s), 0);
    }
  keeps("torque against that without errors [N m]", torque, 0.4);
  keeps("stiffness, of 5 to 52 N m/rad", stiffness, 3);
  keeps("left over, against 0.1 N m", std::fabs(std::sqrt(left) / 0.1 - 1), 1e-10);
  const auto stiff = vsa::tabulated(m, {}, 0.02, 1);
  breaks("control: smoothing of 1 N m, stiffness at rest", std::fabs(stiff->stiffness(0, 0, 0) - 5),
         1);
  for (const auto& [deviation, words] :
       {std::pair{0.01, "with smoothing = 0.01 N m the stiffness is -"},
        {-1.0, "the smoothing is -1, expected 0 N m or more"}}) {
    const std::string why = refusal([&, s = deviation] { vsa::tabulated(m, {}, 0.02, s); });
    EXPECT_NE(why.find(words), std::string::npos) << why;
  }
}

/// The time of a measurement and words beside it. Controls: the same without; a misspelt column.
TEST(Table, ColumnsThatMeanNothingAreNamed) {
  const auto read = [](const std::string& head, const std::string& more, double smoothing) {
    std::string text = "deflection,torque" + head + "\n";
    for (int i = -4; i <= 4; ++i) text += fmt::format("{},{}{}\n", 0.1 * i, 0.2 * i, more);
    return vsa::parse_measurements(text, "spring.csv", smoothing);
  };
  const auto plain = read("", "", 0), timed = read(",time,who", ",12:30,me", 0);
  EXPECT_EQ(timed.torque, plain.torque);
  EXPECT_EQ(plain.remark, "");
  EXPECT_EQ(timed.remark, "spring.csv: not used: the columns 'time', 'who'");
  const auto smooth = read(",time", ",1", 0.5);
  EXPECT_NE(smooth.remark.find("over 1000 times what neighbours scatter by: the curve may be "
                               "flattened; spring.csv: not used: the columns 'time'"),
            std::string::npos)
      << smooth.remark;
  EXPECT_NE(refusal([&] { read(",stifness", ",2", 0); }).find("perhaps 'stiffness'"),
            std::string::npos);
}

TEST(Table, FromAFile) {
  const std::string path = ::testing::TempDir() + "porthos_vsa_table.csv";
  const auto write = [&](const std::string& text) { std::ofstream(path) << text; };
  write(
      "# a spring of 2 N m/rad, of 4 at sigma = 1\nsigma, deflection, "
      "torque\n0,-1,-2\n0,0,0\n0,1,2\n1,1,4\n1,-1,-4\n1,0,0\n");
  const auto e = vsa::tabulated(vsa::read_measurements(path));
  EXPECT_NEAR(e->stiffness(0.3, 0, 0), 2, 1e-14);
  EXPECT_NEAR(e->energy(0.5, 0.0, 1.0), 0.5, 1e-15);
  EXPECT_NEAR(e->slopes(0.5, 0.0, 0.5).sigma, 0.25, 1e-15);
  // as a spreadsheet writes it: a byte-order mark, semicolons, decimal commas
  write("\xEF\xBB\xBFsigma;deflection;torque\r\n0;-1;-2,5\r\n0;0;0\r\n0;1;+2,5\r\n");
  EXPECT_NEAR(vsa::tabulated(vsa::read_measurements(path))->stiffness(0.3, 0, 0), 2.5, 1e-14);
  const std::pair<const char*, const char*> bad[] = {
      {"sigma;deflection;torque\n0;0;1.000,5\n", ":2: 'torque' is '1.000,5'"},
      {"sigma,angle,torque\n",
       ":1: no column 'deflection', expected deflection, sigma, torque, "
       "stiffness, sigma_effort; it has 'angle'"},
      {"sigm,deflection,torque\n", ":1: unknown column 'sigm', expected "},
      {"sigma,deflection\n", ":1: no column 'torque'"},
      {"sigma,deflection,torque\n0,0\n", ":2: the row has 2 numbers, expected 3"},
      {"sigma,deflection,torque\n0,0,x\n", ":2: 'torque' is 'x', expected a finite number"},
      {"sigma,deflection,torque\n0,0,1\n0,0,2\n", ":3: deflection 0 and sigma 0 are given twice"},
      {"sigma,deflection,torque\n0,0,0\n0,1,1\n1,0,0\n",
       "3 places are no grid, expected the same deflections"},
      {"", ":1: no column 'deflection'"}};
  for (const auto& [text, says] : bad) {
    write(text);
    const std::string why = refusal([&] { vsa::read_measurements(path); });
    EXPECT_NE(why.find(says), std::string::npos) << why << "\n  instead of: " << says;
  }
  std::remove(path.c_str());
}

/// Deflections of their own at each sigma, loading and unloading, noise of 0.02 N m.
TEST(Table, AnyPlacesWithSmoothing) {
  const std::string path = ::testing::TempDir() + "porthos_vsa_scattered.csv";
  std::mt19937_64 generator(4);
  std::normal_distribution<double> noise(0, 0.02);
  std::uniform_real_distribution<double> off(-0.004, 0.004);
  const auto torque = [](double phi, double sigma) {
    return (2 + sigma) * phi + 3 * phi * phi * phi;
  };
  std::string text = "deflection,sigma,torque\n";
  for (const double sigma : {0.0, 0.5, 1.0})
    for (int i = 0; i <= 60; ++i) {
      const double phi = -0.6 + 0.02 * i + off(generator);
      for (int way = 0; way < 2; ++way)
        text += std::to_string(phi) + "," + std::to_string(sigma) + "," +
                std::to_string(torque(phi, sigma) + noise(generator)) + "\n";
    }
  std::ofstream(path) << text;
  EXPECT_NE(refusal([&] { vsa::read_measurements(path); }).find("are given twice"),
            std::string::npos);
  const auto m = vsa::read_measurements(path, 0.02);
  EXPECT_EQ(m.sigma.size(), 3u);
  EXPECT_EQ(m.torque.size(), 3 * m.deflection.size());
  const auto e = vsa::tabulated(m, {}, 0.02, 0.02);
  double worst = 0;
  for (const double sigma : {0.0, 0.25, 1.0})
    for (double phi = -0.55; phi < 0.56; phi += 0.05)
      worst = std::fmax(worst, std::fabs(e->slopes(phi, 0, sigma).q - torque(phi, sigma)));
  std::printf("  largest error of the torque %.3f N m of noise 0.02 N m\n", worst);
  EXPECT_LT(worst, 0.03);  // measured 0.019; the noise itself reaches 0.06
  EXPECT_NEAR(e->traits().measured_from, -0.6, 0.01);
  EXPECT_EQ(m.remark, "");  // means of two have 0.02 N m over √2

  // Loading and unloading differ by 0.4 N m at places that differ by what an encoder jitters.
  text = "deflection,sigma,torque\n";
  for (int way = 0; way < 2; ++way)
    for (int i = 0; i <= 60; ++i) {
      const double phi = -0.6 + 0.02 * i + 0.001 * off(generator);
      text += std::to_string(phi) + ",0," +
              std::to_string(torque(phi, 0) + (way == 0 ? 0.2 : -0.2) + noise(generator)) + "\n";
    }
  std::ofstream(path) << text;
  const auto both = vsa::tabulated(vsa::read_measurements(path, 0.02), {}, 0.02, 0.02);
  worst = 0;
  for (double phi = -0.55; phi < 0.56; phi += 0.05)
    worst = std::fmax(worst, std::fabs(both->slopes(phi, 0, 0.0).q - torque(phi, 0)));
  std::printf("  largest error of the mean of two ways, 0.4 N m apart: %.3f N m\n", worst);
  EXPECT_LT(worst, 0.03);

  std::ofstream(path)
      << "deflection,sigma,torque\n-1,0,-1\n0,0,0\n1,0,1\n2,0,2\n3,1,3\n4,1,4\n5,1,5\n6,1,6\n";
  EXPECT_NE(refusal([&] { vsa::read_measurements(path, 0.1); }).find("no range of deflections"),
            std::string::npos);
  std::remove(path.c_str());
}

/// A spring whose settings are measured too, and jitter by 0.003 of a range of 1.
TEST(Table, SettingsThatJitterAreOne) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> noise(0, 0.02);
  std::uniform_real_distribution<double> off(-0.003, 0.003);
  const auto torque = [](double phi, double sigma) { return (2 + 5 * sigma) * phi; };
  std::string text = "deflection,sigma,torque\n";
  for (const double setting : {0.0, 0.5, 1.0})
    for (int i = 0; i <= 60; ++i) {
      const double phi = -0.6 + 0.02 * i, sigma = setting + off(generator);
      text += fmt::format("{},{},{}\n", phi, sigma, torque(phi, sigma) + noise(generator));
    }
  const auto m = vsa::parse_measurements(text, "jitter.csv", 0.02);
  ASSERT_EQ(m.sigma.size(), 3u);
  EXPECT_NEAR(m.one_setting, 1.0 / 50, 2e-4);
  EXPECT_NEAR(m.sigma[1], 0.5, 0.003);
  const auto e = vsa::tabulated(m, {}, 0.02, 0.02);
  double worst = 0;
  for (const double sigma : {0.1, 0.5, 0.9})
    for (double phi = -0.55; phi < 0.56; phi += 0.05)
      worst = std::fmax(worst, std::fabs(e->slopes(phi, 0, sigma).q - torque(phi, sigma)));
  EXPECT_LT(worst, 0.03);
  EXPECT_EQ(e->traits().limits.sigma_lower, m.sigma[0]);
  // Control: settings that are farther apart than that are none of the same.
  std::string apart = "deflection,sigma,torque\n";
  for (int i = 0; i <= 20; ++i) apart += fmt::format("{},{},{}\n", 0.1 * i - 1, 0.05 * i, 0.1 * i);
  EXPECT_NE(refusal([&] {
              vsa::parse_measurements(apart, "apart.csv", 0.1);
            }).find("has 1 deflections, expected 4 or more (settings of sigma nearer than 1/50"),
            std::string::npos);
  // A sigma of its own in each row is no setting.
  std::uniform_real_distribution<double> any(0, 1);
  std::string scattered = "deflection,sigma,torque\n";
  for (int i = 0; i <= 400; ++i) {
    const double phi = -1 + 0.005 * i, sigma = any(generator);
    scattered += fmt::format("{},{},{}\n", phi, sigma, torque(phi, sigma));
  }
  EXPECT_NE(refusal([&] {
              vsa::parse_measurements(scattered, "any.csv", 0.1);
            }).find("any.csv: sigma scatters over "),
            std::string::npos);
}

TEST(Table, NeedsNoSettingAndTheSignThatHolds) {
  const auto m = vsa::parse_measurements("torque,deflection\n-5,-1\n0,0\n5,1\n", "one.csv");
  EXPECT_EQ(m.sigma, std::vector<double>{0});
  EXPECT_NEAR(vsa::tabulated(m)->slopes(0.5, 0, 0.0).q, 2.5, 1e-15);
  const auto other = vsa::parse_measurements("torque,deflection\n5,-1\n0,0\n-5,1\n", "other.csv");
  EXPECT_NE(
      refusal([&] { vsa::tabulated(other); })
          .find("at sigma = 0 torque falls from 5 to -5 N m between deflections -1 and 1 rad, "
                "expected the torque that holds the deflection"),
      std::string::npos);
}

TEST(Refused, Starts) {
  const auto e = vsa::elastic_of(vsa::device("qbmove_advanced"));
  EXPECT_NO_THROW(e->require_inside("elbow", 0.3, 0, 0.5));
  EXPECT_NE(refusal([&] { e->require_inside("elbow", 0.4, 0, 0.5); })
                .find("elbow: starts with a spring deflected by 0.9 rad (link 0.4 rad, theta 0 "
                      "rad, sigma 0.5 rad), expected "
                      "no more than 0.8 rad"),
            std::string::npos);
  EXPECT_NE(refusal([&] {
              e->require_inside("elbow", 0, 0, 0.9);
            }).find("elbow: sigma starts at 0.9 rad, expected -0.8 to 0.8 rad"),
            std::string::npos);
}

TEST(Refused, Parameters) {
  const std::pair<std::function<void()>, const char*> bad[] = {
      {[] { vsa::make_elastic("cosine", {}, {}); },
       "unknown family 'cosine', expected one of series_elastic"},
      {[] {
         vsa::make_elastic("cosh", {{"a", {1}}}, {});
       },
       "cosh: no parameter 'k' [N m], expected a, k, a2, k2"},
      {[] {
         vsa::make_elastic("cosh", {{"b", {1}}}, {});
       },
       "cosh: unknown parameter 'b', expected a, k, a2, k2"},
      {[] {
         vsa::make_elastic("cosh", {{"a", {1, 2}}, {"k", {1}}}, {});
       },
       "cosh: a has 2 entries, expected one number"},
      {[] { vsa::cosh_springs({.a = -1, .k = 1}); }, "cosh: a is -1, expected more than 0 1/rad"},
      {[] { vsa::maccepa({.kappa = 1, .B = 0.2, .C = 0.1, .drum = 1}); },
       "maccepa: C is 0.1, expected more than B"},
      {[] { vsa::moving_pivot({.ks = 1, .R = 1, .L = 0.1}, {.sigma_upper = 0.1}); },
       "expected less than the lever's length L"},
      {[] {
         vsa::variable_lever({{1, -2}}, {.sigma_lower = 0, .sigma_upper = 1});
       },
       "expected 0 or more over sigma's range 0 to 1"},
      {[] { vsa::lever_arm({.ks = 1}, {.deflection = 0.3}); },
       "stop_stiffness, of the stop at the deflection limit, is 0, expected more than 0"},
      {[] { vsa::device("fsj"); }, "unknown device 'fsj', expected one of qbmove_advanced"},
      {[] { vsa::elastic_of(vsa::device("vsaut_ii")); }, "device 'vsaut_ii' has no model"}};
  for (const auto& [call, says] : bad) {
    const std::string why = refusal(call);
    EXPECT_NE(why.find(says), std::string::npos) << why << "\n  instead of: " << says;
  }
}

}  // namespace
}  // namespace porthos::test::points_test
