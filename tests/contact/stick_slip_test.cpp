// Dry friction that sticks: instants, angles at rest, losses, against closed forms.
#include "contact/detail/stick_slip.h"

#include <random>

#include "contact/sticking.h"
#include "phs/network/network.h"
#include "tests/contact/support.h"
#include "tests/support/reference.h"

namespace porthos::contact::stick_slip_test {
namespace {

using namespace test;

constexpr double g = 9.8125;

/// A run whose steps end where joints stop or break away.
struct DryRun {
  std::shared_ptr<const phs::Model> whole;
  std::unique_ptr<integrators::Integrator> method;
  phs::State state;
  Gauge gauge;
  std::vector<integrators::Jump> jumps = {};
  Numbers works;
  long double H0 = 0;
  double least_loss = 0;  ///< of a step

  DryRun(std::shared_ptr<const phs::Model> model, const ContactModel& contacts, const Numbers& x,
         double h, const char* name = "gauss16")
      : whole(std::move(model)),
        method(with_dry_friction(
            *whole, contacts, h,
            [&](const phs::Model& run) { return integrators::make_integrator(name, run, h); })),
        state(whole->description(), x),
        gauge(*whole),
        works(whole->description().powers.size()) {
    H0 = gauge.energy(state);
  }
  bool step() {
    if (method->step(state) != Outcome::ok) return false;
    for (const auto& j : method->jumps()) jumps.push_back(j);
    const auto& powers = whole->description().powers;
    for (size_t a = 0; a < works.size(); ++a) {
      works[a] += method->port_work()[a];
      if (powers[a].kind == phs::PowerKind::dissipated)
        least_loss = std::min(least_loss, method->port_work()[a]);
    }
    return true;
  }
  double work(const std::string& name) const {
    const auto& powers = whole->description().powers;
    for (size_t a = 0; a < works.size(); ++a)
      if (powers[a].name == name) return works[a];
    ADD_FAILURE() << name;
    return NAN;
  }
  double defect() {
    long double d = gauge.energy(state) - H0;
    const auto& powers = whole->description().powers;
    for (size_t a = 0; a < works.size(); ++a)
      if (powers[a].kind != phs::PowerKind::observed)
        d += powers[a].kind == phs::PowerKind::supplied ? -works[a] : works[a];
    return double(d);
  }
};

/// A block of 1 kg on a rail along `axis`, pulled by k(rest - x) and by f(t), with dry friction.
struct Block {
  std::shared_ptr<const mechanics::MechanicalModel> mass;
  std::shared_ptr<const ContactModel> contacts;
  std::shared_ptr<const phs::Model> whole;

  Block(const DryFriction& law, double stiffness, phs::FunctionPtr force,
        const Vec3d& axis = {1, 0, 0}, double gravity = 0) {
    auto spec = body_on("block", "prismatic", 1);
    spec.joint.axis = axis;
    spec.joint.stiffness = stiffness;
    mass = mechanism_of({spec}, gravity);
    contacts = std::make_shared<ContactModel>(mass, mass, std::vector<Contact>{},
                                              std::vector<Stop>{}, std::vector<DryFriction>{law});
    whole = contacts;
    if (!force) return;
    phs::Network n("pulled");
    n.add("mechanism", contacts).main("mechanism");
    n.source("pull", "mechanism.block.force", force);
    whole = n.build();
  }
  DryRun run(double x, double v, double h, const char* method = "gauss16") const {
    return DryRun(whole, *contacts, mass->state(Numbers{x}, Numbers{v}), h, method);
  }
};
DryFriction friction_of(double coulomb, double breakaway = 0, double stribeck = 0,
                        double viscous = 0) {
  return {"dry", "block", coulomb, breakaway, stribeck, viscous};
}

/// w = a + W λ of every solution, for random problems of up to 5 joints.
TEST(StickSlip, SolvesTheProblemWithBounds) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  StickSlip solver(5);
  double worst = 0;
  size_t bound = 0, all = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const size_t m = 1 + size_t(trial) % 5;
    Numbers B(m * m), W(m * m, 0.0), a(m), L(m);
    for (auto& b : B) b = normal(random);
    for (size_t i = 0; i < m; ++i) {
      a[i] = 3 * normal(random);
      L[i] = std::fabs(normal(random));
      for (size_t j = 0; j < m; ++j) {
        for (size_t k = 0; k < m; ++k) W[i * m + j] += B[i * m + k] * B[j * m + k];
        if (i == j) W[i * m + j] += 0.1;
      }
    }
    const auto lambda = solver.solve(W, a, L);
    for (size_t i = 0; i < m; ++i) {
      double w = a[i], scale = std::fabs(a[i]);
      for (size_t j = 0; j < m; ++j) {
        w += W[i * m + j] * lambda[j];
        scale += std::fabs(W[i * m + j] * lambda[j]);
      }
      ++all;
      bound += solver.bound(i) != 0;
      ASSERT_LE(std::fabs(lambda[i]), L[i]);
      const double off = solver.bound(i) == 0 ? std::fabs(w) : std::max(0.0, w * solver.bound(i));
      worst = std::max(worst, off / scale);
    }
  }
  std::printf("  %zu of %zu joints slide; w off by %.1e of its terms   bound 1e-12\n", bound, all,
              worst);
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(bound, all / 10);
  EXPECT_LT(bound, all * 9 / 10);
}

