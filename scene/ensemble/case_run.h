#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "ensemble/batch.h"
#include "scene/ensemble/ensemble.h"

namespace porthos::scene {

/// Receives the results of a case: a row of CaseLayout.
using CaseDone = std::function<void(std::span<const double>)>;

/// A case for simulate_batch(), in lanes if the method has them; for an ensemble with in_lanes().
/// Its errors are measured at its records and between them.
std::unique_ptr<ensemble::BatchRun> make_lane_case(const Ensemble& ensemble, std::int64_t index,
                                                   const CaseDone& done);

/// A case put together: its model, which is the ensemble's where cases differ in their start alone,
/// and where it begins.
/// @throws InvalidArgument "case 7: ..." for numbers that the reader or the model refuses
Assembly assembly_of_case(const Ensemble& ensemble, std::int64_t index);

/// Runs and judges a case as `porthos run` does (without the symmetry check). A stopped case does
/// not count as done.
void run_case(const Ensemble& ensemble, std::int64_t index, const std::atomic<bool>* stop,
              const CaseDone& done);

}  // namespace porthos::scene
