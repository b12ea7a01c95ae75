#pragma once
#include <optional>
#include <string>

#include "scene/compare/trial.h"

namespace porthos::scene {

/// A state of the exact motion, as far as it could be computed, and its accuracy.
struct ReferenceState : KnownState {
  std::string made_by;  ///< "Gauss collocation, 12 stages, 113 bits, step 0.05 s"
  double error = 0;     ///< difference of the last two runs, one with twice the step of the other
};

/// The time of a reference, and its allowed cost.
struct ReferenceOptions {
  double time = 0;  ///< [s]
  double step = 0;  ///< [s] at which gauss methods converge; time is a multiple of it
  double cpu_limit =
      0;  ///< [s] for a run in 113 bits; if it needs more, gauss16 in double is taken
  const std::atomic<bool>* stop = nullptr;
};

/// Runs with steps 2h, h, h/2, … until two agree as well as they can. Empty if none did.
std::optional<ReferenceState> reference_state(const Assembly& assembly, const StateScale& scale,
                                              const ReferenceOptions& options);

}  // namespace porthos::scene
