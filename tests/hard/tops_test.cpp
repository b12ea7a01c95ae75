// Spinning bodies with closed forms. Must hold with gauss16: the fast top's steady precession at
// any spin; the time between the flips of a body spun about its middle axis, and their number; the
// motion of a platform that a wheel reacts on, and its momentum. Must fail: rk4 at the same steps.
// (The Lagrange top's and Euler's trajectories: tests/reference.)
#include "tests/support/energy_run.h"

namespace porthos::tops_test {
namespace {

std::shared_ptr<const mechanics::Mechanism> single(const std::string& joint,
                                                   const mechanics::MassProperties& mass,
                                                   const mechanics::Vec3d& gravity) {
  mechanics::BodySpec body;
  body.name = "body";
  body.parent = "world";
  body.joint.type = joint;
  body.mass = mass;
  return std::make_shared<mechanics::Mechanism>(
      mechanics::MechanismBuilder().gravity(gravity).add(body).build());
}

// Steady precession at inclination θ: I1 Ω² cosθ - I3 ω3 Ω + m g l = 0, the slow root (Goldstein,
// Classical Mechanics, 5.7).
TEST(Tops, SteadyPrecessionOfTheFastTop) {
  const double I1 = 1.25, I3 = 0.5, l = 0.5, g = 9.8125, theta = 0.5;
  const mechanics::MechanicalModel model(
      single("spherical", {1, {0, 0, l}, {I1 - l * l, 0, 0, I1 - l * l, 0, I3}}, {0, 0, -g}));
  for (const double spin : {20.0, 100.0, 500.0, 2000.0}) {
    const double L3 = I3 * spin, c = std::cos(theta), s = std::sin(theta);
    const double rate = 2 * g * l / (L3 + std::sqrt(L3 * L3 - 4 * I1 * c * g * l));
    const phs::State start(
        model.description(),
        model.state(std::vector{std::cos(theta / 2), std::sin(theta / 2), 0.0, 0.0},
                    std::vector{0.0, rate * s, spin}));
    const double h = 0.5 / spin;
    const std::int64_t steps = 20000;
    const auto error = [&](const test::EnergyRun& run) {
      const auto axis =
          mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&run.end.x[0])) *
          mechanics::Vec3d{0, 0, 1};
      const double phi = rate * h * double(steps);
      return std::hypot(axis.x - s * std::sin(phi), axis.y + s * std::cos(phi), axis.z - c);
    };
    const auto ours = test::energy_run("gauss16", model, start, h, steps),
               rk4 = test::energy_run("rk4", model, start, h, steps);
    const std::string name = ", spin " + std::to_string(int(spin)) + " rad/s";
    test::keeps("gauss16 energy" + name, ours.energy, test::random_walk(steps));
    // the precession rate inherits the relative error of L3; 1e-15 of it, over up to 50 rad of
    // precession
    test::keeps("gauss16 axis against the closed form" + name, error(ours), 1e-12);
    test::breaks("rk4 energy" + name, rk4.energy, 1e-9);
    test::breaks("rk4 axis" + name, error(rk4), 1e-9);
  }
}