/// Joints that need exactly their bounds, up to rounding: the pivots end.
TEST(StickSlip, EndsWhereFrictionIsJustEnough) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(0.1, 1);
  StickSlip solver(3);
  size_t bound = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double c = uniform(random);
    const Numbers W{2 + c, c, -c, c, 2, 0.5, -c, 0.5, 3}, L{c, uniform(random), uniform(random)};
    Numbers a(3, 0.0);
    for (size_t i = 0; i < 3; ++i)
      for (size_t j = 0; j < 3; ++j) a[i] -= W[3 * i + j] * L[j];
    const auto lambda = solver.solve(W, a, L);
    for (size_t i = 0; i < 3; ++i) {
      ASSERT_NEAR(lambda[i], L[i], 1e-13);
      bound += solver.bound(i) != 0;
    }
  }
  std::printf("  %zu of 60000 at their bounds\n", bound);
}

/// A block sent along a floor, and up an incline that holds it: it stops where and when mu says,
/// and then does not move by a bit. Up an incline that does not hold it, it slides back.
TEST(DryFriction, BlocksStopWhereMuSays) {
  const auto reference = read_json(data_file("reference/q_stick_slip.json"));
  const auto sent = [](double coulomb, double breakaway, double load, double until, double h) {
    const Block block(friction_of(coulomb, breakaway), 0, phs::constant(load));
    DryRun run = block.run(0, 4, h);
    while (run.state.step * h < until && run.step()) {
    }
    return run;
  };
  const double along = g * 0.6, across = g * 0.8, h = 1.0 / 32;  // tan α = 3/4
  double defect = 0;
  {
    const auto& r = reference["block_flat"];
    DryRun run = sent(0.5 * g, 0, 0, 3, h);
    std::printf("  flat: x off by %.1e m   bound 1e-14, loss by %.1e J\n",
                run.state.x[0] - number(r["distance"]),
                run.work("dry") - number(r["dissipated_per_kg"]));
    EXPECT_NEAR(run.state.x[0], number(r["distance"]), 1e-14);
    EXPECT_NEAR(run.work("dry"), number(r["dissipated_per_kg"]), 1e-13);
    EXPECT_EQ(run.state.x[1] + run.state.lo[1], 0);
    EXPECT_GE(run.least_loss, 0);
    defect = std::max(defect, std::fabs(run.defect()));
  }
  {
    const auto& r = reference["block_up_sticks"];
    DryRun run = sent(0.5 * across, 0.875 * across, -along, 1, h);
    const double x = run.state.x[0], lo = run.state.lo[0];
    while (run.state.step < 32 * 100) ASSERT_TRUE(run.step());
    std::printf("  up: x off by %.1e m   bound 1e-14; moved in 99 s by %.1e m   bound 0\n",
                x - number(r["distance"]), (run.state.x[0] - x) + (run.state.lo[0] - lo));
    EXPECT_NEAR(x, number(r["distance"]), 1e-14);
    EXPECT_EQ(run.state.x[0], x);
    EXPECT_EQ(run.state.lo[0], lo);
    EXPECT_EQ(run.state.x[1] + run.state.lo[1], 0);
    EXPECT_EQ(run.jumps.size(), 0u);
    defect = std::max(defect, std::fabs(run.defect()));
  }
  {
    const auto& r = reference["block_up_slides_back"];
    DryRun run = sent(0.5 * across, 0.625 * across, -along, 1.25, h);
    ASSERT_EQ(run.jumps.size(), 1u);
    const double back = run.state.step * h - number(r["t_stop"]);
    const double x = number(reference["block_up_sticks"]["distance"]) - 0.5 * 1.9625 * back * back;
    std::printf("  back: slides at %.1e s   bound 1e-14, x off by %.1e m   bound 1e-14\n",
                run.jumps[0].t - number(r["t_stop"]), run.state.x[0] - x);
    EXPECT_NEAR(run.jumps[0].t, number(r["t_stop"]), 1e-14);
    EXPECT_NEAR(run.state.x[0], x, 1e-14);
    defect = std::max(defect, std::fabs(run.defect()));
  }
  std::printf("  ledger off by %.1e J   bound 1e-13\n", defect);
  EXPECT_LE(defect, 1e-13);
}

