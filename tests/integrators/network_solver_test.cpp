// A network keeps the solvers of its members: (I - z J)⁻¹ of arm and elements together, by
// Woodbury. Against the Jacobian by duals, against the dense solver, against 113 bits; the control
// is the same solver without the coupling.
#include <gtest/gtest.h>

#include <random>

#include "integrators/methods/gauss.h"
#include "phs/network/network.h"
#include "phs/system/forwarding.h"
#include "phs/system/user_model.h"
#include "tests/support/stiff.h"

namespace porthos::integrators::network_solver_test {
namespace {

using phs::Complex4;
using phs::Dual;
using phs::Matrix;
using phs::Network;
using phs::Quad;

struct Elements {
  const char* name;
  void (*add)(Network&);
};

const phs::LawPtr servo = phs::law([](auto t, auto x, auto y, auto u) {
  u[0] = -2e3 * (x[0] + 0.5 * x[1]) - 20.0 * y[0] - 5.0 * y[1] + 0.1 * t;
});

const Elements networks[] = {
    {"friction",
     [](Network& n) {
       n.resist(
           "friction", "arm.joint0.torque",
           phs::friction(
               {.coulomb = 2, .breakaway = 3, .stribeck = 0.1, .viscous = 0.2, .smoothing = 0.05}));
     }},
    {"LuGre friction",
     [](Network& n) {
       n.lugre("rub", "arm.joint0.torque",
               {.coulomb = 2,
                .breakaway = 3,
                .stribeck = 0.1,
                .viscous = 5,
                .bristle_stiffness = 200,
                .bristle_damping = 10});
     }},
    {"stiff damper on all",
     [](Network& n) {
       for (const char* j : {"0", "1", "2", "3", "4", "5"})
         n.resist(std::string("damper") + j, std::string("arm.joint") + j + ".torque",
                  phs::viscous(1e3));
     }},
    {"Rayleigh damping",
     [](Network& n) {
       n.resist("rayleigh", {"arm.joint1.torque", "arm.joint4.torque"},
                Matrix{{300, -100}, {-50, 200}});
     }},
    {"potentials",
     [](Network& n) {
       n.potential("limit", "arm.joint2", phs::spring(3e4, 0.1, 1e3));
       n.potential("spring", "arm.joint5", phs::spring(1e5));
     }},
    {"spring element to a flywheel",
     [](Network& n) {
       n.add("wheel", phs::inertia_element(0.02));
       n.add("spring", phs::spring_element(phs::spring(1e4)));
       n.zero_junction("shaft", {{"spring.ends"}, {"arm.joint3.torque", -1}, {"wheel.body"}});
     }},
    {"motor",
     [](Network& n) {
       n.add("motor",
             phs::dc_drive({.inductance = 1e-5, .resistance = 1, .constant = 0.2, .gear = 50}));
       n.feedback("arm.joint0.torque", "motor.shaft");
       n.source("supply", "motor.supply", phs::constant(2));
     }},
    {"controller with a sensor",
     [](Network& n) {
       n.control("servo", "arm.joint0.torque", servo, {.sensors = {"arm.joint3.torque"}});
     }},
};

constexpr int bodies = 6;
struct Case {
  test::Robot robot = test::stiff_chain(bodies, 1e3, 0.1);
  std::shared_ptr<const phs::NetworkModel> model;
  std::vector<double> x;
  explicit Case(const Elements& e) {
    Network n("arm with elements");
    n.add("arm", robot.model);
    e.add(n);
    model = n.build();
    x.assign(robot.start.x.begin(), robot.start.x.end());
    x.resize(size_t(model->description().nx), 0.0);
  }
};

/// ‖(I - z J) d - r‖ / ‖r‖, J of the whole by duals.
double defect(const phs::Model& model, std::span<const double> x, const Complex4& z,
              const std::vector<Complex4>& d, const std::vector<Complex4>& r,
              const std::vector<double>& turns) {
  const auto system = model.instantiate<Dual>();
  system->set_turn_angles(std::vector<Dual>(turns.begin(), turns.end()));
  std::vector<Complex4> left = d;
  std::vector<Dual> xd(x.begin(), x.end()), f(x.size());
  for (size_t k = 0; k < x.size(); ++k) {
    xd[k].d = 1;
    system->field(0.0, xd, {}, f);
    xd[k].d = 0;
    for (size_t i = 0; i < x.size(); ++i) left[i] -= f[i].d * (z * d[k]);
  }
  double worst = 0;
  for (size_t i = 0; i < x.size(); ++i)
    for (int lane = 0; lane < 4; ++lane)
      worst = std::max(worst, std::sqrt((left[i] - r[i]).norm2()[lane]));
  return worst;  // r is of size 1
}

/// The same network with the solver of its arm alone.
class Uncoupled final : public phs::ModelFor<Uncoupled> {
 public:
  explicit Uncoupled(const Case& c) : c_(c) {}
  const phs::Description& description() const override { return c_.model->description(); }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    return std::make_unique<Evaluator<T>>(c_);
  }

