// Environments: reset, act, observe.
#include "ensemble/environment.h"

#include <cmath>

#include "ensemble/held_inputs.h"
#include "integrators/core/integrator.h"
#include "phs/system/tunable.h"
#include "phs/system/user_model.h"
#include "tests/support/bounds.h"
#include "tests/support/linkages.h"
#include "tests/support/robots.h"

namespace porthos::ensemble::environment_test {
namespace {

using test::keeps, test::refusal;

/// A mass on a spring with a force, its position a number of the line.
struct Mass {
  phs::Description description() const {
    phs::Description d;
    d.name = "mass";
    d.nx = 2;
    d.nu = 1;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.ports = {{"force", phs::PortKind::effort_in, 1, 0, "N", "m/s"}};
    d.traits = {.canonical = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[0] * x[0] + x[1] * x[1]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0];
    e[1] = x[1];
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};

EnvironmentOptions of_masses() {
  EnvironmentOptions o;
  o.count = 7;
  o.step = 0.05;
  o.substeps = 4;
  o.seed = 11;
  o.outputs = true;
  o.begin = [](Stream& random, std::span<double> x) {
    x[0] = random.uniform(-1, 1);
    x[1] = random.normal();
  };
  return o;
}
std::shared_ptr<const phs::Model> mass() { return std::make_shared<phs::UserModel<Mass>>(Mass{}); }

TEST(Environment, FollowsTheExactMotionUnderHeldForces) {
  Environment env(mass(), {0, 0}, of_masses());
  ASSERT_EQ(env.observation_size(), 3);
  std::vector<double> before(env.observations().begin(), env.observations().end()), u;
  for (int i = 0; i < 7; ++i) u.push_back(0.3 * i - 1);
  env.step(u);
  const double t = env.interval(), c = std::cos(t), s = std::sin(t);
  double worst = 0, wrong = 0;
  for (size_t i = 0; i < 7; ++i) {
    const double q0 = before[3 * i] - u[i], p0 = before[3 * i + 1];  // about the new rest point
    const auto now = env.observations().subspan(3 * i, 3);
    worst = std::max({worst, std::fabs(now[0] - (u[i] + c * q0 + s * p0)),
                      std::fabs(now[1] - (c * p0 - s * q0))});
    wrong = std::max(wrong, std::fabs(now[0] - (c * before[3 * i] + s * p0)));
    EXPECT_EQ(now[2], now[1]) << "y = q'";
    EXPECT_NEAR(env.energies()[i], 0.5 * (now[0] * now[0] + now[1] * now[1]), 1e-15);
  }
  keeps("Gauss, order 4: |x - exact|", worst, 1e-7);
  test::breaks("without the forces", wrong, 1e-3);
}

/// A hundred actions; the observations of all of them.
std::vector<double> play(EnvironmentOptions o, int actions = 60) {
  o.longest = 25;
  o.ended = [](std::span<const double> x) { return x[0] > 1.5; };
  Environment env(mass(), {0, 0}, std::move(o));
  std::vector<double> seen, u(size_t(env.count() * env.action_size()));
  for (int k = 0; k < actions; ++k) {
    for (size_t i = 0; i < u.size(); ++i) u[i] = std::sin(double(k) + double(i));
    env.step(u);
    for (const auto row : {env.observations(), env.final_observations()})
      seen.insert(seen.end(), row.begin(), row.end());
    for (const auto n : env.episodes()) seen.push_back(double(n));
  }
  EXPECT_GT(env.episodes()[0], 0) << "episodes must have ended";
  return seen;
}

TEST(Environment, SameSeedSameBitsOnAnyNumberOfThreads) {
  auto o = of_masses();
  const auto one = play(o);
  o.threads = 2;
  EXPECT_TRUE(play(o) == one);
  o.seed = 12;
  EXPECT_FALSE(play(o) == one) << "control: another seed";
  // An environment does not know how many others there are.
  o.seed = 11;
  o.count = 3;
  const auto few = play(o);
  for (size_t k = 0; k < 9; ++k) EXPECT_EQ(few[k], one[k]);
}

TEST(Environment, APlannerPutsStatesBack) {
  Environment env(mass(), {0.2, 0.1}, {.count = 2});
  const auto x0 = env.state(0);
  env.step(std::vector{1.0, -1.0});
  const auto x1 = env.state(0);
  env.step(std::vector{0.5, 0.5});
  env.set_state(0, x0);
  env.step(std::vector{1.0, 0.0});
  EXPECT_TRUE(env.state(0) == x1);
}

TEST(Environment, EpisodesEndAndBeginAgain) {
  EnvironmentOptions o{.count = 2, .step = 0.1, .longest = 3};
  o.ended = [](std::span<const double> x) { return x[1] > 5; };
  Environment env(mass(), {0.5, 0}, o);
  for (int k = 1; k <= 3; ++k) {
    env.step(std::vector{0.0, k == 2 ? 1000.0 : 0.0});
    EXPECT_EQ(env.terminated()[1], k == 2);
    EXPECT_EQ(env.truncated()[0], k == 3);
    if (k == 2) {
      EXPECT_GT(env.final_observations()[3], 5);
      EXPECT_EQ(env.observations()[3], 0) << "the first of the next episode";
      EXPECT_EQ(env.lengths()[1], 0);
    }
  }
  EXPECT_EQ(env.episodes()[0], 1);
  EXPECT_EQ(env.episodes()[1], 1);
  env.reset(5);
  EXPECT_EQ(env.episodes()[0], 0);
}

TEST(Environment, AFailureBeginsTheNextEpisode) {
  // An arm thrown so hard that no step converges.
  const auto robot = test::ets_vii();
  std::vector<std::string> ports;
  for (const auto& p : robot.model->description().ports)
    if (p.size == 1) ports.push_back(p.name);
  Environment env(robot.model, robot.start.x, {.count = 3, .step = 0.5, .ports = ports});
  std::vector<double> u(size_t(env.count() * env.action_size()), 0.1);
  u[size_t(env.action_size())] = 1e12;
  env.step(u);
  using integrators::Outcome;
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(env.failed()[i], i == 1);
    EXPECT_EQ(env.outcomes()[i], i == 1 ? Outcome::not_converged : Outcome::ok);
  }
  EXPECT_EQ(env.terminated()[1], 1);
  EXPECT_TRUE(env.state(1).x == robot.start.x);
  EXPECT_FALSE(env.state(0).x == robot.start.x);
  EXPECT_TRUE(env.state(0) == env.state(2)) << "a neighbour's failure changes nothing";
  env.reset(1);
  EXPECT_EQ(env.outcomes()[1], Outcome::ok);
}

TEST(Environment, ACallerEndsEpisodes) {
  Environment env(mass(), {0.5, 0}, {.count = 4, .step = 0.1, .longest = 2});
  std::vector<double> before, energy;
  for (int k = 0; k < 2; ++k) {
    before.assign(env.observations().begin(), env.observations().end());
    energy.assign(env.energies().begin(), env.energies().end());
    if (k == 1) env.set_state(3, phs::State(env.model().description(), {0.4, 0.0}));
    env.step(std::vector{1.0, 1.0, 1.0, 1.0});
    if (k == 0) env.end(std::vector<std::uint8_t>{0, 1, 0, 0}, true);
  }
  // 0 and 2 are cut off by their length, 1 began anew in the first step.
  const std::vector<double> last(env.final_observations().begin(), env.final_observations().end());
  env.end(std::vector<std::uint8_t>{0, 1, 1, 0}, false);
  env.end(std::vector<std::uint8_t>{1, 0, 0, 0}, true);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(env.terminated()[i], i < 3) << i;
    EXPECT_EQ(env.truncated()[i], i == 3) << i;
    EXPECT_EQ(env.failed()[i], i == 0) << i;
    EXPECT_EQ(env.episodes()[i], i == 1 ? 2 : 1) << "begun once in each end";
    EXPECT_EQ(env.observations()[2 * i], 0.5) << "the next start";
    for (size_t j = 2 * i; j < 2 * i + 2; ++j)
      EXPECT_EQ(env.final_observations()[j], i == 0 ? before[j] : last[j]) << i;
  }
  EXPECT_EQ(env.final_energies()[0], energy[0]);
  EXPECT_NE(env.final_energies()[2], energy[2]) << "control: one that did not fail";
  const auto few = [&] { env.end(std::vector<std::uint8_t>{1}, true); };
  EXPECT_NE(refusal(few), "");
}

TEST(Environment, TellsWhatAStepCost) {
  const auto spent = [](const std::string& method, double step, int threads) {
    Environment env(
        mass(), {0.5, 0},
        {.count = 20, .method = method, .step = step, .substeps = 3, .threads = threads});
    EXPECT_EQ(env.iterations(), 0) << "no step so far";
    for (int k = 0; k < 2; ++k) env.step(std::vector<double>(20, 0.1));
    return std::pair(env.iterations(), env.alone());
  };
  EXPECT_EQ(spent("rk4", 0.1, 1), std::pair(1.0, 0));
  EXPECT_EQ(spent("rk4", 0.1, 2), std::pair(1.0, 0));
  const auto easy = spent("gauss4", 0.01, 1), hard = spent("gauss4", 5.0, 1);
  EXPECT_TRUE(easy.first > 1 && easy.first < 10) << easy.first;
  EXPECT_EQ(easy.second, 0);
  EXPECT_EQ(hard.second, 20) << "an iteration that does not contract leaves the lanes";
  EXPECT_EQ(spent("gauss4", 0.01, 2), easy);
}

TEST(Environment, AStateThatIsNotFiniteIsNotKept) {
  // Runge-Kutta far beyond its stability: the spring's state grows until it overflows.
  Environment env(mass(), {0.5, 0}, {.method = "rk4", .step = 1e3});
  for (int k = 0; k < 100 && !env.failed()[0]; ++k) env.step(std::vector{0.0});
  EXPECT_EQ(env.failed()[0], 1) << "control: it overflows";
  EXPECT_EQ(env.outcomes()[0], integrators::Outcome::not_finite);
  EXPECT_GT(std::fabs(env.final_observations()[0]), 1e200);
  EXPECT_TRUE(std::isfinite(env.final_observations()[0]));
}

TEST(Environment, Refuses) {
  const auto said = [](EnvironmentOptions o) {
    return refusal([&] { Environment(mass(), {0, 0}, o); });
  };
  EXPECT_EQ(said({.ports = {"torque"}}),
            "environment: 'mass' has no port 'torque', expected one of force");
  EXPECT_EQ(said({.count = 0}), "environment: count is 0, expected 1 or more");
  EXPECT_EQ(said({.observed = {2}}),
            "environment: there is no state number 2 to observe, expected 0 to 1");
  Environment env(mass(), {0, 0}, {});
  EXPECT_EQ(refusal([&] {
              env.step(std::vector{1.0, 2.0});
            }),
            "actions of an environment has 2 entries, expected 1");
  EXPECT_EQ(refusal([&] { env.step(std::vector<double>{NAN}); }),
            "an action is not a finite number");
}

TEST(HeldInputs, BooksTheirWork) {
  // dH = ∫ yᵀu dt, to the method's order: exactly for Gauss and a quadratic H.
  const HeldInputs held(mass());
  const phs::TunedModel tuned(held, {0.7});
  const auto method = integrators::make_integrator("gauss4", tuned, 0.1);
  const auto system = tuned.instantiate<double>();
  phs::State s(held.description(), {0.3, -0.2});
  const double before = system->hamiltonian(s.x);
  double work = 0;
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    work += method->port_work()[0];
  }
  keeps("|dH - work of the inputs|", std::fabs(system->hamiltonian(s.x) - before - work), 1e-14);
  EXPECT_GT(std::fabs(work), 0.1);
}

