// Splittings: order conditions by code for two and three parts, orders in 113 bits, and what they
// keep.
#include "integrators/methods/splitting.h"

#include <gtest/gtest.h>

#include "integrators/methods/gauss.h"
#include "tests/support/gauss.h"
#include "tests/support/order_conditions.h"
#include "tests/support/robots.h"
#include "tests/support/split_systems.h"
#include "tests/support/symplectic.h"

namespace porthos::integrators::splitting_test {
namespace {

using phs::Quad;

/// What a step of that table runs on a system of so many parts.
std::vector<std::pair<int, Quad>> flows_of(const std::vector<Quad>& gamma, int parts) {
  std::vector<std::pair<int, Quad>> flows;
  for (const auto& f : splitting_program(gamma, parts)) flows.push_back({f.part, f.coefficient});
  return flows;
}
double defect(const std::vector<Quad>& gamma, int parts, int order) {
  return double(test::splitting(flows_of(gamma, parts), parts, order).defect_up_to(order));
}

TEST(SplittingTables, MeetTheOrderConditionsForAnyNumberOfParts) {
  for (const auto& t : adjoint_compositions()) {
    const auto gamma = t.gammas<Quad>();
    const double next =
        double(test::splitting(flows_of(gamma, 2), 2, t.order + 1).defect(t.order + 1));
    std::printf(
        "  %-22s order %d, %2d flows of two parts: defect %.1e, three parts %.1e (1e-32), "
        "next order %.1e\n",
        t.name.c_str(), t.order, int(flows_of(gamma, 2).size()), defect(gamma, 2, t.order),
        defect(gamma, 3, t.order), next);
    EXPECT_LE(defect(gamma, 2, t.order), 1e-32) << t.name;
    EXPECT_LE(defect(gamma, 3, t.order), 1e-32) << t.name;
    EXPECT_GT(next, 1e-5) << t.name << ": the order is not higher";
    if (gamma.size() == 2) continue;  // Strang has nothing to perturb
    auto wrong = gamma;
    const size_t s = wrong.size();
    wrong.front() += Quad(1e-12);
    wrong.back() += Quad(1e-12);
    wrong[s / 2] -= Quad(1e-12);
    wrong[s / 2 - 1] -= Quad(1e-12);
    EXPECT_GT(defect(wrong, 2, t.order), 1e-15) << t.name << ": the check must see 1e-12";
  }
}

// The published form: a_i and b_i of alternating flows.
TEST(SplittingTables, MergeIntoThePublishedCoefficients) {
  const auto strang = flows_of(composition_table("strang").gammas<Quad>(), 2);
  ASSERT_EQ(strang.size(), 3u);
  EXPECT_TRUE(strang[0] == std::pair(0, Quad(0.5)) && strang[1] == std::pair(1, Quad(1)) &&
              strang[2] == strang[0]);
  const auto s10 = flows_of(composition_table("blanes_moan6").gammas<Quad>(), 2);
  ASSERT_EQ(s10.size(), 21u);
  EXPECT_NEAR(double(s10[2].second), 0.413514300428344, 1e-15);
  EXPECT_NEAR(double(s10[3].second), -0.132385865767784, 1e-15);
  EXPECT_NEAR(double(s10[10].second), -0.7255255585086897, 4e-15);
}

struct Case {
  std::shared_ptr<const phs::Model> model;
  std::vector<double> start;
};
const Case& henon_heiles() {
  static const Case c{std::make_shared<phs::UserModel<test::HenonHeiles>>(test::HenonHeiles{}),
                      {0.1, 0.3, 0.35, 0.2}};
  return c;
}
const Case& kepler() {
  static const Case c{std::make_shared<phs::UserModel<test::Kepler>>(test::Kepler{}),
                      {1, 0, 0, 1.2}};
  return c;
}
const Case& free_body() {
  static const Case c{std::make_shared<phs::UserModel<test::FreeBody>>(test::FreeBody{}),
                      {0.8, 1.1, -0.6}};
  return c;
}
const Case& rotor(bool driven) {
  static const Case free{std::make_shared<phs::UserModel<test::Rotor>>(test::Rotor{false}),
                         {0.4, 2.5}},
      forced{std::make_shared<phs::UserModel<test::Rotor>>(test::Rotor{true}), {0.4, 2.5}};
  return driven ? forced : free;
}

std::vector<Quad> run_in_113_bits(const std::string& method, const Case& c, Quad T, int steps) {
  const auto m = make_basic_integrator<Quad>(method, *c.model, T / steps);
  phs::BasicState<Quad> s(c.model->description(), {c.start.begin(), c.start.end()});
  for (int i = 0; i < steps; ++i)
    if (m->step(s) != Outcome::ok) throw InvalidArgument("a step of " + method + " failed");
  for (size_t i = 0; i < s.x.size(); ++i) s.x[i] += s.lo[i];
  return s.x;
}

bool is_splitting(const Declaration& d) { return d.family == "Splittings"; }

// Two parts, read off the gradient; the same with an explicit time; three offered flows.
TEST(Splitting, OrderIn113Bits) {
  const Quad T = 1;
  for (const Case* c : {&henon_heiles(), &kepler(), &rotor(true), &free_body()}) {
    const auto& name = c->model->description().name;
    const auto exact = gauss_reference(*c->model, {c->start.begin(), c->start.end()}, T / 48, 48);
    for (const auto& d : catalogue()) {
      const bool verlet = d.name == "stormer_verlet" && c->model->description().traits.separable;
      if (!is_splitting(d) && !verlet) continue;
      const int steps = d.order == 1 ? 512 : 24;
      const double a = test::distance(run_in_113_bits(d.name, *c, T, steps), exact),
                   b = test::distance(run_in_113_bits(d.name, *c, T, 2 * steps), exact),
                   order = std::log2(a / b);
      std::printf("  %-13s %-22s declared %d   measured %5.2f   (errors %.1e, %.1e)\n",
                  name.c_str(), d.name.c_str(), d.order, order, a, b);
      EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << name << " " << d.name;
    }
  }
}

// H = T(p) + V(q): semi-implicit Euler is the symplectic Euler method there; for M(q) it is not,
// see Claims.Symplectic.
TEST(Splitting, Symplectic) {
  const auto& c = henon_heiles();
  for (const auto& d : catalogue()) {
    if (!is_splitting(d) && d.name != "semi_implicit_euler" && d.name != "stormer_verlet") continue;
    const double defect =
        test::symplectic_defect(test::jacobian_of_steps(d.name, *c.model, c.start, 0.2), 4);
    std::printf("  %-22s defect %.1e   bound 1e-14\n", d.name.c_str(), defect);
    EXPECT_LE(defect, 1e-14) << d.name;
  }
  const double control =
      test::symplectic_defect(test::jacobian_of_steps("rk4", *c.model, c.start, 0.2), 4);
  EXPECT_GT(control, 1e-6) << "rk4 must fail";
}

double back_and_forth(const std::string& method, const Case& c) {
  const double h = 0.0625;
  phs::State s(c.model->description(), c.start);
  const auto there = make_integrator(method, *c.model, h),
             back = make_integrator(method, *c.model, -h);
  bool ok = true;
  for (int i = 0; i < 40; ++i) ok = ok && there->step(s) == Outcome::ok;
  for (int i = 0; i < 40; ++i) ok = ok && back->step(s) == Outcome::ok;
  double worst = ok ? 0 : INFINITY;
  for (size_t i = 0; i < s.x.size(); ++i) worst = std::max(worst, std::fabs(s.x[i] - c.start[i]));
  return worst;
}

TEST(Splitting, Symmetric) {
  for (const auto& d : catalogue()) {
    if (!is_splitting(d)) continue;
    const double a = back_and_forth(d.name, kepler()), b = back_and_forth(d.name, free_body());
    std::printf("  %-22s %-6s forth and back %.1e, %.1e   bound 1e-13\n", d.name.c_str(),
                to_string(d.symmetric), a, b);
    if (d.symmetric == Claim::holds)
      EXPECT_LE(std::max(a, b), 1e-13) << d.name;
    else
      EXPECT_GT(std::min(a, b), 1e-6) << d.name << " must fail";
  }
}

// Every flow of a part keeps what commutes with all parts; other quadratic invariants, such as the
// energy of a free body, are lost, where the midpoint rule keeps them.
TEST(Splitting, KeepsTheInvariantsOfItsPartsOnly) {
  struct Errors {
    double L, m2, H;
  };
  const auto errors = [](const std::string& method, int steps) {
    Errors e{};
    for (const Case* c : {&kepler(), &free_body()}) {
      if (misfit(declaration_of(method), c->model->description())) continue;
      test::Gauge gauge(*c->model);
      phs::State s(c->model->description(), c->start);
      const auto start = gauge.invariants(s);
      const auto H0 = gauge.energy(s);
      const auto m = make_integrator(method, *c->model, 0.2);
      for (int i = 0; i < steps; ++i) EXPECT_EQ(m->step(s), Outcome::ok);
      if (c == &kepler())
        e.L = gauge.error("angular_momentum", s, start);
      else {
        e.m2 = gauge.error("momentum_squared", s, start);
        e.H = double(std::fabs((gauge.energy(s) - H0) / H0));
      }
    }
    return e;
  };
  for (const auto& d : catalogue()) {
    if (!is_splitting(d)) continue;
    const auto e = errors(d.name, 2000);
    std::printf("  %-22s Kepler L %.1e, free body |m|^2 %.1e (1e-13)   its energy %.1e\n",
                d.name.c_str(), e.L, e.m2, e.H);
    EXPECT_LE(e.L, 1e-13) << d.name;
    EXPECT_LE(e.m2, 1e-13) << d.name;
    EXPECT_GT(e.H, 1e-12) << d.name << " must lose it";
  }
  EXPECT_LE(errors("midpoint", 2000).H, 1e-13);
  EXPECT_GT(errors("rk4", 2000).L, 1e-9);
}

// The explicit path of stormer_verlet is the map of the implicit one, at two evaluations a step.
TEST(Splitting, ExplicitStormerVerletIsTheGeneralisedOne) {
  const phs::UserModel general(test::HenonHeiles{.separable = false});
  const auto& c = henon_heiles();
  phs::State a(c.model->description(), c.start), b = a;
  const auto explicit_one = make_integrator("stormer_verlet", *c.model, 0.1),
             implicit_one = make_integrator("stormer_verlet", general, 0.1);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(explicit_one->step(a), Outcome::ok);
    ASSERT_EQ(implicit_one->step(b), Outcome::ok);
    for (size_t k = 0; k < 4; ++k) worst = std::max(worst, std::fabs(a.x[k] - b.x[k]));
  }
  const auto cost = explicit_one->cost();
  std::printf("  explicit against implicit, 1000 steps: %.1e (1e-11)   evaluations %ld and %ld\n",
              worst, long(cost.evaluations), long(implicit_one->cost().evaluations));
  EXPECT_LE(worst, 1e-11);
  EXPECT_EQ(cost.evaluations, 2001) << "the last kick and the next share their force";
  EXPECT_EQ(cost.sweeps, 0);
  EXPECT_GT(implicit_one->cost().evaluations, 4000);
}

// The force kept from step to step is part of no checkpoint, and an angle wrapped between the steps
// renews it.
TEST(Splitting, RestartIsContinuation) {
  for (const Case* c : {&rotor(false), &rotor(true), &free_body(), &kepler()})
    for (const auto& d : catalogue()) {
      if (!is_splitting(d)) continue;
      phs::State through(c->model->description(), c->start), stopped = through;
      const auto one = make_integrator(d.name, *c->model, 0.05);
      for (int i = 0; i < 200; ++i) ASSERT_EQ(one->step(through), Outcome::ok);
      for (int part = 0; part < 8; ++part) {
        const auto anew = make_integrator(d.name, *c->model, 0.05);
        for (int i = 0; i < 25; ++i) ASSERT_EQ(anew->step(stopped), Outcome::ok);
      }
      EXPECT_TRUE(through == stopped) << d.name << " on " << c->model->description().name;
      if (!through.turns.empty()) {
        EXPECT_NE(through.turns[0], 0) << "the run must wrap";
      }
    }
}

TEST(Splitting, RefusesWhatItCannotSplit) {
  const auto robot = test::ets_vii();
  EXPECT_THROW((void)make_integrator("strang", *robot.model, 0.1), InvalidArgument);
  phs::State s(kepler().model->description(), {0, 0, 0, 0});  // at the singularity
  const phs::State before = s;
  EXPECT_EQ(make_integrator("strang", *kepler().model, 0.1)->step(s), Outcome::not_finite);
  EXPECT_TRUE(s == before);
}

}  // namespace
}  // namespace porthos::integrators::splitting_test
