// Derivatives of runs with sampled controllers: against powers of a matrix, against 113 bits of the
// same steps with what is held as a number of the state, tangents against adjoints.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "integrators/control/step_control.h"
#include "integrators/control/taken_steps.h"
#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/run_tangents.h"
#include "integrators/derivatives/tangent_run.h"
#include "phs/network/network.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/bounds.h"
#include "tests/support/pendulum.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::integrators::sampled_gradient_test {
namespace {

using phs::Dual, phs::Quad;
using Vec = std::vector<double>;

/// u = k (target - x) - d y at offset `at` of the state.
phs::LawPtr pd(double k, double d, size_t at = 0, double target = 0) {
  return phs::law({{"stiffness", k}, {"damping", d}, {"target", target}},
                  [at](auto gains, auto, auto x, auto y, auto u) {
                    u[0] = gains[0] * (gains[2] - x[at]) - gains[1] * y[0];
                  });
}

double slope_of(const RunGradient& r, const std::string& name) {
  const auto at = std::ranges::find(r.names, name);
  EXPECT_NE(at, r.names.end()) << name;
  return r.parameters[size_t(at - r.names.begin())];
}

Objective number(size_t i) {
  return {.end =
              [i](double, std::span<const double> x, std::span<double> g) {
                g[i] = 1;
                return x[i];
              },
          .sampled = {},
          .running = {}};
}

/// A mass on a rail.
std::shared_ptr<const phs::Model> slider(double mass) {
  mechanics::MechanismBuilder b("slider");
  mechanics::BodySpec s;
  s.name = "cart";
  s.parent = "world";
  s.joint.name = "rail";
  s.joint.type = "prismatic";
  s.joint.axis = {1, 0, 0};
  s.mass = {mass, {0, 0, 0}, {1, 0, 0, 1, 0, 1}};
  b.add(s);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}
struct Servo {
  double mass = 2, k = 40, d = 3, target = 0.1, period = 0.125;
  std::shared_ptr<const phs::NetworkModel> model(phs::LawPtr law = nullptr) const {
    phs::Network n("servo");
    n.add("mass", slider(mass));
    n.control("pd", "mass.rail.force", law ? law : pd(k, d, 0, target), {.period = period});
    return n.build();
  }
};
/// (q, p) after n periods, on parabolas.
template <class T>
std::array<T, 2> after(int n, T q, T p, T mass, T k, T d, T target, double period) {
  const T h(period);
  for (int i = 0; i < n; ++i) {
    const T u = k * (target - q) - d * p / mass;
    q = q + p / mass * h + u / mass * h * h * T(0.5);
    p = p + u * h;
  }
  return {q, p};
}

// Control: what the law makes of the state left out.
TEST(SampledGradient, OfAMassUnderAHeldPdIsAPowerOfItsMatrix) {
  const Servo s;
  const auto model = s.model();
  const int periods = 30;
  const phs::State start(model->description(), {0.3, -0.5});
  for (const char* method :
       {"gauss4", "gauss16", "lobatto4", "hbvm4", "rk4", "radau15", "yoshida4"}) {
    for (size_t i = 0; i < 2; ++i) {
      const auto r = gradient_of_run(method, *model, start, s.period / 4, 4 * periods, number(i));
      ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
      const Vec mine{r.start[0],
                     r.start[1],
                     slope_of(r, "cart.mass"),
                     slope_of(r, "pd.stiffness"),
                     slope_of(r, "pd.damping"),
                     slope_of(r, "pd.target")};
      std::vector<Dual> in{0.3, -0.5, s.mass, s.k, s.d, s.target};
      double worst = 0, size = 0;
      phs::along_each(in, [&](size_t j) {
        const double expected =
            after<Dual>(periods, in[0], in[1], in[2], in[3], in[4], in[5], s.period)[i].d;
        worst = std::max(worst, std::fabs(mine[j] - expected));
        size = std::max(size, std::fabs(expected));
      });
      std::printf("  %-16s end %zu: off by %.1e of the largest (bound 1e-13)\n", method, i,
                  worst / size);
      EXPECT_LT(worst, 1e-13 * size);
    }
  }
  const auto blind = s.model(phs::law([s](auto, auto x, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = T(s.k) * (T(s.target) - x[0]) - T(s.d) * y[0];
    if constexpr (std::is_same_v<T, Dual>) u[0].d = 0;
  }));
  const auto r = gradient_of_run("gauss4", *blind, start, s.period / 4, 4 * periods, number(0));
  const auto whole = gradient_of_run("gauss4", *model, start, s.period / 4, 4 * periods, number(0));
  EXPECT_EQ(r.cost, whole.cost);
  EXPECT_NEAR(r.start[0], 1, 1e-14);
  EXPECT_LT(std::fabs(whole.start[0]), 0.5);
}

/// A pendulum whose torque is a number of the state, and a sum that the law remembers: the run of a
/// sampled controller, with instants by hand.
struct HeldPendulum : test::Pendulum {
  phs::Description description() const {
    phs::Description d;
    d.name = "held pendulum";
    d.nx = 3;
    d.blocks = {{"hinge", phs::BlockKind::linear, 0, 1, 1, "rad", "kg m^2/s"},
                {"torque", phs::BlockKind::linear, 2, 1, -1, "N m", ""}};
    return d;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    test::Pendulum::gradient(x, e);
    e[2] = T(0.0);
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T> e, std::span<T> Je) const {
    Je[0] = e[1];
    Je[1] = -e[0];
    Je[2] = T(0.0);
  }
  template <class T>
  void drive(T, std::span<const T> x, std::span<T> dx) const {
    dx[1] = dx[1] + x[2];
  }
};
struct OpenPendulum : test::Pendulum {
  phs::Description description() const {
    phs::Description d;
    d.name = "pendulum";
    d.nx = 2;
    d.nu = 1;
    d.blocks = {{"hinge", phs::BlockKind::linear, 0, 1, 1, "rad", "kg m^2/s"}};
    d.ports = {{"torque", phs::PortKind::effort_in, 1, 0, "N m", "rad/s"}};
    d.traits.canonical = true;
    return d;
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};
/// A saturated PD with a sum of the errors: a smooth law with a memory of one number.
struct Pid {
  template <class T>
  void operator()(std::span<const T> g, const auto& t, std::span<const T> x, std::span<const T> y,
                  std::span<T> sum, std::span<T> u) const {
    const T error = T(0.5) * phs::sin(T(2.0) * t) - x[0];
    sum[0] = sum[0] + g[2] * error;
    const T asked = g[0] * error - g[1] * y[0] + sum[0];
    u[0] = asked / phs::sqrt(T(1.0) + asked * asked);
  }
};
constexpr double pid_gains[] = {3, 0.7, 0.2};

std::shared_ptr<const phs::NetworkModel> pid_pendulum(double period) {
  phs::Network n("pid");
  n.add("pendulum", std::make_shared<phs::UserModel<OpenPendulum>>(OpenPendulum{}));
  n.control(
      "pid", {"pendulum.torque"},
      phs::sampled_law({0.05}, {{"p", pid_gains[0]}, {"d", pid_gains[1]}, {"i", pid_gains[2]}},
                       [](auto g, auto t, auto x, auto y, auto memory, auto u) {
                         using T = std::remove_const_t<typename decltype(x)::value_type>;
                         Pid{}(std::span<const T>(g), t, std::span<const T>(x),
                               std::span<const T>(y), memory, u);
                       }),
      period);
  return n.build();
}

/// The cost of that run in 113 bits, moved by a part of a direction of (x, gains).
Quad pid_cost(const std::string& method, const Vec& along, Quad by, double h, int every,
              int steps) {
  const phs::UserModel<HeldPendulum> model(HeldPendulum{});
  const auto integrator =
      make_basic_integrator<Quad>(method == "radau15" ? "gauss16" : method, model, Quad(h));
  std::vector<Quad> x{0.7, -0.4, 0}, g(3), sum{0.05};
  for (size_t k = 0; k < 2; ++k) x[k] += by * Quad(along[k]);
  for (size_t k = 0; k < 3; ++k) g[k] = Quad(pid_gains[k]) + by * Quad(along[2 + k]);
  phs::BasicState<Quad> s(model.description(), x);
  Quad cost = 0;
  for (int i = 0; i < steps; ++i) {
    const Quad now[] = {s.x[0] + s.lo[0], s.x[1] + s.lo[1]}, y[] = {now[1]};
    if (i % every == 0) {
      Pid{}(std::span<const Quad>(g), Quad(h) * Quad(i), std::span<const Quad>(now),
            std::span<const Quad>(y), std::span<Quad>(sum), std::span<Quad>(s.x).last(1));
      s.lo[2] = 0;
    }
    EXPECT_EQ(integrator->step(s), Outcome::ok);
    const Quad end[] = {s.x[0] + s.lo[0], s.x[1] + s.lo[1]};
    cost += test::quadratic<Quad>(end) / 8;
    if (i + 1 == steps) cost += test::quadratic<Quad>(end);
  }
  return cost;
}

TEST(SampledGradient, OfALawWithAMemoryIsThatOf113Bits) {
  const double h = 0.0625;
  const int every = 4, steps = 90;
  const Vec along{0.8, -0.3, 0.4, 0.6, -0.5};
  const auto weighted = [](double weight) {
    return [weight](double, std::span<const double> x, std::span<double> g) {
      test::add_quadratic_gradient(x, weight, g);
      return weight * test::quadratic(x);
    };
  };
  const Objective J{.end = weighted(1), .sampled = weighted(0.125), .running = {}};
  const auto model = pid_pendulum(every * h);
  const phs::State start(model->description(), {0.7, -0.4});
  for (const char* method : {"gauss2", "gauss6", "gauss16", "rk4", "radau15"}) {
    const auto r = gradient_of_run(method, *model, start, h, steps, J);
    ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
    const Quad by = 1e-10, up = pid_cost(method, along, by, h, every, steps),
               down = pid_cost(method, along, -by, h, every, steps);
    const double expected = double((up - down) / (2 * by));
    Vec slopes = r.start;
    for (const char* gain : {"pid.p", "pid.d", "pid.i"}) slopes.push_back(slope_of(r, gain));
    const auto [mine, moduli] = run_cost::product(slopes, along);
    std::printf("  %-9s %.12g off by %.1e of the moduli (bound 1e-13)\n", method, mine,
                std::fabs(mine - expected) / moduli);
    EXPECT_NEAR(r.cost, double((up + down) / 2), 1e-12 * std::fabs(r.cost));
    EXPECT_LT(std::fabs(mine - expected), 1e-13 * moduli);
    const auto again = gradient_of_run(method, *model, start, h, steps, J, {.memory = 4000});
    EXPECT_GT(again.steps_taken, r.steps_taken);
    EXPECT_EQ(again.start, r.start);
    EXPECT_EQ(again.parameters, r.parameters);
  }
}

/// An arm, ETS-VII too, with a held PD at each joint; the second controller sees mean rates and is
/// half as fast.
std::shared_ptr<const phs::NetworkModel> servoed(const test::Robot& robot, double h,
                                                 double stiffer = 0) {
  phs::Network n("arm at rates");
  n.add("arm", robot.model);
  size_t which = 0;
  for (const auto& c : robot.model->mechanism().coordinates()) {
    if (c.nv != 1) continue;
    phs::Network::Control how{.period = which % 2 == 1 ? 4 * h : 2 * h};
    if (which % 2 == 1) how.encoder = {"arm." + c.name};
    n.control("servo" + std::to_string(which), "arm." + c.name + ".torque",
              pd(3 + stiffer, 1, size_t(c.q), 0.2), how);
    ++which;
  }
  return n.build();
}

TEST(SampledGradient, IsTheAdjointOfTheTangent) {
  for (const auto& [robot, name, h] : {std::tuple{test::ets_vii(5), "floating arm", 0.0625},
                                       {test::swinging_pendulum(0.1), "pendulum", 0.03125}})
    for (const char* method : {"gauss6", "gauss16", "rk4", "radau15"}) {
      const auto model = servoed(robot, h), up = servoed(robot, h, 1e-4),
                 down = servoed(robot, h, -1e-4);
      const size_t nx = robot.start.x.size();
      const Vec lambda = run_cost::random_vector(nx, 1), delta = run_cost::random_vector(nx, 2);
      const int steps = 60;
      RunTangents run(method, *model, robot.start, h,
                      {{.start = delta}, {Vec(nx, 0.0), up.get(), down.get(), 1e-4}});
      for (int i = 0; i < steps; ++i) ASSERT_EQ(run.step(), Outcome::ok) << run.remark();
      const Objective J{.end =
                            [&](double, std::span<const double>, std::span<double> g) {
                              std::copy(lambda.begin(), lambda.end(), g.begin());
                              return 0.0;
                            },
                        .sampled = {},
                        .running = {}};
      const auto r = gradient_of_run(method, *model, robot.start, h, steps, J);
      ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
      EXPECT_EQ(r.end.x, run.state().x);
      const auto [at_end, moduli] = run_cost::product(lambda, run.tangent(0).x);
      const auto [at_start, moduli_there] = run_cost::product(r.start, delta);
      const double off = std::fabs(at_end - at_start) / std::max(moduli, moduli_there);
      double by_stiffness = 0;
      for (size_t k = 0; k < r.names.size(); ++k)
        if (r.names[k].ends_with(".stiffness") && r.names[k].starts_with("servo"))
          by_stiffness += r.parameters[k];
      const auto [along, size] = run_cost::product(lambda, run.tangent(1).x);
      std::printf(
          "  %-13s %-9s off by %.1e of the moduli (bound 1e-14), by stiffness %.1e (1e-9)\n", name,
          method, off, std::fabs(along - by_stiffness) / size);
      EXPECT_LT(off, 1e-14);
      EXPECT_LT(std::fabs(along - by_stiffness), 1e-9 * size);
    }
}

// A law that is clipped, a wrench that turns, a damper beside it: by duals. And with the steps of a
// step control, against differences of runs at these steps.
TEST(SampledGradient, UnderAStepControlAndByDualsIsThatOfDifferences) {
  const auto robot = test::swinging_pendulum(0.1);
  const double h = 0.0625;
  for (const bool continuous : {false, true}) {
    phs::Network n("pendulum");
    n.add("arm", robot.model);
    const auto upper = robot.model->mechanism().coordinates()[0].name,
               lower = robot.model->mechanism().coordinates()[1].name;
    n.control("servo", "arm." + upper + ".torque", pd(3, 1), {.period = 4 * h});
    if (continuous) n.control("other", "arm." + lower + ".torque", pd(2, 0.5, 1));
    const auto model = n.build();
    const auto run = taken_steps(
        *model,
        [&] { return make_controlled(StepControl::reversible, "gauss8", *model, h, {.rate = 2}); },
        robot.start, 4);
    ASSERT_EQ(run.outcome, Outcome::ok) << run.remark;
    ASSERT_GT(run.steps.size(), 20U);
    const auto cost = [&](double by) {
      phs::State s = robot.start;
      for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += by * std::cos(double(k));
      return gradient_of_run("gauss8", *model, s, h, std::int64_t(run.steps.size()), number(0),
                             {.taken = run.steps});
    };
    const auto r = cost(0);
    ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
    EXPECT_EQ(r.end.x, run.end.x);
    double mine = 0;
    for (size_t k = 0; k < r.start.size(); ++k) mine += r.start[k] * std::cos(double(k));
    const auto once = [&](double by) { return (cost(by).cost - cost(-by).cost) / (2 * by); };
    const double expected = (4 * once(1e-3) - once(2e-3)) / 3;
    std::printf("  %zu steps: %.10g, off by %.1e (bound 1e-8)\n", run.steps.size(), mine,
                std::fabs(mine / expected - 1));
    EXPECT_NEAR(mine, expected, 1e-8 * std::fabs(expected));
    EXPECT_EQ(slope_of(r, "servo.damping") != 0, true);
    EXPECT_TRUE(std::isnan(r.duration));
  }
}

TEST(SampledGradient, WhatHasNoneIsRefusedByName) {
  class Rough final : public phs::SampledLaw {
    std::vector<double> fresh() const override { return {}; }
    void operator()(double, std::span<const double>, std::span<const double>, std::span<double>,
                    std::span<double> u) const override {
      u[0] = 0;
    }
  };
  phs::Network n("servo");
  n.add("mass", slider(1));
  n.control("rough", {"mass.rail.force"}, std::make_shared<Rough>(), 0.25);
  const auto rough = n.build();
  const auto smooth = Servo{.period = 0.25}.model();
  const phs::State start(smooth->description(), {0.3, 0});
  const auto gradient = [&](const phs::Model& m, const char* method, GradientOptions o = {}) {
    return test::refusal([&] { (void)gradient_of_run(method, m, start, 0.125, 4, number(0), o); });
  };
  EXPECT_EQ(gradient(*rough, "gauss8"),
            "'servo': the law of the sampled controller 'rough' has no derivatives, expected one "
            "without a memory, or a phs::SmoothSampledLaw");
  EXPECT_EQ(gradient(*smooth, "gonzalez"),
            "'gonzalez' has no derivatives by what 'pd' holds, which is sampled, expected Gauss "
            "collocation");
  EXPECT_EQ(gradient(*smooth, "gauss8", {.direction = {1, 0}}),
            "a direction takes no sampled controllers, and 'servo' has 'pd', expected a gradient "
            "without one");
  EXPECT_EQ(test::refusal([&] { (void)monodromy("gonzalez", *smooth, start, 0.125, 4); }),
            "'gonzalez' has no tangents with sampled controllers, and 'servo' has 'pd', expected "
            "Gauss collocation");
  EXPECT_EQ(gradient(*smooth, "gauss8"), "");
}

}  // namespace
}  // namespace porthos::integrators::sampled_gradient_test
