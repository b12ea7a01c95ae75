// Joints that move as told: against an equation of their own, the order, and the power they put in.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/catalogue.h"
#include "phs/system/forwarding.h"
#include "phs/system/reactions.h"
#include "tests/support/rollers.h"

namespace porthos::integrators::driven_test {
namespace {

using test::Vec;
using Real = long double;

/// The angle of the pendulum at time `end` from its own equation
///   (I + m c²)(a + θ'') + m l c (a cos θ + w² sin θ) = -m g c cos(φ + θ),   w = φ', a = φ'',
/// by the classical Runge-Kutta method in 64 bits with tiny steps.
/// phi(t, order): the motion or a derivative
template <class Phi>
Real pendulum(double end, Real theta, Real rate, const Phi& phi) {
  const Real m = 2, l = 0.5L, c = 0.375L, I = m * 0.75L * 0.75L / 12, g = 9.8125L;
  const auto accelerate = [&](Real t, Real q) {
    const Real a = phi(t, 2), w = phi(t, 1);
    return (-m * g * c * std::cos(phi(t, 0) + q) -
            m * l * c * (a * std::cos(q) + w * w * std::sin(q))) /
               (I + m * c * c) -
           a;
  };
  const int n = 40000;
  const Real h = Real(end) / n;
  for (int i = 0; i < n; ++i) {
    const Real t = i * h;
    const Real k1 = accelerate(t, theta), k2 = accelerate(t + h / 2, theta + h / 2 * rate),
               k3 = accelerate(t + h / 2, theta + h / 2 * (rate + h / 2 * k1)),
               k4 = accelerate(t + h, theta + h * (rate + h / 2 * k2));
    theta += h * (rate + h / 6 * (k1 + k2 + k3));
    rate += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return theta;
}
Real swing(Real t, int order) {
  const Real w = 2 * 0.625L * 3.14159265358979323846264338327950288L, phase = 0.5L;
  if (order == 0) return 0.25L + 0.75L * std::sin(w * t + phase);
  return order == 1 ? 0.75L * w * std::cos(w * t + phase)
                    : -0.75L * w * w * std::sin(w * t + phase);
}

struct Second {
  double angle, work, balance, gap;
};
/// One second of the pendulum on a crank that swings.
Second run(const std::string& method, int steps) {
  auto l = test::driven_pendulum(phs::swinging_motion(0.25, 0.75, 0.625, 0.5));
  const auto model = l.model();
  const auto system = model.instantiate<long double>();
  const auto rows = system->constraints();
  phs::State s(model.description(), l.start());
  const auto x = [&] {
    std::vector<long double> now(s.x.size());
    for (size_t i = 0; i < now.size(); ++i) now[i] = (long double)(s.x[i]) + s.lo[i];
    return now;
  };
  const long double first = system->hamiltonian(x());
  const double h = 1. / steps;
  const auto by = make_integrator(method, model, h);
  Second r{};
  std::vector<long double> g(1);
  for (int i = 1; i <= steps; ++i) {
    EXPECT_EQ(by->step(s), Outcome::ok);
    r.work += by->port_work()[0];
    rows->set_time(i * (long double)(h));
    rows->place(x(), g);
    r.gap = std::max(r.gap, double(std::fabs(g[0])));
  }
  r.angle = s.x[1] + s.lo[1];
  r.balance = double(system->hamiltonian(x()) - first) - r.work;
  return r;
}

TEST(Driven, APendulumOnADrivenCrankObeysItsOwnEquation) {
  const double exact = double(pendulum(1, -1.25L, 0.5L, swing));
  for (const char* method : {"spark16", "pgauss16"}) {
    const Second r = run(method, 64);
    std::printf(
        "  %s: angle off by %.1e rad   bound 1e-14;  balance %.1e of %.1f J   bound 1e-13;  "
        "gap %.1e rad\n",
        method, r.angle - exact, r.balance, r.work, r.gap);
    EXPECT_NEAR(r.angle, exact, 1e-14);
    EXPECT_NEAR(r.balance, 0, 1e-13);
    EXPECT_GT(std::fabs(r.work), 1);
    EXPECT_LT(r.gap, 1e-15);
  }
}
TEST(Driven, OrderIsTwiceTheStages) {
  const double exact = double(pendulum(1, -1.25L, 0.5L, swing));
  for (const char* method : {"spark4", "pgauss4"}) {
    const double coarse = std::fabs(run(method, 40).angle - exact),
                 fine = std::fabs(run(method, 80).angle - exact);
    std::printf("  %s: errors %.2e, %.2e, order %.2f\n", method, coarse, fine,
                std::log2(coarse / fine));
    EXPECT_NEAR(std::log2(coarse / fine), 4, 0.2);
  }
}

/// The torque of the motor at the start, from the equations of both links.
TEST(Driven, ReactionIsTheTorqueOfTheMotor) {
  auto l = test::driven_pendulum(phs::swinging_motion(0.25, 0.75, 0.625, 0.5));
  const auto model = l.model();
  const auto free = mechanics::MechanicalModel(l.mechanism);
  phs::Reactions reactions(model);
  const Vec x = l.start();
  reactions.at(0, x);
  const double torque = reactions.exerted()[0];
  // With this torque on the crank of the free mechanism, the crank accelerates as told.
  const auto system = free.instantiate<phs::Dual>();
  const auto plain = free.instantiate<double>();
  Vec u(size_t(free.description().nu), 0.0), dx(x.size());
  u[0] = torque;
  plain->field(0, x, u, dx);
  std::vector<phs::Dual> moving(x.size()), e(x.size());
  for (size_t i = 0; i < x.size(); ++i) moving[i] = {x[i], dx[i]};
  system->gradient(moving, e);  // ∂H/∂p = q', and its derivative q''
  std::printf("  torque %.6f N m; crank accelerates by %.15g, told %.15g\n", torque, e[2].d,
              double(swing(0, 2)));
  EXPECT_NEAR(e[2].d, double(swing(0, 2)), 1e-13);
}

/// A wrapper that drops the time would hold the joint where it starts.
TEST(Driven, TimeReachesTheRowsOfAnInnerSystem) {
  auto l = test::driven_pendulum(phs::swinging_motion(0.25, 0.75, 0.625, 0.5));
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  phs::InnerConstraints<double> inside(system->constraints(), 1, l.start().size());
  Vec x(l.start().size() + 1, 0.0), g(1), drift(1, 0.0);
  inside.set_time(0.3);
  inside.place(x, g);
  inside.add_drift(drift);
  EXPECT_NEAR(g[0], -double(swing(0.3L, 0)), 1e-15);
  EXPECT_NEAR(drift[0], -double(swing(0.3L, 1)), 1e-15);
}

TEST(Driven, MovesGoFromRestToRest) {
  const auto m = phs::moves_from(0.5, {{1, 2, 1.5}, {4, 1, -1}});
  const auto at = [&](double t) { return std::pair((*m.position)(t), (*m.rate)(t)); };
  EXPECT_EQ(at(0), std::pair(0.5, 0.0));
  EXPECT_EQ(at(2).first, 1.0);  // the middle of a move of least jerk
  EXPECT_NEAR(at(2).second, 1.875 / 2, 1e-15);
  EXPECT_EQ(at(3.5), std::pair(1.5, 0.0));
  EXPECT_EQ(at(9), std::pair(-1.0, 0.0));
  EXPECT_EQ(m.instants, (std::vector<double>{1, 3, 4, 5}));
  for (const double t : {1.3, 2.7, 4.25}) {
    const phs::Dual d = (*m.position)(phs::Dual(t, 1));
    EXPECT_NEAR(d.d, at(t).second, 1e-14) << t;
  }
  EXPECT_THROW(phs::moves_from(0, {{1, 2, 1}, {2, 1, 0}}), InvalidArgument);
  EXPECT_THROW(phs::moves_from(0, {}), InvalidArgument);
  EXPECT_THROW(phs::moves_from(0, {{1, 0, 1}}), InvalidArgument);
  EXPECT_THROW(phs::swinging_motion(0, 1, 0, 0), InvalidArgument);
  EXPECT_THROW(phs::steady_motion(0, HUGE_VAL), InvalidArgument);
}

}  // namespace
}  // namespace porthos::integrators::driven_test
