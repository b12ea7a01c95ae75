// Acrobot of two links: gains from a sweep under a torque limit, then the certificate. The plant is
// a mechanism of bodies.

#include <cstdio>
#include <exception>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/matching/designs.h"
#include "examples/show.h"
#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"

using namespace porthos;
using namespace porthos::energy_shaping;

std::shared_ptr<const mechanics::MechanicalModel> two_links() {
  mechanics::MechanismBuilder b("acrobot");
  b.gravity({0, 0, -9.8});
  const auto link = [&](const char* name, const char* parent, const char* joint, double at,
                        double mass, double com, double inertia) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = parent;
    s.joint.name = joint;
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.placement.r = {0, 0, at};
    s.mass.mass = mass;
    s.mass.com = {0, 0, com};
    s.mass.inertia = {inertia, 0, 0, inertia, 0, inertia};
    b.add(s);
  };
  link("upper", "world", "shoulder", 0, 4, 0.5, 0.3333);
  link("lower", "upper", "elbow", 1, 1, 2, 1.3333);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

int main(int argc, char** argv) try {
  const auto robot = two_links();
  Acrobot design = Acrobot::of(*robot, 9.8);  // c1 ... c5 read off the mechanism
  const double limit = 60;                    // [N m]
  const std::vector<double> start{0.2, 0, 0, 0};

  // Gains: 400 runs of the same plant from its formulas, eight at a time.
  const auto results =
      sweep(*acrobot(design), grid_of({logarithmic(100, 800, 20), logarithmic(0.5, 20, 20)}),
            {.start = start, .duration = 20, .step = 0.01});
  const int best = fastest(results, limit);
  if (best < 0) {
    std::puts("no gains keep the torque limit");
    return 1;
  }
  design.ku = results[size_t(best)].gains[0];
  design.kv = results[size_t(best)].gains[1];
  std::printf("of %zu gains the fastest within %g N m: ku = %.0f, kv = %.2f, settles in %.2f s\n\n",
              results.size(), limit, design.ku, design.kv, results[size_t(best)].settling);

  const auto loop = acrobot(design, robot, {}, "elbow.torque");
  CertifyOptions o{.region = {{-1.5, -3}, {1.5, 3}, 5}, .starts = {start}};
  o.periods = {0, 0.005};
  o.run.duration = 20;
  o.run.step = 0.005;
  o.run.limits = {limit};
  const Certificate certificate = certify(*loop, o);

  const Run run = simulate(*loop, start, o.run);
  const double rest = loop->instantiate<double>()->hamiltonian(loop->rest());
  auto H = run.H;
  for (double& h : H) h -= rest;
  using scene::column;
  return show(
      argc, argv, certificate,
      scene::trace_plot({{"angles [rad]",
                          {column("shoulder", run.t, run.x, 0), column("elbow", run.t, run.x, 1)}},
                         {"H_d above rest [J]", {{"H_d", run.t, H}}, true},
                         {"torque [N m]", {column("elbow", run.t, run.u, 0)}}},
                        "Acrobot, constant M_d", "from 0.2 rad off upright, torque within 60 N m"));
} catch (const std::exception& e) {  // one sentence: what, where, what was expected
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
