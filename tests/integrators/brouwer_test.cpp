// Brouwer's law: with nothing but unbiased rounding left, errors grow like the square root of the
// number of steps. An ensemble of starts tells that law from a drift; each ingredient taken away
// must show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <functional>

#include "ensemble/batch.h"
#include "integrators/methods/collocation.h"
#include "integrators/methods/gauss.h"
#include "tests/support/gauss.h"
#include "tests/support/random_tree.h"
#include "tests/support/robots.h"

namespace porthos::integrators::brouwer_test {
namespace {

bool long_run() { return std::getenv("PORTHOS_LONG") != nullptr; }

using Starts = std::vector<test::Robot>;

/// ETS-VII from random configurations and rates.
Starts ets_vii_starts(int count, double rate = 0.1) {
  Starts all;
  test::RandomTree random(2026);
  const auto first = test::ets_vii();
  const std::shared_ptr<const mechanics::Mechanism> mechanism(first.model,
                                                              &first.model->mechanism());
  for (int i = 0; i < count; ++i)
    all.push_back(test::make_robot(mechanism, random.numbers(6), random.numbers(6, rate)));
  return all;
}

/// A free-floating tree of 30 bodies with revolute joints, rates of up to 0.15 rad/s. Its motion is
/// chaotic: from 0.3 rad/s one joint in 24 runs whirls up to 15 rad/s, at other roundings another,
/// and the error of the method at that step (4e-12) is above all rounding.
Starts tree_starts(int count) {
  Starts all;
  test::RandomTree random(30);
  const auto tree = random.tree(30, "free", "revolute", {0, 0, 0});
  for (int i = 0; i < count; ++i)
    all.push_back(test::make_robot(tree, random.numbers(29), random.numbers(29, 0.15)));
  return all;
}

/// What errors a run has after 10³, 10³·√10, 10⁴, … steps.
struct Marks {
  std::vector<double> energy, momentum, norm;
};

/// Increments of the energy error over 2^j marks of `stride` steps, pooled over starts.
struct Increments {
  std::vector<double> sum_of_squares, count;
  void add(const std::vector<double>& e) {
    for (size_t j = 0; (size_t(1) << j) < e.size(); ++j) {
      if (j >= count.size()) {
        sum_of_squares.push_back(0);
        count.push_back(0);
      }
      for (size_t i = size_t(1) << j; i < e.size(); i += size_t(1) << j) {
        const double d = e[i] - e[i - (size_t(1) << j)];
        sum_of_squares[j] += d * d;
        count[j] += 1;
      }
    }
  }
  /// Weighted least-squares slope of log rms against log of the distance from 10³ steps on; a
  /// level's weight is its number of increments, at most 512, as neighbouring levels share their
  /// noise.
  struct Slope {
    double value, error;  ///< and its standard error, the increments taken as independent
  };
  Slope exponent(std::int64_t stride) const {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (size_t j = 0; j < count.size(); ++j) {
      if ((stride << j) < 1000) continue;
      const double w = std::min(count[j], 512.0), x = double(j),
                   y = 0.5 * std::log2(sum_of_squares[j] / count[j]);
      n += w;
      sx += w * x;
      sy += w * y;
      sxx += w * x * x;
      sxy += w * x * y;
    }
    // log2 of the rms of w normal numbers has the variance 1 / (2 w ln² 2).
    return {(n * sxy - sx * sy) / (n * sxx - sx * sx),
            1 / (std::log(2.0) * std::sqrt(2 * (sxx - sx * sx / n)))};
  }
};

double rms(const std::vector<double>& v) {
  double s = 0;
  for (double x : v) s += x * x;
  return std::sqrt(s / double(v.size()));
}
double mean(const std::vector<double>& v) {
  double s = 0;
  for (double x : v) s += x;
  return s / double(v.size());
}

struct Law {
  double energy_coefficient = 0, momentum_coefficient = 0,
         norm_coefficient = 0;  ///< largest rms/√N
  double exponent = 0, exponent_error = 0;
  double mean_over_its_error = 0;  ///< of the energy error at the end
  double final_rms = 0;
};

constexpr std::int64_t stride = 250;  ///< steps from look to look

/// What is seen of the errors of all runs.
struct Record {
  std::vector<Marks> at;  ///< per mark N = 1000·10^(j/2), one value a start
  Increments increments;
};

/// One run: looks at its state every `stride` steps.
class Watched : public ensemble::BatchRun {
 public:
  Watched(const test::Robot& robot, std::int64_t total, Record& into)
      : robot_(robot), gauge_(*robot.model), into_(into) {
    start = robot.start;
    steps = total;
    every = stride;
    H0_ = gauge_.energy(start);
    I0_ = gauge_.invariants(start);
  }
  bool see(const phs::State& s) override {
    series_.push_back(double((gauge_.energy(s) - H0_) / H0_));
    if (double(s.step) + 0.5 * double(stride) < next_) return true;
    if (mark_ >= into_.at.size()) into_.at.push_back({});
    Marks& m = into_.at[mark_];
    m.energy.push_back(series_.back());
    m.momentum.push_back(gauge_.error("angular_momentum", s, I0_));
    for (const auto& inv : robot_.model->description().invariants)
      if (inv.name.starts_with("quaternion_norm"))
        m.norm.push_back(gauge_.error(inv.name, s, I0_) / 2);
    ++mark_;
    next_ *= std::sqrt(10.0);
    return true;
  }
  void end(const phs::State& last, Outcome o) override {
    EXPECT_EQ(o, Outcome::ok) << "at step " << last.step;
    into_.increments.add(series_);
  }

