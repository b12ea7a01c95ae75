// A satellite with thrusters turns 170 degrees about a skew axis and goes to a place. Smooth on
// SO(3): nothing unwinds.

#include <cmath>
#include <cstdio>
#include <exception>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/laws/potential_loop.h"
#include "examples/show.h"
#include "mechanics/builder.h"

using namespace porthos;
using namespace porthos::energy_shaping;

int main(int argc, char** argv) try {
  mechanics::MechanismBuilder b("satellite");
  mechanics::BodySpec body;
  body.name = "base";
  body.parent = "world";
  body.joint.type = "free";
  body.mass.mass = 120;
  body.mass.inertia = {30, 2, -1, 20, 1, 15};
  b.add(body);
  const auto satellite = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));

  PotentialShaping s;
  s.poses = {{.link = "base",
              .stiffness = 2,
              .position = {0, 0, 0},
              .attitude_stiffness = {0.4, 0.5, 0.6}}};
  s.damping = {{"base.wrench", {7, 7, 7, 20, 20, 20}}};
  s.rest = {0, 0, 0, 1, 0, 0, 0};
  const PotentialLoop loop(satellite, s);

  const double angle = 170 * std::acos(-1.0) / 180, half = std::sin(angle / 2) / std::sqrt(3.0);
  const std::vector<double> q{5, -3, 2, std::cos(angle / 2), half, half, -half};
  auto minus = q;  // the same attitude, the other quaternion
  for (size_t i = 3; i < 7; ++i) minus[i] = -minus[i];
  const std::vector<double> still(6, 0.0);

  CertifyOptions o{};
  o.region.lower.assign(7, -1);
  o.region.upper.assign(7, 1);
  o.starts = {satellite->state(q, still), satellite->state(minus, still)};
  o.periods = {0, 0.1};
  o.run.duration = 120;
  o.run.step = 0.05;
  const Certificate certificate = certify(loop, o);

  const Run run = simulate(loop, o.starts[0], o.run), other = simulate(loop, o.starts[1], o.run);
  auto turn = [](const Run& r) {
    std::vector<double> a;
    for (const auto& x : r.x)
      a.push_back(2 * std::atan2(std::hypot(x[4], x[5], x[6]), std::fabs(x[3])));
    return a;
  };
  using scene::column;
  return show(
      argc, argv, certificate,
      scene::trace_plot(
          {{"angle off [rad]", {{"from q", run.t, turn(run)}, {"from -q", other.t, turn(other)}}},
           {"position [m]",
            {column("x", run.t, run.x, 0), column("y", run.t, run.x, 1),
             column("z", run.t, run.x, 2)}},
           {"H_d [J]", {{"H_d", run.t, run.H}}, true},
           {"moment [N m]",
            {column("x", run.t, run.u, 0), column("y", run.t, run.u, 1),
             column("z", run.t, run.u, 2)}}},
          "Pose of a satellite by thrusters",
          "trace potential on SO(3), spring and damper for the position; 170° off at the start"));
} catch (const std::exception& e) {  // one sentence: what, where, what was expected
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
