// Joints as stiff as shafts, at steps of the links' motion. 7-joint arm in gravity, a spring of 1e4
// … 1e6 N m/rad and a rotor at each joint: the springs ring at up to thousands of rad/s, the links
// move at a few.
#include <chrono>

#include "integrators/core/integrator.h"
#include "tests/support/bounds.h"
#include "tests/support/energy_run.h"
#include "tests/vsa/actuators.h"

namespace porthos::test::stiff_test {
namespace {

using integrators::Outcome;
constexpr const char* arm_file = "reference/pinocchio/urdf/panda7.urdf";
constexpr double rotor = 0.2, seconds = 0.5;

struct Arm {
  std::shared_ptr<const mechanics::MechanicalModel> links;
  std::shared_ptr<const phs::NetworkModel> model;
  phs::State start;
  std::vector<std::string> joints;
};

Arm stiff_arm(double k) {
  mechanics::UrdfOptions o;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  o.gravity = {0, 0, -9.81};
  Arm a;
  a.links = std::make_shared<mechanics::MechanicalModel>(std::make_shared<mechanics::Mechanism>(
      mechanics::read_urdf(test::data_file(arm_file).string(), o).mechanism));
  const auto& m = a.links->mechanism();
  const std::vector<double> q{0.3, -0.5, 0.4, -1.8, 0.2, 1.4, 0.1}, v(7, 0.0);
  phs::Network n("stiff arm");
  n.add("mechanism", a.links).main("mechanism");
  for (const auto& p : a.links->description().ports) {
    if (p.size != 1) continue;
    vsa::Actuator act;
    act.elastic = vsa::series_elastic({k});
    act.theta = {.kind = vsa::Drive::Kind::torque, .inertia = rotor, .viscous = 20};
    a.joints.push_back("drive" + std::to_string(a.joints.size()));
    vsa::attach(n, a.joints.back(), "mechanism." + p.name, act);
  }
  a.model = n.build();
  // The springs start slack, rotors and links at the same angles: what they ring with is what
  // gravity then pulls.
  std::vector<std::pair<std::string, std::vector<double>>> starts;
  for (size_t i = 0; i < a.joints.size(); ++i) starts.push_back({a.joints[i], {q[i], q[i], 0}});
  a.start = state_of(*a.model, a.links->state(q, v), starts);
  (void)m;
  return a;
}

struct Run {
  std::vector<double> q;
  double defect = 0, microseconds = 0, evaluations = 0;
  std::string remark;
};
Run run(const Arm& a, const char* method, double h) {
  const auto integrator = integrators::make_integrator(method, *a.model, h);
  Gauge gauge(*a.model);
  phs::State s = a.start;
  long double in = 0, turned = 0;
  const auto steps = std::int64_t(std::lround(seconds / h));
  const auto from = std::chrono::steady_clock::now();
  Run r;
  for (std::int64_t i = 0; i < steps; ++i) {
    if (const Outcome method_outcome = integrator->step(s); method_outcome != Outcome::ok) {
      r.defect = HUGE_VAL;
      r.q.assign(7, 1e300);
      r.remark = to_string(method_outcome);
      return r;
    }
    for (size_t k = 0; k < integrator->port_work().size(); ++k) {
      const double w = integrator->port_work()[k];
      in += a.model->description().powers[k].kind == phs::PowerKind::supplied ? w : -w;
      turned += std::fabs(w);
    }
  }
  r.microseconds =
      std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - from).count() /
      double(steps);
  r.defect = double(std::fabs(gauge.energy(s) - gauge.energy(a.start) - in) / turned);
  r.evaluations = double(integrator->cost().evaluations) / double(steps);
  r.remark = integrator->remark();
  r.q.assign(s.x.begin(), s.x.begin() + 7);
  return r;
}

// The higher orders, whose stages are more, lean on the noise Newton's iteration measures: a
// rounding of two angles is K times as much in the torque, and the sweeps end where only that is
// left.
TEST(Stiff, SevenJointsAtStepsOfTheLinks) {
  const double h = 0.005;
  for (const double k : {1e4, 1e6}) {
    const Arm a = stiff_arm(k);
    ASSERT_EQ(a.joints.size(), 7u);
    const auto fine = run(a, "gauss16", 2.5e-4);  // resolves the springs
    double moved = 0;
    for (size_t i = 0; i < 7; ++i) moved = std::max(moved, std::fabs(fine.q[i] - a.start.x[i]));
    std::printf(
        "  K = %.0e N m/rad, the links move by %.2f rad; gauss16 at 2.5e-4 s: defect %.1e, %.0f us "
        "a step\n",
        k, moved, fine.defect, fine.microseconds);
    EXPECT_GT(moved, 0.1);
    for (const char* method :
         {"gauss4", "gauss8", "gauss16", "midpoint", "gonzalez", "mean_value"}) {
      const auto r = run(a, method, h);
      double worst = 0;
      for (size_t i = 0; i < 7; ++i) worst = std::max(worst, std::fabs(r.q[i] - fine.q[i]));
      std::printf("  %-10s %4.0f us, %3.0f evaluations a step  %s\n", method, r.microseconds,
                  r.evaluations, r.remark.c_str());
      keeps(std::string(method) + ", angles [rad]", worst,
            1e-4);  // of springs whose ringing of τ/K is not resolved
      const bool exact =
          integrators::declaration_of(method).energy_exact == integrators::Claim::holds;
      keeps(std::string(method) + ", defect of what was turned over", r.defect,
            exact ? 1e-13 : 1e-5);
    }
    breaks("rk4 at the same step, defect", run(a, "rk4", h).defect, 1);
  }
}

}  // namespace
}  // namespace porthos::test::stiff_test
