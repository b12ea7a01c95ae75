#pragma once
#include <string>
#include <vector>

#include "scene/compare/compare.h"

namespace porthos::scene {

/// Trials whose trajectory error is larger are left out of advice for an energy error: a method may
/// keep the energy at steps at which its motion is wrong.
inline constexpr double most_trajectory_error = 0.1;

/// What a method needs for an error, for methods whose error says how accurate they are:
/// interpolated between the two trials that enclose the error, linearly in logarithms.
struct Reach {
  const MethodTrials* of = nullptr;
  double step_s = 0, rtol = 0;  ///< one of the two
  double iteration_tolerance = 0;
  double control_rate = 0, control_length = 0;  ///< of a step control
  double cpu_s = 0;
  bool at_most = false;  ///< the coarsest trial is already better: less may be enough
  bool drifts = false;   ///< the nearest trial has an energy error that grows steadily
};

/// Advice for a target error.
struct Advice {
  double target = 0;
  std::vector<Reach> reaching;  ///< cheapest first
  std::string sentence;
};

/// Whether the energy error grows steadily, by its size and its growth law: over a few periods a
/// bounded error may change by more than chance, but does not grow in proportion to time.
bool drifts(const EnergyReport& energy);
/// The trial of a method whose error is nearest to the target by its factor, among those that move
/// rightly, if there are any; of a method whose energy says nothing, by the trajectory. The last
/// one where none came to the end. @pre the method has trials
size_t nearest_trial(const Comparison& comparison, const MethodTrials& method, double target);
/// The methods that reach the relative error `target`, cheapest first, and a sentence for people.
Advice advise(const Comparison& comparison, double target);

}  // namespace porthos::scene
