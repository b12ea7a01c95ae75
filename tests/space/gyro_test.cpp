// Wheels at speed: a balanced one is a cyclic coordinate, so that the slow motion sets the step.
// Closed forms of a dual-spin satellite and of a pair of control-moment gyros.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>

#include "mechanics/momentum.h"
#include "phs/network/elements.h"
#include "phs/network/network.h"
#include "tests/space/support.h"

namespace porthos::test::gyro_test {
namespace {

using mechanics::BodySpec;
using mechanics::MechanicalModel;
using mechanics::MechanismBuilder;
using Vec = std::vector<double>;

constexpr double rpm_6000 = 628.31853071795865;

BodySpec part(const char* name, const char* parent, const char* type, Vec3d axis, double mass,
              Vec3d I) {
  BodySpec s;
  s.name = name;
  s.parent = parent;
  s.joint.name = parent == std::string("world") ? "base" : name;
  s.joint.type = type;
  s.joint.axis = axis;
  s.mass.mass = mass;
  s.mass.inertia.xx = I.x;
  s.mass.inertia.yy = I.y;
  s.mass.inertia.zz = I.z;
  return s;
}
std::shared_ptr<const MechanicalModel> made(MechanismBuilder& b) {
  return std::make_shared<MechanicalModel>(std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// A platform with a fast wheel about z; `off`: how far its two cross inertias differ, relative.
std::shared_ptr<const MechanicalModel> dual_spin(double off) {
  MechanismBuilder b("dual spin");
  b.add(part("platform", "world", "free", {0, 0, 1}, 400, {95, 95, 60}));
  b.add(part("wheel", "platform", "revolute", {0, 0, 1}, 20, {0.06, 0.06 * (1 + off), 0.1}));
  return made(b);
}

struct Flight {
  bool ok = true;
  double energy = 0;  ///< largest relative error
  phs::State state;
};
Flight fly(const phs::Model& model, const Vec& x, double h, double duration) {
  Flight f;
  f.state = phs::State(model.description(), x);
  phs::wrap_angles(model.description(), f.state);
  const auto integrator = integrators::make_integrator("gauss16", model, h);
  const auto system = model.instantiate<long double>();
  const auto energy = [&] {
    std::vector<long double> y(f.state.x.begin(), f.state.x.end());
    for (size_t i = 0; i < y.size(); ++i) y[i] += f.state.lo[i];
    return system->hamiltonian(y);
  };
  const long double before = energy();
  for (int i = 0; i < int(duration / h + 0.5) && f.ok; ++i) {
    f.ok = integrator->step(f.state) == integrators::Outcome::ok;
    f.energy = std::max(f.energy, double(fabsl(energy() / before - 1)));
  }
  return f;
}

TEST(FastWheel, NutationOfADualSpinSatelliteAtStepsOfManyTurns) {
  // h = c (W + w_z) is kept, and w_x + i w_y turns at ((C - A) w_z + h)/A, A with the wheel across.
  const auto m = dual_spin(0);
  const double A = 95.06, C = 60, wz = 0.02, W = rpm_6000;
  const std::complex<double> w0(0.01, -0.004);
  const Vec q = m->mechanism().neutral(), v{w0.real(), w0.imag(), wz, 0, 0, 0, W};
  const Vec x = m->state(q, v);
  const double momentum = 0.1 * (W + wz), rate = ((C - A) * wz + momentum) / A;
  const double T = 1000;
  for (const double h : {0.25, 0.5, 1.0}) {
    const Flight f = fly(*m, x, h, T);
    ASSERT_TRUE(f.ok);
    const auto r = m->rates(f.state.x);
    const auto expected = w0 * std::polar(1.0, rate * T);
    const double off = std::abs(std::complex<double>(r[0], r[1]) - expected) / std::abs(w0);
    const double kept = std::fabs(f.state.x[15] / momentum - 1);
    std::printf(
        "  step %.2f s, %5.1f turns of the wheel: nutation off by %.1e after %.0f periods   "
        "bound 1e-10;  energy %.1e, wheel's momentum %.1e   bound 1e-15\n",
        h, W * h / (2 * M_PI), off, rate * T / (2 * M_PI), f.energy, kept);
    EXPECT_LE(off, 1e-10);
    EXPECT_LE(f.energy, 1e-14);
    EXPECT_LE(kept, 1e-15);
  }
  // Control: a wheel whose angle is felt must be followed turn by turn.
  const auto uneven = dual_spin(0.05);
  const Vec y = uneven->state(q, v);
  double largest = 0, h = 0.5;
  for (; h > 1e-4 && largest == 0; h /= 2) {
    const Flight f = fly(*uneven, y, h, 512 * h);
    if (f.ok && f.energy < 1e-13) largest = h;
    std::printf("  uneven wheel, step %.5f s: %s, energy %.1e\n", h, f.ok ? "ran" : "failed",
                f.energy);
  }
  std::printf("  a wheel that is 5 %% uneven needs steps of %.5f s, %.2f turns\n", largest,
              largest * W / (2 * M_PI));
  EXPECT_LT(largest, 0.02);
  EXPECT_GT(largest, 0);
}

TEST(FastWheel, GyrostatOfThreeAxesKeepsEnergyAndMomentum) {
  MechanismBuilder b("gyrostat");
  b.add(part("platform", "world", "free", {0, 0, 1}, 400, {70, 95, 60}));
  b.add(part("wheel", "platform", "revolute", {0.6, 0, 0.8}, 20, {0.06, 0.06, 0.06}));
  const auto m = made(b);
  const Vec x = m->state(m->mechanism().neutral(), Vec{0.02, -0.01, 0.03, 0, 0, 0, rpm_6000});
  const Flight coarse = fly(*m, x, 0.5, 1000), fine = fly(*m, x, 0.25, 1000);
  ASSERT_TRUE(coarse.ok && fine.ok);
  double apart = 0;
  for (size_t i = 0; i < 7; ++i)
    apart = std::max(apart, std::fabs(coarse.state.x[i] - fine.state.x[i]));
  mechanics::Workspace<double> w(m->mechanism());
  const auto momentum = [&](const Vec& s) {
    return mechanics::momentum<double>(m->mechanism(), w, std::span(s).first(8),
                                       std::span(s).subspan(8))
        .angular;
  };
  const auto L0 = momentum(x), L1 = momentum(fine.state.x);
  const double jump = mechanics::norm(L1 - L0) / mechanics::norm(L0);
  std::printf(
      "  half the step: attitude %.1e   bound 1e-10; energy %.1e, momentum %.1e   bound "
      "1e-14\n",
      apart, fine.energy, jump);
  EXPECT_LE(apart, 1e-10);
  EXPECT_LE(fine.energy, 1e-14);
  EXPECT_LE(jump, 1e-14);
}

TEST(ControlMomentGyro, APairTurnsTheBaseAsItsMomentumSays) {
  // Spin axes x and -x, gimbals about z turned by g and -g: 2 p sin g along y, so
  // (I_y + 2 G + 2 a cos² g) w = -2 p sin g, p the momentum of a wheel, which is kept.
  MechanismBuilder b("pair");
  const double Iy = 80, G = 0.3, a = 0.06, c = 0.1;
  b.add(part("bus", "world", "free", {0, 0, 1}, 400, {70, Iy, 60}));
  for (const char* side : {"1", "2"}) {
    const std::string gimbal = std::string("gimbal_") + side, wheel = std::string("wheel_") + side;
    b.add(part(gimbal.c_str(), "bus", "revolute", {0, 0, 1}, 5, {G, G, G}));
    b.add(part(wheel.c_str(), gimbal.c_str(), "revolute", {*side == '1' ? 1.0 : -1.0, 0, 0}, 20,
               {c, a, a}));
  }
  const auto m = made(b);
  phs::Network n("pair");
  n.add("mechanism", m).main("mechanism");
  const auto command = phs::profile({0, 10, 20, 30, 40}, {0, 0.03, 0.05, 0.02, 0.0});
  for (const double sign : {1.0, -1.0})
    n.control(sign > 0 ? "drive 1" : "drive 2",
              sign > 0 ? "mechanism.gimbal_1.torque" : "mechanism.gimbal_2.torque",
              phs::law([command, sign](auto t, auto, auto y, auto u) {
                using T = typename decltype(u)::value_type;
                u[0] = T(5000.0) * (T(sign) * (*command)(T(t)) - y[0]);
              }));
  const auto model = n.build();
  Vec v(size_t(m->mechanism().nv()), 0.0);
  for (const char* wheel : {"wheel_1", "wheel_2"})
    v[size_t(m->mechanism().coordinate(wheel).v)] = rpm_6000;
  const double p = c * rpm_6000;
  const Flight f = fly(*model, m->state(m->mechanism().neutral(), v), 0.1, 40);
  ASSERT_TRUE(f.ok);
  const auto r = m->rates(f.state.x);
  const double g = f.state.x[size_t(m->mechanism().coordinate("gimbal_1").q)];
  const double expected = -2 * p * std::sin(g) / (Iy + 2 * G + 2 * a * std::cos(g) * std::cos(g));
  const double others = std::max(std::fabs(r[0]), std::fabs(r[2]));
  std::printf(
      "  gimbals at %.3f rad: rate about y off by %.1e of %.3f rad/s, about x and z %.1e   "
      "bound 1e-13\n",
      g, r[1] - expected, expected, others);
  EXPECT_GT(g, 0.5);
  EXPECT_NEAR(r[1], expected, 1e-13);
  EXPECT_LE(others, 1e-13);
  // Control: without the wheels' cross inertia the closed form is off.
  EXPECT_GT(std::fabs(r[1] + 2 * p * std::sin(g) / (Iy + 2 * G)), 1e-5);
}

}  // namespace
}  // namespace porthos::test::gyro_test
