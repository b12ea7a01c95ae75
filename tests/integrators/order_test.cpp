// The order of every method on nonlinear problems, against 113-bit runs.
#include <gtest/gtest.h>

#include "phs/network/network.h"
#include "tests/integrators/problems.h"
#include "tests/support/fast_arm.h"

namespace porthos::integrators::order_test {
namespace {

using phs::Quad;
using namespace test::fast_arm;

double error_after(const std::string& method, int steps) {
  phs::State s = robot().start;
  const auto integrator = make_integrator(method, *robot().model, duration / steps);
  for (int i = 0; i < steps; ++i)
    if (integrator->step(s) != Outcome::ok) return INFINITY;
  return test::distance(test::unwrapped(robot().model->description(), s), reference());
}

TEST(Order, ReferenceIsConverged) {
  const double worst = test::distance(reference_by(96), reference());
  std::printf("  113-bit reference against a finer one: %.1e   bound 1e-25\n", worst);
  EXPECT_LE(worst, 1e-25);
}

/// Error of a method in 113 bits after `duration` s in so many steps; infinite if it gave up.
double quad_error(const std::string& method, const test::Problem& p, double T, int steps,
                  const std::vector<Quad>& exact) {
  phs::BasicState<Quad> s(p.model->description(), {p.start.x.begin(), p.start.x.end()});
  const auto integrator =
      make_basic_integrator<Quad>(method, *p.model, Quad(T) / steps, {.max_sweeps = 400});
  for (int i = 0; i < steps; ++i)
    if (integrator->step(s) != Outcome::ok) return INFINITY;
  for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += s.lo[k];
  return test::distance(s.x, exact);
}

// The very step of a run, in 113 bits: orders up to 16 show their slope long before round-off.
// Variable mass where the method can take it. A linear problem would hide order defects.
TEST(Order, OfEveryMethodIn113Bits) {
  const double T = 0.5;
  const auto all = test::problems();
  std::vector<std::vector<Quad>> exact;
  for (const auto& p : all)
    exact.push_back(
        gauss_reference(*p.model, {p.start.x.begin(), p.start.x.end()}, Quad(T) / 32, 32, 12));
  for (const auto& d : catalogue()) {
    if (d.rival || d.order == 0 || d.needs.contacts) continue;
    size_t at = 0;  // double pendulum, else Henon-Heiles
    if (!test::fits(d, all[at])) at = 2;
    double before = INFINITY, now = INFINITY;
    int steps = 4;
    while (true) {
      before = now;
      now = quad_error(d.name, all[at], T, steps, exact[at]);
      if (std::isfinite(before) && (now < 1e-22 || steps >= (d.order > 2 ? 64 : 512))) break;
      steps *= 2;
    }
    const double order = std::log2(before / now);
    std::printf("  %-22s declared %2d   measured %5.2f   on the %s, errors %.1e, %.1e\n",
                d.name.c_str(), d.order, order, all[at].name.c_str(), before, now);
    EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << d.name;
  }
}

/// A charge in the plane, in a quartic well.
struct Charge {
  static phs::Description description() {
    phs::Description d;
    d.name = "charge";
    d.nx = 4;
    d.nu = 2;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
    d.ports = {{"x", phs::PortKind::effort_in, 1, 0, "N", "m/s"},
               {"y", phs::PortKind::effort_in, 1, 1, "N", "m/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T r2 = x[0] * x[0] + T(2.0) * x[1] * x[1];
    return T(0.5) * (x[2] * x[2] + x[3] * x[3] + r2) + T(0.25) * r2 * r2;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    const T k = T(1.0) + x[0] * x[0] + T(2.0) * x[1] * x[1];
    e[0] = k * x[0];
    e[1] = T(2.0) * k * x[1];
    e[2] = x[2];
    e[3] = x[3];
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = Gu[1] = T(0.0);
    Gu[2] = u[0];
    Gu[3] = u[1];
  }
};

/// Across a magnetic field: a network whose J is not canonical; damped and pushed along one axis
/// where asked.
test::Problem charge_in_a_field(bool driven) {
  phs::Network n(driven ? "driven charge" : "charge in a field");
  n.add("charge", std::make_shared<phs::UserModel<Charge>>(Charge{}));
  n.gyrator("charge.x", "charge.y", 1.5);
  if (driven) {
    n.resist("damper", {"charge.x", "charge.y"}, phs::Matrix{{0.4, 0.1}, {0.1, 0.3}});
    n.source("push", "charge.x",
             phs::function([](auto t) { return decltype(t)(0.7) * phs::sin(t); }));
  }
  const auto model = n.build();
  return {model->description().name, model, phs::State(model->description(), {0.6, -0.3, 0.4, 0.9}),
          0.1};
}

// A network that is not canonical, and one that is driven and damped too: the order is that of the
// method all the same.
TEST(Order, OnDrivenDampedAndComposedSystems) {
  const double T = 1;
  for (const bool driven : {false, true}) {
    const auto p = charge_in_a_field(driven);
    const auto exact =
        gauss_reference(*p.model, {p.start.x.begin(), p.start.x.end()}, Quad(T) / 64, 64, 12);
    int methods = 0;
    for (const auto& d : catalogue()) {
      if (d.rival || d.order == 0 || !test::fits(d, p)) continue;
      double before = INFINITY, now = INFINITY;
      int steps = 4;
      while (true) {
        before = now;
        now = quad_error(d.name, p, T, steps, exact);
        if (std::isfinite(before) && (now < 1e-22 || steps >= (d.order > 2 ? 64 : 512))) break;
        if (steps > 1024) break;  // it gave up every time
        steps *= 2;
      }
      const double order = std::log2(before / now);
      ++methods;
      std::printf("  %-22s declared %2d   measured %5.2f   on the %s\n", d.name.c_str(), d.order,
                  order, p.name.c_str());
      EXPECT_NEAR(order, d.order, 0.05 * d.order + 0.1) << d.name << " on the " << p.name;
    }
    EXPECT_GT(methods, 15) << p.name;
  }
}

/// Canonical, lossless and driven in time: methods for such systems alone see the force at the
/// times of their stages.
test::Problem driven_pendulum() {
  const auto free = test::double_pendulum();
  phs::Network n("driven double pendulum");
  n.add("pendulum", free.model).main("pendulum");
  n.source("push", "pendulum." + free.model->description().ports.back().name,
           phs::function([](auto t) { return decltype(t)(3.0) * phs::sin(decltype(t)(2.0) * t); }));
  const auto model = n.build();
  return {"driven double pendulum", model, phs::State(model->description(), {0.3, -0.2, 0.4, 0.1}),
          0.1};
}

// They treat time as one more coordinate: a force that is frozen over a step costs them an order.
TEST(Order, OfMethodsForLosslessSystemsUnderAForceInTime) {
  const auto p = driven_pendulum();
  const double T = 0.5;
  const auto exact =
      gauss_reference(*p.model, {p.start.x.begin(), p.start.x.end()}, Quad(T) / 32, 32, 12);
  for (const char* name : {"stormer_verlet", "yoshida4_sv", "lobatto4", "tao2", "tao4"}) {
    const double order =
        std::log2(quad_error(name, p, T, 128, exact) / quad_error(name, p, T, 256, exact));
    std::printf("  %-16s measured %5.2f\n", name, order);
    EXPECT_NEAR(order, declaration_of(name).order, 0.1) << name;
  }
}

// What the suite sees in 113 bits is what a run does in double: the same step, the same error.
TEST(Order, DoubleIsTheSameMethod) {
  const auto p = test::double_pendulum();
  for (const auto& d : catalogue()) {
    if (d.rival || !test::fits(d, p)) continue;
    phs::State s = p.start;
    phs::BasicState<Quad> q(p.model->description(), {p.start.x.begin(), p.start.x.end()});
    const auto in_double = make_integrator(d.name, *p.model, p.h);
    const auto in_quad = make_basic_integrator<Quad>(d.name, *p.model, p.h, {.max_sweeps = 400});
    for (int i = 0; i < 4; ++i)
      ASSERT_TRUE(in_double->step(s) == Outcome::ok && in_quad->step(q) == Outcome::ok) << d.name;
    for (size_t k = 0; k < q.x.size(); ++k) q.x[k] += q.lo[k];
    EXPECT_LE(test::distance(test::unwrapped(p.model->description(), s), q.x), 1e-12) << d.name;
  }
}

// A free-floating arm in fast motion: quaternion, wrapped angles, six joints. The order is the
// least-squares slope over the errors between 2e-7 (2e-4 up to order 2) and round-off.
TEST(Order, OnAFloatingArm) {
  for (const auto& d : catalogue()) {
    if (d.rival || d.order == 0 || d.order > 8 || misfit(d, robot().model->description())) continue;
    if (d.order > 6 && d.family == "Compositions")
      continue;  // not yet asymptotic where double still sees
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, error = 1;
    for (double steps = 16; steps < 3000 && error > 1e-12; steps *= std::sqrt(2)) {
      const int k = int(std::lround(steps));
      error = error_after(d.name, k);
      if (!(error < (d.order <= 2 ? 2e-4 : 2e-7)) || error < 1e-13) continue;
      const double x = -std::log2(double(k)), y = std::log2(error);
      n += 1;
      sx += x;
      sy += y;
      sxx += x * x;
      sxy += x * y;
    }
    if (d.order == 1) continue;  // its errors are too large here to tell
    const double order = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    std::printf("  %-22s declared %2d   measured %5.2f   over %g step sizes\n", d.name.c_str(),
                d.order, order, n);
    EXPECT_GE(n, 3) << d.name;
    EXPECT_NEAR(order, d.order, 0.1 * d.order + 0.1) << d.name;
  }
}

}  // namespace
}  // namespace porthos::integrators::order_test
