// The power balance of nonlinear systems that lose energy and take it in through a port.
#include <gtest/gtest.h>

#include <functional>

#include "integrators/methods/collocation.h"
#include "phs/system/user_model.h"
#include "tests/support/energy_run.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::integrators::passivity_test {
namespace {

using phs::Quad;
using Make = std::function<std::unique_ptr<Integrator>(const phs::Model&, double h)>;

Make by_name(const std::string& name) {
  return [name](const phs::Model& m, double h) { return make_integrator(name, m, h); };
}

/// H = p²/2 + q⁴/4, p' = -q³ - 0.1 p + u with u = sin t held over each step of 0.05.
struct QuarticOscillator {
  static constexpr double h = 0.05;
  phs::Description description() const {
    phs::Description d;
    d.name = "quartic oscillator";
    d.nx = 2;
    d.nu = 1;
    d.traits = {.autonomous = false, .canonical = true, .separable = true, .lossless = false};
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    d.ports = {{"q.force", phs::PortKind::effort_in, 1, 0, "N", "m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T q2 = x[0] * x[0];
    return T(0.5) * x[1] * x[1] + T(0.25) * q2 * q2;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0] * x[0] * x[0];
    e[1] = x[1];
  }
  template <class T>
  T friction(T) const {
    return T(0.1);
  }
  template <class T>
  T lever(T) const {
    return T(1.0);
  }
};

/// Mass, friction and port depend on the place: H = ½ p²/(1 + q²) + q²/2 + q⁴/4, r = 0.05 q², G = 1
/// + 0.3 q.
struct Mud : QuarticOscillator {
  phs::Description description() const {
    auto d = QuarticOscillator::description();
    d.name = "mud";
    d.traits.separable = false;
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T q2 = x[0] * x[0];
    return T(0.5) * x[1] * x[1] / (T(1.0) + q2) + T(0.5) * q2 + T(0.25) * q2 * q2;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    const T q2 = x[0] * x[0], v = x[1] / (T(1.0) + q2);
    e[0] = x[0] * (T(1.0) + q2 - v * v);
    e[1] = v;
  }
  template <class T>
  T friction(T q) const {
    return T(0.05) * q * q;
  }
  template <class T>
  T lever(T q) const {
    return T(1.0) + T(0.3) * q;
  }
};

/// The rest of the contract, from friction and lever.
template <class S>
struct Driven : S {
  template <class T>
  void dissipation(std::span<const T> x, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = S::friction(x[0]) * e[1];
  }
  template <class T>
  void input(std::span<const T> x, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = S::lever(x[0]) * u[0];
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    using phs::sin, std::sin;
    dx[1] = dx[1] + S::lever(x[0]) * phs::sin(t);
  }
};

struct Balance {
  double defect = 0;              ///< largest of a step [J]
  double lost = 0, supplied = 0;  ///< in all [J]
};

/// H1 - H0 + h ēᵀR(m)ē - h ȳu of every step, with q1 - q0 = h ∂̄_pH: loss r(m) (q1 - q0)²/h and
/// supply u G(m) (q1 - q0) are read off the trajectory and ask nothing of the method. u is its
/// value at the middle of the step.
template <class S>
Balance balance(const Make& make, int steps) {
  const double h = S::h;
  const phs::UserModel<Driven<S>> model{Driven<S>{}};
  const auto method = make(model, h);
  phs::State s(model.description(), {1.5, 0.3});
  const S system{};
  Balance b;
  auto x = test::unwrapped(model.description(), s);
  for (int i = 0; i < steps; ++i) {
    const auto before = x;
    const double u = std::sin(method->time(s) + 0.5 * h);
    if (method->step(s) != Outcome::ok) {
      b.defect = HUGE_VAL;
      return b;
    }
    x = test::unwrapped(model.description(), s);
    const Quad dq = x[0] - before[0], m = (x[0] + before[0]) / 2;
    const Quad lost = system.friction(m) * dq * dq / Quad(h), in = Quad(u) * system.lever(m) * dq;
    const Quad defect = system.hamiltonian(std::span<const Quad>(x)) -
                        system.hamiltonian(std::span<const Quad>(before)) + lost - in;
    b.defect = std::max(b.defect, std::fabs(double(defect)));
    b.lost += double(lost);
    b.supplied += double(in);
  }
  return b;
}

// Every method whose step asks for the dissipation and the drive once can be held against that
// balance. Those of higher order have sums over stages in its place; they fail because already H is
// not exact without friction and port.
TEST(Passivity, EveryClaim) {
  int holding = 0;
  for (const auto& d : catalogue()) {
    if (d.rival || d.order == 0) continue;
    if (d.passivity_exact == Claim::holds) {
      EXPECT_EQ(d.energy_exact, Claim::holds) << d.name << ": no friction is friction too";
    }
    const bool holds = d.passivity_exact == Claim::holds;
    const auto quartic = phs::UserModel<Driven<QuarticOscillator>>({}).description();
    if ((!holds && d.order > 2) || misfit(d, quartic)) continue;
    const auto b = balance<QuarticOscillator>(by_name(d.name), 2000);
    std::printf("  %-16s %-7s  lost %.1f J, supplied %.1f J, defect of a step %.1e J\n",
                d.name.c_str(), to_string(d.passivity_exact), b.lost, b.supplied, b.defect);
    if (holds) {
      ++holding;
      EXPECT_LE(b.defect, 1e-14) << d.name;
      EXPECT_GT(std::min(b.lost, b.supplied), 10) << "friction and port must matter";
    } else if (d.passivity_exact == Claim::fails) {
      EXPECT_GT(b.defect, 1e-5) << d.name << " must fail";
    }
  }
  EXPECT_GE(holding, 4);
}

// R and G at the middle. HBVM averages R ∇H over the step, which is something else where R depends
// on the state.
TEST(Passivity, MassFrictionAndPortThatDependOnTheState) {
  const int steps = 1000;
  for (const char* name : {"gonzalez", "mean_value", "itoh_abe", "itoh_abe2"}) {
    const auto b = balance<Mud>(by_name(name), steps);
    test::keeps(name, b.defect, 2e-14);
    EXPECT_GT(std::min(b.lost, b.supplied), 1) << "friction and port must matter";
  }
  const Make hbvm = [](const phs::Model& m, double h) {
    return make_collocation<double>({.name = "hbvm2", .order = 2}, hbvm_table<double>(16, 1), m, h,
                                    {});
  };
  test::breaks("HBVM(16,1)", balance<Mud>(hbvm, steps).defect, 1e-6);
  test::breaks("midpoint", balance<Mud>(by_name("midpoint"), steps).defect, 1e-6);
}

// A mechanism with joint dampers: the loss is Σ d_j (q1 - q0)_j² / h.
TEST(Passivity, BalanceOfADampedPendulum) {
  const double damping = 0.15, h = 0.03;
  const int steps = 600;
  const auto r = test::swinging_pendulum(damping);
  test::Gauge gauge(*r.model);
  const auto H0 = gauge.energy(r.start);
  const double bound = 5e-16 * std::sqrt(double(steps)) * double(H0);
  for (const char* name : {"gonzalez", "mean_value", "itoh_abe", "itoh_abe2", "midpoint", "rk4"}) {
    phs::State s = r.start;
    const auto method = make_integrator(name, *r.model, h);
    auto q = test::unwrapped(r.model->description(), s);
    Quad lost = 0;
    double worst = 0;
    for (int i = 0; i < steps; ++i) {
      ASSERT_EQ(method->step(s), Outcome::ok) << name;
      const auto before = std::move(q);
      q = test::unwrapped(r.model->description(), s);
      for (size_t k = 0; k < 2; ++k)
        lost += Quad(damping) * (q[k] - before[k]) * (q[k] - before[k]) / Quad(h);
      worst = std::max(worst, std::fabs(double(Quad(gauge.energy(s) - H0) + lost)));
    }
    EXPECT_GT(double(lost), 10) << "the damping must matter";
    if (declaration_of(name).passivity_exact == Claim::holds)
      test::keeps(name, worst, bound);
    else
      test::breaks(name, worst, 1e6 * bound);
  }
}

}  // namespace
}  // namespace porthos::integrators::passivity_test
