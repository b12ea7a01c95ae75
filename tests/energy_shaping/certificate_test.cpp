// What certificates say, and that they say no where no is the answer.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <random>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/modes.h"
#include "energy_shaping/matching/plant.h"
#include "tests/energy_shaping/loops.h"
#include "tests/energy_shaping/robots.h"

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

/// Nothing holds the third joint of an arm without gravity that has actuators at the others alone.
/// Control: with a spring of its own the same certificate holds.
TEST(Certify, AJointThatNothingHoldsIsNamed) {
  const auto certificate = [](double spring) {
    const auto arm = test::arm(3, 0.2, 0, spring);
    PotentialShaping s;
    for (const char* port : {"joint_0.torque", "joint_1.torque"}) {
      s.joints.push_back({port, 10, 0});
      s.damping.push_back({port, {3}});
      s.actuators.push_back(port);
    }
    s.rest = {0, 0, 0};
    s.compensate = false;
    const PotentialLoop loop(arm, s);
    EXPECT_TRUE(loop.certificate().holds());
    EXPECT_TRUE(loop.certificate().text().ends_with(
        spring == 0 ? "  all conditions hold, but neither law nor model holds joint_2\n"
                    : "  all conditions hold\n"))
        << loop.certificate().text();
    CertifyOptions o{.region = {{-1, -1, -1}, {1, 1, 1}},
                     .starts = {arm->state(Vec{0.5, 0.8, 0.4}, Vec{0, 0, 0})}};
    o.run.duration = 40;
    o.run.step = 0.01;
    return certify(loop, o);
  };
  const auto free = certificate(0);
  std::printf("%s", free.text().c_str());
  EXPECT_FALSE(free.holds());
  EXPECT_EQ(free.item("joints that nothing holds").text.rfind("joint_2: neither", 0), 0u);
  EXPECT_EQ(free.item("basin, c - H_d(rest)").finding, Finding::fails);
  EXPECT_FALSE(free.has("input on the basin")) << "of a basin without a state";
  EXPECT_EQ(free.item("run, continuous").finding, Finding::holds) << "wherever joint_2 stops";
  EXPECT_NE(free.item("directions without stiffness").text.find("joint_2; nothing holds joint_2"),
            std::string::npos);
  // The rest point is one of a line of critical points, which is told as one.
  EXPECT_EQ(free.item("critical points of V_d").value, 1);
  EXPECT_TRUE(free.item("V_d is flat").text.starts_with("along 'joint_2': ")) << free.text();
  EXPECT_TRUE(free.has("  flat"));
  const auto held = certificate(8);
  EXPECT_FALSE(held.has("V_d is flat")) << held.text();
  EXPECT_TRUE(held.has("  minimum"));
  EXPECT_TRUE(held.holds()) << held.text();
  EXPECT_FALSE(held.has("run, continuous, injected")) << "no hold and no limit puts anything in";
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
  // H_d of a start is told beside c: in this well, in the other one, above the pass.
  CertifyOptions o{.region = region, .starts = {{0.5, 0}, {-0.9, 0}, {1, 1}}};
  o.run.duration = 1;
  const auto c = certify(loop, o);
  const auto start = [&](int k) { return c.item(fmt::format("basin, H_d, start {}", k)); };
  keeps("H_d(0.5, 0) - 9/64", std::fabs(start(1).value - 9.0 / 64), 1e-15);
  keeps("H_d(1, 1) - 1/2", std::fabs(start(3).value - 0.5), 1e-15);
  EXPECT_EQ(start(1).text, "at the start: inside the basin, c = 0.25");
  EXPECT_EQ(start(2).text.rfind("at the start: below c = 0.25, but on the straight way", 0), 0u);
  EXPECT_EQ(start(3).text, "at the start: outside the basin, c = 0.25");
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
  EXPECT_NE(c.item("basin, H_d").text.find("outside the basin"), std::string::npos);
}

/// A reaction-wheel pendulum over a box that is long along the wheel: the valley of V_d to its
/// passes is narrower than the grid. Controls: a box that shows it, and a pass behind a higher one.
TEST(Certify, NoBasinLiesAboveAPassItReaches) {
  const auto loop =
      inertia_wheel_pendulum(inertia_wheel_gains({.I1 = 0.0125, .I2 = 2.1e-4, .m3 = 0.62}, 5, 0.8));
  const double pass =
      loop->instantiate<double>()->hamiltonian(Vec{std::acos(-1.0), -558.0092596, 0, 0});
  for (const double wheel : {2000.0, 20000.0, 200000.0}) {
    const Basin b = basin(*loop, {{-3.2, -wheel}, {3.2, wheel}});
    std::printf("  wheel to %g: c = %.6g, %s\n", wheel, b.level, b.method.c_str());
    agrees("c", b.level, pass, 1e-6);
    EXPECT_NEAR(std::fabs(b.at[1]), 558.01, 0.01);
    EXPECT_EQ(b.method.find("a pass that the grid misses") != std::string::npos, wheel == 2e4);
  }
}

