#pragma once
#include <memory>

#include "integrators/collocation_table.h"
#include "integrators/lane_integrator.h"

namespace porthos::integrators {

/// The step of collocation.h for a state per lane: the same operations in the same order, by the fixed point, each lane
/// with its own end of the iteration. A lane is stuck where collocation.h would try Newton's iteration, or gives up.
/// Null for a solver other than the automatic and the fixed point.
std::unique_ptr<LaneIntegrator> make_lane_collocation(const Declaration& declaration,
                                                      const CollocationTable<double>& table,
                                                      const phs::Model& model, double h,
                                                      const Options& options);

}  // namespace porthos::integrators
