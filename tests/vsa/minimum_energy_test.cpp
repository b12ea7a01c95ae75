// Least energy for a change of stiffness: against closed forms, against other paths, and against
// the ledger of a run.
#include "vsa/minimum_energy.h"

#include "integrators/core/integrator.h"
#include "tests/support/bounds.h"
#include "tests/support/robots.h"
#include "tests/vsa/actuators.h"
#include "vsa/jet.h"
#include "vsa/planning.h"

namespace porthos::test::minimum_energy_test {
namespace {

using Kind = vsa::Drive::Kind;

vsa::ElasticPtr linear_lever() {  // k = 20 + 60 σ: at a deflection held, a constant pull on σ
  return vsa::variable_lever({{20, 60}}, {.sigma_lower = 0, .sigma_upper = 1});
}
vsa::Drive motor(double viscous) {
  return {.kind = Kind::torque, .inertia = 2e-5, .gear = 100, .viscous = viscous};  // n² J = 0.2
}

/// With a constant pull and the ends at rest Euler's equation is σ'''' = κ² σ'', κ² = (c d² + d) /
/// (c J²):
/// σ' = A (1 - cosh κ(t - T/2) / cosh κT/2).
TEST(MinimumEnergy, IsTheClosedFormWhereThePullIsConstant) {
  const auto lever = linear_lever();
  const double T = 0.4, c = 0.5, J = 0.2;
  for (const auto& [kT, bound] :
       {std::pair{0.0, 1e-13}, {1.0, 1e-11}, {10.0, 1e-8}, {40.0, 1e-4}}) {
    // c d² + d = c J² κ², solved for d
    const double m = kT * kT * J * J / (T * T);
    const double d = kT == 0 ? 0 : (-1 + std::sqrt(1 + 4 * c * c * m)) / (2 * c);
    const auto plan = vsa::minimum_energy_change(
        lever, motor(d / 1e4),
        {.deflection = 0.3, .from = 0.1, .to = 0.8, .duration = T, .winding_loss = c});
    double worst = 0;
    for (int i = 0; i <= 200; ++i) {
      const double s = i / 200.0, x = kT * (s - 0.5);
      const double moved =
          kT == 0 ? s * s * (3 - 2 * s)
                  : (s - (std::sinh(x) + std::sinh(kT / 2)) / (kT * std::cosh(kT / 2))) /
                        (1 - 2 / kT * std::tanh(kT / 2));
      worst = std::max(worst, std::fabs((plan.sigma(s * T) - 0.1) / 0.7 - moved));
    }
    char name[80];
    std::snprintf(name, sizeof name, "kappa T = %2.0f: sigma, of the change", kT);
    keeps(name, worst, bound);
    keeps("  slope left, relative", plan.stationarity, 1e-10);
    if (kT == 0) {  // ∫ c (J σ'' + F)² with σ'' = 6 Δ (1 - 2s) / T²: 12 c J² Δ² / T³ + c F² T
      const double F = 0.5 * 60 * 0.09;
      keeps("  winding loss of the cubic, relative",
            std::fabs(plan.winding / (c * (12 * J * J * 0.49 / (T * T * T) + F * F * T)) - 1),
            1e-13);
      EXPECT_EQ(plan.friction, 0);
    }
    if (kT == 40.0) {  // the cubic is not the least here
      const double cubic = d * 1.2 * 0.49 / T;
      breaks("  friction of the cubic over that of the plan", cubic / plan.friction, 1.1);
    }
  }
}

/// The link is held by its own inertia: 1e15 kg m², which the spring moves by 1e-16 rad.
std::shared_ptr<const phs::NetworkModel> held(const vsa::Actuator& a) {
  phs::Network n("held link");
  n.add("mechanism", pendulum(1e15, 0)).main("mechanism");
  vsa::attach(n, "vsa", "mechanism.hinge.torque", a);
  return n.build();
}
phs::State start_of(const phs::NetworkModel& model, const vsa::Actuator& a, double link,
                    double theta, double sigma) {
  return state_of(model, {link, 0}, {{"vsa", vsa::actuator_start("vsa", a, link, theta, sigma)}});
}

struct Ledger {
  double work = 0, viscous = 0, winding = 0, defect = 0, sigma = 0, rate = 0;
};
/// The torque of a plan from its start.
Ledger run(const vsa::ElasticPtr& e, const vsa::Drive& drive, double phi, double from, double T,
           const phs::FunctionPtr& torque, double c) {
  vsa::Actuator a{.elastic = e, .sigma = drive};
  a.sigma.command = torque;
  const auto model = held(a);
  const auto start = start_of(*model, a, phi, 0, from);
  phs::State s = start;
  const int steps = 200;
  const auto method = integrators::make_integrator("gauss16", *model, T / steps);
  Gauge gauge(*model);
  Ledger l;
  long double in = 0;
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(method->step(s), integrators::Outcome::ok);
    for (size_t k = 0; k < method->port_work().size(); ++k) {
      const auto& p = model->description().powers[k];
      const double w = method->port_work()[k];
      in += p.kind == phs::PowerKind::supplied ? w : -w;
      (p.name == "vsa.sigma.torque" ? l.work : l.viscous) += w;
    }
    const double t = (i + 0.5) * T / steps,
                 tau = (*torque)(t);  // the windings, by the midpoint rule
    l.winding += c * tau * tau * T / steps;
  }
  l.defect = double(std::fabs(gauge.energy(s) - gauge.energy(start) - in));
  const size_t at = size_t(model->offset("vsa"));
  l.sigma = s.x[at + 2];
  l.rate = s.x[at + 3] / (drive.gear * drive.gear * drive.inertia);
  return l;
}

TEST(MinimumEnergy, TheLedgerOfARunSaysWhatThePlanSays) {
  const vsa::ElasticPtr energies[] = {
      linear_lever(), vsa::elastic_of(vsa::device("qbmove_advanced")),
      vsa::variable_lever({{20, 60, 120}}, {.sigma_lower = 0, .sigma_upper = 1})};
  const double c = 0.5, T = 0.3, phi = 0.2, from = 0.1, to = 0.4;
  for (const auto& e : energies) {
    const auto drive = motor(2e-5);
    const auto plan = vsa::minimum_energy_change(e, drive, {phi, from, to, T, c});
    const auto l = run(e, drive, phi, from, T, plan.torque, c);
    std::printf("%s, stiffness %.2f to %.2f N m/rad: spring %.4f, friction %.4f, windings %.4f J\n",
                e->traits().family.c_str(), e->stiffness(phi, 0, from), e->stiffness(phi, 0, to),
                plan.spring, plan.friction, plan.winding);
    keeps("ledger [J]", l.defect, 1e-13);
    keeps("work of the motor, ledger - plan [J]", std::fabs(l.work - plan.work()), 1e-11);
    keeps("viscous loss, ledger - plan [J]", std::fabs(l.viscous - plan.friction), 1e-11);
    keeps("windings, by the midpoint rule - plan, relative",
          std::fabs(l.winding / plan.winding - 1), 1e-4);
    keeps("arrives: sigma", std::fabs(l.sigma - to), 1e-11);
    keeps("arrives: rate", std::fabs(l.rate), 1e-9);
    EXPECT_EQ((*plan.torque)(2 * T), e->slopes(phi, 0.0, plan.sigma(T)).sigma) << "and holds";
    // Another path between the same ends takes more: the cubic, and the plan with a wiggle, at rest
    // at both ends.
    const auto takes = [&](auto sigma) {  // by differences, midpoint rule
      double sum = 0;
      const double h = T / 4000;
      for (int i = 0; i < 4000; ++i) {
        const double t = (i + 0.5) * h, eps = 1e-4 * T;
        const double v = (sigma(t + eps) - sigma(t - eps)) / (2 * eps);
        const double w = (sigma(t + eps) - 2 * sigma(t) + sigma(t - eps)) / (eps * eps);
        const double tau = 0.2 * w + 0.2 * v + e->slopes(phi, 0.0, sigma(t)).sigma;
        sum += h * (tau * v + c * tau * tau);
      }
      return sum;
    };
    const double own = takes([&](double t) { return plan.sigma(t); });
    keeps("electrical energy, by differences - plan, relative",
          std::fabs(own / plan.electrical() - 1), 1e-5);
    for (const double size : {-0.02, 0.02})
      for (const int waves : {1, 2}) {
        const double other = takes([&](double t) {
          const double x = std::sin(waves * std::numbers::pi * t / T);
          return plan.sigma(t) + size * x * x;
        });
        breaks("a wiggle more, relative", other / own - 1, 1e-3);
      }
  }
}

// The constant-energy path, walked with flow inputs: what one port takes the other gives, each
// stated by the ledger.
TEST(MinimumEnergy, ConstantEnergyPathsByTheLedger) {
  const auto lever = vsa::variable_lever({{20, 60, 120}}, {.sigma_lower = 0, .sigma_upper = 1});
  static constexpr int parts = 100;
  const double part = 0.01;
  const auto path = vsa::constant_energy_path(*lever, 0.3, 0.1, 0.2, parts);
  // θ = -φ, σ: from point to point at constant rates, each a whole step
  const auto rate_of = [&](auto number) {
    std::vector<double> rates;
    for (int i = 0; i < parts; ++i)
      rates.push_back((number(path[size_t(i) + 1]) - number(path[size_t(i)])) / part);
    return phs::function([rates, part](auto t) {
      using T = decltype(t);
      return vsa::gather<T>([&](int lane) {
        return rates[size_t(std::clamp(int(vsa::lane(t, lane) / part), 0, parts - 1))];
      });
    });
  };
  vsa::Actuator a{.elastic = lever, .theta = {.kind = Kind::rate}, .sigma = {.kind = Kind::rate}};
  a.theta.command = rate_of([](const auto& p) { return -p.phi; });
  a.sigma.command = rate_of([](const auto& p) { return p.sigma; });
  const auto model = held(a);
  const auto start = start_of(*model, a, 0, -0.3, 0.1);
  phs::State s = start;
  const auto method = integrators::make_integrator("gauss8", *model, part);
  double turn = 0, retune = 0;
  for (int i = 0; i < parts; ++i) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok);
    for (size_t k = 0; k < method->port_work().size(); ++k) {
      const auto& name = model->description().powers[k].name;
      (name == "vsa.theta.rate" ? turn : retune) += method->port_work()[k];
    }
  }
  std::printf("  stiffness %.2f to %.2f N m/rad: motor %.6f J, stiffness port %.6f J\n",
              path.front().stiffness, path.back().stiffness, turn, retune);
  keeps("sum of the works [J]", std::fabs(turn + retune), 1e-13);
  // k φ² stays 27.2 · 0.09: the motor gives ∫ k φ dφ = 2.448 ln(2/3)
  keeps("work of the motor, closed form [J]", std::fabs(turn - 2.448 * std::log(2.0 / 3)), 1e-4);
  breaks("stiffness port at the deflection held instead [J]",
         lever->energy(0.3, 0.0, path.back().sigma) - lever->energy(0.3, 0.0, 0.1), retune);
}