/// A start off the loops is refused with its gap, by positions and by rates; one on them is not.
TEST(Environment, RefusesStartsOffTheLoops) {
  auto bars = test::four_bar();
  const auto on = bars.start();
  const auto model = std::make_shared<mechanics::MechanicalModel>(bars.model());
  EnvironmentOptions o{.method = "spark16", .step = 0.01};
  Environment closed(model, on, o);
  const double before = closed.energies()[0];
  closed.step(std::vector<double>(3, 0.0));
  keeps("closed: change of the energy in a step [J]", std::fabs(closed.energies()[0] - before),
        1e-10);
  o.begin = [](Stream&, std::span<double> x) { x[0] += 0.1; };
  std::string why = refusal([&] { Environment(model, on, o); });
  EXPECT_NE(why.find("the gap of the constraint 'pin' is 0.19"), std::string::npos) << why;
  EXPECT_NE(why.find("close_loops(q, v)"), std::string::npos) << why;
  o.begin = [](Stream&, std::span<double> x) { x[3] += 0.1; };  // a momentum
  why = refusal([&] { Environment(model, on, o); });
  EXPECT_NE(why.find("the rate of the gap of the constraint 'pin'"), std::string::npos) << why;
  o.begin = [](Stream&, std::span<double> x) { x[0] += 1e-10; };  // rounding
  EXPECT_EQ(refusal([&] { Environment(model, on, o); }), "");
}

}  // namespace
}  // namespace porthos::ensemble::environment_test
