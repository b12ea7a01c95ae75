// A joint with an elastic gear: motor-side PD damps the link only through the spring; preserving
// the elastic structure puts the damper at the link.

#include <cmath>
#include <cstdio>
#include <exception>

#include "energy_shaping/elastic/elastic.h"
#include "energy_shaping/loop/run.h"
#include "examples/show.h"
#include "integrators/core/integrator.h"

using namespace porthos;
using namespace porthos::energy_shaping;

struct Link {
  static constexpr int n = 1, m = 1;
  const char* name = "link";
  std::array<std::pair<const char*, const char*>, 1> coordinates{{{"joint", "rad"}}};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = S(1.0);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(-2.0) * phs::cos(q[0]);
  }
};

int main(int argc, char** argv) try {
  const ElasticJoints<Link> joint{.arm = {}, .stiffness = {100}, .motor = {0.1}};
  const auto tomei = motor_side<Link>(joint, {.rest = {0.5}, .kp = {60}, .kd = {2}});
  const auto light =
      motor_side<Link>(joint, {.rest = {0.5}, .kp = {60}, .kd = {2}, .motor = {0.02}});
  const ElasticStructurePreserving<Link> esp(
      joint, {.rest = {0.5}, .link_damping = {4}, .stiffness = {60}, .damping = {2}});

  const RunOptions o{.duration = 5, .step = 0.0025};
  const std::vector<double> start(4, 0.0);
  const Run a = simulate(*tomei, start, o), b = simulate(*light, start, o);

  // ESP: the plant under its law, H_d in the coordinates (q, η) it preserves.
  const auto model = esp.under_law(), target = esp.target();
  const auto method = integrators::make_integrator("gauss8", *model, o.step),
             own = integrators::make_integrator("gauss8", *target, o.step);
  const auto energy = target->instantiate<double>();
  phs::State x(model->description(), start), z(target->description(), start);
  Run c;
  Certificate certificate("elastic-structure-preserving regulation");
  double difference = 0;
  std::vector<double> mapped(4), u(1);
  for (int i = 0;; ++i) {
    esp.to_target<double>(x.x, mapped);
    esp.law<double>(x.x, u);
    for (size_t k = 0; k < 4; ++k) difference = std::max(difference, std::fabs(mapped[k] - z.x[k]));
    c.t.push_back(i * o.step);
    c.x.push_back(x.x);
    c.u.push_back(u);
    c.H.push_back(energy->hamiltonian(mapped));
    if (i > 0) c.rise = std::max(c.rise, c.H[size_t(i)] - c.H[size_t(i) - 1]);
    if (i == 2000) break;
    if (method->step(x) != integrators::Outcome::ok || own->step(z) != integrators::Outcome::ok)
      return 2;
  }
  for (const auto& item : tomei->certificate().items()) certificate.add(item);
  certificate.at_most("ESP: plant against its target", difference, 1e-10,
                      "two runs of 5 s, largest difference of states");
  certificate.at_most("ESP: rise of H_d", c.rise, 1e-12, "in a step [J]");
  certificate.report("ESP: H_d after 2 s", c.H[800], "[J], from 7.5 J");
  const double rest = tomei->instantiate<double>()->hamiltonian(tomei->rest()),
               lit = light->instantiate<double>()->hamiltonian(light->rest());
  certificate.report("motor PD: H_d after 2 s", a.H[800] - rest, "[J], from 8.03 J");
  auto Ha = a.H, Hb = b.H;
  for (double& h : Ha) h -= rest;
  for (double& h : Hb) h -= lit;
  using scene::column;
  const char* names[] = {"motor PD", "with torque feedback", "ESP"};
  return show(
      argc, argv, certificate,
      scene::trace_plot({{"link [rad]",
                          {column(names[0], a.t, a.x, 0), column(names[1], b.t, b.x, 0),
                           column(names[2], c.t, c.x, 0)}},
                         {"H_d above rest [J]",
                          {{names[0], a.t, Ha}, {names[1], b.t, Hb}, {names[2], c.t, c.H}},
                          true},
                         {"motor torque [N m]",
                          {column(names[0], a.t, a.u, 0), column(names[1], b.t, b.u, 0),
                           column(names[2], c.t, c.u, 0)}}},
                        "An elastic joint, three regulators",
                        "link of 1 kg m² under gravity, spring of 100 N m/rad; to 0.5 rad"));
} catch (const std::exception& e) {  // one sentence: what, where, what was expected
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