TEST(MinimumEnergy, WhatCannotBeIsRefused) {
  const auto lever = linear_lever();
  const vsa::StiffnessChange good{0.3, 0.1, 0.8, 0.4, 0.5};
  const auto why = [&](vsa::ElasticPtr e, vsa::Drive d, vsa::StiffnessChange c) {
    return refusal([&] { vsa::minimum_energy_change(e, d, c); });
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  EXPECT_EQ(why(lever, motor(0), good), "");
  has(why(vsa::series_elastic({10.0}), motor(0), good), "does not depend on sigma");
  has(why(lever, {.kind = Kind::rate}, good), "has no torque drive");
  has(why(lever, {.kind = Kind::torque}, good), "inertia is 0");
  auto limited = motor(0);
  limited.torque_limit = 3;
  has(why(lever, limited, good), "friction law or a limit");
  has(why(lever, motor(0), {0.3, 0.1, 0.8, 0.4, 0}), "the least is not attained");
  has(why(lever, motor(0), {0.3, 0.1, 0.8, 0, 0.5}), "the duration is 0");
  has(why(lever, motor(0), {0.3, 0.1, 1.8, 0.4, 0.5}), "end");
  // A pull that grows with σ makes waiting at low σ cheap: it would go below its range.
  has(why(vsa::variable_lever({{20, 60, 120}}, {.sigma_lower = 0, .sigma_upper = 1}), motor(0),
          {0.6, 0.0, 0.9, 3, 0.5}),
      "the best path passes sigma");
}

}  // namespace
}  // namespace porthos::test::minimum_energy_test
