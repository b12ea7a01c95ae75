// No step allocates, whatever the system is put together from and whatever watches the run.
#include <gtest/gtest.h>

#include <atomic>

#include "contact/rigid.h"
#include "contact/sticking.h"
#include "contact/time_stepping.h"
#include "integrators/control/energy_monitor.h"
#include "phs/network/elements.h"
#include "phs/network/network.h"
#include "scene/run/watched_run.h"
#include "tests/contact/support.h"
#include "tests/space/support.h"
#include "tests/support/swinging_pendulum.h"
#include "tests/vsa/actuators.h"
#include "vsa/formula.h"

namespace porthos::test {
extern std::atomic<long> allocations;  // counted in allocation_test.cpp

namespace systems_allocation_test {
namespace {

using integrators::Integrator;
using integrators::make_integrator;
using integrators::Outcome;

/// After a few steps, in which buffers may grow, none.
void expect_none(const std::string& what, Integrator& method, phs::State s, int steps = 200) {
  for (int i = 0; i < 3; ++i) ASSERT_EQ(method.step(s), Outcome::ok) << what;
  const long before = allocations;
  bool ok = true;
  for (int i = 0; i < steps; ++i) ok = ok && method.step(s) == Outcome::ok;
  const long made = allocations - before;
  EXPECT_TRUE(ok) << what;
  EXPECT_EQ(made, 0) << what << ", in " << steps << " steps";
}

/// The double pendulum in a network: friction, a source, and a controller at the elbow, sampled or
/// not.
std::shared_ptr<const phs::NetworkModel> controlled(double period) {
  const auto robot = swinging_pendulum(0.05);
  phs::Network n("controlled");
  n.add("arm", robot.model).main("arm");
  const auto& ports = robot.model->description().ports;
  const std::string first = "arm." + ports[0].name, second = "arm." + ports[1].name;
  n.resist(
      "friction", first,
      phs::friction(
          {.coulomb = 0.1, .breakaway = 0.2, .stribeck = 0.1, .viscous = 0.05, .smoothing = 0.05}));
  n.source("push", first, phs::function([](auto t) { return decltype(t)(0.3) * phs::sin(t); }));
  n.control("servo", second, phs::law([](auto, auto x, auto y, auto u) {
              using T = typename decltype(u)::value_type;
              u[0] = -T(2.0) * x[1] - T(0.4) * y[0];
            }),
            {period});
  return n.build();
}

TEST(Allocation, NoneInASwingUpThatHandsOverToARegulator) {
  const auto s = scene::read_scene(PORTHOS_SOURCE_DIR "/examples/acrobot_swing_up/scene.toml");
  const auto a = scene::assemble(s);
  const auto method = make_integrator("gauss8", *a.model, s.step);
  expect_none("acrobot", *method, a.initial, 5000);  // the handover is in step 4395
}

TEST(Allocation, NoneUnderLawsOfWholeArms) {  // a tank; accelerations and jerks in duals
  for (const char* example : {"hand_and_posture", "esp_arm"})
    for (const auto solver :
         {integrators::Solver::automatic, integrators::Solver::newton_articulated}) {
      const auto s =
          scene::read_scene(std::string(PORTHOS_SOURCE_DIR "/examples/") + example + "/scene.toml");
      const auto a = scene::assemble(s);
      integrators::Options o;
      o.solver = solver;
      const auto method = make_integrator("gauss8", *a.model, s.step, o);
      expect_none(example, *method, a.initial);
      if (solver == integrators::Solver::newton_articulated) {
        EXPECT_GT(method->cost().factorisations, 0) << example;
      }
    }
}

TEST(Allocation, NoneInAStepOfANetwork) {
  for (const double period : {0.0, 0.1})
    for (const char* name : {"gauss8", "rk4", "gonzalez", "midpoint"}) {
      const auto model = controlled(period);
      phs::State s(model->description(), {2.0, -0.4, 1.1, 0.5});
      const auto method = make_integrator(name, *model, 0.02);
      expect_none(std::string(name) + (period > 0 ? ", sampled" : ", continuous"), *method, s);
    }
}

// Its own solver too: of the arm, the friction and the continuous controller together.
TEST(Allocation, NoneInANewtonStepOfANetwork) {
  integrators::Options o;
  o.solver = integrators::Solver::newton_articulated;
  for (const char* name : {"gauss8", "gonzalez"}) {
    const auto model = controlled(0);
    phs::State s(model->description(), {2.0, -0.4, 1.1, 0.5});
    const auto method = make_integrator(name, *model, 0.05, o);
    expect_none(std::string(name) + " by Newton", *method, s);
    EXPECT_GT(method->cost().factorisations, 0) << name;
  }
}

TEST(Allocation, NoneInAStepUnderAMonitor) {
  using integrators::MonitorOptions;
  using integrators::OnViolation;
  const auto robot = swinging_pendulum(0.05);
  const auto sampled = controlled(0.1);
  const std::pair<const char*, MonitorOptions> watches[] = {
      {"quiet", {.limit = 1, .step_limit = 1}},
      {"stops", {.limit = 1, .step_limit = 1, .action = OnViolation::stop}},
      {"repeats", {.step_limit = 1, .action = OnViolation::repeat}},
      {"projects", {.project = true}}};
  for (const auto& [what, options] : watches)
    for (const char* name : {"gauss8", "rk4", "radau15"})
      for (const phs::Model* model : std::initializer_list<const phs::Model*>{
               robot.model.get(), static_cast<const phs::Model*>(sampled.get())}) {
        if (model == sampled.get() && options.project) continue;
        const auto d = integrators::declaration_of(name);
        if (options.action == OnViolation::repeat && d.order == 0) continue;
        integrators::EnergyMonitor method(make_integrator(name, *model, 0.02), *model, 0.02,
                                          options);
        phs::State s(model->description(), {2.0, -0.4, 1.1, 0.5});
        expect_none(std::string(name) + ", " + what, method, s);
      }
}

// The loop of every run: ledger, looks between records, an event that is waited for, a monitor.
// Control: a record allocates where its sink does.
TEST(Allocation, NoneInAWatchedStep) {
  const auto robot = swinging_pendulum(0.05);
  const std::vector<double> x{2.0, -0.4, 1.1, 0.5};
  const auto a = scene::assembly_of(robot.model, x);
  scene::Scene plain;
  plain.method = "gauss8";
  plain.step = 0.02;
  plain.duration = 100;
  plain.record_every = 50;
  scene::Scene monitored = plain, controlled_steps = plain;
  monitored.monitor = integrators::MonitorOptions{.step_limit = 1};
  controlled_steps.step_control = integrators::StepControl::reversible;
  const integrators::Event never{[](double, std::span<const double>) { return -1.0; },
                                 integrators::Crossing::rising};
  const auto made_by = [&](const scene::Scene& s, std::vector<integrators::Event> until,
                           scene::RecordSink sink) {
    scene::WatchedRun run(s, a, std::move(until), std::move(sink));
    run.begin();
    for (int i = 0; i < 40; ++i) run.step();
    const long before = allocations;
    for (int i = 0; i < 200; ++i) run.step();
    const long made = allocations - before;
    EXPECT_TRUE(run.goes_on());
    return made;
  };
  EXPECT_EQ(made_by(plain, {}, {}), 0);
  EXPECT_EQ(made_by(plain, {never}, {}), 0);
  EXPECT_EQ(made_by(monitored, {never}, {}), 0);
  EXPECT_EQ(made_by(controlled_steps, {}, {}), 0);
  scene::Scene often = plain;
  often.record_every = 0.2;
  std::vector<std::vector<double>> kept;
  EXPECT_GT(made_by(often, {}, [&](auto row) { kept.emplace_back(row.begin(), row.end()); }), 0);
}

TEST(Allocation, NoneInAStepOfAnActuatedJoint) {
  const auto link = pendulum(0.5, 2);
  vsa::Actuator act;
  act.elastic = vsa::formula({"k/b^2*(cosh(b*phi) - 1) + phi^4", {{"k", 100}, {"b", 2}}});
  act.theta = {.kind = vsa::Drive::Kind::torque, .inertia = 0.1, .viscous = 0.5};
  act.theta.command = phs::function([](auto t) { return decltype(t)(0.3) * phs::sin(t); });
  phs::Network n("actuated");
  n.add("arm", link).main("arm");
  vsa::attach(n, "drive", "arm." + link->description().ports[0].name, act);
  const auto model = n.build();
  std::vector<double> x(size_t(model->description().nx), 0.0);
  for (const char* name : {"gauss8", "rk4"}) {
    const auto method = make_integrator(name, *model, 0.01);
    expect_none(name, *method, phs::State(model->description(), x));
  }
}

TEST(Allocation, NoneInAStepOfPartsAndInOrbit) {
  const auto arm = ets_vii(0.3);
  space::Thruster jet;
  jet.name = "jet";
  jet.link = arm.model->mechanism().bodies().front().name;
  jet.thrust = 1;
  const space::Parts parts{.thrusters = {jet}};
  const space::PartsModel pushed(arm.model, parts);
  const auto free = make_integrator("gauss8", pushed, 0.1);
  expect_none("parts", *free, phs::State(pushed.description(), arm.start.x));

  space::Environment env;
  env.planet.J[0] = 1.08e-3;
  env.planet.rotation_rate = 7.29e-5;
  env.atmosphere = space::Atmosphere{1e-12, 400e3, 60e3, 10};
  space::Plate plate;
  plate.link = jet.link;
  plate.area = 2;
  plate.normal = {1, 0, 0};
  plate.drag = 2.2;
  env.plates = {plate};
  const space::Spacecraft craft(arm.model, arm.model, env, parts);
  const auto start = space::from_elements(env.planet.mu, 6928e3, 0.001, 0.6, 0.3, 0.2, 0);
  for (const char* splitting : {"lobatto4", "lobatto8c"}) {
    space::SplitIntegrator method(craft, 2, {.splitting = splitting});
    expect_none(splitting, method,
                phs::State(craft.description(), craft.state(arm.start.x, start)));
  }
}

/// A tilted block above the ground.
struct FallingBlock {
  std::shared_ptr<const mechanics::MechanicalModel> body =
      mechanism_of({body_on("body", "free", 1)}, 9.8125);
  ContactModel model;
  Numbers start = body->state(Numbers{0, 0, 0.4, 0.6, 0.8, 0, 0}, Numbers(6, 0.3));