/// The oscillator on a belt, seen from the belt: m y'' + k (y + v t) = friction.
TEST(DryFriction, StickSlipOscillator) {
  const auto reference = read_json(data_file("reference/q_stick_slip.json"));
  const Block block(friction_of(2, 3), 4, phs::function([](auto t) {
                      return decltype(t)(-2.0) * t;  // -k v_b
                    }));
  DryRun run = block.run(0, 0, 1.0 / 32);
  double defect = 0;
  while (run.state.step < 32 * 28) {
    ASSERT_TRUE(run.step());
    defect = std::max(defect, std::fabs(run.defect()));
  }
  double time = 0, period = 0;
  ASSERT_EQ(run.jumps.size(), reference["events"].size());
  for (size_t k = 0; k < run.jumps.size(); ++k) {
    time =
        std::max(time, std::fabs(run.jumps[k].t - number(reference["events"][k]["slip_starts"])));
    if (k > 0)
      period = std::max(
          period, std::fabs(run.jumps[k].t - run.jumps[k - 1].t - number(reference["period"])));
  }
  std::printf(
      "  %zu slips: times off by %.1e s   bound 1e-12, period by %.1e s   bound 1e-12; ledger %.1e "
      "J   bound 1e-12\n",
      run.jumps.size(), time, period, defect);
  EXPECT_LE(time, 1e-12);
  EXPECT_LE(period, 1e-12);
  EXPECT_LE(defect, 1e-12);
  EXPECT_GE(run.least_loss, 0);
}

/// A block that sticks and slides by a smooth load, with a Stribeck curve whose breakaway is
/// smooth: the order of the method over all that.
TEST(DryFriction, MethodsKeepTheirOrder) {
  const auto load = phs::function([](auto t) {
    using T = decltype(t);
    return T(2.5) * sin(T(1.25) * t);
  });
  const Block block(friction_of(1, 1.5, 0.5, 0.1), 4, load);
  const auto at_end = [&](const char* method, double h) {
    DryRun run = block.run(0, 0, h, method);
    while (run.state.step * h < 12) {
      if (run.step()) continue;
      ADD_FAILURE() << method << ' ' << h;
      break;
    }
    return std::pair{run.state.x[0] + run.state.lo[0], run.jumps.size()};
  };
  const auto [exact, slips] = at_end("gauss16", 1.0 / 64);
  const double known = std::fabs(exact - at_end("gauss16", 1.0 / 100).first);
  std::printf("  %zu slips; the reference is known to %.1e m\n", slips, known);
  EXPECT_GE(slips, 3u);
  EXPECT_LE(known, 1e-15);
  expect_orders(
      {{"midpoint", 2, 1.0 / 8, 4}, {"gauss4", 4, 1.0 / 8, 4}, {"gauss6", 6, 1.0 / 4, 5}},
      [&, end = exact](const char* method, double h) { return at_end(method, h).first - end; });
}

/// An arm of two links with dry joints. The elbow is bent and holds; the shoulder swings, stops,
/// and in the end both stick, at angles that gravity alone would not allow.
struct Arm {
  std::shared_ptr<const mechanics::MechanicalModel> links;
  std::shared_ptr<const ContactModel> contacts;

  explicit Arm(const std::vector<DryFriction>& dry) {
    links = two_links(g);
    contacts = std::make_shared<ContactModel>(links, links, std::vector<Contact>{},
                                              std::vector<Stop>{}, dry);
  }
  DryRun run(const Numbers& q, const Numbers& v, double h) const {
    return DryRun(contacts, *contacts, links->state(q, v), h);
  }
};