 private:
  template <class T>
  class Evaluator final : public phs::Forwarding<T> {
   public:
    explicit Evaluator(const Case& c)
        : phs::Forwarding<T>(c.model->template instantiate<T>(), c.model->description()),
          c_(c),
          arm_(c.robot.model->template instantiate<T>()) {}
    std::unique_ptr<phs::System<T>> clone() const override {
      return this->alike(std::make_unique<Evaluator>(c_));
    }
    std::unique_ptr<phs::Resolvent> resolvent() override {
      return std::make_unique<phs::InnerResolvent>(arm_->resolvent(), 2 * bodies);
    }

   private:
    const Case& c_;
    std::unique_ptr<phs::System<T>> arm_;
  };
  const Case& c_;
};

TEST(NetworkSolver, SolvesWithTheJacobianOfTheWhole) {
  Complex4 z;
  for (int lane = 0; lane < 4; ++lane) {
    z.re.set(lane, lane == 3 ? 0.05 : 0.01 * (lane + 1));
    z.im.set(lane, 0.03 * lane * (lane < 3));
  }
  for (const auto& e : networks) {
    const Case c(e);
    const auto system = c.model->instantiate<double>();
    const std::vector<double> turns(bodies, -1e-3);
    const auto right = system->resolvent();
    ASSERT_NE(right, nullptr) << e.name;
    EXPECT_FALSE(right->exact());
    system->set_turn_angles(turns);  // after: they are read at each factorisation
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> between(-1, 1);
    auto x = c.x;
    for (auto& v : x) v += 1e-2 * between(random);
    std::vector<Complex4> r(x.size());
    for (auto& v : r)
      for (int lane = 0; lane < 4; ++lane) {
        v.re.set(lane, between(random));
        v.im.set(lane, between(random));
      }
    auto d = r, apart = r;
    right->factor(0, x, z);
    right->solve(d);
    const auto alone = Uncoupled(c).instantiate<double>();
    const auto uncoupled = alone->resolvent();
    const double found = defect(*c.model, x, z, d, r, turns);
    uncoupled->factor(0, x, z);
    uncoupled->solve(apart);
    const double control = defect(*c.model, x, z, apart, r, turns);
    std::printf("  %-30s residual %.1e (1e-9)   without the coupling %.1e\n", e.name, found,
                control);
    EXPECT_LE(found, 1e-9) << e.name;
    EXPECT_GT(control, 1e-2) << e.name;
  }
}

std::unique_ptr<Integrator> method(const char* name, const phs::Model& model, double h, Solver s) {
  Options o;
  o.solver = s;
  return make_integrator(name, model, h, o);
}
Outcome run(Integrator& m, phs::State& s, int steps) {
  for (int i = 0; i < steps; ++i)
    if (const Outcome o = m.step(s); o != Outcome::ok) return o;
  return Outcome::ok;
}
double sweeps(const Integrator& m) { return double(m.cost().sweeps) / double(m.cost().steps); }
double difference(const phs::State& a, std::span<const double> b, std::span<const double> b_lo) {
  double worst = 0, size = 0;
  for (size_t k = 0; k < b.size(); ++k) {
    worst = std::max(worst, std::fabs((a.x[k] - b[k]) + (a.lo[k] - b_lo[k])));
    size = std::max(size, std::fabs(b[k]));
  }
  return worst / size;
}

TEST(NetworkSolver, FindsWhatTheDenseSolverFindsAndNotWithoutTheCoupling) {
  const double h = 0.02;
  for (const auto& e : networks) {
    const Case c(e);
    const Uncoupled apart(c);
    const phs::State start(c.model->description(), c.x);
    phs::State a = start, b = start, f = start;
    const auto own = method("gauss12", *c.model, h, Solver::newton_articulated),
               dense = method("gauss12", *c.model, h, Solver::newton_dense),
               control = method("gauss12", apart, h, Solver::newton_articulated);
    ASSERT_EQ(run(*own, a, 10), Outcome::ok) << e.name;
    ASSERT_EQ(run(*dense, b, 10), Outcome::ok) << e.name;
    const bool converges = run(*control, f, 10) == Outcome::ok;
    const double off = difference(a, b.x, b.lo);
    std::printf("  %-30s sweeps %.1f, dense %.1f   apart %.1e (1e-14)   without the coupling %s\n",
                e.name, sweeps(*own), sweeps(*dense), off,
                converges ? std::to_string(sweeps(*control)).c_str() : "no convergence");
    // Rounding decides on the last sweep or two of a step.
    EXPECT_LE(sweeps(*own), sweeps(*dense) + 2) << e.name;
    EXPECT_LE(off, 1e-14) << e.name;
    EXPECT_TRUE(!converges || sweeps(*control) > 1.5 * sweeps(*own)) << e.name;
  }
}

// A free base and body ports: the columns of G turn with the state, J is not exact, the iteration
// still contracts.
TEST(NetworkSolver, ServesAFloatingArm) {
  const auto robot = test::stiff_chain(6, 1e5, 0, 0.2, true);
  Network n("floating");
  n.add("arm", robot.model);
  n.potential("spring", "arm.joint3", phs::spring(1e6));
  n.resist("damper", "arm.joint2.torque", phs::viscous(10));
  const auto model = n.build();
  phs::State a(model->description(), {robot.start.x.begin(), robot.start.x.end()}), b = a;
  const auto own = method("gauss12", *model, 0.02, Solver::newton_articulated),
             dense = method("gauss12", *model, 0.02, Solver::newton_dense);
  ASSERT_EQ(run(*own, a, 20), Outcome::ok);
  ASSERT_EQ(run(*dense, b, 20), Outcome::ok);
  const double off = difference(a, b.x, b.lo);
  std::printf("  sweeps %.1f, dense %.1f   apart %.1e (1e-13)\n", sweeps(*own), sweeps(*dense),
              off);
  EXPECT_LE(sweeps(*own), sweeps(*dense) + 2);
  EXPECT_LE(off, 1e-13);
}

TEST(NetworkSolver, IsChosenByItselfForALongChainWithOneElement) {
  const auto robot = test::stiff_chain(60, 1e4, 0.1);
  Network n("long");
  n.add("arm", robot.model);
  n.resist("friction", "arm.joint0.torque", phs::viscous(0.1));
  const auto model = n.build();
  phs::State s(model->description(), {robot.start.x.begin(), robot.start.x.end()});
  const auto m = method("gauss8", *model, 0.02, Solver::automatic);
  ASSERT_EQ(run(*m, s, 10), Outcome::ok);
  std::printf("  %s, %.0f evaluations a step (60)\n", m->remark().c_str(),
              double(m->cost().evaluations) / 10);
  EXPECT_NE(m->remark().find("Newton, articulated, in 10 of 10"), std::string::npos);
  EXPECT_LE(double(m->cost().evaluations) / 10, 60) << "with Krylov it was about 1000";
}

TEST(NetworkSolver, IsNotOfferedWhereNothingIsGained) {
  Network small("no arm");
  small.add("a", phs::inertia_element(1));
  EXPECT_EQ(small.build()->instantiate<double>()->resolvent(), nullptr);

  const auto robot = test::stiff_chain(2, 1e3, 0);
  Network large("a large member without a solver");
  large.add("arm", robot.model);
  large.add("chain", std::make_shared<phs::UserModel<test::QuarticChain>>(test::QuarticChain{20}));
  EXPECT_EQ(large.build()->instantiate<double>()->resolvent(), nullptr);
}

}  // namespace
}  // namespace porthos::integrators::network_solver_test