// Spun about the middle axis with ω3 = 1e-3 beside: ω2 ~ sn, its sign changes every 2K (Landau,
// Lifshitz, Mechanics, § 37).
TEST(Tops, DzhanibekovFlips) {
  const double I1 = 1, I2 = 2, I3 = 3, w2 = 1, w3 = 1e-3;
  const mechanics::MechanicalModel model(
      single("free", {1, {0, 0, 0}, {I1, 0, 0, I2, 0, I3}}, {0, 0, 0}));
  const phs::State start(model.description(), model.state(model.mechanism().neutral(),
                                                          std::vector{0.0, w2, w3, 0.0, 0.0, 0.0}));
  const double E2 = I2 * w2 * w2 + I3 * w3 * w3, L2 = I2 * I2 * w2 * w2 + I3 * I3 * w3 * w3;
  const double rate = std::sqrt((I3 - I2) * (L2 - E2 * I1) / (I1 * I2 * I3));
  // 1 - m without cancellation; L² - 2E I2 = I3 (I3 - I2) ω3²
  const double m1 = (I3 - I1) * I3 * (I3 - I2) * w3 * w3 / ((I3 - I2) * (L2 - E2 * I1));
  double a = 1, b = std::sqrt(m1);  // K = π / 2 agm(1, √(1 - m))
  for (int i = 0; i < 8; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  const double flip = M_PI / a / rate;

  const double h = 0.125, duration = 1e4;
  // Where a crossing lies inside the step: Newton on ω2(τ), with I2 ω2' = (I3 - I1) ω3 ω1.
  struct Flips {
    int count = 0;
    double period = 0;
  };
  const auto run = [&](const char* name) {
    const auto method = integrators::make_integrator(name, model, h),
               probe = integrators::make_integrator(name, model, h);
    phs::State s = start;
    double first = 0, last = 0, before = w2;
    Flips f;
    while (double(s.step) * h < duration) {
      const phs::State at = s;
      if (method->step(s) != integrators::Outcome::ok) return Flips{};
      const double now = model.rates(s.x)[1];
      if ((now > 0) != (before > 0)) {
        double tau = h * before / (before - now);
        for (int i = 0; i < 4; ++i) {
          phs::State inside = at;
          EXPECT_EQ(probe->step_by(inside, tau), integrators::Outcome::ok);
          const auto w = model.rates(inside.x);
          tau -= w[1] * I2 / ((I3 - I1) * w[2] * w[0]);
        }
        last = double(at.step) * h + tau;
        if (f.count++ == 0) first = last;
      }
      before = now;
    }
    f.period = (last - first) / (f.count - 1);
    return f;
  };
  const auto ours = run("gauss16"), rk4 = run("rk4");
  // From the start, at ω2 = max, to the first crossing: half a flip.
  const int expected = int(duration / flip - 0.5) + 1;
  std::printf("  %d flips (closed form %d), rk4 %d; every %.9f s (closed form %.9f)\n", ours.count,
              expected, rk4.count, ours.period, flip);
  EXPECT_EQ(ours.count, expected);
  // The time at the saddle is ½ log of L² - 2E I2 = 3e-6, which an energy error of 1e-15 moves by
  // 1e-9.
  test::keeps("gauss16 time between flips, relative", std::fabs(ours.period / flip - 1), 1e-9);
  test::breaks("rk4 time between flips, relative", std::fabs(rk4.period / flip - 1), 1e-7);
}

/// A free platform with a wheel on its z axis.
std::shared_ptr<const mechanics::Mechanism> platform_with_wheel(double Ip, double Iw, double k) {
  mechanics::MechanismBuilder b("platform and wheel");
  mechanics::BodySpec s;
  s.name = "platform";
  s.parent = "world";
  s.joint.type = "free";
  s.mass = {100, {0, 0, 0}, {0.8 * Ip, 0, 0, 0.6 * Ip, 0, Ip}};
  b.add(s);
  s = {};
  s.name = "wheel";
  s.parent = "platform";
  s.joint.type = "revolute";
  s.joint.stiffness = k;
  s.mass = {5, {0, 0, 0}, {Iw / 2, 0, 0, Iw / 2, 0, Iw}};
  b.add(s);
  return std::make_shared<mechanics::Mechanism>(b.build());
}

// Wheel on a torsion spring, released from rest: L = 0, so the platform turns by -Iw/(Ip + Iw) of
// the wheel's angle,
// which is θ0 cos ωt with ω² = k (1/Ip + 1/Iw).
TEST(Tops, MomentumWheelOnASpring) {
  const double Ip = 10, Iw = 0.25, k = 4, angle = 1;
  const mechanics::MechanicalModel model(platform_with_wheel(Ip, Iw, k));
  auto q = model.mechanism().neutral();
  q.back() = angle;
  const phs::State start(model.description(), model.state(q, std::vector<double>(7, 0.0)));
  const double omega = std::sqrt(k * (1 / Ip + 1 / Iw)), h = 0.25 / omega;
  const std::int64_t steps = 20001;
  const auto errors = [&](const char* method) {
    const auto end = test::energy_run(method, model, start, h, steps).end;
    const auto v = model.rates(end.x);
    const double t = h * double(steps), wheel = -angle * omega * std::sin(omega * t);
    return std::pair{std::fabs(v[2] + Iw / (Ip + Iw) * v[6]) / omega,
                     std::fabs(v[6] - wheel) / omega};
  };
  const auto [momentum, motion] = errors("gauss16");
  const auto [rk4_momentum, rk4_motion] = errors("rk4");
  test::keeps("gauss16: platform rate from L = 0", momentum, 1e-14);
  // ωt = 5000 rad is itself a rounded number: 1e-16 of it
  test::keeps("gauss16: wheel against the closed form, 5000 rad", motion, 5e-12);
  test::breaks("rk4: wheel against the closed form", rk4_motion, 1e-9);
  std::printf("  rk4: platform rate from L = 0: %.1e (linear here, so kept)\n", rk4_momentum);
}

// A tumbling platform with the wheel at 300 rad/s: the gyrostat has no simple closed form, but its
// momentum is one.
TEST(Tops, GyrostatWithAFastWheel) {
  const mechanics::MechanicalModel model(platform_with_wheel(10, 0.25, 0));
  const phs::State start(
      model.description(),
      model.state(model.mechanism().neutral(), std::vector{0.3, -0.5, 0.2, 0.0, 0.0, 0.0, 300.0}));
  const std::int64_t steps = 20000;
  const auto run = [&](const char* method) {
    return test::energy_run(method, model, start, 0.05, steps, {.invariant = "angular_momentum"});
  };
  const auto ours = run("gauss16"), rk4 = run("rk4");
  test::keeps("gauss16 energy, gyrostat", ours.energy, test::random_walk(steps));
  test::keeps("gauss16 angular momentum, gyrostat", ours.invariant, test::random_walk(steps));
  test::breaks("rk4 energy, gyrostat", rk4.energy, 1e-9);
  test::breaks("rk4 angular momentum, gyrostat", rk4.invariant, 1e-9);
}

}  // namespace
}  // namespace porthos::tops_test
