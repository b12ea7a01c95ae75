// Gradients of runs across events: against closed forms, and against 113 bits of the same steps,
// cut where the guard is zero. Controls: the saltation left out, a graze.
#include "integrators/control/event_gradient.h"

#include <gtest/gtest.h>

#include <cmath>

#include "phs/network/network.h"
#include "phs/scalars/derivative.h"
#include "tests/integrators/run_cost.h"
#include "tests/support/pendulum.h"

namespace porthos::integrators::event_gradient_test {
namespace {

using phs::Dual, phs::Quad;
using Vec = std::vector<double>;
using In = std::span<const Dual>;

/// Falling: H = p²/2m + m g q.
struct Ball {
  static constexpr double m = 2, g = 9.81;
  phs::Description description() const {
    phs::Description d;
    d.name = "ball";
    d.nx = 2;
    d.blocks = {{"height", phs::BlockKind::linear, 0, 1, 1, "m", "N s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[1] * x[1] / T(2 * m) + T(m * g) * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(m * g);
    e[1] = x[1] / T(m);
  }
};
const phs::UserModel<Ball> ball{Ball{}};

RunEvent bounce(double restitution) {
  return {.name = "floor",
          .guard = [](In, const Dual&, In x) { return x[0]; },
          .direction = Crossing::falling,
          .reset =
              [](In numbers, const Dual&, In x, std::span<Dual> after) {
                after[0] = x[0];
                after[1] = -numbers[0] * x[1];
              },
          .numbers = {{"restitution", restitution}}};
}
Objective::Part number(size_t i) {
  return [i](double, std::span<const double> x, std::span<double> g) {
    g[i] = 1;
    return x[i];
  };
}

/// The state of a ball at T, which bounces n times before.
template <class T>
std::array<T, 2> bounced(T q, T v, T e, double end, int& n) {
  T t(0.0);
  for (n = 0;; ++n) {
    const T g(Ball::g), down = phs::sqrt(v * v + T(2.0) * g * q), flight = (v + down) / g;
    const T left = T(end) - t;
    if (!(phs::to_double(flight) < phs::to_double(left)))
      return {q + v * left - T(0.5) * g * left * left, T(Ball::m) * (v - g * left)};
    t = t + flight;
    q = T(0.0);
    v = e * down;
  }
}

double value_of(const EventGradient& g, const std::string& name) {
  const auto at = std::ranges::find(g.names, name);
  EXPECT_NE(at, g.names.end()) << name;
  return g.parameters[size_t(at - g.names.begin())];
}

/// Control: the same instants as given times, so that they do not move.
TEST(EventGradient, OfABouncingBallIsItsClosedForm) {
  const double e = 0.8, T = 3.1, h = 0.0625;
  const phs::State start(ball.description(), {1.2, 0.6});
  for (const char* method : {"gauss4", "gauss16", "rk4", "yoshida4"})
    for (size_t i = 0; i < 2; ++i) {
      const EventObjective J{.end = number(i)};
      const std::vector<RunPhase> phases{{&ball, {bounce(e)}}};
      const auto r = gradient_across_events(method, phases, start, h, T, J);
      ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
      const Vec mine{r.start[0], r.start[1], value_of(r, "floor.restitution")};
      std::vector<Dual> in{1.2, 0.6, e};
      double worst = 0, size = 0;
      int bounces = 0;
      phs::along_each(in, [&](size_t j) {
        const auto x = bounced<Dual>(in[0], in[1] / Dual(Ball::m), in[2], T, bounces);
        EXPECT_NEAR(r.cost, x[i].v, 1e-12);
        worst = std::max(worst, std::fabs(mine[j] - x[i].d));
        size = std::max(size, std::fabs(x[i].d));
      });
      std::vector<RunPhase> fixed{{&ball, {}}};
      for (const auto& happened : r.events) {
        RunEvent at = bounce(e);
        at.guard = nullptr;
        at.at = happened.t;
        fixed[0].events.push_back(at);
      }
      const auto still = gradient_across_events(method, fixed, start, h, T, J);
      ASSERT_EQ(still.outcome, Outcome::ok) << still.remark;
      EXPECT_NEAR(still.cost, r.cost, 1e-12);
      const double apart =
          std::fabs(still.start[0] - r.start[0]) + std::fabs(still.start[1] - r.start[1]);
      std::printf(
          "  %-9s end %zu, %d bounces: off by %.1e of the largest (bound 1e-12); instants "
          "that stay: %.1e\n",
          method, i, bounces, worst / size, apart / size);
      EXPECT_EQ(r.events.size(), size_t(bounces));
      EXPECT_GE(bounces, 3);
      EXPECT_LT(worst, 1e-12 * size);
      EXPECT_GT(apart, 0.01 * (std::fabs(r.start[0]) + std::fabs(r.start[1])));
    }
}

/// A pendulum that is pushed in time and hits a wall.
struct Pushed : test::Pendulum {
  phs::Description description() const {
    phs::Description d;
    d.name = "pushed";
    d.nx = 2;
    d.blocks = {{"hinge", phs::BlockKind::linear, 0, 1, 1, "rad", "kg m^2/s"}};
    d.traits.canonical = true;
    d.traits.autonomous = false;
    return d;
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[1] = dx[1] + T(0.4) * phs::sin(T(1.5) * t);
  }
};
/// It moves, and takes more the faster it is hit.
struct Wall {
  template <class T>
  static T guard(std::span<const T> n, const T& t, std::span<const T> x) {
    return x[0] - n[0] - T(0.1) * phs::sin(t);
  }
  template <class T>
  static void reset(std::span<const T> n, const T& t, std::span<const T> x, std::span<T> after) {
    after[0] = x[0] - T(0.05) * x[0] * x[0];
    after[1] = -n[1] * x[1] / (T(1.0) + T(0.1) * x[1] * x[1]) + T(0.02) * phs::cos(t);
  }
};
constexpr double wall_numbers[] = {0.5, 0.9};

/// The cost of the same steps in 113 bits, moved along (x, numbers).
Quad wall_cost(const std::string& method, const Vec& along, Quad by, double h, double T,
               int* hits = nullptr) {
  const phs::UserModel<Pushed> model(Pushed{});
  std::vector<Quad> x{-0.3 + by * Quad(along[0]), 0.6 + by * Quad(along[1])}, n(2);
  for (size_t k = 0; k < 2; ++k) n[k] = Quad(wall_numbers[k]) + by * Quad(along[2 + k]);
  const std::span<const Quad> numbers(n);
  const auto step = [&](const std::vector<Quad>& from, Quad t, Quad size) {
    const auto integrator = make_basic_integrator<Quad>(method, model, Quad(h));
    phs::BasicState<Quad> s(model.description(), from);
    EXPECT_EQ(integrator->advance(t, size, s), Outcome::ok);
    for (size_t k = 0; k < 2; ++k) s.x[k] += s.lo[k];
    return s.x;
  };
  const auto guard = [&](Quad t, const std::vector<Quad>& at) {
    return Wall::guard<Quad>(numbers, t, std::span<const Quad>(at));
  };
  Quad cost = 0;
  for (int i = 0; Quad(i) * Quad(h) < Quad(T) - Quad(1e-9); ++i) {
    Quad t = Quad(i) * Quad(h), left = Quad(h) * Quad(i + 1) < Quad(T) ? Quad(h) : Quad(T) - t;
    const Quad whole = left;
    auto next = step(x, t, left);
    if (guard(t, x) < Quad(0) && guard(t + left, next) > Quad(0)) {
      Quad a = 0, b = left, ga = guard(t, x), gb = guard(t + left, next);
      for (int k = 0; k < 40 && phs::abs(b - a) > Quad(1e-32); ++k) {  // secants
        const Quad c = b - gb * (b - a) / (gb - ga);
        a = b;
        ga = gb;
        b = c;
        gb = guard(t + c, step(x, t, c));
        if (gb == Quad(0) || gb == ga) break;
      }
      const auto hit = step(x, t, b);
      Wall::reset<Quad>(numbers, t + b, std::span<const Quad>(hit), std::span<Quad>(x));
      next = step(x, t + b, left - b);
      if (hits) ++*hits;
    }
    x = next;
    if (whole == Quad(h)) cost += test::quadratic<Quad>(x) / 8;
  }
  const Quad last = test::quadratic<Quad>(x);
  return cost + last;
}

TEST(EventGradient, OfAMovingWallIsThatOf113BitsOfTheSameSteps) {
  const double h = 0.125, T = 12;
  const phs::UserModel<Pushed> model(Pushed{});
  const phs::State start(model.description(), {-0.3, 0.6});
  const RunEvent wall{.name = "wall",
                      .guard = [](In n, const Dual& t, In x) { return Wall::guard(n, t, x); },
                      .reset = [](In n, const Dual& t, In x,
                                  std::span<Dual> after) { Wall::reset(n, t, x, after); },
                      .numbers = {{"place", wall_numbers[0]}, {"restitution", wall_numbers[1]}}};
  const auto weighted = [](double weight) {
    return [weight](double, std::span<const double> x, std::span<double> g) {
      test::add_quadratic_gradient(x, weight, g);
      return weight * test::quadratic(x);
    };
  };
  const EventObjective J{.end = weighted(1), .sampled = weighted(0.125)};
  const Vec along{0.7, -0.4, 0.3, 0.6};
  double other = 0;
  for (const char* method : {"gauss2", "gauss4", "gauss12", "rk4"}) {
    const auto r = gradient_across_events(method, {{&model, {wall}}}, start, h, T, J);
    ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
    int hits = 0;
    const Quad by = 1e-10, up = wall_cost(method, along, by, h, T, &hits),
               down = wall_cost(method, along, -by, h, T);
    const double expected = double((up - down) / (2 * by));
    const Vec slopes{r.start[0], r.start[1], value_of(r, "wall.place"),
                     value_of(r, "wall.restitution")};
    const auto [mine, moduli] = run_cost::product(slopes, along);
    std::printf("  %-8s %d hits: %.12g off by %.1e of the moduli (bound 1e-13), the cost by %.1e\n",
                method, hits, mine, std::fabs(mine - expected) / moduli,
                std::fabs(r.cost - double((up + down) / 2)));
    EXPECT_EQ(r.events.size(), size_t(hits));
    EXPECT_GE(hits, 3);
    EXPECT_LT(std::fabs(mine - expected), 1e-13 * moduli);
    const auto linear =
        gradient_across_events(method, {{&model, {wall}}}, start, h, T,
                               {.end = [](double, std::span<const double>, std::span<double> g) {
                                 g[0] = 0.3;
                                 g[1] = -0.8;
                                 return 0.0;
                               }});
    const auto tangent =
        tangent_across_events(method, {{&model, {wall}}}, start, h, T, {{along[0], along[1]}},
                              {{"wall.place", along[2]}, {"wall.restitution", along[3]}});
    ASSERT_EQ(tangent.outcome, Outcome::ok) << tangent.remark;
    const auto [there, size] = run_cost::product({0.3, -0.8}, tangent.change);
    const auto [here, of_terms] =
        run_cost::product({linear.start[0], linear.start[1], value_of(linear, "wall.place"),
                           value_of(linear, "wall.restitution")},
                          along);
    std::printf("           the adjoint is off the tangent by %.1e of the moduli (bound 1e-14)\n",
                std::fabs(there - here) / std::max(size, of_terms));
    EXPECT_LT(std::fabs(there - here), 1e-14 * std::max(size, of_terms));
    if (method == std::string("gauss2")) other = mine;
    if (method == std::string("gauss12")) {
      EXPECT_GT(std::fabs(mine - other), 1e-4 * moduli) << "the control: of the same flow";
    }
  }
}

// --- phases ------------------------------------------------------------------------------------

/// n free masses of 1 and 3 kg on a line; the last one on a spring.
template <int n>
struct Masses {
  double stiffness = 0;
  phs::Description description() const {
    phs::Description d;
    d.name = "masses";
    d.nx = 2 * n;
    d.blocks = {{"places", phs::BlockKind::linear, 0, n, n, "m", "N s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    if constexpr (n == 1)
      return x[1] * x[1] / T(8.0) + T(0.5 * stiffness) * x[0] * x[0];
    else
      return x[2] * x[2] / T(2.0) + x[3] * x[3] / T(6.0);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    std::fill(e.begin(), e.end(), T(0.0));
    if constexpr (n == 1) {
      e[0] = T(stiffness) * x[0];
      e[1] = x[1] / T(4.0);
    } else {
      e[2] = x[2];
      e[3] = x[3] / T(3.0);
    }
  }
};

/// Two bodies that meet are one from then on: 4 numbers, then 2.
TEST(EventGradient, OfACaptureIsItsClosedForm) {
  const phs::UserModel<Masses<2>> apart(Masses<2>{});
  const phs::UserModel<Masses<1>> joined(Masses<1>{});
  const RunEvent meet{.name = "meet",
                      .guard = [](In, const Dual&, In x) { return x[0] - x[1]; },
                      .reset =
                          [](In, const Dual&, In x, std::span<Dual> after) {
                            after[0] = x[0];
                            after[1] = x[2] + x[3];
                          },
                      .then = 1};
  const phs::State start(apart.description(), {0, 1, 2, -0.3});
  const double T = 1.3;
  const auto r = gradient_across_events("gauss6", {{&apart, {meet}}, {&joined}}, start, 0.1, T,
                                        {.end = number(0)});
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  std::vector<Dual> x{0, 1, 2, -0.3};
  phs::along_each(x, [&](size_t k) {
    const Dual v0 = x[2], v1 = x[3] / Dual(3), t = (x[1] - x[0]) / (v0 - v1);
    const Dual q = x[0] + v0 * t + (x[2] + x[3]) / Dual(4) * (Dual(T) - t);
    EXPECT_NEAR(r.cost, q.v, 1e-14);
    EXPECT_NEAR(r.start[k], q.d, 1e-13) << k;
  });
  EXPECT_EQ(r.end.x.size(), 2U);
  const auto tangent = tangent_across_events("gauss6", {{&apart, {meet}}, {&joined}}, start, 0.1, T,
                                             {{1.0, 0.5, -0.25, 2.0}});
  EXPECT_NEAR(tangent.change[0], r.start[0] + 0.5 * r.start[1] - 0.25 * r.start[2] + 2 * r.start[3],
              1e-14);
}

/// A spring that is there from a given time on, and by the time.
TEST(EventGradient, ByTheTimeAtWhichASpringSwitchesOn) {
  const phs::UserModel<Masses<1>> loose(Masses<1>{}), sprung(Masses<1>{9});
  const RunEvent on{.name = "on", .at = 0.43, .then = 1};
  const phs::State start(loose.description(), {0.2, 1.5});
  const double T = 2;
  const auto r = gradient_across_events("gauss16", {{&loose, {on}}, {&sprung}}, start, 0.1, T,
                                        {.end = number(0)});
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  std::vector<Dual> in{0.2, 1.5, 0.43};
  const Vec mine{r.start[0], r.start[1], value_of(r, "on.at")};
  phs::along_each(in, [&](size_t k) {
    const Dual v = in[1] / Dual(4), q = in[0] + v * in[2], w(1.5), left = Dual(T) - in[2];
    const Dual end = q * phs::cos(w * left) + v / w * phs::sin(w * left);
    EXPECT_NEAR(r.cost, end.v, 1e-13);
    EXPECT_NEAR(mine[k], end.d, 1e-12) << k;
  });
  const auto tangent = tangent_across_events("gauss16", {{&loose, {on}}, {&sprung}}, start, 0.1, T,
                                             {{0.0, 0.0}}, {{"on.at", 2}});
  EXPECT_NEAR(tangent.change[0], 2 * mine[2], 1e-13);
}

/// The time of the fall, whose run its event ends.
TEST(EventGradient, OfTheTimeOfAnEventThatEndsTheRun) {
  RunEvent floor = bounce(0.5);
  floor.ends = true;
  const auto r = gradient_across_events("gauss4", {{&ball, {floor}}},
                                        phs::State(ball.description(), {1.5, 0}), 0.1, 10,
                                        {.end = [](double t, auto, auto) { return t; },
                                         .end_by_time = [](double, auto) { return 1; }});
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  const double t = std::sqrt(2 * 1.5 / Ball::g);
  EXPECT_NEAR(r.cost, t, 1e-15);
  EXPECT_NEAR(r.time, t, 1e-15);
  EXPECT_NEAR(r.start[0], 1 / (Ball::g * t), 1e-14);
  EXPECT_NEAR(r.start[1], 1 / (Ball::m * Ball::g), 1e-14);
  const auto tangent =
      tangent_across_events("gauss4", {{&ball, {floor}}}, phs::State(ball.description(), {1.5, 0}),
                            0.1, 10, {{2.0, 0.0}}, {{"floor.restitution", 1}});
  EXPECT_NEAR(tangent.time_change, 2 * r.start[0], 1e-14);
  EXPECT_NEAR(tangent.change[0], 0, 1e-14) << "it is on the floor";
}

/// A mass on a spring that hits a wall, by its mass and the spring.
TEST(EventGradient, ByParametersIsThatOfDifferences) {
  const auto cost = [](double mass, double factor) {
    mechanics::MechanismBuilder b("slider");
    mechanics::BodySpec s;
    s.name = "cart";
    s.parent = "world";
    s.joint.name = "rail";
    s.joint.type = "prismatic";
    s.joint.axis = {1, 0, 0};
    s.joint.damping = 0.1;
    s.mass = {mass, {0, 0, 0}, {1, 0, 0, 1, 0, 1}};
    b.add(s);
    phs::Network n("sprung");
    n.add("mass", std::make_shared<mechanics::MechanicalModel>(
                      std::make_shared<mechanics::Mechanism>(b.build())));
    n.potential("spring", "mass.rail", phs::spring(8 * factor, 0.2, 5 * factor));
    const auto model = n.build();
    RunEvent wall = bounce(0.7);
    return gradient_across_events("gauss8", {{model.get(), {wall}}},
                                  phs::State(model->description(), {0.8, 0.3}), 0.0625, 6,
                                  {.end = number(0)});
  };
  const auto r = cost(2, 1);
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  EXPECT_GE(r.events.size(), 3U);
  const auto slope = [](const auto& f) {
    const auto once = [&](double by) { return (f(by).cost - f(-by).cost) / (2 * by); };
    return (4 * once(1e-3) - once(2e-3)) / 3;
  };
  const double by_mass = slope([&](double by) { return cost(2 + by, 1); }),
               by_spring = slope([&](double by) { return cost(2, 1 + by); });
  std::printf(
      "  %zu hits: by mass %.9g off by %.1e, by the spring %.9g off by %.1e (bounds 1e-7)\n",
      r.events.size(), by_mass, std::fabs(value_of(r, "cart.mass") / by_mass - 1), by_spring,
      std::fabs(value_of(r, "spring.factor") / by_spring - 1));
  EXPECT_NEAR(value_of(r, "cart.mass"), by_mass, 1e-7 * std::fabs(by_mass));
  EXPECT_NEAR(value_of(r, "spring.factor"), by_spring, 1e-7 * std::fabs(by_spring));
}

/// Thrown up to a ceiling that it just reaches, at the end of a step. Control: a little harder.
TEST(EventGradient, NamesAnEventThatGrazes) {
  const auto at_speed = [](double v) {
    RunEvent ceiling = bounce(1);
    ceiling.name = "ceiling";
    ceiling.guard = [](In, const Dual&, In x) { return x[0] - Dual(0.5); };
    ceiling.direction = Crossing::rising;
    return gradient_across_events("gauss4", {{&ball, {ceiling}}},
                                  phs::State(ball.description(), {0, Ball::m * v}), v / Ball::g / 4,
                                  0.6, {.end = number(0)});
  };
  const double reaches = std::sqrt(2 * Ball::g * 0.5);
  const auto r = at_speed(reaches * (1 + 1e-14));
  EXPECT_EQ(r.outcome, Outcome::failed);
  EXPECT_NE(r.remark.find("the event 'ceiling' grazes at t = 0.31927"), std::string::npos)
      << r.remark;
  EXPECT_EQ(at_speed(reaches * 1.001).outcome, Outcome::ok);
}

TEST(EventGradient, RefusesWhatItDoesNotCover) {
  const phs::State start(ball.description(), {1, 0});
  const auto refusal = [&](const char* method, std::vector<RunEvent> events) -> std::string {
    try {
      (void)gradient_across_events(method, {{&ball, std::move(events)}}, start, 0.1, 1,
                                   {.end = number(0)});
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "(accepted)";
  };
  EXPECT_EQ(refusal("gonzalez", {}),
            "'gonzalez' has no derivative by the size of its steps, which events cut, expected "
            "Gauss collocation");
  EXPECT_EQ(refusal("gauss4", {{.name = "a", .at = 0.2, .then = 3}}),
            "the event 'a' goes on to phase 3 of 1");
  EXPECT_EQ(refusal("gauss4", {{.name = "a"}}),
            "the event 'a' has no guard, expected a time at > 0");
  EXPECT_EQ(refusal("gauss4", {{.name = "a", .at = 0.25}}), "(accepted)");
}

}  // namespace
}  // namespace porthos::integrators::event_gradient_test
