#pragma once
#include <memory>

#include "integrators/core/lane_integrator.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// The step of collocation.h with one state per lane, by fixed-point iteration. A lane is stuck
/// where collocation.h would try Newton's iteration or give up. Returns null for a solver other
/// than the automatic and the fixed point.
std::unique_ptr<LaneIntegrator> make_lane_collocation(const CollocationTable<double>& table,
                                                      const phs::Model& model, double h,
                                                      const Options& options);

}  // namespace porthos::integrators
