// Designs without a closed form at hand: a pendubot of bodies, a cart and pole of bodies.
#include "energy_shaping/matching/numerical_matching.h"

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/loop/port_law.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::numerical_matching_test {
namespace {

using test::agrees, test::breaks, test::keeps, test::refusal, test::Vec;

/// Two links, coordinates from upright; torque at the shoulder makes it a pendubot.
test::ModelPtr two_links(double gravity = -9.8) {
  mechanics::MechanismBuilder b("pendubot");
  b.gravity({0, 0, gravity});
  const auto link = [&](const char* name, const char* parent, const char* joint, double at,
                        double m, double com, double I) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = joint;
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.placement.r = {0, 0, at};
    s.mass.mass = m;
    s.mass.com = {0, 0, com};
    s.mass.inertia = {I, 0, 0, I, 0, I};
    b.add(s);
  };
  link("upper", "world", "shoulder", 0, 2, 0.5, 0.1);
  link("lower", "upper", "elbow", 1, 1, 0.5, 0.05);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}
NumericalMatching pendubot() {
  NumericalMatching o;
  o.name = "pendubot";
  o.actuator = "shoulder.torque";
  o.unactuated = 1;
  o.ratio = -0.6;
  o.half_width = 0.8;
  o.ku = 300;
  o.kv = 0.5;
  o.determinant = 0.2;
  return o;
}

/// A rotary pendulum of 0.25 kg and 0.12 kg that hangs at 0; torque at the arm.
test::ModelPtr rotary_pendulum(double gravity = 9.81) {
  mechanics::MechanismBuilder b("rotary");
  b.gravity({0, 0, -gravity});
  mechanics::BodySpec arm, rod;
  arm.name = "arm";
  arm.parent = "world";
  arm.joint.name = "turn";
  arm.joint.type = "revolute";
  arm.joint.axis = {0, 0, 1};
  arm.mass.mass = 0.25;
  arm.mass.com = {0.1, 0, 0};
  arm.mass.inertia = {1e-6, 0, 0, 8e-4, 0, 8e-4};
  rod.name = "rod";
  rod.parent = "arm";
  rod.joint.name = "swing";
  rod.joint.type = "revolute";
  rod.joint.axis = {1, 0, 0};
  rod.placement.r = {0.2, 0, 0};
  rod.mass.mass = 0.12;
  rod.mass.com = {0, 0, -0.15};
  rod.mass.inertia = {9e-4, 0, 0, 9e-4, 0, 1e-6};
  b.add(arm).add(rod);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}
NumericalMatching rotary() {
  NumericalMatching o;
  o.name = "rotary";
  o.actuator = "turn.torque";
  o.ratio = 2;
  o.half_width = 0.6;
  o.ku = 0.072;
  o.kv = 0.29;
  o.determinant = 0.0136;
  o.rest = {0, std::acos(-1.0)};
  return o;
}

TEST(NumericalMatching, Pendubot) {
  const auto loop = numerical_matching(two_links(), pendubot());
  const auto& c = loop->certificate();
  std::printf("%s", c.text().c_str());
  keeps("matching, kinetic energy", c.item("matching, kinetic energy").value, 1e-10);
  keeps("matching, potential energy", c.item("matching, potential energy").value, 1e-10);
  CertifyOptions o{.region = loop->options().region, .starts = {{0.1, -0.1, 0, 0}}};
  o.run.duration = 30;
  o.run.step = 0.005;
  o.periods = {0, 0.005};
  const auto full = certify(*loop, o);
  std::printf("%s", full.text().c_str());
  EXPECT_TRUE(full.holds());
}

/// Ferguson's cart and pole: both of 1 kg, 1 m, g = 9.8; M = [[2, cos q], [cos q, 1]].
TEST(NumericalMatching, CartAndPoleOfBodies) {
  mechanics::MechanismBuilder b("cart and pole");
  b.gravity({0, 0, -9.8});
  mechanics::BodySpec cart, pole;
  cart.name = "cart";
  cart.parent = "world";
  cart.joint.name = "rail";
  cart.joint.type = "prismatic";
  cart.joint.axis = {1, 0, 0};
  cart.mass.mass = 1;
  cart.mass.inertia = {1, 0, 0, 1, 0, 1};
  pole.name = "pole";
  pole.parent = "cart";
  pole.joint.name = "pivot";
  pole.joint.type = "revolute";
  pole.joint.axis = {0, 1, 0};
  pole.mass.mass = 1;
  pole.mass.com = {0, 0, 1};
  pole.mass.inertia = {1e-9, 0, 0, 1e-9, 0, 1e-9};
  b.add(cart).add(pole);
  const auto model = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
  NumericalMatching o;
  o.name = "cart and pole";
  o.actuator = "rail.force";
  o.unactuated = 1;
  o.ratio = -2;
  o.half_width = 0.8;
  o.ku = 5;
  o.kv = 5;
  o.determinant = 2;
  const auto loop = numerical_matching(model, o);
  keeps("matching, kinetic energy", loop->certificate().item("matching, kinetic energy").value,
        1e-10);
  const auto run = simulate(*loop, loop->state(Vec{0, 0.3}, Vec{0, 0}),
                            {.duration = 60, .step = 0.005, .record = 10});
  for (size_t k = 0; k < run.t.size(); ++k)
    std::printf("  t = %3.0f s: cart %+.4f m, pole %+.5f rad, H_d %.3e\n", run.t[k], run.x[k][0],
                run.x[k][1], run.H[k]);
  ASSERT_TRUE(run.finished) << run.outcome;
  keeps("pole after 60 s [rad]", std::fabs(run.x.back()[1]), 1e-3);
}

/// A model that hangs at q = 0, with its upright stated: the law is that of the model whose zero is
/// the upright, and the design for the hanging position says that it is one.
TEST(NumericalMatching, RestsWhereItIsTold) {
  const double pi = std::acos(-1.0);
  const auto hanging = two_links(9.8);
  auto turned = pendubot();
  turned.rest = {pi, 0};
  const auto upright = numerical_matching(two_links(), pendubot()),
             stated = numerical_matching(hanging, turned);
  EXPECT_EQ(stated->rest(), (Vec{pi, 0, 0, 0}));
  EXPECT_TRUE(stated->certificate().holds());
  const Vec x{0.1, -0.15, 0.2, 0.1}, there{pi + 0.1, -0.15, 0.2, 0.1};
  agrees("u of the stated upright", test::law_at(*stated, there)[0], test::law_at(*upright, x)[0],
         1e-11);
  breaks("control: u at the other place", std::fabs(test::law_at(*stated, x)[0]), 10);
  EXPECT_FALSE(upright->certificate().has("rest without the law"));
  EXPECT_FALSE(stated->certificate().has("rest without the law"));
  auto low = pendubot();
  low.ratio = 0.6;
  const auto below = numerical_matching(hanging, low);
  EXPECT_NE(below->certificate().item("rest without the law").text.find("a pendulum hangs there"),
            std::string::npos);
}

/// Gains by bandwidth and damping ratio: the loop that is made with them has both twice, and
/// the ratio follows. Controls: the defaults, and a ratio that attracts nowhere.
TEST(NumericalMatching, GainsByBandwidth) {
  const auto model = rotary_pendulum();
  const auto furthest = [&](const NumericalMatching& o, double bandwidth = 7, double ratio = 0.7) {
    const auto n = numerical_matching(model, o)->certificate().item("modes").numbers;
    double far = 0;
    for (size_t i = 0; i < n.size(); i += 2) {
      std::printf("  %.3f rad/s, %.3f\n", n[i], n[i + 1]);
      far = std::max(far, std::fabs(std::log(n[i] / bandwidth)) + std::fabs(n[i + 1] - ratio));
    }
    return far;
  };
  auto plain = rotary();
  plain.ku = 100;
  plain.kv = plain.determinant = 1;
  plain.ratio = 0;
  const auto found = numerical_matching_gains(*model, plain, 7, 0.7);
  std::printf("  ku %.4g, kv %.4g, determinant %.4g\n", found.ku, found.kv, found.determinant);
  keeps("furthest mode, logarithm and difference", furthest(found), 1e-2);  // a double pole
  agrees("ratio of 7 rad/s", found.ratio, (-0.12 * 9.81 * 0.15 / 49 - 0.0036) / -0.0036, 1e-12);
  // Little damping: a walk alone ended in a valley beside, at 0.018 and 0.377.
  for (const auto& [bandwidth, ratio] : {std::pair{10.0, 0.2}, {8.0, 0.1}})
    keeps("furthest mode, other ratios",
          furthest(numerical_matching_gains(*model, plain, bandwidth, ratio), bandwidth, ratio),
          1e-2);
  plain.ratio = 2;
  breaks("control: the defaults", furthest(plain), 1);
  plain.ratio = 0.1;
  const auto why = refusal([&] { (void)numerical_matching_gains(*model, plain, 7, 0.7); });
  EXPECT_NE(why.find("expected another ratio"), why.npos) << why;
  plain.ratio = 0;
  plain.rest[1] = 2.5;
  const auto leans = refusal([&] { (void)numerical_matching_gains(*model, plain, 7, 0.7); });
  EXPECT_NE(leans.find("no equilibrium at rest [0, 2.5]: -0.106 N m (N) pull 'swing', which"),
            leans.npos)
      << leans;
  EXPECT_LE(leans.size(), 220u);
}

/// The design and its gains say the same of a rest that is none, and of a model without gravity,
/// whatever else is wrong. Control: at the upright both are made.
TEST(NumericalMatching, ARestThatIsNoneIsTold) {
  const auto why = [](double swing, double gravity, double ratio) {
    const auto model = rotary_pendulum(gravity);
    auto o = rotary();
    o.rest[1] = swing;
    o.ratio = ratio;
    const auto made = refusal([&] { (void)numerical_matching(model, o); }),
               gains = refusal([&] { (void)numerical_matching_gains(*model, o, 7, 0.7); });
    EXPECT_EQ(made.substr(made.find(": ") + 1), gains.substr(gains.find(": ") + 1));
    return made;
  };
  const double upright = std::acos(-1.0);
  EXPECT_EQ(why(upright, 9.81, 2), "");
  for (const double ratio : {2.0, -1.0})
    EXPECT_NE(why(2.5, 9.81, ratio).find("equilibrium at rest [0, 2.5]: -0.106 N m (N) pull 'sw"),
              std::string::npos)
        << why(2.5, 9.81, ratio);
  EXPECT_EQ(why(2.5, 0, 2),
            "numerical matching 'rotary': nothing pulls 'swing', which has no actuator: the model "
            "has no gravity there, expected some");
}

/// Near the place where the column of M_d degenerates the polynomials of V_d do not suffice: the
/// refusal names what helps. Control: each of both does.
TEST(NumericalMatching, APotentialThatIsNotResolvedIsTold) {
  const auto got = [](double half_width, int degree) {
    auto o = rotary();
    o.half_width = half_width;
    o.degree = degree;
    return refusal([&] { (void)numerical_matching(rotary_pendulum(), o); });
  };
  const std::string why = got(1, 60);
  std::printf("  %s\n", why.c_str());
  EXPECT_NE(why.find("of degree 60 misses the matching within half_width = 1 by "), why.npos);
  EXPECT_NE(why.find("take a smaller half_width or a higher degree"), why.npos);
  EXPECT_LE(why.size(), 220u);
  EXPECT_EQ(got(0.8, 60), "");
  EXPECT_EQ(got(1, 200), "");
}

/// A run that fails outside the interval names the coordinate, the interval and the remedy.
/// Controls: an ordinary start, a run that fails within, and the same angle a turn further.
TEST(NumericalMatching, TellsWhatLeftItsInterval) {
  const auto model = two_links();
  const auto loop = numerical_matching(model, pendubot());
  const auto run =
      simulate(*loop, loop->state(Vec{0.1, 0.95}, Vec{0, 0}), {.duration = 10, .step = 0.005});
  std::printf("  %s\n", run.outcome.c_str());
  EXPECT_FALSE(run.finished);
  EXPECT_EQ(run.outcome.find("at 0 s 'elbow' is 0.95, outside -0.8 to 0.8, where "), 0u);
  EXPECT_NE(run.outcome.find("take a larger half_width than 0.8"), std::string::npos);
  EXPECT_LE(run.outcome.size(), 220u);
  // With a limit that is too low the interval is not at fault, unless the start is outside it.
  const auto limited = [&](double elbow, double limit) {
    RunOptions o{.duration = 10, .step = 0.005};
    o.limits = {limit};
    return simulate(*loop, loop->state(Vec{0.1, elbow}, Vec{0, 0}), o).outcome;
  };
  std::printf("  %s\n", limited(-0.1, 0.1).c_str());
  EXPECT_NE(
      limited(-0.1, 0.1).find("made 'pendubot': limits[0] acted, first at 0 s: take a larger"),
      std::string::npos);
  EXPECT_EQ(limited(-0.1, 0.1).find("half_width"), std::string::npos);
  EXPECT_EQ(limited(0.95, 0.1), run.outcome);
  EXPECT_EQ(limited(-0.1, 40), "ok");
  EXPECT_TRUE(
      simulate(*loop, loop->state(Vec{0.1, -0.1}, Vec{0, 0}), {.duration = 0.1, .step = 0.005})
          .finished);
  phs::Network n("under its law");
  n.add("arm", model);
  control(n, "law", "arm", port_laws(loop));
  const auto network = n.build();
  const auto said = [&](double elbow, std::int64_t turns) {
    phs::State s(network->description(), loop->state(Vec{0.1, elbow}, Vec{0, 0}));
    s.turns.back() = turns;
    return network->hindrance(s);
  };
  EXPECT_EQ(said(0.1, 0), "");
  EXPECT_EQ(said(-0.9, 0).find("controller 'law': 'elbow' is -0.9, outside"), 0u);
  EXPECT_EQ(said(0.1, 1).find("controller 'law': 'elbow' is 6.383, outside"), 0u);
}

/// A run that leaves the interval and comes back was not under a law that is made for it: it ends
/// where it left, and a sweep gives it no settling time. Control: a start that stays within.
TEST(NumericalMatching, ARunThatComesBackIntoTheIntervalDoesNotCount) {
  auto narrow = pendubot();
  narrow.half_width = 0.4;
  const auto loop = numerical_matching(two_links(), narrow);
  const auto tried = [&](double rate) {
    const auto start = loop->state(Vec{0, 0.1}, Vec{0, rate});
    const std::vector<std::vector<double>> gains{{pendubot().ku, pendubot().kv}};
    const auto swept = sweep(*loop, gains, {.start = start, .duration = 20, .step = 0.005})[0];
    const auto run = simulate(*loop, start, {.duration = 20, .step = 0.005});
    std::printf("  rate %g: excursion %.3f, H_d left %.1e, settled in %.2g s; %s\n", rate,
                swept.max_excursion, swept.residual, swept.settling, run.outcome.c_str());
    EXPECT_EQ(swept.defined, run.finished);
    EXPECT_EQ(swept.defined, std::isfinite(swept.settling));
    return swept;
  };
  EXPECT_TRUE(tried(0).defined);
  const auto left = tried(0.3);
  EXPECT_FALSE(left.defined);
  EXPECT_LT(left.residual, 0.01) << "it came back: by its energy alone it settled";
}

/// A certificate tells the interval and looks at no place beyond it. Controls: the interval itself
/// about a rest that rounds its ends, and a start within.
TEST(NumericalMatching, CertifiesItsIntervalAlone) {
  const auto loop = numerical_matching(rotary_pendulum(), rotary());
  const auto& item = loop->certificate().item("half_width");
  EXPECT_EQ(item.text, "the law is made for 'swing' from 2.542 to 3.742 and is not defined beyond");
  const auto told = [&](double lower, double upper, double start) {
    CertifyOptions o{.region = loop->options().region, .starts = {{0.1, 3.2, 0, 0}}};
    o.region.lower[1] = lower;
    o.region.upper[1] = upper;
    o.region.samples = 10;
    o.starts.push_back({0, start, 0, 0});
    o.run.duration = 0.1;
    return refusal([&] { (void)certify(*loop, o); });
  };
  const double pi = std::acos(-1.0);
  EXPECT_EQ(told(pi - 0.6, pi + 0.6, pi + 0.6), "");
  const auto box = told(0, pi + 0.6, pi), start = told(pi - 0.6, pi + 0.6, 2);
  EXPECT_EQ(box.find("narrow the region: 'swing' is 0, outside 2.542 to 3.742, "), 0u) << box;
  EXPECT_EQ(start.find("starts[1]: 'swing' is 2, outside 2.542 to 3.742, where "), 0u) << start;
  EXPECT_LE(std::max(box.size(), start.size()), 220u);
  // A box that may not be wider is not told to be.
  auto region = loop->options().region;
  region.lower[0] = -100;
  region.upper[0] = 100;
  const std::string method = basin(*loop, region).method;
  EXPECT_NE(method.find("the box of 'swing' ends it"), std::string::npos) << method;
  EXPECT_EQ(method.find("widen"), std::string::npos) << method;
}

TEST(NumericalMatching, RefusesWithTheReason) {
  const auto model = two_links();
  auto degenerate = pendubot(), coarse = pendubot(), wide = pendubot(), port = pendubot();
  degenerate.ratio = -0.52;
  wide.half_width = 2;
  coarse.degree = 8;
  coarse.matching = 1e-9;
  port.actuator = "elbow.torque";
  for (const auto& [o, expected] :
       {std::pair<NumericalMatching, const char*>{wide, "degenerates at r"},
        {coarse, "do not resolve"},
        {port,
         "actuator 'elbow.torque' acts on 'elbow', which unactuated = 1 states to have none, "
         "expected "
         "the port of 'shoulder', or unactuated = 0"}}) {
    const auto got = refusal([&, &how = o] { (void)numerical_matching(model, how); });
    std::printf("  %s\n", got.c_str());
    EXPECT_NE(got.find(expected), std::string::npos) << got;
  }
  // The width that is named is where the column vanishes. Control: a little more than it.
  const auto why = [&](double half_width) {
    wide.half_width = half_width;
    return refusal([&] { (void)numerical_matching(model, wide); });
  };
  const std::string named = why(2);
  const double most = std::stod(named.substr(named.find("below ") + 6));
  EXPECT_EQ(why(0.99 * most).find("degenerates"), std::string::npos);
  EXPECT_NE(why(1.01 * most).find("degenerates"), std::string::npos);
  auto slow = pendubot();
  slow.determinant = 1e-9;
  const std::string tells = refusal([&] { (void)numerical_matching(model, slow); });
  EXPECT_NE(tells.find("it is nearly singular, take gains of a larger bandwidth"), tells.npos);
}

}  // namespace
}  // namespace porthos::energy_shaping::numerical_matching_test