TEST(DryFriction, AnArmComesToRestAndHolds) {
  const Arm arm({{"shoulder", "upper", 4, 5, 0, 0.2}, {"elbow", "lower", 2, 2.5, 0.3, 0}});
  const double h = 1.0 / 64;
  DryRun run = arm.run({1.2, 0.8}, {0, 0}, h);
  double defect = 0;
  while (run.state.step < 64 * 10) {
    ASSERT_TRUE(run.step());
    defect = std::max(defect, std::fabs(run.defect()));
  }
  const Numbers rest = run.state.x;
  while (run.state.step < 64 * 60) ASSERT_TRUE(run.step());
  std::printf(
      "  %zu slips; rests at %.4f and %.4f rad; moved in 50 s by %.1e rad   bound 0; ledger %.1e J "
      "  bound 1e-12; losses %.3f and %.3f J\n",
      run.jumps.size(), rest[0], rest[1], run.state.x[0] - rest[0], defect, run.work("shoulder"),
      run.work("elbow"));
  EXPECT_EQ(run.state.x[0], rest[0]);
  EXPECT_EQ(run.state.x[1], rest[1]);
  EXPECT_LE(std::max(std::fabs(run.state.x[2]), std::fabs(run.state.x[3])), 1e-15);
  EXPECT_GT(std::fabs(rest[0]), 0.01);
  EXPECT_LE(defect, 1e-12);
  EXPECT_GE(run.least_loss, 0);
}

/// Both joints at rest, under gravity torques just below and just above what each can hold, by
/// statics. An arm whose shoulder slides falls with its elbow, which then bears less and holds.
TEST(DryFriction, SeveralJointsStickAtOnce) {
  const double q0 = 0.9, q1 = 0.4, upper = 2, lower = 1;
  const double at_elbow = lower * g * 0.5 * std::sin(q0 + q1),
               at_shoulder = upper * g * 0.5 * std::sin(q0) + lower * g * std::sin(q0) + at_elbow;
  for (const double shoulder : {1 - 1e-9, 1 + 1e-9})
    for (const double elbow : {1 - 1e-9, 1 + 1e-9}) {
      const Arm arm({{"shoulder", "upper", 1, at_shoulder * shoulder, 0, 0},
                     {"elbow", "lower", 1, at_elbow * elbow, 0, 0}});
      DryRun run = arm.run({q0, q1}, {0, 0}, 1.0 / 64);
      ASSERT_TRUE(run.step());
      const bool moves_0 = run.state.x[0] != q0, moves_1 = run.state.x[1] != q1;
      std::printf("  holds %+.0e, %+.0e: the shoulder %s, the elbow %s\n", shoulder - 1, elbow - 1,
                  moves_0 ? "slides" : "sticks", moves_1 ? "slides" : "sticks");
      EXPECT_EQ(moves_0, shoulder < 1);
      EXPECT_EQ(moves_1, elbow < 1 && shoulder > 1);
    }
}

/// Arms with all kinds of friction, breakaway equal to sliding friction among them, shaken at up to
/// 4 Hz: no run fails, no step gains energy by friction, and the ledger closes.
TEST(DryFriction, ShakenArmsOnlyLose) {
  std::mt19937_64 random(21);
  const auto between = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto law = [&](const char* name, const char* joint, int kind) {
    const double coulomb = between(0.2, 4);
    const double breakaway = kind % 3 == 0 ? coulomb : coulomb * between(1.01, 2);
    const double stribeck = kind % 3 == 1 ? between(0.05, 1) : 0;
    return DryFriction{name, joint, coulomb, breakaway, stribeck, kind % 2 == 0 ? 0 : 0.1};
  };
  double defect = 0, least = 0;
  size_t slips = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Arm arm({law("shoulder", "upper", trial), law("elbow", "lower", trial / 3)});
    phs::Network n("shaken");
    n.add("mechanism", arm.contacts).main("mechanism");
    n.source("shake", "mechanism.upper.torque", phs::sine(between(0, 10), between(0.5, 4)));
    n.source("twist", "mechanism.lower.torque", phs::sine(between(0, 5), between(0.5, 4)));
    const double h = 1.0 / 64;
    DryRun run(n.build(), *arm.contacts,
               arm.links->state(Numbers{between(-1, 1), between(-1, 1)}, Numbers{0, 0}), h);
    while (run.state.step * h < 5) ASSERT_TRUE(run.step()) << trial << " at " << run.state.step * h;
    defect = std::max(defect, std::fabs(run.defect()));
    least = std::min(least, run.least_loss);
    slips += run.jumps.size();
  }
  std::printf(
      "  200 arms, %zu slips; ledgers off by %.1e J   bound 1e-9; least loss of a step %.1e J   "
      "bound 0\n",
      slips, defect, least);
  EXPECT_LE(defect, 1e-9);
  EXPECT_GE(least, 0);
}