  explicit FallingBlock(const Law& law)
      : model(body, body, {{"ground", {{"body", shape()}}, {{"world", ground()}}, law}}) {}
  static Shape shape() {
    Shape block;
    block.kind = Kind::box;
    block.half = {0.2, 0.3, 0.15};
    return block;
  }
};

/// A block that falls on the ground and tips, in steps of several parts.
TEST(Allocation, NoneWhereBodiesTouch) {
  Law law = power_law(5e3, 1, 0.2);
  law.friction = 0.3;
  law.creep = 0.1;
  const FallingBlock fall(law);
  const ContactModel& model = fall.model;
  ContactRun run(model, fall.start, 1e-3);
  expect_none("contact", *run.method, run.state, 600);
}

/// The same block with a rigid law: impacts, then rest on an edge and on a face.
TEST(Allocation, NoneAtImpacts) {
  Law law;
  law.form = Law::Form::rigid;
  law.restitution = 0.5;
  const FallingBlock fall(law);
  const ContactModel& model = fall.model;
  const auto method = contact::with_rigid_contacts(model, model, 1e-3, [](const phs::Model& run) {
    return integrators::make_integrator("gauss16", run, 1e-3);
  });
  phs::State state(model.description(), fall.start);
  expect_none("rigid contact", *method, state, 600);
}

/// The same block by time stepping, with friction: it tumbles, rubs and comes to rest on a face.
/// Room for contacts grows with the most there were.
TEST(Allocation, NoneByTimeStepping) {
  Law law;
  law.form = Law::Form::rigid;
  law.restitution = 0.5;
  law.friction = 0.4;
  const FallingBlock fall(law);
  const ContactModel& model = fall.model;
  const auto method = contact::with_time_stepping(model, model, 1e-3);
  const phs::State start(model.description(), fall.start);
  for (auto [state, k] = std::pair(start, 0); k < 2000; ++k)
    ASSERT_EQ(method->step(state), Outcome::ok) << method->remark();
  expect_none("time stepping", *method, start, 2000);
}

/// A ball with friction: it bounces with spin, slides, and rolls.
TEST(Allocation, NoneWhereBallsSlideAndRoll) {
  const auto body = mechanism_of({body_on("body", "free", 1)}, 9.8125);
  Law law;
  law.form = Law::Form::rigid;
  law.restitution = 0.3;
  law.friction = 0.2;
  const ContactModel model(body, body,
                           {{"ground", {{"body", ball(0.25)}}, {{"world", ground()}}, law}});
  const auto method = contact::with_rigid_contacts(model, model, 1e-3, [](const phs::Model& run) {
    return integrators::make_integrator("gauss16", run, 1e-3);
  });
  phs::State state(model.description(),
                   body->state(Numbers{0, 0, 0.27, 1, 0, 0, 0}, Numbers{0.3, 2, 0.5, 0.1, 0.2, 0}));
  expect_none("rigid friction", *method, state, 1500);
}

/// An arm whose joints slide, stop and stick.
TEST(Allocation, NoneWhereJointsStick) {
  const auto arm = two_links(9.8125);
  const ContactModel model(
      arm, arm, {}, {}, {{"shoulder", "upper", 4, 5, 0, 0.2}, {"elbow", "lower", 2, 2.5, 0.3, 0}});
  const auto method = contact::with_dry_friction(model, model, 0.01, [](const phs::Model& run) {
    return integrators::make_integrator("gauss16", run, 0.01);
  });
  phs::State state(model.description(), arm->state(Numbers{1.2, 0.8}, Numbers{0, 0}));
  expect_none("dry friction", *method, state, 600);
}

}  // namespace
}  // namespace systems_allocation_test
}  // namespace porthos::test
