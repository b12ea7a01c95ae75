// What a controller of a scene costs: a step of gauss8 on two rods under computed torque, from a
// [[controller]], and the same law put into a network in C++.
#include <benchmark/benchmark.h>

#include <fstream>

#include "energy_shaping/laws/computed_torque.h"
#include "energy_shaping/laws/tracking.h"
#include "energy_shaping/loop/port_law.h"
#include "integrators/core/integrator.h"
#include "mechanics/mechanical_model.h"
#include "scene/assemble/assembly.h"

namespace porthos::bench {
namespace {

scene::Assembly from_scene() {
  const std::string path = "/tmp/porthos_controller_bench.toml";
  std::ofstream(path) << "[model]\nurdf = \"" PORTHOS_SOURCE_DIR
                         "/examples/double_pendulum/double_pendulum.urdf\"\nbase = \"fixed\"\n"
                         "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n[initial]\n"
                         "joints.shoulder.position = 0.5\njoints.elbow.position = 0.6\n"
                         "[integrator]\nmethod = \"gauss8\"\nstep = 0.005\n[run]\nduration = 1\n"
                         "[[controller]]\ntype = \"tracking\"\nname = \"law\"\nlaw = "
                         "\"computed_torque\"\njoints.shoulder = { kp = 30, kd = 15, amplitude = "
                         "0.5, frequency = 1 }\njoints.elbow = { kp = 30, kd = 15, amplitude = "
                         "0.5, frequency = 1 }\n";
  return scene::assemble(scene::read_scene(path));
}

std::shared_ptr<const phs::Model> in_cpp(const scene::Assembly& a) {
  const auto path = energy_shaping::sines({0.5, 0.6}, {0.5, 0.5}, {1, 1});
  phs::Network n("arm");
  n.add("arm", a.mechanical);
  energy_shaping::control(n, "law", "arm",
                          energy_shaping::computed_torque(a.mechanical, path, {30, 30}, {15, 15}));
  return n.build();
}

void controlled_step(benchmark::State& state, bool of_scene) {
  const auto a = from_scene();
  const auto model = of_scene ? a.model : in_cpp(a);
  phs::State s = a.initial;
  const auto method = integrators::make_integrator("gauss8", *model, 0.005, {.port_work = true});
  for (auto _ : state)
    if (method->step(s) != integrators::Outcome::ok) state.SkipWithError("the step failed");
}
BENCHMARK_CAPTURE(controlled_step, in_cpp, false);
BENCHMARK_CAPTURE(controlled_step, of_scene, true);

}  // namespace
}  // namespace porthos::bench