/// Control: the smooth law creeps down an incline that the dry one holds without moving.
TEST(DryFriction, TheSmoothLawCreeps) {
  const Block held(friction_of(0.9), 0, phs::constant(-0.5));
  DryRun run = held.run(0, 0, 1.0 / 32);
  while (run.state.step < 32 * 10) ASSERT_TRUE(run.step());
  phs::Network n("creeps");
  n.add("mechanism", held.mass).main("mechanism");
  n.source("pull", "mechanism.block.force", phs::constant(-0.5));
  n.resist("smooth", "mechanism.block.force", phs::friction({.coulomb = 0.9, .smoothing = 1e-3}));
  const auto smooth = n.build();
  const auto method = integrators::make_integrator("gauss16", *smooth, 1.0 / 1024);
  phs::State s(smooth->description(), held.mass->state(Numbers{0}, Numbers{0}));
  while (s.step < 1024 * 10) ASSERT_EQ(method->step(s), Outcome::ok);
  std::printf("  dry moved by %.1e m   bound 0, smooth by %.1e m\n", run.state.x[0], s.x[0]);
  EXPECT_EQ(run.state.x[0], 0);
  EXPECT_LT(s.x[0], -1e-3);
}

/// R(x) has the friction as its secant, F/v: finite however slow the joint is, and none at rest.
TEST(DryFriction, TheSecantIsFinite) {
  const Block block(friction_of(2), 0, nullptr);
  const auto system = block.whole->instantiate<double>();
  const Numbers e{0, 3};
  for (const auto& [rate, R] : {std::pair{-1e-3, 2e3}, {1e-29, 2e29}, {5e-324, 0.0}, {0.0, 0.0}}) {
    Numbers Re(2);
    system->apply_dissipation(Numbers{0, rate}, e, Re);
    EXPECT_DOUBLE_EQ(Re[1], R * e[1]) << rate;
  }
}

/// A method alone has no sign for the friction; wrong numbers are told.
TEST(DryFriction, IsRefusedInASentence) {
  const auto refusal = [](const auto& f) -> std::string {
    try {
      f();
    } catch (const InvalidArgument& why) {
      return why.what();
    }
    return "none";
  };
  const Block block(friction_of(1), 0, nullptr);
  EXPECT_EQ(refusal([&] { integrators::make_integrator("gauss16", *block.whole, 0.1); }),
            "'bodies' sticks and slides by the dry friction 'dry': expected a run of a scene, or "
            "contact::with_dry_friction()");
  const auto of = [&](const DryFriction& law) { return refusal([&] { Block(law, 0, nullptr); }); };
  EXPECT_EQ(of(friction_of(0)), "dry friction 'dry': coulomb is 0, expected a force above 0");
  EXPECT_EQ(of(friction_of(2, 1)),
            "dry friction 'dry': breakaway is 1, expected coulomb, 2, or more");
  EXPECT_EQ(of(friction_of(2, 0, 0.1)),
            "dry friction 'dry': stribeck is 0.1, expected none without a breakaway above coulomb");
  EXPECT_EQ(of(friction_of(2, 3, -1)),
            "dry friction 'dry': stribeck is -1, expected a rate of 0 or more");
  EXPECT_EQ(of(friction_of(2, 3, 1, NAN)),
            "dry friction 'dry': viscous is nan, expected 0 or more");
  EXPECT_EQ(refusal([] {
              Arm({{"one", "upper", 1}, {"two", "upper", 1}});
            }),
            "dry friction 'two': joint 'upper' has dry friction already, expected it once");
  Law rigid;
  rigid.form = Law::Form::rigid;
  EXPECT_EQ(refusal([&] {
              ContactModel(block.mass, block.mass, {}, {{"stop", "block", -1, 1, rigid}},
                           {friction_of(1)});
            }),
            "dry friction 'dry': 'stop' is rigid, expected soft contacts and stops beside dry "
            "friction");
}

}  // namespace
}  // namespace porthos::contact::stick_slip_test