/// The double well with a third one behind it.
struct ThreeWells : WellShaping {
  template <class S, class T>  // minima at 1, -1, -2; passes at 0 of height 0, at -1.5 below it
  S potential(std::span<const S> q, std::span<const T>) const {
    const S x = q[0];
    return x * x * (x * x * (x * x / S(6.0) + S(0.7) * x + S(0.5)) - S(3.5 / 3) * x - S(1.5));
  }
};

TEST(Certify, APassBehindAHigherOneLowersNoBasin) {
  const Region region{{-3}, {3}, 1, 200};
  const MatchedLoop loop(plant(DoubleWell{}), shaping(ThreeWells{}), {"x.force"}, {1},
                         {.region = region});
  const auto points = critical_points(loop, region);
  ASSERT_EQ(points.size(), 5u);
  EXPECT_TRUE(points[3].descending == 1 && points[3].value < -0.3);
  for (const int cells : {0, 50}) keeps("c", std::fabs(basin(loop, region, cells).level), 1e-12);
}

/// A run to the next turn's minimum, 2 pi along the pendulum and -1116 rad along the wheel, where
/// H_d is that of the rest point. Control: a start on this side of the pass.
TEST(Certify, ARunThatEndsAtAnotherMinimumFails) {
  const auto loop =
      inertia_wheel_pendulum(inertia_wheel_gains({.I1 = 0.0125, .I2 = 2.1e-4, .m3 = 0.62}, 5, 0.8));
  CertifyOptions o{.region = {{-3.2, -2000}, {3.2, 2000}},
                   .starts = {{3.0, -550, 0, 0}, {3.2, -560, 0, 0}}};
  o.run.duration = 60;
  const Certificate c = certify(*loop, o);
  const auto &here = c.item("run, continuous, start 1"),
             &there = c.item("run, continuous, start 2");
  EXPECT_EQ(here.finding, Finding::holds);
  EXPECT_EQ(there.finding, Finding::fails);
  EXPECT_EQ(c.about(there),
            "H_d left, relative; 60 s; it ends at another minimum at pendulum 6.2832, wheel "
            "-1116");
  EXPECT_NE(c.text().find("    run, continuous, start 2: start where H_d is below the basin's c"),
            std::string::npos);
}

/// Where H_d repeats after a full turn of a joint, the rest point is reached there too. Control: a
/// slide, whose 2 pi metres are another place.
struct Cosine : WellShaping {
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T>) const {
    return S(1.0) - phs::cos(q[0]);
  }
};
TEST(Certify, AFullTurnOfAJointIsTheRestPointWhereHdRepeats) {
  const Region region{{-3}, {3}, 1, 200};
  const auto run = [&](std::shared_ptr<const phs::Model> p, const char* port) {
    const MatchedLoop loop(p, shaping(Cosine{}), {port}, {0}, {.region = region});
    CertifyOptions o{.region = region, .starts = {{2 * std::acos(-1.0) - 0.5, 0}}};
    o.run.duration = 40;
    return certify(loop, o).item("run, continuous");
  };
  EXPECT_EQ(run(test::arm(1, 0.2), "joint_0.torque").finding, Finding::holds);
  const auto slide = run(plant(DoubleWell{}), "x.force");
  EXPECT_EQ(slide.finding, Finding::fails);
  EXPECT_NE(slide.text.find("another minimum"), std::string::npos);
}

TEST(Certify, ARegionWithoutTheRestPointIsRefused) {
  const auto loop = acrobot({});
  for (const double low : {0.5, -0.5})
    EXPECT_EQ(refusal([&] {
                (void)basin(*loop, {{low, -3}, {2, 3}, 5});
              }),
              low < 0 ? ""
                      : "the region of 'shoulder' is 0.5 to 2, expected the rest point's 0 between "
                        "them");
  auto o = options_of(*loop, {0.1, 0, 0, 0}, 1);
  o.region.upper[1] = -1;
  EXPECT_NE(refusal([&] { (void)certify(*loop, o); }).find("'elbow' is -"), std::string::npos);
}

