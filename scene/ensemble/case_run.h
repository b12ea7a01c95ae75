#pragma once
#include <functional>
#include <memory>

#include "ensemble/batch.h"
#include "scene/ensemble/ensemble.h"

namespace porthos::scene {

/// Takes what is kept of a case: a row of CaseLayout.
using CaseDone = std::function<void(std::span<const double>)>;

/// A case for simulate_batch(), in lanes where the method has them: of an ensemble whose in_lanes()
/// says so. Its errors are measured at its records and at looks between them.
std::unique_ptr<ensemble::BatchRun> make_lane_case(const Ensemble& ensemble, std::int64_t index,
                                                   const CaseDone& done);

/// A case as `porthos run` would run it, judged as it is (symmetry apart). One that is stopped is
/// not done.
void run_case(const Ensemble& ensemble, std::int64_t index, const std::atomic<bool>* stop,
              const CaseDone& done);

}  // namespace porthos::scene
