// What certificates say, and that they say no where no is the answer.
#include <nlohmann/json.hpp>
#include <random>

#include "energy_shaping/certify.h"
#include "energy_shaping/modes.h"
#include "energy_shaping/plant.h"
#include "tests/energy_shaping/loops.h"

namespace porthos::energy_shaping::certificate_test {
namespace {

using test::agrees, test::breaks, test::keeps, test::refusal, test::Vec;

CertifyOptions options_of(const MatchedLoop& loop, Vec start, double duration) {
  CertifyOptions o;
  o.region = loop.options().region;
  o.starts = {std::move(start)};
  o.run.duration = duration;
  o.run.step = 0.01;
  return o;
}

TEST(Certify, CartPole) {
  const auto loop = cart_pole({});
  auto o = options_of(*loop, {0.5, 0, 0, 0}, 20);
  o.periods = {0, 0.01, 0.02};
  for (const double factor : {0.9, 1.1})
    o.plants.push_back(cart_pole_plant({.a = 10 * factor, .b = 1}));
  const Certificate c = certify(*loop, o);
  std::printf("%s", c.text().c_str());
  EXPECT_TRUE(c.holds());
  const auto j = nlohmann::json::parse(c.json());
  EXPECT_EQ(j["items"].size(), c.items().size());
  EXPECT_EQ(j["holds"], true);
  EXPECT_EQ(c.item("critical points of V_d").value, 1) << "V_d has one critical point";
  EXPECT_THROW((void)c.item("no such item"), InvalidArgument);
}

/// A run from the rest shows nothing, 0/0, and neither do no samples. Control: CartPole's start.
TEST(Certify, WhatShowsNothingDoesNotPass) {
  const auto loop = cart_pole({});
  auto o = options_of(*loop, {0, 0, 0, 0}, 1);
  o.starts = {loop->rest()};
  const Certificate c = certify(*loop, o);
  EXPECT_FALSE(c.holds());
  const auto& run = c.item("run, continuous");
  EXPECT_EQ(run.finding, Finding::fails);
  EXPECT_NE(run.text.find("expected another start"), std::string::npos) << run.text;
  o.region.samples = 0;
  EXPECT_EQ(refusal([&] { (void)certify(*loop, o); }),
            "samples is 0, expected 1 or more: none would show nothing");
}

TEST(Certificate, HtmlIsEscapedAndNamesWhatFails) {
  Certificate c("a <b>law</b> & more");
  c.at_most("force \"free\"", 2, 1, "joint <j3>", {0.5});
  const std::string html = c.html();
  EXPECT_NE(html.find("a &lt;b&gt;law&lt;/b&gt; &amp; more"), std::string::npos);
  EXPECT_NE(html.find("not certified: force &quot;free&quot;"), std::string::npos);
  EXPECT_NE(html.find("joint &lt;j3&gt; at (0.5)"), std::string::npos);
  EXPECT_EQ(html.find("<b>law"), std::string::npos);
  EXPECT_NE(html.find("<td>FAILS</td>"), std::string::npos);
}

// The pass of a double well is known.
struct DoubleWell {
  static constexpr int n = 1, m = 1;
  const char* name = "mass on a line";
  std::array<std::pair<const char*, const char*>, 1> coordinates{{{"x", "m"}}};
  std::array<const char*, 1> inputs{"x"};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = S(1.0);
  }
  template <class S>
  S potential(std::span<const S>) const {
    return S(0.0);
  }
  template <class T>
  void input(std::span<const T>, std::span<T> G) const {
    G[0] = T(1.0);
  }
};
struct WellShaping {
  static constexpr int n = 1;
  std::string name = "double well";
  double kv = 1;
  std::vector<Gain> gains() const { return {{"kv", kv}}; }
  template <class S, class T>
  void mass(std::span<const S>, std::span<const T>, std::span<S> Md) const {
    Md[0] = S(1.0);
  }
  template <class S, class T>  // minima at ±1, pass at 0 of height ¼
  S potential(std::span<const S> q, std::span<const T>) const {
    const S s = q[0] * q[0] - S(1.0);
    return S(0.25) * s * s;
  }
};

TEST(Certify, BasinOfADoubleWell) {
  const Region region{{-3}, {3}, 1, 200};
  const MatchedLoop loop(plant(DoubleWell{}), shaping(WellShaping{}), {"x.force"}, {1},
                         {.region = region});
  const auto points = critical_points(loop, region);
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0].descending + points[1].descending, 0);
  EXPECT_EQ(points[2].descending, 1);
  const Basin b = basin(loop, region);
  agrees("c", b.level, 0.25, 1e-12);
  keeps("pass", std::fabs(b.at[0]), 1e-9);
  // A state just above c leaves, one below stays.
  const auto crosses = [&](double q, double H) {
    const double V = 0.25 * (q * q - 1) * (q * q - 1), v = -std::sqrt(2 * (H - V));
    const auto run = simulate(loop, {q, v}, {.duration = 30});
    return run.x.back()[0] < 0;
  };
  EXPECT_FALSE(crosses(1, 0.2499));
  EXPECT_TRUE(crosses(1, 2.0)) << "damped on the way: far above c";
  // Near the pass there is no way to be damped on: c is tight to a percent.
  EXPECT_FALSE(crosses(0.02, 0.9999 * b.level));
  EXPECT_TRUE(crosses(0.02, 1.01 * b.level));
}