/// Limits act in the runs, and the shares of them are told. Control: without limits no share is.
TEST(Certify, LimitsOfTheInputsActInTheRuns) {
  const auto loop = cart_pole({});
  auto o = options_of(*loop, {0.5, 0, 0, 0}, 1);
  const auto free = certify(*loop, o);
  o.run.limits = {5};
  const auto limited = certify(*loop, o);
  const auto peak = [](const Certificate& c) { return c.item("run, continuous, input peak"); };
  keeps("peak over the limit", peak(limited).value / 5, 1);
  breaks("control: without", peak(free).value / 5, 1);
  EXPECT_EQ(limited.about(peak(limited)), "100 % of its limit");
  EXPECT_EQ(free.about(peak(free)), "");
  const auto says = [](const Certificate& c, const char* item, const char* part) {
    return c.item(item).text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(says(limited, "input on the basin",
                   "% of its limit; of the states sampled it acts from c - H_d(rest) = "));
  EXPECT_FALSE(says(free, "input on the basin", "limit"));
  // The basin is that of the law without it, and so it says.
  EXPECT_TRUE(says(limited, "basin, c - H_d(rest)", "leaves by the law without its limit; "));
  EXPECT_FALSE(says(free, "basin, c - H_d(rest)", "limit"));
  const auto from = [](const std::string& text) {
    return std::stod(text.substr(text.find("(rest) = ") + 9));
  };
  // The start is inside the basin, and beyond where the limit acts.
  const auto helps = [](const Certificate& c, const char* part) {
    return remedy(c.item("run, continuous")).find(part) != std::string::npos;
  };
  EXPECT_TRUE(says(limited, "basin, H_d", "inside the basin"));
  EXPECT_TRUE(helps(limited, "the limit acts from H_d = "));
  EXPECT_FALSE(helps(limited, "the limit is the cause"))
      << "it does not settle in 1 s without, either";
  EXPECT_TRUE(helps(free, "start where H_d is below the basin's c"));
  EXPECT_FALSE(helps(free, "the limit acts"));
  const double level = from(limited.item("input on the basin").text);
  EXPECT_GT(level, 0);
  EXPECT_LT(level, limited.item("basin, c - H_d(rest)").value);
  // Where a run settles without it, the limit is the cause; how long it takes is told of both.
  auto longer = options_of(*loop, {0.5, 0, 0, 0}, 30);
  const auto settling = [](const Certificate& of) {
    const std::string name = "run, continuous, settling time";
    return of.has(name) ? of.item(name).value : HUGE_VAL;
  };
  const double alone = settling(certify(*loop, longer));
  EXPECT_TRUE(alone > 1 && alone < 30) << alone;
  longer.run.limits = {1};
  const auto lost = certify(*loop, longer);
  EXPECT_EQ(settling(lost), HUGE_VAL);
  EXPECT_TRUE(helps(
      lost,
      fmt::format("the limit is the cause: without it H_d settles in {:.3g} s", alone).c_str()))
      << remedy(lost.item("run, continuous"));
  o.run.limits = {1e4};
  const auto wide = certify(*loop, o);
  EXPECT_TRUE(says(wide, "input on the basin", "; it does not act below c"));
  o.run.limits = {2.5};
  const double half = from(certify(*loop, o).item("input on the basin").text);
  std::printf("  limits of 5 and 2.5 N act from %g and %g\n", level, half);
  keeps("half the limit: level over a third", half / level * 3, 1);
  o.run.limits = {5, 5};
  EXPECT_NE(refusal([&] { (void)certify(*loop, o); }).find("limits"), std::string::npos);
  o.run.limits = {-5};
  EXPECT_EQ(refusal([&] { (void)certify(*loop, o); }),
            "limits[0] is -5, expected the largest |u| of an actuated input, above 0");
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

/// A run that breaks off decides nothing: neither it nor its rise of H_d reads as held, in any
/// form. Control: one that finishes.
TEST(Certify, ARunThatDoesNotFinishIsNotJudged) {
  const auto loop = cart_pole({});
  auto o = options_of(*loop, {0.5, 0, 0, 0}, 20);
  EXPECT_EQ(certify(*loop, o).json().find("not judged"), std::string::npos);
  o.periods = {0, 0.5};
  const Certificate c = certify(*loop, o);
  const auto& run = c.item("run at 500 ms");
  EXPECT_EQ(run.finding, Finding::not_judged);
  EXPECT_EQ(run.text.find("did not finish: at 0.6 s H_d is "), 0u) << run.text;
  EXPECT_EQ(c.item("run, continuous").finding, Finding::holds);
  EXPECT_FALSE(c.holds());
  EXPECT_EQ(c.failure(), &run);
  EXPECT_NE(c.html().find("<td>not judged</td>"), std::string::npos);
  EXPECT_NE(c.text().find("  not judged did not finish"), std::string::npos);
  const auto j = nlohmann::json::parse(c.json());
  for (const auto& i : j["items"]) EXPECT_EQ(i["finding"] == "not judged", i["name"] == run.name);
  // A rise that stayed 0 until a run broke off has not been shown to stay so.
  o.periods = {0};
  o.starts = {{0.5, 0, 1e153, 0}};
  o.run.method = "rk4";
  const Certificate first = certify(*loop, o);
  EXPECT_EQ(first.item("run, continuous").text.find("did not finish: "), 0U);
  EXPECT_EQ(first.item("run, continuous, rise of H_d").finding, Finding::not_judged);
}

/// At its minima the double well is the oscillator x'' = -2 x - kv x'.
TEST(Modes, OfTheDoubleWellAreItsLinearOscillator) {
  for (const auto& [kv, slowest, ratio] : {std::tuple{1.0, std::sqrt(2.0), std::sqrt(0.125)},
                                           {0.0, std::sqrt(2.0), 0.0},
                                           {0.02, std::sqrt(2.0), 0.01 / std::sqrt(2.0)},
                                           {3.0, 1.0, 1.0}}) {  // λ = -1 and -2
    const MatchedLoop loop(plant(DoubleWell{}), shaping(WellShaping{.kv = kv}), {"x.force"}, {1},
                           {.region = {{0.5}, {1.5}, 1}});
    const auto& item = loop.certificate().item("modes");
    std::printf("  kv %.0f: %s\n", kv, item.text.c_str());
    EXPECT_NEAR(item.value, slowest, 4e-16 * 8);
    EXPECT_NEAR(item.numbers.at(1), ratio, 4e-16 * 8);
    EXPECT_EQ(item.numbers.size(), kv == 3 ? 4 : 2);
    EXPECT_EQ(loop.certificate().has("hardly damped"), kv < 0.01 * 2 * slowest);
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
  EXPECT_FALSE(c.has("hardly damped"));
  EXPECT_EQ(c.item("unstable").value, -1) << "the fastest, of 3 rad/s";
  EXPECT_TRUE(
      c.item("unstable").text.starts_with("damping ratio of the mode at 3 rad/s: it grows"));
}

/// Rounding of an eigenvalue is no growth, a millionth of it is.
TEST(Modes, ThatGrowByRoundingAreHardlyDamped) {
  for (const auto& [real, grows] : {std::pair{1e-12, false}, {0.0, false}, {1e-6, true}}) {
    Certificate c;
    const std::vector<std::complex<double>> s{{-1, 0}, {real, -1}, {real, 1}};
    report_modes(c, s);
    EXPECT_EQ(c.has("unstable"), grows) << real;
    EXPECT_EQ(c.has("hardly damped"), !grows) << real;
  }
}

/// The steps of the plant do not fail, but its energy is no number.
TEST(Certify, ARunThatDoesNotFinishTellsWhy) {
  const auto arm = test::arm(1, 0, 0);
  PotentialShaping shaping;
  shaping.joints = {{"joint_0.torque", 1}};
  shaping.rest = {0};
  const PotentialLoop loop(arm, shaping);
  const auto of = [&](double momentum) {
    CertifyOptions o{.region = {{-1}, {1}}, .starts = {{0, momentum}}, .periods = {0.01}};
    o.run.duration = 0.1;
    return certify(loop, o).item("run at 10 ms").text;
  };
  EXPECT_EQ(of(1e160).find("did not finish: at 0.01 s H_d is inf, expected"), 0u) << of(1e160);
  EXPECT_EQ(of(1).find("H_d left, relative"), 0u) << of(1);  // control
}

/// A basin that its box ends names the side. Control: the other side.
TEST(Certify, ABasinThatTheBoxEndsNamesTheCoordinate) {
  PotentialShaping springs;
  springs.joints = {{"joint_0.torque", 1}, {"joint_1.torque", 1}};
  springs.rest = {0, 0};
  const PotentialLoop loop(test::arm(2, 0, 0), springs);
  const auto method = [&](double first, double second) {
    return basin(loop, {{-first, -second}, {first, second}}).method;
  };
  const auto one = method(0.1, 3), other = method(3, 0.1);
  EXPECT_NE(one.find("boundary: the box of 'joint_0' ends it, widen it"), one.npos) << one;
  EXPECT_NE(other.find("boundary: the box of 'joint_1' ends it, widen it"), other.npos) << other;
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