 private:
  const test::Robot& robot_;
  test::Gauge gauge_;
  Record& into_;
  long double H0_;
  std::vector<long double> I0_;
  std::vector<double> series_{0};
  double next_ = 1000;
  size_t mark_ = 0;
};

Law law_from(const char* title, const Starts& starts, const Record& record) {
  const auto& at = record.at;
  Law law;
  if (at.empty()) return law;
  double N = 1000;
  std::printf("  %s, %zu starts\n", title, starts.size());
  for (const auto& m : at) {
    const double e = rms(m.energy) / std::sqrt(N), l = rms(m.momentum) / std::sqrt(N),
                 q = rms(m.norm) / std::sqrt(N);
    std::printf("    N = %8.0f   rms/sqrt(N): energy %.2e  angular momentum %.1e  |xi| %.1e\n", N,
                e, l, q);
    law.energy_coefficient = std::max(law.energy_coefficient, e);
    law.momentum_coefficient = std::max(law.momentum_coefficient, l);
    law.norm_coefficient = std::max(law.norm_coefficient, q);
    N *= std::sqrt(10.0);
  }
  const auto& end = at.back().energy;
  law.final_rms = rms(end);
  law.mean_over_its_error =
      std::fabs(mean(end)) * std::sqrt(double(end.size())) / std::max(rms(end), 1e-300);
  const auto slope = record.increments.exponent(stride);
  law.exponent = slope.value;
  law.exponent_error = slope.error;
  std::printf(
      "    growth exponent %.3f +- %.3f   |mean| is %.1f of its standard errors   rms %.2e\n",
      law.exponent, law.exponent_error, law.mean_over_its_error, law.final_rms);
  return law;
}

/// The runs of gauss16, eight side by side: each has the bits it has alone.
Law law_of(const char* title, const Starts& starts, double h, std::int64_t steps,
           const Options& o = {}) {
  Record record;
  size_t next = 0;
  ensemble::simulate_batch(*starts[0].model, "gauss16", h,
                           [&]() -> std::unique_ptr<ensemble::BatchRun> {
                             if (next == starts.size()) return nullptr;
                             return std::make_unique<Watched>(starts[next++], steps, record);
                           },
                           {.threads = 1, .method = o});
  return law_from(title, starts, record);
}

/// The runs of another method, one after another.
using Make = std::function<std::unique_ptr<Integrator>(const phs::Model&)>;
Law law_of(const char* title, const Starts& starts, const Make& make, std::int64_t steps) {
  Record record;
  for (const auto& robot : starts) {
    Watched run(robot, steps, record);
    const auto method = make(*robot.model);
    phs::State s = robot.start;
    Outcome o = Outcome::ok;
    while (s.step < steps && o == Outcome::ok) {
      o = method->step(s);
      if (s.step % stride == 0) run.see(s);
    }
    run.end(s, o);
  }
  return law_from(title, starts, record);
}

/// Bounds of the law. A mean counts as significant beyond 3.5 standard errors (one in 2000 by
/// chance); the runs are so many that the exponent has a standard error of a third of its bound and
/// less.
void expect_brouwer(const Law& law, double exponent_bound) {
  EXPECT_LE(law.energy_coefficient, 3e-17);
  EXPECT_LE(law.momentum_coefficient, 4e-17);
  EXPECT_LE(law.norm_coefficient, 4e-17);
  EXPECT_LE(law.exponent_error, exponent_bound / 3);
  EXPECT_NEAR(law.exponent, 0.5, exponent_bound);
  EXPECT_LE(law.mean_over_its_error, 3.5);
}

constexpr double ets_step = 0.25, tree_step = 0.05;

// The starts are so many because neighbouring levels share more noise than their standard error
// says: five draws of 56 starts gave exponents of 0.42 to 0.52, three of 168 gave 0.46 to 0.50.
TEST(Brouwer, EtsVii) {
  expect_brouwer(law_of("ETS-VII, gauss16, h = 0.25 s", ets_vii_starts(long_run() ? 16 : 168),
                        ets_step, long_run() ? 1'000'000 : 31'750),
                 long_run() ? 0.05 : 0.07);
}

TEST(Brouwer, TreeOf30Bodies) {
  expect_brouwer(
      law_of("30-body free-floating tree, gauss16, h = 0.05 s", tree_starts(long_run() ? 16 : 24),
             tree_step, long_run() ? 1'000'000 : 16'000),
      long_run() ? 0.05 : 0.12);
}

// The control: made-up errors of the size of the ETS-VII runs, a random walk and one with a drift
// that makes its exponent 0.6.
TEST(Brouwer, AnExponentOfSixTenthsIsSeen) {
  const auto exponent_of = [](double drift) {
    test::RandomTree random(3);
    Increments increments;
    for (int start = 0; start < 56; ++start) {
      std::vector<double> series{0};
      const double way = start % 2 ? drift : -drift;
      for (int i = 0; i < 127; ++i) {
        double step = way;
        for (int k = 0; k < 12; ++k) step += random.uniform(-0.5, 0.5);  // variance 1
        series.push_back(series.back() + step);
      }
      increments.add(series);
    }
    const auto slope = increments.exponent(stride);
    std::printf("  drift %.2f of a step of the walk: exponent %.3f +- %.3f\n", drift, slope.value,
                slope.error);
    return slope.value;
  };
  EXPECT_NEAR(exponent_of(0), 0.5, 0.07);
  const double with_drift = exponent_of(0.14);
  EXPECT_NEAR(with_drift, 0.6, 0.05);
  EXPECT_GT(with_drift, 0.57) << "outside the bound";
}

/// A single body tumbling near its unstable axis, half a radian a step.
Starts tumbling_starts(int count) {
  Starts all;
  test::RandomTree random(7);
  mechanics::BodySpec body;
  body.name = "body";
  body.parent = "world";
  body.joint.name = "base";
  body.joint.type = "free";
  body.mass = {1, {0, 0, 0}, {1, 0, 0, 2, 0, 3}};
  const auto m =
      std::make_shared<mechanics::Mechanism>(mechanics::MechanismBuilder("body").add(body).build());
  for (int i = 0; i < count; ++i) {
    auto robot = test::make_robot(m, {}, {});
    const std::vector<double> v{
        0.01, 1 + random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0, 0, 0};
    robot.start = phs::State(robot.model->description(), robot.model->state(m->neutral(), v));
    all.push_back(robot);
  }
  return all;
}

// Each ingredient taken away, on the same starts: worse than the whole by more than chance.
TEST(Brouwer, WithoutWrappingEnergySuffers) {
  const auto starts = ets_vii_starts(6, 0.8);
  Options no_wrap;
  no_wrap.wrap = false;
  const Law whole = law_of("ETS-VII at rates of 0.8 rad/s", starts, 0.05, 31'750);
  const Law without = law_of("without wrapping", starts, 0.05, 31'750, no_wrap);
  EXPECT_GT(without.final_rms, 5 * whole.final_rms);
}

TEST(Brouwer, WithTheWrongTriangleTheNormDriftsAndWithAToleranceEverything) {
  const auto starts = tumbling_starts(16);
  const double h = 0.5;
  Options tolerance;
  tolerance.iteration_tolerance = 1e-12;
  const Law whole = law_of("tumbling body", starts, h, 31'750);
  const Law triangle = law_of(
      "wrong triangle of mu", starts,
      [=](const phs::Model& m) {
        return make_collocation<double>({.name = "wrong"}, gauss_table_wrong_triangle(8), m, h, {});
      },
      31'750);
  const Law stopped = law_of("stopped by a tolerance of 1e-12", starts, h, 31'750, tolerance);
  EXPECT_LE(whole.norm_coefficient, 4e-17);
  EXPECT_LE(whole.momentum_coefficient, 4e-17);
  EXPECT_GT(triangle.norm_coefficient, 4 * whole.norm_coefficient);
  EXPECT_NEAR(whole.exponent, 0.5, 0.12);
  EXPECT_GT(triangle.exponent, 0.8) << "measured 0.98";
  EXPECT_GT(stopped.final_rms, 50 * whole.final_rms);
  EXPECT_GT(stopped.exponent, 0.8) << "a tolerance makes a drift of a random walk";
}

}  // namespace
}  // namespace porthos::integrators::brouwer_test
