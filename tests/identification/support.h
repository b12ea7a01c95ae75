#pragma once
#include <random>

#include "integrators/derivatives/run_tangents.h"
#include "scene/identification/identification.h"
#include "scene/identification/observation.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene {

/// What a run of a scene has of some numbers at the end of every `every`-th step, from time 0 on.
inline NamedColumns run_of(Scene scene, const std::vector<std::string>& names, double duration,
                           int every = 1) {
  scene.centre_stays = true;
  const Assembly a = assemble(scene);
  Observation observation(scene, a, names);
  integrators::RunTangents run(scene.method, *a.model, a.initial, scene.step, {});
  NamedColumns log;
  std::vector<double> values(names.size());
  const auto take = [&] {
    observation.at(run.time(), run.state(), values);
    log["time"].push_back(run.time());
    for (size_t i = 0; i < names.size(); ++i) log[names[i]].push_back(values[i]);
  };
  take();
  for (std::int64_t i = 1; run.time() < duration - scene.step / 2; ++i) {
    EXPECT_EQ(run.step(), integrators::Outcome::ok);
    if (i % every == 0) take();
  }
  return log;
}

/// The same with noise.
inline NamedColumns noisy(NamedColumns log, const LogNoise& noise, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  for (auto& [name, values] : log) {
    if (name == "time") continue;
    const auto own = noise.by_name.find(name);
    const double sigma = own == noise.by_name.end() ? noise.of_all.value_or(0) : own->second;
    for (double& x : values) x += sigma * normal(rng);
  }
  return log;
}

}  // namespace porthos::scene
