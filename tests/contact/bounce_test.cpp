// A mass on a rail hits the ground: restitution, energy and order against closed forms.
#include "tests/contact/support.h"
#include "tests/support/reference.h"

namespace porthos::contact::bounce_test {
namespace {

using namespace test;

/// A ball of 2 kg on a vertical rail, at z = height, above the plane z = 0.
struct Rail {
  std::shared_ptr<const mechanics::MechanicalModel> mass;
  ContactModel model;
  explicit Rail(const Law& law, double gravity = 0)
      : mass(mechanism_of({body_on("ball", "prismatic", 2)}, gravity)),
        model(mass, mass, {{"ground", {{"ball", ball(0.25)}}, {{"world", ground()}}, law}}) {}
  Numbers start(double height, double v) const { return mass->state(Numbers{height}, Numbers{v}); }
};

/// Speed after a bounce from the speed v, in about `steps` steps of contact.
double speed_after(const Law& law, double v, int steps, bool blind = false) {
  const Rail rail(law);
  const double n = law.exponent;
  const double deepest = std::pow((n + 1) * v * v / law.stiffness, 1 / (n + 1));
  const double h = 3 * deepest / v / steps;
  ContactRun run(rail.model, rail.start(0.25 + 2.3 * h * v, -v), h, blind);
  for (int i = 0; i < 3 * steps + 10; ++i)
    if (!run.step()) return NAN;
  return run.state.x[1] / 2;
}

/// e is the same for every exponent and stiffness. Hertz's law has a force that no power series
/// describes at the touch, so it converges slowly.
TEST(Bounce, RestitutionOfHuntAndCrossley) {
  const auto reference = read_json(data_file("reference/q_hunt_crossley.json"));
  double worst = 0, hertz = 0, blind = 0;
  for (const auto& each : reference["dissipative"]) {
    const double a = number(each["a"]), v = number(each["v_in"]), out = number(each["v_out"]);
    for (const double n : {1.0, 2.0, 3.0}) {
      worst = std::max(worst, std::fabs(speed_after(power_law(16384, n, a), v, 16) / out - 1));
      if (n == 1)
        blind =
            std::max(blind, std::fabs(speed_after(power_law(16384, n, a), v, 16, true) / out - 1));
    }
    hertz = std::max(hertz, std::fabs(speed_after(power_law(16384, 1.5, a), v, 64) / out - 1));
  }
  std::printf(
      "  16 steps in contact: off by %.1e   bound 1e-12 (steps that do not end at touches: %.1e); "
      "Hertz, 64 steps: %.1e   bound 1e-7\n",
      worst, blind, hertz);
  EXPECT_LE(worst, 1e-12);
  EXPECT_LE(hertz, 1e-7);
  EXPECT_GT(blind, 1e-7);
}

/// Bounces under gravity without loss, 8 to 10 steps in contact: the energy error of whole steps of
/// a smooth field each, which grows like rounding. Control: the same steps that do not end at
/// touches.
TEST(Bounce, EnergyOfAThousandBounces) {
  for (const double n : {1.0, 2.0, 3.0}) {
    const double k = n == 1 ? 2e4 : n == 2 ? 4e5 : 8e6;
    const Rail rail(power_law(k, n), 9.8125);
    const double v = std::sqrt(2 * 9.8125 * 0.5);
    const double h = 3 * std::pow((n + 1) * v * v / k, 1 / (n + 1)) / v / 9;
    const auto off = [&](bool blind, int steps) {
      ContactRun run(rail.model, rail.start(0.75, 0), h, blind);
      double worst = 0;
      for (int i = 0; i < steps; ++i) {
        EXPECT_TRUE(run.step());
        worst = std::max(worst, std::fabs(run.defect()) / (2 * 9.8125 * 0.5));
      }
      return worst;
    };
    const double with = off(false, 20000), without = off(true, 2000);
    std::printf("  n = %g: %.1e of the energy in 20000 steps   bound 1e-14 (blind, 2000: %.1e)\n",
                n, with, without);
    EXPECT_LE(with, 1e-14);
    EXPECT_GT(without, 1e-9);
  }
}

/// The smooth law needs no switches: with gauss16 its energy error falls with the step at once.
TEST(Bounce, TheSmoothLawNeedsNoTouches) {
  const Law smooth{.form = Law::Form::smooth, .stiffness = 2e4, .width = 2e-3};
  const Rail rail(smooth, 9.8125);
  EXPECT_EQ(rail.model.depths()->count(), 0u);
  double last = 0;
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    ContactRun run(rail.model, rail.start(0.75, 0), h);
    double worst = 0;
    while (run.state.step * h < 4) {
      ASSERT_TRUE(run.step());
      worst = std::max(worst, std::fabs(run.defect()) / (2 * 9.8125 * 0.5));
    }
    std::printf("  h = %.0e s: %.1e of the energy\n", h, worst);
    last = worst;
  }
  EXPECT_LE(last, 1e-12);
}

/// A pendulum between two stops that do not lose anything, then with the restitution 0.5.
TEST(Bounce, StopsOfAJoint) {
  auto spec = body_on("rod", "revolute", 1);
  spec.joint.axis = {0, 1, 0};
  spec.mass.com = {0, 0, -0.5};
  const auto rod = mechanism_of({spec}, 9.8125);
  const auto run_with = [&](double loss) {
    const ContactModel model(rod, rod, {}, {{"stop", "rod", -0.25, 0.4, power_law(4e3, 2, loss)}});
    ContactRun run(model, rod->state(Numbers{0}, Numbers{2.5}), 2e-3);
    double worst = 0, largest = 0;
    for (int i = 0; i < 4000; ++i) {
      EXPECT_TRUE(run.step());
      worst = std::max(worst, std::fabs(run.defect()) / (0.5 * 2.5 * 2.5 * 0.28));
      largest = std::max(largest, std::fabs(run.state.x[0]));
    }
    EXPECT_LT(largest, 0.55);
    EXPECT_GE(run.least_work, 0);
    return std::pair{worst, double(run.energy() - run.H0)};
  };
  const auto [kept, none] = run_with(0);
  const auto [closed, lost] = run_with(0.3);
  std::printf("  energy off by %.1e, ledger with loss by %.1e   bound 1e-13; lost %.3f J\n", kept,
              closed, -lost);
  EXPECT_LE(kept, 1e-13);
  EXPECT_LE(closed, 1e-13);
  EXPECT_LT(lost, -0.5);
}

}  // namespace
}  // namespace porthos::contact::bounce_test
