// Sampled controllers: a zero-order hold against its closed form, the energy it injects, passive
// sampling, restart.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "integrators/control/event.h"
#include "integrators/control/step_control.h"
#include "phs/network/network.h"
#include "phs/system/check.h"
#include "tests/support/swinging_pendulum.h"

namespace porthos::test::sampled_test {
namespace {

using integrators::make_integrator;
using integrators::Outcome;
using phs::Network;

constexpr double k = 40, d = 3;  // gains of a mass of 2 kg
phs::LawPtr pd(double stiffness = k, double damping = d) {
  return phs::law([=](auto, auto x, auto y, auto u) {
    using T = typename decltype(u)::value_type;
    u[0] = -T(stiffness) * x[0] - T(damping) * y[0];
  });
}

/// x = (q, p) of a mass.
struct Mass {
  static constexpr double m = 2;
  static phs::Description description() {
    phs::Description r;
    r.name = "mass";
    r.nx = 2;
    r.nu = 1;
    r.blocks = {{"position", phs::BlockKind::linear, 0, 1, 1, "m", "N s"}};
    r.ports = {{"force", phs::PortKind::effort_in, 1, 0, "N", "m/s"}};
    r.traits.canonical = r.traits.separable = true;
    return r;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[1] * x[1] / T(2 * m);
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};

std::shared_ptr<const phs::NetworkModel> sampled_mass(double period, bool mean = false,
                                                      double stiffness = k, double damping = d) {
  Network n("servo");
  n.add("mass", std::make_shared<phs::UserModel<Mass>>(Mass{}));
  const std::vector<std::string> encoder = {"mass.position"};
  n.control("pd", "mass.force", pd(stiffness, damping),
            {period, mean ? encoder : std::vector<std::string>{}});
  return n.build();
}

// Between instants the mass moves on a parabola; ∫ κ y dt over it is a polynomial.
TEST(Sampled, AHoldAgainstItsClosedForm) {
  const double T = 0.1;
  const auto model = sampled_mass(T);
  const auto method = make_integrator("gauss4", *model, 0.05);
  phs::State s(model->description(), {0.3, 0});
  double q = 0.3, v = 0, controller = 0, hold = 0;
  double booked[2] = {0, 0}, error = 0, most_held = 0;
  for (int i = 0; i < 60; ++i) {
    const double u = -k * q - d * v, a = u / Mass::m;
    const double q1 = q + v * T + a * T * T / 2, v1 = v + a * T;
    // κ y = -k q v - d v²: -k Δ(q²/2) and ∫ (v + a t)² dt
    const double wished =
        -k * (q1 * q1 - q * q) / 2 - d * (v * v * T + v * a * T * T + a * a * T * T * T / 3);
    controller += wished;
    hold += u * (q1 - q) - wished;
    q = q1;
    v = v1;
    for (int step = 0; step < 2; ++step) {
      ASSERT_EQ(method->step(s), Outcome::ok);
      for (int row = 0; row < 2; ++row) booked[row] += method->port_work()[size_t(row)];
    }
    error = std::max({error, std::fabs(s.x[0] - q), std::fabs(s.x[1] / Mass::m - v),
                      std::fabs(booked[0] - controller), std::fabs(booked[1] - hold)});
    most_held = std::max(most_held, std::fabs(hold));
  }
  std::printf("  60 instants: motion and works off by %.1e (1e-13); the hold gave %.3f J\n", error,
              hold);
  EXPECT_LT(error, 1e-13);
  EXPECT_GT(most_held, 0.1) << "the control: a hold is not the continuous law";
  EXPECT_EQ(model->description().powers[1].name, "pd.hold");
}

/// Energy the hold injected until t = 2 s.
double injected(double period) {
  const auto model = sampled_mass(period);
  const auto method = make_integrator("gauss4", *model, period);
  phs::State s(model->description(), {0.3, 0});
  double sum = 0;
  while (method->time(s) < 2 - 1e-9) {
    EXPECT_EQ(method->step(s), Outcome::ok);
    sum += method->port_work()[1];
  }
  return sum;
}

TEST(Sampled, TheHoldInjectsInProportionToItsPeriod) {
  const double coarse = injected(0.02), fine = injected(0.01), finest = injected(0.005);
  std::printf("  injected %.4f, %.4f, %.4f J at 20, 10, 5 ms: ratios %.2f, %.2f (2)\n", coarse,
              fine, finest, coarse / fine, fine / finest);
  EXPECT_GT(finest, 0);
  EXPECT_NEAR(fine / finest, 2, 0.1);
}

// Σ held · mean flow · period is the energy that went in, whatever happens between the instants;
// with the flow at the instants a damper, passive as a law, gives energy that the sampled numbers
// do not tell.
TEST(Sampled, MeanFlowsCountTheEnergyExactly) {
  const double T = 0.25;
  for (const bool mean : {true, false}) {
    const auto model = sampled_mass(T, mean, 0, 12);  // d T/m = 1.5: too strong for its rate
    const auto method = make_integrator("gauss4", *model, T / 4);
    phs::State s(model->description(), {0, 2});
    double sampled = 0, scale = 0, most = 0;
    for (int i = 0; i < 24; ++i) {
      const double q = s.x[0] + s.lo[0], v = (s.x[1] + s.lo[1]) / Mass::m;
      for (int j = 0; j < 4; ++j) ASSERT_EQ(method->step(s), Outcome::ok);
      const double u = method->sampler().memory()[0], flow = mean ? (s.x[0] + s.lo[0] - q) / T : v;
      sampled += T * u * flow;
      scale += std::fabs(T * u * flow);
      const double H = s.x[1] * s.x[1] / (2 * Mass::m);
      most = std::max(most, std::fabs(sampled - (H - 1)));
    }
    std::printf("  %-7s flow: sampled sum against the energy %.1e of %.2f J%s\n",
                mean ? "mean" : "instant", most, scale, mean ? " (1e-13)" : " (control, > 0.1)");
    if (mean)
      EXPECT_LT(most, 1e-13 * scale);
    else
      EXPECT_GT(most, 0.1 * scale);
  }
}

TEST(Sampled, ContinuesBitForBitBetweenInstants) {
  phs::State ends[2];
  for (const bool interrupted : {false, true}) {
    auto model = sampled_mass(0.1, true);
    auto method = make_integrator("gauss8", *model, 0.02);
    phs::State s(model->description(), {0.3, 0});
    for (int i = 0; i < 50; ++i) {
      if (interrupted && i == 23) {  // two steps before an instant
        const auto memory = method->memory(), held = method->sampler().memory();
        model = sampled_mass(0.1, true);
        method = make_integrator("gauss8", *model, 0.02);
        method->restore(memory);
        method->sampler().restore(held);
      }
      ASSERT_EQ(method->step(s), Outcome::ok);
    }
    ends[interrupted] = s;
  }
  EXPECT_EQ(ends[0].x, ends[1].x);
  EXPECT_EQ(ends[0].lo, ends[1].lo);
}

// A continuous controller is a spring and a damper where its law says so; its axioms are those of
// any system.
TEST(Sampled, AContinuousControllerIsWhatItsLawSays) {
  const auto robot = swinging_pendulum();
  Network a("controlled"), b("sprung");
  for (Network* n : {&a, &b}) n->add("arm", robot.model);
  a.control("pd", "arm.lower.torque", phs::law([](auto, auto x, auto y, auto u) {
              using T = typename decltype(u)::value_type;
              u[0] = T(-7.0) * x[1] - T(0.5) * y[0];
            }));
  b.potential("spring", "arm.lower", phs::spring(7))
      .resist("damper", "arm.lower.torque", phs::viscous(0.5));
  const auto controlled = a.build(), sprung = b.build();
  const auto axioms = phs::check(*controlled);
  EXPECT_TRUE(axioms.holds()) << axioms.text();
  EXPECT_TRUE(controlled->description().powers.at(0).control);
  auto one = robot.start, two = robot.start;
  const auto first = make_integrator("gauss12", *controlled, 0.02),
             second = make_integrator("gauss12", *sprung, 0.02);
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    ASSERT_EQ(first->step(one), Outcome::ok);
    ASSERT_EQ(second->step(two), Outcome::ok);
    ASSERT_EQ(one.turns, two.turns);
    for (size_t n = 0; n < 4; ++n) worst = std::max(worst, std::fabs(one.x[n] - two.x[n]));
  }
  std::printf("  10 s of both: %.1e apart (1e-11)\n", worst);
  EXPECT_LT(worst, 1e-11);
}

template <class F>
std::string refusal(F f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "(accepted)";
}

// Events between instants: what is held stays held, and the instants stay where they are.
TEST(Sampled, EventsBetweenInstantsMoveNone) {
  const auto model = sampled_mass(0.1);
  const auto make = [&] { return make_integrator("gauss4", *model, 0.05); };
  const phs::State start(model->description(), {0.3, 0});
  phs::State plain = start, s = start;
  const auto method = make();
  for (int k = 0; k < 100; ++k) ASSERT_EQ(method->step(plain), integrators::Outcome::ok);
  integrators::EventStepper run(
      *model, make, {{[](double t, std::span<const double>) { return std::sin(7 * t + 0.1); }}},
      {.to_grid = true});
  int events = 0;
  while (s.step < 100 || s.origin_step != 0) {
    const auto r = run.step(s);
    ASSERT_EQ(r.outcome, integrators::Outcome::ok);
    events += r.event >= 0;
  }
  const double off = std::max(std::fabs(s.x[0] - plain.x[0]), std::fabs(s.x[1] - plain.x[1]));
  std::printf("  %d events in 5 s; state off by %.1e   bound 1e-14\n", events, off);
  EXPECT_EQ(events, 11);
  EXPECT_LT(off, 1e-14);
  EXPECT_EQ(s.step, plain.step);
  EXPECT_EQ(run.time(s), method->time(plain));
}

TEST(Sampled, WhatWouldMissAnInstantIsRefused) {
  const auto model = sampled_mass(0.1);
  EXPECT_EQ(refusal([&] { make_integrator("gauss4", *model, 0.03); }),
            "the controller 'pd' is sampled every 0.1 s, 3.33333333 steps of 0.03 s, expected a "
            "whole number of them, as at 11.1111111 Hz or with step = 0.0333333333333333");
  // The step that is named does as it is printed, also where few digits are left out.
  EXPECT_EQ(refusal([&] { make_integrator("gauss4", *model, 0.0333333333333333); }), "(accepted)");
  EXPECT_TRUE(refusal([&] {
                make_integrator("gauss4", *model, 0.0333333);
              }).ends_with(" Hz or with step = 0.0333333333333333"));
  EXPECT_TRUE(refusal([&] {
                make_integrator("gauss4", *model, 0.3);
              }).ends_with("as at 3.33333333 Hz or with step = 0.1"));
  const auto method = make_integrator("gauss4", *model, 0.1);
  phs::State s(model->description(), {0.3, 0});
  // An odd step holds, and so does the next; a whole one from there would not begin at an instant.
  EXPECT_EQ(refusal([&] {
              (void)method->step_by(s, 0.01);
              (void)method->step(s);
            }),
            "(accepted)");
  EXPECT_NE(refusal([&] { (void)method->step(s); }).find("would miss its instants"),
            std::string::npos);
  // Steps of varying size end at the instants instead: tests/run/controlled_events_test.cpp.
  EXPECT_NE(refusal([&] {
              integrators::EventStepper(*model,
                                        [&] { return make_integrator("gauss4", *model, 0.1); }, {});
            }).find("a step that ends at an event"),
            std::string::npos);
  Network n("n");
  n.add("mass", std::make_shared<phs::UserModel<Mass>>(Mass{}));
  EXPECT_EQ(
      refusal([&] { n.control("pd", "mass.force", pd(), {-1}); }),
      "network 'n': the period of the controller 'pd' is -1 s, expected a positive number, or "
      "0 for a continuous one");
  EXPECT_EQ(refusal([&] {
              n.control("pd", "mass.force", pd(), {0, {"mass.position"}});
            }),
            "network 'n': the controller 'pd' has an encoder without a period, expected both");
  EXPECT_EQ(
      refusal([&] {
        n.control("pd", "mass.force", pd(), {0.1, {"mass.angle"}});
      }),
      "network 'n': the encoder of 'pd': unknown coordinate 'mass.angle', expected one of the "
      "member 'mass'");
  EXPECT_EQ(refusal([&] { n.control("pd", "mass.force", nullptr); }),
            "network 'n': the law of the controller 'pd' is null");
  Network outer("outer");
  EXPECT_EQ(refusal([&] { outer.add("servo", model); }),
            "network 'outer': member 'servo' has sampled controllers inside, expected them in the "
            "outermost network");
}

// A model is shared by runs, and what a controller holds belongs to each of them.
TEST(Sampled, RunsOfOneModelSideBySideHaveTheBitsTheyHaveAlone) {
  const auto model = sampled_mass(0.25, false, 0, 1);
  const auto after = [&](double start, integrators::Integrator* other) {
    const auto method = make_integrator("gauss4", *model, 0.0625);
    phs::State s(model->description(), {0, start}), aside(model->description(), {5, -1});
    for (int i = 0; i < 10; ++i) {
      EXPECT_EQ(method->step(s), Outcome::ok);
      if (other) {
        EXPECT_EQ(other->step(aside), Outcome::ok);
      }
    }
    return s;
  };
  const auto other = make_integrator("gauss4", *model, 0.0625);
  EXPECT_TRUE(after(2, nullptr) == after(2, other.get()));
  EXPECT_FALSE(after(2, nullptr) == after(3, nullptr)) << "the control: what is held matters";
  EXPECT_EQ(model->holds().at(0)->fresh, std::vector<double>{0}) << "the model is as it was";
}

}  // namespace
}  // namespace porthos::test::sampled_test
