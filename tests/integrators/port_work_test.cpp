// The ledger of a run: works through ports and losses against references, and the defect of the
// balance by method.
#include <gtest/gtest.h>

#include <cstdio>

#include "integrators/core/integrator.h"
#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "phs/network/network.h"
#include "tests/support/driven_pendulum.h"
#include "tests/support/reference.h"
#include "tests/support/robots.h"

namespace porthos::test::port_work_test {
namespace {

using integrators::make_integrator;
using integrators::Outcome;
using phs::Matrix;
using phs::Network;
using phs::PowerKind;

/// Runs with the ledger open.
struct Ledger {
  const phs::Model& model;
  std::unique_ptr<integrators::Integrator> method;
  phs::State state;
  Gauge gauge;
  std::vector<double> work, low;
  double turned_over = 0, worst_defect = 0;
  long double start;

  Ledger(const phs::Model& m, const std::string& name, double h, std::vector<double> x)
      : model(m),
        method(make_integrator(name, m, h)),
        state(m.description(), std::move(x)),
        gauge(m),
        work(m.description().powers.size()),
        low(work.size()),
        start(H()) {}
  long double H() { return gauge.energy(state); }
  void run_to(double t, bool watch = false) {
    while (method->time(state) < t - 1e-9) {
      ASSERT_EQ(method->step(state), Outcome::ok);
      for (size_t a = 0; a < work.size(); ++a) {
        phs::compensated_add(work[a], low[a], method->port_work()[a]);
        turned_over += std::fabs(method->port_work()[a]);
      }
      if (watch) worst_defect = std::max(worst_defect, std::fabs(defect()));
    }
  }
  double sum(PowerKind kind) const {
    double s = 0;
    for (size_t a = 0; a < work.size(); ++a)
      if (model.description().powers[a].kind == kind) s += work[a];
    return s;
  }
  double defect() {
    long double d = H() - start;
    for (size_t a = 0; a < work.size(); ++a)
      d += (model.description().powers[a].kind == PowerKind::supplied ? -1 : 1) *
           (static_cast<long double>(work[a]) + low[a]);
    return double(d);
  }
};

double number(const nlohmann::json& j) { return std::stod(j.get<std::string>()); }

mechanics::Mechanism pendulum_of_the_reference() {
  mechanics::MechanismBuilder b("pendulum");
  b.gravity({0, 0, -9.8125});
  mechanics::BodySpec rod;
  rod.name = "rod";
  rod.parent = "world";
  rod.joint.name = "hinge";
  rod.joint.type = "revolute";
  rod.joint.axis = {0, -1, 0};
  rod.mass.mass = 1;
  rod.mass.com = {0, 0, -1};
  b.add(rod);
  return b.build();
}

std::shared_ptr<const phs::NetworkModel> driven_pendulum_of_the_reference() {
  Network n("driven pendulum");
  n.add("pendulum", std::make_shared<mechanics::MechanicalModel>(
                        std::make_shared<mechanics::Mechanism>(pendulum_of_the_reference())));
  n.resist("friction", "pendulum.hinge.torque", phs::viscous(0.25));
  n.source("motor", "pendulum.hinge.torque",
           phs::function([](auto t) { return decltype(t)(4.0) * phs::cos(decltype(t)(2.0) * t); }));
  return n.build();
}

TEST(PortWork, DrivenPendulumOfTheReference) {
  const auto ref = read_json(data_file("reference/n_driven_pendulum.json"));
  const auto model = driven_pendulum_of_the_reference();
  ASSERT_EQ(model->description().powers.size(), 2u);
  for (const std::string name : {"gauss16", "rk4"}) {
    Ledger b(*model, name, name == "rk4" ? 4e-3 : 0.0625, {1.0, 0.5});
    double worst = 0, worst_defect = 0;
    for (const auto& out : ref["outputs"]) {
      b.run_to(number(out["t"]));
      const double W = number(out["group0"][2]), D = number(out["group0"][3]);
      const double H = number(out["group1"][0]);
      const double error = std::max(
          {std::fabs(b.sum(PowerKind::supplied) - W), std::fabs(b.sum(PowerKind::dissipated) - D),
           std::fabs(double(b.H() - b.start) - (H - number(ref["outputs"][0]["group1"][0])))});
      worst = std::max(worst, error / std::max(1.0, b.turned_over));
      worst_defect = std::max(worst_defect, std::fabs(b.defect()) / std::max(1.0, b.turned_over));
    }
    std::printf(
        "  %-8s work, loss and energy against the reference %.1e (1e-12), defect %.1e (1e-12), of "
        "%.0f J turned over\n",
        name.c_str(), worst, worst_defect, b.turned_over);
    if (name == "gauss16") {
      EXPECT_LT(worst, 1e-12);
      EXPECT_LT(worst_defect, 1e-12);
    } else {
      EXPECT_GT(worst_defect, 1e-12) << "negative control: order 4";
    }
  }
}

/// Two links, their motors as inertias behind springs: a member each, all joined through ports.
std::shared_ptr<const phs::NetworkModel> elastic_arm(bool driven) {
  mechanics::MechanismBuilder b("links");
  b.gravity({0, 0, -9.8125});
  const double mass[] = {2, 1}, inertia[] = {0.0625, 0.03125};
  for (int i = 0; i < 2; ++i) {
    mechanics::BodySpec link;
    link.name = i ? "lower" : "upper";
    link.parent = i ? "upper" : "world";
    link.joint.name = i ? "q2" : "q1";
    link.joint.type = "revolute";
    link.joint.axis = {0, -1, 0};
    if (i) link.placement.r = {0, 0, -0.5};
    link.mass.mass = mass[i];
    link.mass.com = {0, 0, -0.25};
    link.mass.inertia = {inertia[i], 0, 0, inertia[i], 0, inertia[i]};
    b.add(link);
  }
  Network n("series-elastic arm");
  n.add("arm", std::make_shared<mechanics::MechanicalModel>(
                   std::make_shared<mechanics::Mechanism>(b.build())));
  n.main("arm");
  const double J[] = {0.125, 0.0625}, K[] = {64, 32}, D[] = {0.125, 0.0625}, B[] = {0.25, 0.125},
               dl[] = {0.0625, 0.03125}, A[] = {3, 1}, Om[] = {1.5, 2.25};
  for (int i = 0; i < 2; ++i) {
    const std::string k = std::to_string(i + 1), joint = "arm.q" + k + ".torque",
                      motor = "motor_" + k, spring = "spring_" + k;
    n.add(motor, phs::inertia_element(J[i])).add(spring, phs::spring_element(phs::spring(K[i])));
    n.zero_junction("drive_" + k, {{spring + ".ends"}, {motor + ".body"}, {joint, -1}});
    n.resist("spring_damping_" + k, {motor + ".body", joint}, Matrix{{D[i], -D[i]}, {-D[i], D[i]}});
    n.resist("motor_friction_" + k, motor + ".body", phs::viscous(B[i]));
    n.resist("joint_friction_" + k, joint, phs::viscous(dl[i]));
    if (driven)
      n.source("torque_" + k, motor + ".body", phs::function([a = A[i], w = Om[i]](auto t) {
                 return decltype(t)(a) * phs::sin(decltype(t)(w) * t);
               }));
  }
  return n.build();
}

TEST(PortWork, SeriesElasticArmOfTheReference) {
  const auto ref = read_json(data_file("reference/m_sea_2dof.json"));
  const auto model = elastic_arm(true);
  // x = (q1 q2 p1 p2, motor_1 spring_1 motor_2 spring_2); at rest, springs at theta - q.
  Ledger b(*model, "gauss16", 0.03125, {0.25, -0.5, 0, 0, 0, 0.125, 0, 0.0});
  double worst = 0, worst_defect = 0, positions = 0;
  for (const auto& out : ref["outputs"]) {
    b.run_to(number(out["t"]));
    const auto& x = b.state.x;
    const double W = number(out["group0"][8]), D = number(out["group0"][9]);
    const double dE = number(out["group1"][0]) - number(ref["outputs"][0]["group1"][0]);
    worst = std::max({worst, std::fabs(b.sum(PowerKind::supplied) - W),
                      std::fabs(b.sum(PowerKind::dissipated) - D),
                      std::fabs(double(b.H() - b.start) - dE)});
    positions = std::max({positions, std::fabs(x[0] - number(out["group0"][0])),
                          std::fabs(x[1] - number(out["group0"][1])),
                          std::fabs(x[0] + x[5] - number(out["group0"][2])),
                          std::fabs(x[1] + x[7] - number(out["group0"][3]))});
    worst_defect = std::max(worst_defect, std::fabs(b.defect()) / std::max(1.0, b.turned_over));
  }
  std::printf(
      "  angles %.1e (1e-12), work, loss and energy %.1e J (1e-12 J), defect %.1e (1e-12) of %.0f "
      "J turned over\n",
      positions, worst, worst_defect, b.turned_over);
  EXPECT_LT(positions, 1e-12);
  EXPECT_LT(worst, 1e-12);
  EXPECT_LT(worst_defect, 1e-12);
}

// The elongation of a spring is the angle between its ends: a Casimir the builder finds and the run
// keeps. A source at a motor does not touch it.
TEST(PortWork, ElongationsAreCasimirsOfTheArm) {
  Network n("arm with a spring");
  n.add("pendulum", std::make_shared<mechanics::MechanicalModel>(
                        std::make_shared<mechanics::Mechanism>(pendulum_of_the_reference())));
  n.add("spring", phs::spring_element(phs::spring(30)));
  n.feedback("pendulum.hinge.torque", "spring.ends");
  n.resist("friction", "pendulum.hinge.torque", phs::viscous(0.01));
  const auto model = n.build();
  ASSERT_EQ(model->casimirs().size(), 1u);
  EXPECT_EQ(model->casimirs()[0].text, "-pendulum.hinge + spring.elongation");
  Ledger b(*model, "gauss8", 0.05, {0.3, 2.0, 0.0});
  b.run_to(50);
  EXPECT_NEAR(b.state.x[2] - b.state.x[0], -0.3, 1e-14);
  EXPECT_LT(std::fabs(b.defect()), 1e-12);
}

TEST(PortWork, TheDefectOfGaussFallsLikeItsOrder) {
  const auto model = driven_pendulum_of_the_reference();
  for (const auto& [name, order, h] : {std::tuple{"midpoint", 2, 0.05},
                                       {"gauss4", 4, 0.1},
                                       {"gauss6", 6, 0.2},
                                       {"rk4", 4, 0.05}}) {
    double defect[2];
    for (const int i : {0, 1}) {
      Ledger b(*model, name, i ? h / 2 : h, {1.0, 0.5});
      b.run_to(20);
      defect[i] = std::fabs(b.defect());
    }
    const double slope = std::log2(defect[0] / defect[1]);
    std::printf("  %-8s defect %.1e -> %.1e, order %.2f (%d)\n", name, defect[0], defect[1], slope,
                order);
    EXPECT_GT(slope, order - 0.6) << name;
  }
}

TEST(PortWork, MethodsWithoutWeightsAreBookedToOrderFour) {
  const phs::UserModel<DrivenPendulum> model{DrivenPendulum{}};
  ASSERT_EQ(model.description().powers.size(), 2u);
  for (const char* name : {"radau15", "cvode_adams"}) {
    double defect[2];
    for (const int i : {0, 1}) {
      Ledger b(model, name, i ? 0.1 : 0.2, {1.0, 0.5});
      EXPECT_FALSE(b.method->integrates_power());
      b.run_to(20);
      defect[i] = std::fabs(b.defect());
    }
    std::printf("  %-12s defect %.1e -> %.1e with half the step\n", name, defect[0], defect[1]);
    EXPECT_GT(defect[0] / defect[1], 10) << name;
  }
}

TEST(PortWork, LanesKeepTheSameWork) {
  const auto model = elastic_arm(true);
  const auto lanes = make_integrator("gauss16", *model, 0.03125, {.lanes = true});
  const auto scalar = make_integrator("gauss16", *model, 0.03125, {.lanes = false});
  phs::State a(model->description(), {0.25, -0.5, 0, 0, 0, 0.125, 0, 0.0}), b = a;
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(lanes->step(a), Outcome::ok);
    ASSERT_EQ(scalar->step(b), Outcome::ok);
    for (size_t k = 0; k < lanes->port_work().size(); ++k)
      ASSERT_EQ(lanes->port_work()[k], scalar->port_work()[k]);
  }
  EXPECT_EQ(a.x, b.x);
}

}  // namespace
}  // namespace porthos::test::port_work_test
