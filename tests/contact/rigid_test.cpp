// Runs with rigid contacts against closed forms: instants, losses, the end of a sequence of
// bounces.
#include "contact/rigid.h"

#include "tests/contact/rigid_run.h"
#include "tests/support/reference.h"

namespace porthos::contact::rigid_test {
namespace {

using namespace test;

constexpr double g = 9.8125;

struct Compared {
  size_t count = 0;
  double time = 0, loss = 0;
};
/// The impacts of a run with those of a reference, which lists some of them.
Compared compared(const RigidRun& run, const nlohmann::json& impacts) {
  Compared c;
  for (const auto& impact : impacts) {
    const size_t k = impact["k"];
    if (k > run.jumps.size()) {
      ADD_FAILURE() << "no impact " << k;
      break;
    }
    double sum = 0;
    for (size_t i = 0; i < k; ++i) sum += run.jumps[i].loss;
    c.time = std::max(c.time, std::fabs(run.jumps[k - 1].t - number(impact["t"])));
    c.loss = std::max(c.loss, std::fabs(sum - number(impact["cumulative_loss"])));
    ++c.count;
  }
  return c;
}

/// A ball of 2 kg on a vertical rail above the plane z = 0.
struct Rail {
  std::shared_ptr<const mechanics::MechanicalModel> mass;
  ContactModel model;
  explicit Rail(double e)
      : mass(mechanism_of({body_on("ball", "prismatic", 2)}, g)),
        model(mass, mass,
              {{"ground", {{"ball", ball(0.25)}}, {{"world", ground()}}, rigid_law(e)}}) {}
  Numbers start(double height, double v) const {
    return mass->state(Numbers{0.25 + height}, Numbers{v});
  }
};

/// e = 3/4 from 1 m: every impact of the reference, its loss, the time at which the bounces end,
/// and rest afterwards.
TEST(Rigid, BouncesThatEnd) {
  const auto reference = read_json(data_file("reference/q_bouncing_ball.json"));
  const Rail rail(0.75);
  RigidRun run(rail.model, rail.start(1, 0), 1.0 / 32);
  double ledger = 0;
  while (run.state.step < 32 * 5) {
    ASSERT_TRUE(run.step());
    ledger = std::max(ledger, std::fabs(run.defect()) / (2 * g));
  }
  const auto [k, worst, loss] = compared(run, reference["impacts"]);
  const double last = run.jumps.back().t, end = number(reference["t_infinity"]);
  std::printf(
      "  %zu impacts; the %zu of the reference: times off by %.1e s   bound 1e-13, losses by %.1e "
      "J  "
      " bound 1e-13; the last %.1e s from the accumulation   bound 1e-6; ledger %.1e of m g h   "
      "bound 1e-15; at rest z = %.1e m, v = %.1e m/s\n",
      run.jumps.size(), k, worst, loss, end - last, ledger, run.state.x[0] - 0.25,
      run.state.x[1] / 2);
  EXPECT_LE(worst, 1e-13);
  EXPECT_LE(loss, 1e-13);
  EXPECT_LE(std::fabs(end - last), 1e-6);
  EXPECT_LE(ledger, 1e-15);
  EXPECT_NEAR(run.state.x[0], 0.25, 1e-15);
  EXPECT_NEAR(run.state.x[1], 0, 1e-15);
}

/// e = 1: ten thousand bounces at t1 (2 k - 1), no energy lost. The midpoint rule makes no error
/// in a uniform field, so it shows that of the impacts; the rounded coefficients of gauss16 make
/// one of the size of the step. Control: e = 1 - 1e-12.
TEST(Rigid, TenThousandElasticBounces) {
  struct Off {
    double time = 0, energy = 0;
  };
  const auto off = [](const char* method, double h, double e, size_t bounces) {
    const Rail rail(e);
    RigidRun run(rail.model, rail.start(1, 0), h, method);
    Off off;
    size_t seen = 0;
    while (seen < bounces && run.step())
      for (; seen < run.jumps.size(); ++seen) {
        const long double t = std::sqrt(2 / (long double)g) * (2 * (long double)seen + 1);
        off.time = std::max(off.time, double(std::fabs(run.jumps[seen].t - t) / t));
      }
    EXPECT_GE(seen, bounces);
    off.energy = std::fabs(run.defect()) / (2 * g);
    return off;
  };
  const Off midpoint = off("midpoint", 0.25, 1, 10000), gauss = off("gauss16", 1.0 / 32, 1, 10000),
            control = off("midpoint", 0.25, 1 - 1e-12, 1000);
  std::printf(
      "  10000 bounces: times off by %.1e (gauss16 %.1e) relative   bound 1e-13 (e = 1 - 1e-12, "
      "1000: "
      "%.1e); energy by %.1e of m g h   bound 1e-15 (gauss16 %.1e   bound 2e-13)\n",
      midpoint.time, gauss.time, control.time, midpoint.energy, gauss.energy);
  EXPECT_LE(std::max(midpoint.time, gauss.time), 1e-13);
  EXPECT_LE(midpoint.energy, 1e-15);
  EXPECT_LE(gauss.energy, 2e-13);
  EXPECT_GT(control.time, 1e-11);
}

/// A method without the jumps would fall through the ground.
TEST(Rigid, MethodsAloneRefuseIt) {
  const Rail rail(0.75);
  try {
    integrators::make_integrator("gauss16", rail.model, 0.1);
    ADD_FAILURE() << "no refusal";
  } catch (const InvalidArgument& why) {
    EXPECT_STREQ(why.what(),
                 "'bodies' jumps at the impacts of 'ground', which are rigid: expected a run of a "
                 "scene, or contact::with_rigid_contacts()");
  }
}

/// A pendulum that swings onto a stop: the reference's impacts.
TEST(Rigid, PendulumOnAStop) {
  const auto reference = read_json(data_file("reference/q_pendulum_stop.json"));
  auto spec = body_on("rod", "revolute", 1);
  spec.joint.axis = {0, -1, 0};
  spec.mass.com = {0, 0, -1};
  spec.mass.inertia = {};
  const auto rod = mechanism_of({spec}, g);
  const ContactModel model(rod, rod, {}, {{"stop", "rod", -0.25, HUGE_VAL, rigid_law(0.75)}});
  RigidRun run(model, rod->state(Numbers{1}, Numbers{0}), 1.0 / 32);
  double ledger = 0;
  while (run.state.step < 32 * 55) {
    ASSERT_TRUE(run.step());
    ledger = std::max(ledger, std::fabs(run.defect()) / g);
  }
  const auto [k, worst, loss] = compared(run, reference["impacts"]);
  std::printf(
      "  %zu impacts: times off by %.1e s   bound 1e-13, losses by %.1e J   bound 1e-13; ledger "
      "%.1e "
      "of m g L   bound 1e-15\n",
      k, worst, loss, ledger);
  EXPECT_LE(worst, 1e-13);
  EXPECT_LE(loss, 1e-13);
  EXPECT_LE(ledger, 1e-15);
}

/// A platform on a spring carries a ball upwards. The ball leaves it where both fall freely,
/// which is where the spring is not strained, and flies a parabola. Friction across the rails,
/// where nothing moves, changes nothing.
void open_contact(const Law& law) {
  auto platform = body_on("platform", "prismatic", 1), mass = body_on("ball", "prismatic", 2);
  platform.joint.stiffness = 400;
  const auto pair = mechanism_of({platform, mass}, g);
  const ContactModel model(pair, pair,
                           {{"seat", {{"ball", ball(0.25)}}, {{"platform", ground()}}, law}});
  // Together they swing about z0 = -(m1 + m2) g/k with ω² = k/(m1 + m2).
  const double z0 = -3 * g / 400, depth = 0.25, w = std::sqrt(400.0 / 3);
  RigidRun run(model, pair->state(Numbers{z0 - depth, 0.25 + z0 - depth}, Numbers{0, 0}),
               1.0 / 256);
  const double leaves = std::acos(z0 / depth) / w, speed = depth * w * std::sin(w * leaves);
  double gap_before = 0;
  while (run.state.step < 0.6 / (1.0 / 256)) {
    ASSERT_TRUE(run.step());
    const double t = double(run.state.step) / 256, gap = run.state.x[1] - 0.25 - run.state.x[0];
    if (t < leaves) gap_before = std::max(gap_before, std::fabs(gap));
    if (t > leaves && run.jumps.size() < 2 && t < leaves + 0.1) {
      const double s = t - leaves, z = 0.25 + speed * s - 0.5 * g * s * s;
      EXPECT_NEAR(run.state.x[1], z, 1e-12) << t;
    }
  }
  std::printf("  leaves at %.6f s; gap before %.1e m   bound 1e-15; energy off by %.1e J\n", leaves,
              gap_before, run.defect());
  EXPECT_LE(gap_before, 1e-15);
  EXPECT_LE(std::fabs(run.defect()), 1e-13);
}
TEST(Rigid, AContactOpensWhereItWouldPull) {
  open_contact(rigid_law(0));
  open_contact(rough_law(0, 0.5));
}

/// Three pendulums that touch: the first one's motion goes to the last, with a step that meets all
/// impacts at their instants. Energy is kept, and the middle one does not move.
TEST(Rigid, CradleOfThree) {
  std::vector<mechanics::BodySpec> bodies;
  for (int i = 0; i < 3; ++i) {
    static const char* const names[] = {"a", "b", "c"};
    auto b = body_on(names[i], "revolute", 1);
    b.joint.axis = {0, -1, 0};
    b.placement.r = {0.125 * i, 0, 0};
    b.mass.com = {0, 0, -1};
    b.mass.inertia = {};
    bodies.push_back(b);
  }
  const auto row = mechanism_of(bodies, g);
  const auto bob = [](const char* link) {
    Shape s = ball(0.0625);
    s.pose.r = {0, 0, -1};
    return Surface{link, s};
  };
  const ContactModel model(
      row, row,
      {{"ab", {bob("a")}, {bob("b")}, rigid_law(1)}, {"bc", {bob("b")}, {bob("c")}, rigid_law(1)}});
  RigidRun run(model, row->state(Numbers{-0.5, 0, 0}, Numbers{0, 0, 0}), 1.0 / 64);
  double middle = 0, off = 0, last = 0;
  while (run.state.step < 64 * 10) {
    ASSERT_TRUE(run.step());
    middle = std::max(middle, std::fabs(run.state.x[1]));
    last = std::max(last, run.state.x[2]);
    off = std::max(off, std::fabs(run.defect()) / g);
  }
  std::printf("  %zu pushes; middle moves %.1e rad, the last reaches %.15f of 0.5; energy %.1e\n",
              run.jumps.size(), middle, last, off);
  EXPECT_GE(run.jumps.size(), 18u);
  EXPECT_LE(middle, 1e-10);
  EXPECT_NEAR(last, 0.5, 1e-3);
  EXPECT_LE(off, 1e-14);
}

/// A free box falls flat: four corners at once, one dependent on the others; it ends at rest on
/// them.
TEST(Rigid, ABoxComesToRest) {
  const auto body = mechanism_of({body_on("box", "free", 2)}, g);
  Shape box;
  box.kind = Kind::box;
  box.half = {0.3, 0.2, 0.1};
  const ContactModel model(body, body,
                           {{"g", {{"box", box}}, {{"world", ground()}}, rigid_law(0.5)}});
  Numbers q = body->mechanism().neutral();
  q[2] = 0.5;
  RigidRun run(model, body->state(q, Numbers(6, 0.0)), 1.0 / 32);
  double off = 0;
  while (run.state.step < 64) {
    ASSERT_TRUE(run.step());
    off = std::max(off, std::fabs(run.defect()) / (2 * g));
  }
  std::printf("  %zu pushes; z = 0.1 + %.1e m; energy off by %.1e of m g h\n", run.jumps.size(),
              run.state.x[2] - 0.1, off);
  EXPECT_NEAR(run.state.x[2], 0.1, 1e-14);
  EXPECT_LE(off, 1e-14);
}

}  // namespace
}  // namespace porthos::contact::rigid_test
