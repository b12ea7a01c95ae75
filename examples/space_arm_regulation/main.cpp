// ETS-VII with momentum wheels: the arm to a posture and the base to an attitude by internal
// torques alone. The total momentum cannot change, and does not.

#include <cmath>
#include <cstdio>
#include <exception>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/certify/sweep.h"
#include "examples/show.h"
#include "mechanics/momentum.h"
#include "mechanics/urdf.h"

using namespace porthos;
using namespace porthos::energy_shaping;

/// The largest total momentum of a run, relative to what the bodies carry at most.
static double largest_momentum(const mechanics::MechanicalModel& robot, const Run& run) {
  mechanics::Workspace<double> w(robot.mechanism());
  const size_t nq = size_t(robot.mechanism().nq());
  double linear = 0, angular = 0, P = 1e-300, L = 1e-300;
  for (const auto& x : run.x) {
    const std::span<const double> s(x);
    const auto total =
        mechanics::momentum<double>(robot.mechanism(), w, s.first(nq), s.subspan(nq));
    const auto scale = mechanics::momentum_scale(robot.mechanism(), w, s.first(nq), robot.rates(s));
    P = std::max(P, scale.linear);
    L = std::max(L, scale.angular);
    linear = std::max(linear, norm(total.linear));
    angular = std::max(angular, norm(total.angular));
  }
  return std::max(linear / P, angular / L);
}

int main(int argc, char** argv) try {
  mechanics::UrdfOptions options;
  options.base = mechanics::UrdfOptions::Base::free;
  options.accept_unphysical_inertia = true;
  const auto urdf = mechanics::read_urdf(
      PORTHOS_SOURCE_DIR "/examples/space_arm_regulation/ets_vii_with_wheels.urdf", options);
  const auto mechanism = std::make_shared<mechanics::Mechanism>(urdf.mechanism);
  const auto robot = std::make_shared<mechanics::MechanicalModel>(mechanism);
  const auto at = [&](const std::string& joint) { return size_t(mechanism->coordinate(joint).q); };

  // Where to: arm folded, base upright. Wheels may end anywhere.
  auto rest = mechanism->neutral();
  const double posture[] = {0.3, -0.6, 1.1, -0.4, 0.9, 0.2};
  for (int i = 0; i < 6; ++i) rest[at("joint_" + std::to_string(i + 1))] = posture[i];
  const std::vector<std::string> wheels{"wheel_x.torque", "wheel_y.torque", "wheel_z.torque"};
  auto shaping = joint_regulation(*robot, rest, 0.5, 1.0, wheels);
  // A wheel of inertia j turns a base of inertia I at ω with stiffness k = I² ω²/j about its axis;
  // k_x = a_y + a_z, ... The arm feels the attitude's spring too (the generalised Jacobian): its
  // own bandwidth of 0.5 rad/s holds it.
  shaping.poses = {{.link = "base", .attitude_stiffness = {3050, 9550, 50}}};
  for (const auto& w : wheels) {
    shaping.damping.push_back({w, {0.008}});
    shaping.actuators.push_back(w);
  }
  shaping.zero_momentum = true;
  const PotentialLoop loop(robot, shaping);

  // From: arm stretched, base 0.05 rad off, all at rest.
  auto q = mechanism->neutral();
  q[3] = std::cos(0.025);
  q[4] = 0.6 * std::sin(0.025);
  q[5] = 0.8 * std::sin(0.025);
  const auto start = robot->state(q, std::vector<double>(size_t(mechanism->nv()), 0.0));
  CertifyOptions o{.region = {}, .starts = {start}};
  o.region.lower.assign(rest.size(), -1);
  o.region.upper.assign(rest.size(), 1);
  o.region.samples = 200;
  o.run.duration = 1500;
  o.run.step = 0.05;
  o.run.record = 1;
  o.periods = {0, 0.05};
  Certificate certificate = certify(loop, o);

  const Run run = simulate(loop, start, o.run);
  certificate.at_most("total momentum", largest_momentum(*robot, run), 1e-13,
                      "stays zero, relative to what the bodies carry at most");

  std::vector<double> off;
  for (const auto& x : run.x) off.push_back(2 * std::asin(std::hypot(x[4], x[5], x[6])));
  using scene::column;
  std::vector<scene::TraceLine> joints, torques, wheel_torques;
  for (int i = 1; i <= 6; ++i) {
    const std::string name = "joint_" + std::to_string(i);
    joints.push_back(column(name, run.t, run.x, at(name)));
  }
  for (size_t j = 0; j < loop.actuated().size(); ++j)
    for (const auto& p : robot->description().ports)
      if (p.at == loop.actuated()[j] && p.size == 1)
        (p.name[0] == 'w' ? wheel_torques : torques).push_back(column(p.name, run.t, run.u, j));
  return show(
      argc, argv, certificate,
      scene::trace_plot({{"arm [rad]", joints},
                         {"base off [rad]", {{"attitude", run.t, off}}},
                         {"H_d [J]", {{"H_d", run.t, run.H}}, true},
                         {"arm torque [N m]", torques},
                         {"wheel torque [N m]", wheel_torques}},
                        "ETS-VII: arm and base by internal torques",
                        "wheels of 0.4 kg m², base of 2552 kg; total momentum zero throughout"));
} catch (const std::exception& e) {  // one sentence: what, where, what was expected
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
