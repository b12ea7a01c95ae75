#pragma once
#include <atomic>
#include <cmath>
#include <vector>

#include "scene/assemble/assembly.h"
#include "scene/run/state_distance.h"

namespace porthos::scene {

/// A step with which gauss8 takes `steps` steps from the start without failure: the largest of
/// guess, guess/2, guess/4, … that works. `scale` sees the states passed. @throws InvalidArgument
/// if there is none
double find_step(const Assembly& assembly, double guess, std::int64_t steps, StateScale& scale);

/// Limits for following the growth of small deviations.
struct SensitivityOptions {
  double step = 0, duration = 0;  ///< [s]
  std::int64_t most_steps = 20000;
  double most_growth = 1e40;    ///< enough of it: stop here
  double cpu_limit = HUGE_VAL;  ///< [s]
  const std::atomic<bool>* stop = nullptr;
};

/// The growth of a small deviation at the start over some time.
struct Sensitivity {
  double step_s = 0, observed_s = 0;
  double growth = 1;  ///< of the deviation over that time
  double exponent_per_s =
      0;  ///< largest Lyapunov exponent: mean growth rate in the second half of that time
  bool chaotic = false;  ///< the second half brought a factor above e⁵; a shear brings 2

  std::vector<double> log_growth;  ///< after each step

  /// The first time a deviation has grown by this factor; observed_s if it never did.
  double time_of_growth(double factor) const;
};

/// Carries a tangent vector along a run of gauss16 by dual numbers through the actual steps, so it
/// is neither too small for rounding nor too large to be linear. It starts in a fixed pseudo-random
/// direction; `scale` measures its size.
Sensitivity sensitivity(const Assembly& assembly, const StateScale& scale,
                        const SensitivityOptions& options);

}  // namespace porthos::scene
