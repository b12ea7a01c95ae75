// What rests on a rigid stop and is released where its load reverses.
#include <numbers>

#include "phs/network/network.h"
#include "tests/contact/rigid_run.h"

namespace porthos::contact::rigid_release_test {
namespace {

using namespace test;

/// A cart on a rail with a stop above 0.25 m, and on it a slider that moves across the rail, at the
/// angle 0.9. While the cart rests the slider gives it momentum, so its rate 0 is one of rounding.
struct Rail {
  static constexpr double stop = 0.25, all = 2.9, slides = 0.7;  // [m], [kg], [kg]
  std::shared_ptr<const mechanics::MechanicalModel> masses;
  std::shared_ptr<const ContactModel> contacts;
  std::shared_ptr<const phs::Model> whole;

  Rail(double restitution, phs::FunctionPtr force) {
    auto cart = body_on("cart", "prismatic", all - slides),
         slider = body_on("slider", "prismatic", slides);
    cart.joint.axis = {1, 0, 0};
    slider.parent = "cart";
    slider.joint.axis = {std::cos(0.9), 0, std::sin(0.9)};
    masses = mechanism_of({cart, slider});
    contacts = std::make_shared<ContactModel>(
        masses, masses, std::vector<Contact>{},
        std::vector<Stop>{{"stop", "cart", -HUGE_VAL, stop, rigid_law(restitution)}});
    phs::Network n("pressed");
    n.add("mechanism", contacts).main("mechanism");
    n.source("press", "mechanism.cart.force", force);
    whole = n.build();
  }
  RigidRun run(double gap, double approach, double slip, double h) const {
    return RigidRun(*whole, *contacts,
                    masses->state(Numbers{stop - gap, 0.1}, Numbers{approach, slip}), h);
  }
};
double gap(const RigidRun& run) { return Rail::stop - run.state.x[0] - run.state.lo[0]; }

/// The force sin(w (released - t)) [N] presses the cart until `released`. With s from then on, the
/// gap is (s - sin(w s)/w) / (w m), with m the mass that resists the cart alone.
constexpr double w = std::numbers::pi / 2;
double flown(double s) {
  const double m = Rail::all - Rail::slides * std::pow(std::cos(0.9), 2);
  return (s - std::sin(w * s) / w) / (w * m);
}

/// The cart bounces to rest and leaves the stop where its load reverses, at any step. Control: a
/// release 1e-9 s later.
TEST(RigidRelease, WhereTheLoadReverses) {
  double worst = 0, least = HUGE_VAL, early = 0, ledger = 0;
  int runs = 0;
  for (const double e : {0.0, 0.3, 0.6})
    for (int i = 0; i <= 30; ++i, ++runs) {
      const double h = 0.05 * std::pow(0.003 / 0.05, i / 30.0), released = 0.8 + 0.01 * i;
      const Rail rail(e, phs::sine(-1, w / (2 * std::numbers::pi), -w * released));
      RigidRun run = rail.run(1e-4, 0.02, 0.3 + 0.01 * i, h);
      while (run.state.step * h < 1.5) {
        ASSERT_TRUE(run.step()) << "e " << e << ", h " << h << ": " << run.method->remark();
        const double s = double(run.state.step) * h - released;
        if (s < 0 && s > -0.25) early = std::max(early, std::fabs(gap(run)));
        if (s < 0) continue;
        worst = std::max(worst, std::fabs(gap(run) - flown(s)));
        if (s > 0.1) least = std::min(least, std::fabs(gap(run) - flown(s - 1e-9)));
      }
      ledger = std::max(ledger, std::fabs(run.defect()));
    }
  std::printf(
      "  %d runs; gap at rest %.1e m   bound 1e-15; flight off by %.1e m   bound 1e-13 "
      "(released 1e-9 s later %.1e); ledger %.1e J   bound 1e-12\n",
      runs, early, worst, least, ledger);
  EXPECT_LE(early, 1e-15);
  EXPECT_LE(worst, 1e-13);
  EXPECT_GE(least, 1e-12);
  EXPECT_LE(ledger, 1e-12);
}

/// A load that reverses for an instant, or only comes to 0: the cart ends at rest. Between two
/// samples of a step such an instant is missed, which the ledger shows.
TEST(RigidRelease, ALoadThatReversesForAnInstant) {
  double off = 0, ledger = 0;
  for (const double pulls : {0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 0.1})
    for (const double e : {0.0, 0.3, 0.6})
      for (const double h : {0.05, 0.0311, 0.0123}) {
        const Rail rail(e, phs::sine(1, 1, 0, 1 - pulls));
        RigidRun run = rail.run(0, 0, 0.3, h);
        while (run.state.step * h < 1.375)
          ASSERT_TRUE(run.step()) << pulls << ", e " << e << ", h " << h << ": "
                                  << run.method->remark();
        off = std::max(off, std::fabs(gap(run)));
        ledger = std::max(ledger, std::fabs(run.defect()));
      }
  std::printf("  gap at the end %.1e m   bound 1e-15; ledger %.1e J   bound 1e-10\n", off, ledger);
  EXPECT_LE(off, 1e-15);
  EXPECT_LE(ledger, 1e-10);
}

/// A run restarted just after the release has the bits of the whole one.
TEST(RigidRelease, GoesOnFromACheckpoint) {
  const double h = 1.0 / 64, released = 0.5 - 1e-6;
  const Rail rail(0.3, phs::sine(-1, w / (2 * std::numbers::pi), -w * released));
  RigidRun run = rail.run(0, 0, 0.3, h), other = rail.run(0, 0, 0.3, h);
  while (run.state.step < 32) ASSERT_TRUE(run.step());
  EXPECT_LT(std::fabs(gap(run)), 1e-12);
  other.state = run.state;
  other.method->restore(run.method->memory());
  while (run.state.step < 64) {
    ASSERT_TRUE(run.step() && other.step());
    EXPECT_EQ(run.state.x, other.state.x);
    EXPECT_EQ(run.state.lo, other.state.lo);
  }
  EXPECT_NEAR(gap(run), flown(1 - released), 1e-13);
}

/// More than ten thousand bounces in a step: the run ends and names a step with which it goes on.
TEST(RigidRelease, TooManyJumpsNameAStep) {
  const auto between = [](size_t carts, double h) {
    std::vector<mechanics::BodySpec> bodies;
    std::vector<Stop> stops;
    for (size_t i = 0; i < carts; ++i) {
      const std::string name = i == 0 ? "cart" : "other";
      bodies.push_back(body_on(name.c_str(), "prismatic", 2));
      stops.push_back({"stop of " + name, name, -1, 1, rigid_law(1)});
    }
    const auto masses = mechanism_of(bodies);
    const ContactModel model(masses, masses, {}, stops);
    Numbers at(carts, 0.0);
    at.back() = 0.5 * double(carts - 1);
    RigidRun run(model, masses->state(at, Numbers(carts, 2048.0)), h, "midpoint");
    const bool goes_on = run.step();
    EXPECT_EQ(run.outcome, goes_on ? Outcome::ok : Outcome::jammed);
    return goes_on ? std::to_string(run.jumps.size()) : run.method->remark();
  };
  EXPECT_EQ(between(1, 16),
            "'stop of cart' jumps ten thousand times in one step: expected a step of at most 5 s, "
            "or method = \"moreau\"");
  EXPECT_EQ(between(1, 5), "5120");
  const std::string both = between(2, 8);
  EXPECT_NE(both.find("' and others jump ten thousand times"), std::string::npos) << both;
}

}  // namespace
}  // namespace porthos::contact::rigid_release_test
