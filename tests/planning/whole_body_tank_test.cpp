// Whole-body control that a tank of energy pays for: budgets of work against a closed form, and
// closed loops that would make energy.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/catalogue.h"
#include "mechanics/builder.h"
#include "phs/functions/tank.h"
#include "phs/network/network.h"
#include "planning/whole_body_law.h"
#include "tests/support/bounds.h"

namespace porthos::planning::whole_body_tank_test {
namespace {

using mechanics::BodySpec;
using mechanics::Mechanism;
using Vec = std::vector<double>;
constexpr double g = 9.81;

std::shared_ptr<const Mechanism> chain(const char* type, int links, double gravity) {
  mechanics::MechanismBuilder builder("arm");
  builder.gravity({0, 0, -gravity});
  for (int k = 0; k < links; ++k) {
    BodySpec link;
    link.name = "link" + std::to_string(k);
    link.parent = k ? "link" + std::to_string(k - 1) : "world";
    link.joint.name = "joint" + std::to_string(k);
    link.joint.type = type;
    link.joint.axis = {0, 0, 1};
    if (k) link.placement.r = {0.5, 0, 0};
    link.mass.mass = 2;
    link.mass.com = {0.25, 0, 0};
    link.mass.inertia = {0.01, 0, 0, 0.05, 0, 0.05};
    builder.add(link);
  }
  return std::make_shared<const Mechanism>(builder.build());
}

/// A mass of 2 kg on a vertical slide: T m (g + a)(v + ½T a) = budget, solved for a.
double lifted(double v, double T, double budget) {
  const double half = v + 0.5 * T * g, c = v * g - budget / (2 * T);
  return (-half + std::sqrt(half * half - 2 * T * c)) / T;
}

}  // namespace

/// Control: without a budget the task is met and takes more.
TEST(WholeBodyTank, ALiftTakesTheBudgetOfItsInstant) {
  const auto m = chain("prismatic", 1, g);
  WholeBodyOptions o;
  o.period = 0.01;
  WholeBody control(m, o);
  double off = 0, beyond = 0, plain = HUGE_VAL;
  for (const double v : {0.0, 0.3, 2.0})
    for (const double budget : {0.0, 0.01, 0.1}) {
      control.update(Vec{0.2}, Vec{v});
      const std::vector<TaskLevel> tasks{control.joints(Vec{50})};
      control.budget(budget);
      const auto& s = control.solve(tasks);
      ASSERT_TRUE(s.possible && s.limited) << s.why;
      EXPECT_TRUE(s.exceeded.empty());
      EXPECT_FALSE(s.tasks[0].met);
      off = std::max(off, std::fabs(s.v_dot[0] - lifted(v, o.period, budget)));
      beyond = std::max(beyond, s.work - budget);
      control.budget(HUGE_VAL);
      const auto& all = control.solve(tasks);
      EXPECT_TRUE(all.tasks[0].met && !all.limited);
      plain = std::min(plain, all.work - budget);
    }
  test::keeps("acceleration against the closed form [m/s2]", off, 1e-6);
  test::keeps("work beyond the budget [J]", beyond, 1e-9);
  test::breaks("without a budget [J]", plain, 0.01);
  EXPECT_TRUE(test::refusal([&] { control.budget(-1); }).find("-1") != std::string::npos);
}

/// Two joints with a speed, and no energy: the first task has what the second gives up.
TEST(WholeBodyTank, TheFirstTaskIsServedFirst) {
  const auto m = chain("revolute", 2, 0);
  WholeBodyOptions o;
  o.period = 0.01;
  WholeBody control(m, o);
  control.update(Vec{0.3, 0.8}, Vec{0.5, 0.4});
  const std::vector<TaskLevel> tasks{control.joints(Vec{3, NAN}), control.joints(Vec{NAN, 5})};
  const bool met = control.solve(tasks).tasks[1].met;
  control.budget(0.0);
  const auto& s = control.solve(tasks);
  EXPECT_TRUE(met && s.limited && s.tasks[0].met && !s.tasks[1].met);
  test::keeps("work without energy [J]", s.work, 1e-9);
  // With calm tasks the last one gives way in part: it asks for something between 5 and -20.
  const std::vector<TaskLevel> calm{control.joints(Vec{-20, NAN}), control.joints(Vec{NAN, -20})};
  for (const double budget : {0.0, 0.002}) {
    control.budget(budget);
    const auto& part = control.solve(tasks, calm);
    std::printf("  with %g J the second joint has %.3f rad/s2\n", budget, part.v_dot[1]);
    EXPECT_TRUE(part.limited && part.tasks[0].met && !part.tasks[1].met);
    EXPECT_TRUE(part.v_dot[1] > -20 && part.v_dot[1] < 5);
    test::keeps("work against the budget [J]", std::fabs(part.work - budget), 1e-15);
  }
}

namespace {

/// An arm whose tip is held by the law, on springs of its surroundings.
struct Loop {
  std::shared_ptr<const phs::NetworkModel> network;
  std::shared_ptr<const WholeBodyLaw> law;
};
constexpr double least = 0.2, most = 2.2, period = 0.01, step = 0.0025;

Loop closed_loop(const SteeredTask& task, bool paid) {
  const auto model = std::make_shared<mechanics::MechanicalModel>(chain("revolute", 2, 0));
  WholeBodyDesign d;
  d.name = "law";
  d.tasks = {task};
  d.period = period;
  for (const char* joint : {"joint0", "joint1"}) d.limits.push_back({.joint = joint, .torque = 20});
  if (paid) d.reserve = phs::tank_reserve(least, most);
  Loop loop;
  loop.law = std::make_shared<const WholeBodyLaw>(model, d);
  phs::Network n("loop");
  n.add("arm", model).main("arm").potential("wall", "arm.joint0", phs::spring(30));
  n.potential("soft", "arm.joint1", phs::spring(5, 1));
  n.tank("tank", {least, most});
  std::vector<std::string> ports;
  for (const auto& port : loop.law->motors()) ports.push_back("arm." + port);
  n.control("law", ports, loop.law, period, paid ? "tank" : "");
  loop.network = n.build();
  return loop;
}

struct Outcome {
  double gained = -HUGE_VAL;     ///< by arm and springs since the start, the most [J]
  double rise = 0, balance = 0;  ///< of H in a step, of H against the ledger [J]
  double booked = 0;             ///< the tank's loss in a period against Σ τ Δq [J]
  double low = HUGE_VAL;         ///< of the tank [J]
  std::vector<std::string> stories;
};

/// The mechanism's numbers are x[0] to x[3], the tank's is x[4].
Outcome run(const Loop& loop, double duration) {
  const auto& m = *loop.network;
  const auto integrator = integrators::make_integrator("gauss8", m, step);
  const auto system = m.instantiate<double>();
  phs::State s(m.description(), {0.3, 0.9, 0, 0, 1.2});
  const double first = system->hamiltonian(s.x);
  const auto& powers = m.description().powers;
  double before = first, supplied = 0, level = s.x[4];
  Vec q{s.x[0], s.x[1]};
  Outcome o;
  for (int i = 1; i <= std::lround(duration / step); ++i) {
    if (integrator->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
    const double now = system->hamiltonian(s.x);
    for (size_t a = 0; a < powers.size(); ++a)
      if (powers[a].kind != phs::PowerKind::observed)
        supplied +=
            (powers[a].kind == phs::PowerKind::supplied ? 1 : -1) * integrator->port_work()[a];
    o.rise = std::max(o.rise, now - before);
    o.balance = std::max(o.balance, std::fabs(now - first - supplied));
    o.low = std::min(o.low, s.x[4]);
    o.gained = std::max(o.gained, now - s.x[4] - (first - 1.2));
    before = now;
    if (i % 4) continue;
    const Vec held = integrator->sampler().memory();
    const double work = held[0] * (s.x[0] - q[0]) + held[1] * (s.x[1] - q[1]);
    const bool full = std::min(level, s.x[4]) >= phs::tank_reserve(least, most) &&
                      std::max(level, s.x[4]) <= most - phs::tank_margin * (most - least);
    if (full) o.booked = std::max(o.booked, std::fabs(level - s.x[4] - work));
    level = s.x[4];
    q = {s.x[0], s.x[1]};
  }
  const Vec memory = integrator->sampler().memory();
  o.stories = loop.law->stories(std::span(memory).subspan(2));
  return o;
}

SteeredTask tip() {
  SteeredTask task;
  task.kind = SteeredTask::Kind::position;
  task.name = "tip";
  task.link = "link1";
  task.at = {0.5, 0, 0};
  task.axes = {true, true, false};
  task.bandwidth = 3;
  for (size_t k = 0; k < 3; ++k) task.target[k] = phs::steady_motion(k == 0 ? 0.6 : 0.5, 0);
  return task;
}

void expect_passive(const SteeredTask& task) {
  const auto paid = run(closed_loop(task, true), 15), free = run(closed_loop(task, false), 3);
  std::printf("  arm and springs gain %.3f J, without a tank %.3f J; least level %.6f J\n",
              paid.gained, free.gained, paid.low);
  test::keeps("more than the tank held [J]", paid.gained - (1.2 - least), 0);
  test::breaks("without a tank [J]", free.gained, 1.5);
  test::keeps("rise of H with the tank in a step [J]", paid.rise, 1e-14);
  test::keeps("H against the ledger [J]", paid.balance, 1e-14);
  test::keeps("loss of the tank against torque times way [J]", paid.booked, 1e-14);
  test::keeps("below the reserve [J]", phs::tank_reserve(least, most) - paid.low, 0.05);
  ASSERT_FALSE(paid.stories.empty());
  EXPECT_NE(paid.stories[0].find("law: the tank held less than the tasks would have taken at "),
            std::string::npos)
      << paid.stories[0];
}

}  // namespace

TEST(WholeBodyTank, NegativeDampingMakesNoEnergy) {
  auto task = tip();
  task.damping_ratio = -0.3;
  expect_passive(task);
}

/// A spring whose rest swings shakes the arm.
TEST(WholeBodyTank, AMovingSpringMakesNoEnergy) {
  auto task = tip();
  task.damping_ratio = 0.05;
  task.target[0] = phs::swinging_motion(0.6, 0.2, 0.6, 0);
  expect_passive(task);
}

}  // namespace porthos::planning::whole_body_tank_test