TEST(Certify, BasinOfTheAcrobotAgainstRuns) {
  const auto loop = acrobot({});
  const Region region{{-2, -3}, {2, 3}, 5};
  const Basin b = basin(*loop, region);
  std::printf("  c - V_d(rest) = %.4f, left at (%.3f, %.3f): %s\n", b.depth, b.at[0], b.at[1],
              b.method.c_str());
  EXPECT_GT(b.depth, 0.1);
  // Runs that start inside stay inside and come to rest.
  const auto law = loop->loop<double>();
  const double rest = law->hamiltonian(loop->rest());
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int tried = 0;
  while (tried < 6) {
    Vec x{0.6 * unit(generator), 0.6 * unit(generator), 0, 0};
    if (!(law->hamiltonian(x) < b.level)) continue;
    ++tried;
    const auto run = simulate(*loop, x, {.duration = 60, .record = 60});
    EXPECT_TRUE(run.finished);
    keeps("H_d left, relative", (run.H.back() - rest) / (run.H.front() - rest), 1e-2);
  }
  // The control of 3.13: with these gains the run from 0.5 rad leaves. It must lie outside the
  // basin found.
  Acrobot d{.ku = 400, .kv = 5};
  d.a3 = 2 / (1 - std::sqrt(d.c1 / d.c2));
  const auto stiff = acrobot(d);
  const Basin narrow = basin(*stiff, region);
  breaks("ku = 400 from (0.5, 0): H_d(0) - c",
         stiff->instantiate<double>()->hamiltonian(Vec{0.5, 0, 0, 0}) - narrow.level, 0);
  const auto c = certify(*stiff, options_of(*stiff, {0.5, 0, 0, 0}, 60));
  EXPECT_EQ(c.item("run, continuous").finding, Finding::fails);
}

// A slow controller destroys what the continuous one has: the certificate shows the energy the hold
// puts in.
TEST(Certify, SampledUse) {
  const auto loop = cart_pole({});
  auto o = options_of(*loop, {0.5, 0, 0, 0}, 10);
  const auto injected = [&](double period) {
    RunOptions run = o.run;
    run.period = period;
    return simulate(*loop, o.starts[0], run);
  };
  double last = 0;
  for (const double period : {0.01, 0.02, 0.04}) {
    const auto r = injected(period);
    std::printf("  period %.2f s: injected %+.4e J, rise in a step %.1e J, H_d(end) - 30 = %.3e\n",
                period, r.injected, r.rise, r.H.back() - 30);
    EXPECT_GT(r.injected, last) << "a longer hold injects more";
    last = r.injected;
  }
  keeps("continuous: injected [J]", std::fabs(injected(0).injected), 1e-4);
  const auto slow = injected(0.5);
  std::printf("  period 0.5 s: finished %d, H_d(end) %.3g\n", slow.finished, slow.H.back());
  EXPECT_TRUE(!slow.finished || !(slow.H.back() < slow.H.front()));
  o.periods = {0.5};
  EXPECT_FALSE(certify(*loop, o).holds());
}

/// At its minima the double well is the oscillator x'' = -2 x - kv x'.
TEST(Modes, OfTheDoubleWellAreItsLinearOscillator) {
  for (const auto& [kv, slowest, ratio] : {std::tuple{1.0, std::sqrt(2.0), std::sqrt(0.125)},
                                           {0.0, std::sqrt(2.0), 0.0},
                                           {3.0, 1.0, 1.0}}) {  // λ = -1 and -2
    const MatchedLoop loop(plant(DoubleWell{}), shaping(WellShaping{.kv = kv}), {"x.force"}, {1},
                           {.region = {{0.5}, {1.5}, 1}});
    const auto& item = loop.certificate().item("modes");
    std::printf("  kv %.0f: %s\n", kv, item.text.c_str());
    EXPECT_NEAR(item.value, slowest, 4e-16 * 8);
    EXPECT_NEAR(item.numbers.at(1), ratio, 4e-16 * 8);
    EXPECT_EQ(item.numbers.size(), kv == 3 ? 4 : 2);
  }
}

/// Signs: a mode that grows is one of negative damping; zeros are no modes.
TEST(Modes, ThatGrowSaySo) {
  Certificate c;
  const std::vector<std::complex<double>> s{{-4, 0}, {0, 0}, {0.6, -0.8}, {0.6, 0.8}, {3, 0}};
  certify_modes(c, s, 1e-9, "of a test");
  EXPECT_EQ(c.item("rightmost eigenvalue").finding, Finding::fails);
  EXPECT_EQ(c.item("modes").text,
            "rad/s, the slowest; 1 rad/s (damping ratio -0.6), 3 rad/s (grows), 4 rad/s");
}

TEST(Certify, UndampedLoopFails) {
  const auto loop = acrobot({.kv = 0});
  const auto c = certify(*loop, options_of(*loop, {0.1, 0, 0, 0}, 20));
  EXPECT_EQ(c.item("rightmost eigenvalue").finding, Finding::fails);
  EXPECT_EQ(c.item("run, continuous").finding, Finding::fails);
  EXPECT_NE(c.text().find("NOT certified"), std::string::npos);
}

}  // namespace
}  // namespace porthos::energy_shaping::certificate_test
