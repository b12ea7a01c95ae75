#pragma once
#include <memory>
#include <string>

#include "mechanics/mechanical_model.h"

namespace porthos::bench {

/// Registers the benchmarks of gradients for a model from a start with steps h [s].
void add_gradients(const std::string& name,
                   const std::shared_ptr<const mechanics::MechanicalModel>& model,
                   const phs::State& start, double h);

}  // namespace porthos::bench
