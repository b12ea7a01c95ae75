#include "scene/plot/plot.h"
#include "scene/plot/trace_plot.h"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <cmath>
#include <random>

namespace porthos::test::plot_test {
namespace {

using namespace scene;

Envelope random_walk(double first, double last, int n) {
  Envelope e(first, last);
  std::mt19937_64 rng(2);
  std::normal_distribution<double> step(0, 1e-17);
  double error = 0;
  for (int i = 0; i <= n; ++i) {
    e.add(i * last / n, error);
    error += step(rng);
  }
  return e;
}

void expect_valid(const std::string& svg) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(svg.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  EXPECT_STREQ(document.RootElement()->Name(), "svg");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Plot, IsValidXmlWhateverTheTitle) {
  const auto e = random_walk(1, 1e4, 10000);
  const auto svg = energy_plot(e, {"a <b> & \"c\" \x01 — ü", "gauss16", 1e-12});
  expect_valid(svg);
  EXPECT_NE(svg.find("a &lt;b&gt; &amp;"), std::string::npos);
}

TEST(Plot, DecimatesTo1500ColumnsAndKeepsTheExtremes) {
  Envelope e(1, 1e6);
  for (int i = 0; i <= 1000000; ++i) e.add(i, i == 777777 ? 1e-3 : 1e-9);
  EXPECT_LE(e.points().size(), 1500u);
  double highest = 0;
  for (const auto& p : e.points()) highest = std::max(highest, p.high);
  EXPECT_EQ(highest, 1e-3);
}

TEST(Plot, HasALogarithmicTimeAxisOnlyOverDecades) {
  EXPECT_TRUE(Envelope(1, 101).logarithmic());
  EXPECT_FALSE(Envelope(1, 99).logarithmic());
}

TEST(Plot, SurvivesEveryDegenerateSeries) {
  for (const double value : {0.0, 1e-300, 1e300, HUGE_VAL, double(NAN)}) {
    Envelope e(1, 50);
    for (int i = 0; i <= 50; ++i) e.add(i, value);
    expect_valid(energy_plot(e, {"t", "s", 1e-12}));
  }
  expect_valid(energy_plot(Envelope(0, 0), {"", "", {}}));
  Envelope one(0, 0);
  one.add(0, 0);
  expect_valid(energy_plot(one, {"t", "s", 0.0}));
}

/// A coordinate that a lock holds differs by its last bit: ticks that fine would not end.
TEST(Plot, TracesOfAlmostEqualValuesHaveTicks) {
  for (const double low : {0.0, 1e-300, 0.32, -5e6, 1e300})
    for (const double high : {low, std::nextafter(low, HUGE_VAL), low + 1e-10 * std::fabs(low)}) {
      const std::vector<TracePanel> panels{{"angle [rad]", {{"j", {0, 1}, {low, high}}}}};
      const auto svg = trace_plot(panels, "t", "s");
      expect_valid(svg);
      EXPECT_LT(svg.size(), 10000u) << low << ' ' << high;
    }
}

}  // namespace
}  // namespace porthos::test::plot_test
