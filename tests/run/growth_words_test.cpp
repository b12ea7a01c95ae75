#include "scene/run/growth_words.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "phs/error.h"

namespace {

using namespace porthos;

/// A run of a million steps over 1000 s, whose rounding is below 8.9e-13.
scene::RunReport run(double error, double exponent, double drift = 0, double swings = 1) {
  scene::RunReport r;
  r.method = "gauss8";
  r.steps = 1000000;
  r.records = 1001;
  r.simulated_s = 1000;
  r.energy.max_rel_error = error;
  r.energy.growth_exponent = exponent;
  r.energy.drift_per_s = drift;
  r.energy.drift_is_significant = drift != 0;
  r.energy.swing_growth = swings;
  return r;
}

TEST(GrowthWords, OfEachKindOfError) {
  const auto words = [](const scene::RunReport& r) { return scene::growth_words(r); };
  EXPECT_EQ(words(run(NAN, 0.5)), "is not a finite number");
  EXPECT_EQ(words(run(1e-16, 0.5)), "is below one rounding of a double");
  EXPECT_EQ(words(run(1e-13, 0.48)), "grows like rounding, √t (growth exponent 0.48)");
  EXPECT_EQ(words(run(1e-13, 0.02)), "stays bounded (growth exponent 0.02)");
  EXPECT_EQ(words(run(1e-9, 0.02)),
            "stays bounded (growth exponent 0.02), above rounding: the truncation of the method");
  auto failing = run(1e-9, 0.02);
  failing.checks = {{"energy", 1e-9, 1e-12, false}};
  EXPECT_TRUE(words(failing).ends_with(
      "the truncation of the method, expected a shorter step or a method of higher order"));
  // The same exponent of an error that is no rounding is none of it.
  EXPECT_EQ(words(run(1e-9, 0.48)),
            "grows like a random walk, √t (growth exponent 0.48), by more than rounding: does it "
            "with a shorter step (porthos compare)?");
  auto own = run(1e-9, 0.48);
  own.own_slopes = true;
  EXPECT_TRUE(
      words(own).ends_with("(porthos compare)? Do the slopes of energies of your own agree with "
                           "them (porthos verify)?"));
  own.method = "rk4";
  EXPECT_TRUE(words(own).ends_with(
      ", by more than rounding: rk4 is not symplectic and does not keep the energy"));
  EXPECT_EQ(words(run(1e-6, 0.97, 1e-9)),
            "drifts, like t or faster (growth exponent 0.97), by 1e-09 per s");
  EXPECT_EQ(words(run(1e-6, 0.97)),
            "drifts, like t or faster (growth exponent 0.97), by an amount that is not "
            "significant");
  EXPECT_EQ(words(run(1e-6, 0.3, 9e-10)),
            "drifts by 9e-10 per s (growth exponent 0.30); the exponent is that of the swings on "
            "it");
  EXPECT_EQ(words(run(1e-6, 0.3, 1e-10)),
            "drifts by 1e-10 per s (growth exponent 0.30), which is hidden in the scatter of "
            "single records");
  EXPECT_EQ(words(run(1e-6, 0.1, 0, 3)),
            "swings, and its swings grow 3-fold (growth exponent 0.10)");
  EXPECT_EQ(words(run(1e-6, NAN)), "does not tell how it grows") << "of an older file";
  EXPECT_EQ(words(run(1e-6, NAN, 1e-9)), "drifts by 1e-09 per s");
  // The words never contradict the flag.
  EXPECT_EQ(words(run(1e-13, 0.48, 1e-16)),
            "is no more than rounding may leave; it drifts by 1e-16 per s (growth exponent 0.48)");
  EXPECT_EQ(words(run(1e-13, NAN, 1e-16)),
            "is no more than rounding may leave; it drifts by 1e-16 per s");
  EXPECT_TRUE(words(run(1e-13, 0.8)).starts_with("is no more than rounding may leave; it drifts"));
}

/// Without a step there is no error, and none relative to an energy that overflowed. Controls: one
/// record more; a run that ended for another reason; an error that is no overflow.
TEST(GrowthWords, OfARunWithoutAnError) {
  auto r = run(0, NAN);
  r.records = 1;
  EXPECT_EQ(scene::growth_words(r), "is not known: nothing but the start was seen");
  r.records = 2;
  EXPECT_EQ(scene::growth_words(r), "is below one rounding of a double");
  r = run(1, 0.97);
  r.outcome = integrators::Outcome::not_finite;
  EXPECT_EQ(scene::growth_words(r), "is as large as the energy itself, which overflowed");
  r.energy.max_rel_error = 1e-6;
  EXPECT_TRUE(scene::growth_words(r).starts_with("drifts"));
  r = run(1, 0.97);
  r.outcome = integrators::Outcome::not_converged;
  EXPECT_TRUE(scene::growth_words(r).starts_with("drifts"));
}

TEST(GrowthWords, OfAJumpAndOfADriftThatSlows) {
  auto r = run(1e-9, NAN);
  r.energy.jump_s = 3;
  r.energy.jump = -1e-9;
  r.energy.jump_then = "stays there";
  EXPECT_EQ(scene::growth_words(r),
            "jumps by -1e-09 at about 3 s and stays there: the motion is not resolved there");
  r.energy.max_rel_error = 1e-13;
  EXPECT_EQ(scene::growth_words(r),
            "is no more than rounding may leave; it jumps by -1e-09 at about 3 s and stays there");
  // Of a jump far below the limit there is nothing to do.
  r.energy.max_rel_error = 1e-9;
  r.checks = {{"energy", 1e-9, 3e-6, true}};
  EXPECT_EQ(scene::growth_words(r),
            "jumps by -1e-09 at about 3 s and stays there, 3e+03 times below the limit");
  r.checks[0].limit = 5e-8;
  EXPECT_TRUE(scene::growth_words(r).ends_with(": the motion is not resolved there"));
  r = run(1e-9, 0.5, 1e-12);
  r.energy.slows = true;
  EXPECT_EQ(scene::growth_words(r),
            "drifts ever more slowly, like t^0.50, by 1e-12 per s in the mean");
}

TEST(GrowthWords, OfARecordedMotion) {
  auto r = run(1e-9, 0.02);
  r.method = "recorded";
  EXPECT_EQ(scene::growth_words(r),
            "stays bounded (growth exponent 0.02), above rounding: the digits of the file, or its "
            "method");
  r.energy.growth_exponent = NAN;
  r.energy.unknown = scene::GrowthUnknown::unequal_rows;
  EXPECT_EQ(scene::growth_words(r),
            "is known at unequal intervals, which do not tell how it grows");
}

/// Notes are for people: what they say changes no words.
TEST(GrowthWords, OfSpringsWithKinks) {
  auto r = run(1e-9, 0.48);
  r.notes = {"so a method needs smaller steps than for a formula without kinks, or is gonzalez"};
  EXPECT_TRUE(scene::growth_words(r).ends_with("(porthos compare)?"));
  r.energy.kinks = true;
  EXPECT_TRUE(scene::growth_words(r).ends_with(", by more than rounding")) << "the note tells more";
}

/// Each reason is the control of the others.
TEST(GrowthWords, SayWhyTheGrowthIsUnknown) {
  using Why = scene::GrowthUnknown;
  const auto of = [](int n, const std::function<double(int)>& e) {
    scene::ErrorStatistics s;
    for (int i = 0; i < n; ++i) s.add(1e-6 * e(i));
    EXPECT_EQ(std::isnan(s.growth_exponent()), s.unknown() != Why::no);
    return std::pair(s.unknown(), scene::growth_words(s));
  };
  std::mt19937_64 rng(3);
  std::normal_distribution<double> noise(0, 1);
  const auto swings = [](int i) { return std::sin(0.7 * i * i); };
  EXPECT_EQ(of(32, swings), std::pair(Why::few_records, std::string("has too few records to tell "
                                                                    "how it grows, expected 33 or "
                                                                    "more")));
  EXPECT_EQ(of(33, swings).first, Why::no);
  const auto once = [](int i) { return std::sin(2 * 3.14159 * i / 200); };
  EXPECT_EQ(of(201, once).first, Why::few_swings);
  EXPECT_EQ(of(201, once).second, "has too few swings to tell how it grows, expected a longer run");
  double walk = 0;
  const auto noisy = of(1000, [&](int) { return (walk += 0.15 * noise(rng)) + noise(rng); });
  EXPECT_EQ(noisy.first, Why::scatter);
  EXPECT_EQ(noisy.second, "scatters too much from record to record to tell how it grows");
  for (const Why why :
       {Why::no, Why::few_records, Why::few_swings, Why::scatter, Why::unequal_rows})
    EXPECT_EQ(scene::growth_unknown(to_string(why)), why);
  EXPECT_THROW((void)scene::growth_unknown("no reason"), InvalidArgument);
}

/// Of one wording with runs. Each kind of error is the control of the others.
TEST(GrowthWords, OfASeries) {
  const auto words = [](const std::function<double(double)>& e) {
    scene::ErrorStatistics s;
    for (int i = 0; i <= 2000; ++i) s.add(e(i / 2000.0));
    return scene::growth_words(s);
  };
  EXPECT_EQ(words([](double x) { return 1e-6 * std::sin(300 * x); }),
            "stays bounded (growth exponent 0.00), above rounding");
  EXPECT_EQ(words([](double x) { return 1e-6 * (1 - std::exp(-10 * x)); }),
            "stays bounded (growth exponent 0.00), above rounding");
  EXPECT_EQ(words([](double x) { return 1e-6 * x; }),
            "drifts, like t or faster (growth exponent 1.00), by 5e-10 per record");
  EXPECT_EQ(words([](double x) { return x > 0.5 ? 1e-6 : 0; }),
            "jumps by 1e-06 at about record 1001 and stays there");
  EXPECT_EQ(words([](double x) { return x == 0.5 ? 1e-6 : 0; }),
            "jumps by 1e-06 at about record 1000 and comes back");
  EXPECT_EQ(words([](double x) { return x > 0.3 && x < 0.5 ? 1e-6 : 0; }),
            "jumps by 1e-06 at about record 601 and has others beside it");
  EXPECT_EQ(words([](double x) { return 1e-6 * std::sqrt(x); }),
            "drifts ever more slowly, like t^0.50, by 5e-10 per record in the mean");
  std::mt19937_64 rng(1);
  std::normal_distribution<double> step(0, 1e-8);
  double walk = 0;
  EXPECT_TRUE(words([&](double) {
                return walk += step(rng);
              }).starts_with("grows like a random walk, √t (growth exponent 0."));
  EXPECT_TRUE(words([](double x) {
                return 1e-6 * std::exp(10 * x);
              }).starts_with("drifts, like t or faster (growth exponent 7."));
  EXPECT_TRUE(words([](double x) {
                return 1e-6 * (x + 0.1 * std::sin(300 * x));
              }).starts_with("drifts by 5e-10 per record"));
  EXPECT_TRUE(words([](double x) {
                return 1e-6 * std::exp(5 * x) * std::sin(300 * x);
              }).starts_with("swings, and its swings grow"));
  EXPECT_TRUE(scene::growth_words(scene::ErrorStatistics{}).starts_with("has too few records"));
  const auto noise = [](double x) { return 0.005 * std::sin(1e7 * x * x); };
  EXPECT_TRUE(words([&](double x) {
                return 1e-15 * (x + noise(x));
              }).starts_with("is no more than rounding may leave; it drifts"));
  EXPECT_TRUE(words([&](double x) { return 1e-13 * noise(x); }).starts_with("stays bounded"));
  EXPECT_EQ(words([](double x) { return 1e-17 * x; }), "is below one rounding of a double");
}

}  // namespace
