#pragma once
#include <atomic>
#include <functional>

#include "scene/record_log.h"
#include "scene/run.h"

namespace porthos::python {

/// A run that stays in memory: the report and records of scene::run without its files, checkpoints and plots.
struct Simulation {
  scene::RunReport report;
  scene::RecordLayout layout;
  std::vector<double> rows;  ///< as RecordLayout says, one record after another
  std::string summary;       ///< as summary.json
};

/// @param check_symmetry  as in RunOptions. Of the other options `stop` and `progress` count.
/// @throws InvalidArgument for step and duration that are not positive, a method that needs a pilot ("auto"), and as
///   scene::make_integrator
Simulation simulate(const scene::Scene& scene, const scene::Assembly& assembly,
                    const scene::RunOptions& options);

}  // namespace porthos::python
