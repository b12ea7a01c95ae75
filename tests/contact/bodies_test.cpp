// Bodies in space that touch: the axioms, ledgers of drop tests, momenta of collisions.
#include <random>

#include "phs/system/check.h"
#include "tests/contact/support.h"

namespace porthos::contact::bodies_test {
namespace {

using namespace test;

Law rough(Law law) {
  law.loss = 0.2;
  law.friction = 0.4;
  law.creep = 0.1;
  return law;
}
const Law smooth{.form = Law::Form::smooth, .stiffness = 50, .width = 0.3};

Shape block() {
  Shape s;
  s.kind = Kind::box;
  s.half = {0.2, 0.3, 0.15};
  s.radius = 0.02;
  return s;
}

/// The contract, forwards derivatives included, where nearly everything touches.
TEST(ContactBodies, AxiomsHold) {
  const auto bodies = mechanism_of({body_on("a", "free", 1), body_on("b", "free", 2)}, 3);
  for (const Law& law : {smooth, rough(smooth), rough(power_law(40, 2))}) {
    const ContactModel model(bodies, bodies,
                             {{"pair", {{"a", ball(0.9)}}, {{"b", ball(0.8)}}, law},
                              {"ground", {{"a", block()}}, {{"world", ground()}}, law}});
    const auto report = phs::check(model);
    EXPECT_TRUE(report.holds()) << report.text();
  }
  auto arm = body_on("arm", "revolute", 1);
  const auto one = mechanism_of({arm});
  const ContactModel stop(one, one, {}, {{"stop", "arm", -0.1, 0.1, power_law(40, 3, 0.3)}});
  EXPECT_TRUE(phs::check(stop).holds()) << phs::check(stop).text();
}

/// Random bodies fall on the ground, slide, tip and come to rest. No loss gives energy back in any
/// step, and the ledger closes. Control: steps that do not end at touches.
TEST(ContactBodies, DropsNeverGainEnergy) {
  std::mt19937_64 bits(3);
  const auto normal = [&] { return std::normal_distribution<double>()(bits); };
  Shape capsule = ball(0.1), cylinder = ball(0.15);
  capsule.kind = Kind::capsule;
  capsule.half_length = 0.3;
  cylinder.kind = Kind::cylinder;
  cylinder.half_length = 0.2;
  double worst = 0, least = 0, highest = 0, blind = 0;
  for (const Shape& shape : {block(), capsule, cylinder, ball(0.2)})
    for (int k = 0; k < 3; ++k) {
      const auto body = mechanism_of({body_on("body", "free", 1)}, 9.8125);
      const ContactModel model(
          body, body,
          {{"ground", {{"body", shape}}, {{"world", ground()}}, rough(power_law(5e3, 1))}});
      Numbers q{0, 0, 0.6, normal(), normal(), normal(), normal()}, v(6);
      double size = 0;
      for (int i = 3; i < 7; ++i) size += q[size_t(i)] * q[size_t(i)];
      for (int i = 3; i < 7; ++i) q[size_t(i)] /= std::sqrt(size);
      for (double& each : v) each = normal();
      ContactRun run(model, body->state(q, v), 5e-4), control(model, run.state.x, 5e-4, true);
      for (int i = 0; i < 1500; ++i) {
        ASSERT_TRUE(run.step()) << to_string(shape.kind) << " " << k << ", step " << i << " "
                                << integrators::to_string(run.outcome);
        worst = std::max(worst, std::fabs(run.defect()));
        highest = std::max(highest, double(run.energy() - run.H0));
        if (k == 0 && control.step()) blind = std::max(blind, std::fabs(control.defect()));
      }
      least = std::min(least, run.least_work);
    }
  std::printf(
      "  ledger off by %.1e J   bound 1e-12 (blind: %.1e); least loss of a step %.1e J   bound 0\n",
      worst, blind, least);
  EXPECT_LE(worst, 1e-12);
  EXPECT_GT(blind, 1e-8);
  EXPECT_GE(least, 0);
  EXPECT_LE(highest, 1e-12);
}

/// Two free bodies meet off centre, with friction: forces are opposite and act at one point.
TEST(ContactBodies, ACollisionKeepsMomenta) {
  const auto bodies = mechanism_of({body_on("a", "free", 1), body_on("b", "free", 2)});
  const ContactModel model(
      bodies, bodies, {{"hit", {{"a", block()}}, {{"b", ball(0.25)}}, rough(power_law(4e3, 2))}});
  ASSERT_EQ(model.description().invariant_count(), 6 + 4);
  Numbers q = bodies->mechanism().neutral(), v(12, 0.0);
  q[0] = -0.7;
  q[1] = 0.12;
  v[3] = 1.5;
  v[0] = 0.7;
  v[7] = 0.4;
  ContactRun run(model, bodies->state(q, v), 4e-3);
  const auto system = model.instantiate<double>();
  const auto momenta = [&] {
    Numbers values(10), x = run.state.x;
    for (size_t i = 0; i < x.size(); ++i) x[i] += run.state.lo[i];
    system->invariants(x, values);
    values.resize(6);
    return values;
  };
  const Numbers before = momenta();
  double off = 0, defect = 0;
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(run.step());
    const Numbers now = momenta();
    for (size_t k = 0; k < 6; ++k) off = std::max(off, std::fabs(now[k] - before[k]));
    defect = std::max(defect, std::fabs(run.defect()));
  }
  std::printf("  momenta off by %.1e   bound 1e-14, ledger by %.1e J   bound 1e-12; lost %.3f J\n",
              off, defect, run.works[0] + run.works[1]);
  EXPECT_LE(off, 1e-14);
  EXPECT_LE(defect, 1e-12);
  EXPECT_GT(run.works[0], 0.01);
  EXPECT_GT(run.works[1], 0.005);
}

TEST(ContactBodies, LanesAndAloneHaveTheSameBits) {
  const auto body = mechanism_of({body_on("body", "free", 1)}, 9.8125);
  const ContactModel model(
      body, body,
      {{"ground", {{"body", block()}}, {{"world", ground()}}, rough(power_law(5e3, 1))}});
  const Numbers x = body->state(Numbers{0, 0, 0.3, 0.6, 0.8, 0, 0}, Numbers{1, 0, 2, 0, 1, 0});
  ContactRun lanes(model, x, 2e-3), alone(model, x, 2e-3, false, {.lanes = false});
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(lanes.step() && alone.step());
  EXPECT_EQ(lanes.state, alone.state);
}

/// As after a joint between them was locked.
TEST(ContactBodies, SurfacesOnOneBodyDoNotTouch) {
  const auto body = mechanism_of({body_on("a", "free", 1)});
  const ContactModel model(body, body, {{"c", {{"a", ball(1)}}, {{"a", ball(2)}}, smooth}});
  const Numbers x = body->state(body->mechanism().neutral(), Numbers(6, 0.0));
  ContactRun run(model, x, 0.1);
  EXPECT_EQ(double(run.energy()), 0);
  EXPECT_TRUE(run.step());
}

TEST(ContactBodies, RefusalsNameTheContact) {
  const auto bodies = mechanism_of({body_on("a", "free", 1), body_on("b", "free", 2)});
  const auto refusal = [&](Contact c, std::vector<Stop> stops = {}) {
    try {
      ContactModel(bodies, bodies, {std::move(c)}, std::move(stops));
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const Law law = power_law(10, 1);
  const auto has = [](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  Shape can = ball(0.1);
  can.kind = Kind::cylinder;
  can.half_length = 0.2;
  has(refusal({"c", {{"a", block()}}, {{"b", can}}, law}),
      "contact 'c': there is no distance in closed form between a box on 'a' and a cylinder on "
      "'b', "
      "expected one of the pairs plane and sphere");
  has(refusal({"c", {{"x", ball(1)}}, {{"b", ball(1)}}, law}), "contact 'c'");
  has(refusal({"c", {{"a", ball(-1)}}, {{"b", ball(1)}}, law}), "radius of a sphere is -1 m");
  has(refusal({"c", {{"a", ball(1)}}, {{"b", ball(1)}}, power_law(0, 1)}), "stiffness is 0");
  has(refusal({"c", {{"a", ball(1)}}, {{"b", ball(1)}}, power_law(1, 1.2)}), "exponent is 1.2");
  has(refusal({"c", {{"a", ball(1)}}, {{"b", ball(1)}}, law}, {{"s", "nothing", 0, 1, law}}),
      "stop 's'");
}

}  // namespace
}  // namespace porthos::contact::bodies_test
