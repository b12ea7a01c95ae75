// Compositions: the order conditions of every table by code, the orders in 113 bits, and what the
// base keeps.
#include <gtest/gtest.h>

#include "integrators/methods/composition.h"
#include "integrators/methods/gauss.h"
#include "tests/support/gauss.h"
#include "tests/support/order_conditions.h"
#include "tests/support/robots.h"

namespace porthos::integrators::composition_test {
namespace {

using phs::Quad;

/// The sum of magnitudes behind a word of that weight, S^w / w! with S = Σ|γ|: rounding of γ enters
/// by this factor.
double magnitude_of(const std::vector<Quad>& gamma, int weight) {
  Quad S = 0, power = 1;
  for (const Quad g : gamma) S += phs::abs(g);
  for (int k = 1; k <= weight; ++k) power *= S / k;
  return double(phs::max(power, Quad(1)));
}

double relative_defect(const std::vector<Quad>& gamma, int order) {
  const auto product = test::symmetric_composition(gamma, order);
  double worst = 0;
  for (int w = 1; w <= order; ++w)
    worst = std::max(worst, double(product.defect(w)) / magnitude_of(gamma, w));
  return worst;
}

TEST(CompositionTables, MeetTheOrderConditions) {
  for (const auto& t : symmetric_compositions()) {
    const auto gamma = t.gammas<Quad>();
    const double defect = relative_defect(gamma, t.order),
                 next = double(test::symmetric_composition(gamma, t.order + 1).defect(t.order + 1));
    // Control: one coefficient wrong by 1e-12, its mirror image with it and the sum kept.
    auto wrong = gamma;
    wrong.front() += Quad(1e-12);
    wrong.back() += Quad(1e-12);
    wrong[wrong.size() / 2] -= Quad(2e-12);
    const double control = relative_defect(wrong, t.order);
    std::printf(
        "  %-22s order %2d, %2d stages: defect %.1e (1e-32), next order %.1e, control %.1e\n",
        t.name.c_str(), t.order, t.stages(), defect, next, control);
    EXPECT_LE(defect, 1e-32) << t.name;
    EXPECT_GT(next, 1e-10) << t.name << ": the order is not higher";
    EXPECT_GT(control, 1e-16) << t.name << ": the check must see 1e-12";
  }
}

template <class Real>
void expect_exact_sum_and_palindrome(const CompositionTable& t) {
  const auto g = t.gammas<Real>();
  ASSERT_EQ(int(g.size()), t.stages());
  Quad sum = 0;  // of multiples of 2^-51 or 2^-109: without rounding
  for (size_t i = 0; i < g.size(); ++i) {
    sum += Quad(g[i]);
    EXPECT_EQ(g[i], g[g.size() - 1 - i]) << t.name;
  }
  EXPECT_TRUE(sum == 1) << t.name << ": off by " << double(sum - 1);
}

TEST(CompositionTables, SumToOneExactly) {
  for (const auto* tables : {&symmetric_compositions(), &adjoint_compositions()})
    for (const auto& t : *tables) {
      expect_exact_sum_and_palindrome<double>(t);
      expect_exact_sum_and_palindrome<Quad>(t);
    }
  // Control: the same decimals, each rounded to the nearest double, do not all sum to 1.
  int inexact = 0;
  for (const auto& t : symmetric_compositions()) {
    Quad sum = 0;
    for (const Quad g : t.gammas<Quad>()) sum += Quad(double(g));
    inexact += sum != 1;
  }
  EXPECT_GT(inexact, 5);
}

/// Two links under gravity, mass that depends on q.
const mechanics::MechanicalModel& pendulum() {
  static const mechanics::MechanicalModel m(
      test::planar_chain({1, 1}, {1, 1}, {0.5, 0.5}, {1. / 12, 1. / 12}, 9.81));
  return m;
}
const std::vector<Quad> pendulum_start{0.7, -0.4, 1.1, 0.5};

/// Error after `steps` steps over T in 113 bits; INFINITY where a step fails.
double error_in_113_bits(const std::string& method, Quad T, int steps,
                         const std::vector<Quad>& exact) {
  const auto m = make_basic_integrator<Quad>(method, pendulum(), T / steps);
  phs::BasicState<Quad> s(pendulum().description(), pendulum_start);
  for (int i = 0; i < steps; ++i)
    if (m->step(s) != Outcome::ok) return INFINITY;
  for (size_t i = 0; i < s.x.size(); ++i) s.x[i] += s.lo[i];
  return test::distance(s.x, exact);
}

// In double the asymptotic range of the high orders lies below round-off.
TEST(Compositions, OrderIn113Bits) {
  const Quad T = Quad(1) / 4;
  const auto exact = gauss_reference(pendulum(), pendulum_start, T / 24, 24, 12);
  for (const auto& d : catalogue()) {
    if (d.family != "Compositions") continue;
    const int steps = d.name == "yoshida8" ? 48 : 16;  // its long steps ask for a smaller h
    const double a = error_in_113_bits(d.name, T, steps, exact),
                 b = error_in_113_bits(d.name, T, 2 * steps, exact), order = std::log2(a / b);
    std::printf("  %-22s declared %2d   measured %5.2f   (errors %.1e, %.1e)\n", d.name.c_str(),
                d.order, order, a, b);
    EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << d.name;
  }
}

// A composition needs a base whose error expansion has odd powers only.
TEST(Compositions, RefuseABaseThatIsNotSymmetric) {
  const Declaration d{.name = "wrong"};
  const auto compose = [&](const char* table, const char* base) {
    return make_composition<double>(d, composition_table(table), base, pendulum(), 0.01, {});
  };
  EXPECT_THROW((void)compose("yoshida4", "rk4"), InvalidArgument);
  EXPECT_THROW((void)compose("strang", "midpoint"), InvalidArgument);
  EXPECT_NO_THROW((void)compose("yoshida4", "gauss4"));
}

// A step that fails half-way leaves the state as it was.
TEST(Compositions, FailureIsAStatus) {
  const auto robot = test::ets_vii(100);
  for (const char* name : {"yoshida4", "kahan_li8", "yoshida4_sv"}) {
    phs::State s = robot.start;
    EXPECT_NE(make_integrator(name, *robot.model, 20.0)->step(s), Outcome::ok) << name;
    EXPECT_TRUE(s == robot.start) << name;
  }
}

TEST(Compositions, CostIsThatOfTheBase) {
  const auto robot = test::ets_vii();
  phs::State s = robot.start;
  const auto method = make_integrator("yoshida4", *robot.model, 0.05);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(method->step(s), Outcome::ok);
  EXPECT_EQ(method->cost().steps, 10);
  EXPECT_GE(method->cost().evaluations, 3 * 10 * 2) << "three implicit sub-steps a step";
}

}  // namespace
}  // namespace porthos::integrators::composition_test
